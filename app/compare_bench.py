"""The comparison of methods on the workbench: on demand, in a process of its own, so that nothing here waits for it."""

import contextlib
import multiprocessing
import threading
from collections.abc import Callable
from multiprocessing.connection import Connection

from core.errors import InputError, TrueaxisError
from core.rivals.comparison import Comparison

MOST_TRIALS = 100
Told = tuple[str, object]
"""``trial`` and how many are done, ``found`` and the comparison, or ``failed`` and why."""


class CompareBench:
    """The last comparison, and the one that is being made."""

    def __init__(self) -> None:
        self.found: Comparison | None = None
        self._process: multiprocessing.process.BaseProcess | None = None
        self._lock = threading.Lock()

    @property
    def running(self) -> bool:
        """Whether a comparison is being made."""
        return self._process is not None

    def compare(self, trials: int, progress: Callable[[int], None], finished: Callable[[str], None]) -> None:
        """Begin a comparison; this returns at once.

        Args:
            trials: how many simulated measurements are averaged.
            progress: told how many are done, from another thread.
            finished: told at the end, from another thread: an empty text, or why there is no comparison.

        Raises:
            InputError: one is being made already, or the number is not 1..100.
        """
        if not isinstance(trials, int) or not 1 <= trials <= MOST_TRIALS:
            raise InputError(f"{trials!r} trials, expected a whole number from 1 to {MOST_TRIALS}")
        with self._lock:
            if self._process is not None:
                raise InputError("a comparison is being made already: wait for it, or stop it")
            context = multiprocessing.get_context("spawn")
            ours, theirs = context.Pipe(duplex=False)
            self._process = context.Process(target=_work, args=(theirs, trials), daemon=True, name="trueaxis-compare")
            self._process.start()
            theirs.close()
        threading.Thread(target=self._listen, args=(ours, progress, finished), daemon=True).start()

    def stop(self) -> None:
        """Give up the comparison that is being made, if any."""
        process = self._process
        if process is not None:
            process.terminate()

    def _listen(self, told: Connection, progress: Callable[[int], None], finished: Callable[[str], None]) -> None:
        why = "It was stopped."
        # The end of the pipe is the end of the process, however it came.
        with contextlib.suppress(EOFError, OSError):
            while True:
                kind, value = told.recv()
                if kind == "trial":
                    progress(value)
                elif kind == "found":
                    self.found, why = value, ""
                else:
                    why = str(value)
        told.close()
        with self._lock:
            process, self._process = self._process, None
        if process is not None:
            process.join(timeout=10)
        finished(why)


def _work(pipe: Connection, trials: int) -> None:
    """The other process: compare, and tell."""
    try:
        from core.twin.trials import compare_on_twin

        found = compare_on_twin(trials, lambda done: pipe.send(("trial", done)))
        pipe.send(("found", found))
    except TrueaxisError as wrong:
        pipe.send(("failed", str(wrong)))
    except Exception as wrong:
        pipe.send(("failed", f"this did not work ({type(wrong).__name__}: {wrong})"))
    finally:
        pipe.close()
