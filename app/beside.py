"""Long work in a process of its own: measuring and solving never wait for it, and it can be stopped at any moment."""

import contextlib
import logging
import multiprocessing
import os
import signal
import threading
import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Protocol

from core.errors import InputError, TrueaxisError

LOG = logging.getLogger("trueaxis")
NICE = 10
"""Of the process, where the system knows that: what somebody waits for at the page comes first."""
STOPPED = "It was stopped."
Tell = Callable[[object], None]
Told = tuple[str, object, str]
"""``told`` and what; ``made`` and what; ``failed``, a sentence and the trace, which is empty where it was foreseen."""


class Started(Protocol):
    """What of a process is needed here."""

    def terminate(self) -> None: ...

    def join(self, timeout: float | None = None) -> None: ...


class Beside:
    """At most one piece of work of a kind."""

    def __init__(self, name: str) -> None:
        """``name`` is what the work is, as in ``a comparison``."""
        self._name = name
        self._process: Started | None = None
        self._lock = threading.Lock()

    @property
    def running(self) -> bool:
        """Whether it is at work."""
        return self._process is not None

    def start(
        self,
        work: Callable[..., object],
        arguments: tuple,
        told: Callable[[object], None],
        finished: Callable[[object, str], None],
    ) -> None:
        """Begin; this returns at once.

        Args:
            work: a function of a module, called in the other process with a way to tell and the arguments.
            arguments: whatever can be pickled, as what the work tells and returns.
            told: called, from another thread, with what the work tells.
            finished: called at the end, from another thread, with what came of it and an empty text, or with None and
                a sentence that says why nothing came.

        Raises:
            InputError: it is at work already.
        """
        with self._lock:
            if self._process is not None:
                raise InputError(f"{self._name} is being made already: wait for it, or stop it")
            ours, theirs = multiprocessing.get_context("spawn").Pipe(duplex=False)
            self._process = started(theirs, work, arguments)
        threading.Thread(target=self._listen, args=(ours, told, finished), daemon=True).start()

    def stop(self) -> None:
        """Give up what is at work, if anything is."""
        process = self._process
        if process is not None:
            process.terminate()

    def _listen(
        self, pipe: Connection, told: Callable[[object], None], finished: Callable[[object, str], None]
    ) -> None:
        made, why = None, STOPPED
        # The end of the pipe is the end of the process, however it came.
        with contextlib.suppress(EOFError, OSError):
            while True:
                kind, value, trace = pipe.recv()
                if kind == "told":
                    _hear(told, value)
                elif kind == "made":
                    made, why = value, ""
                else:
                    made, why = None, str(value)
                    if trace:
                        LOG.error("%s failed in its process\n%s", self._name, trace)
        pipe.close()
        with self._lock:
            process, self._process = self._process, None
        if process is not None:
            process.join(timeout=10)
        finished(made, why)


def _hear(told: Callable[[object], None], value: object) -> None:
    """Whoever watches may be gone; the work goes on."""
    try:
        told(value)
    except Exception:
        LOG.exception("progress could not be shown")


def started(pipe: Connection, work: Callable[..., object], arguments: tuple) -> Started:
    """The other process, at work; the pipe is its own from here on."""
    context = multiprocessing.get_context("spawn")
    process = context.Process(target=at_work, args=(pipe, work, arguments), daemon=True, name="trueaxis-beside")
    process.start()
    pipe.close()
    return process


def at_work(pipe: Connection, work: Callable[..., object], arguments: tuple) -> None:
    """What the other process does: work, tell, and say how it ended."""
    if multiprocessing.parent_process() is not None:
        # Ctrl+C at the terminal is for the program, which ends this process too.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        if hasattr(os, "nice"):
            os.nice(NICE)
    try:
        pipe.send(("made", work(lambda value: pipe.send(("told", value, "")), *arguments), ""))
    except TrueaxisError as wrong:
        pipe.send(("failed", str(wrong), ""))
    except BrokenPipeError:
        # Nobody listens any more.
        pass
    except Exception as wrong:
        sentence = f"This did not work ({type(wrong).__name__}: {wrong}). Nothing was lost; the log has the details."
        pipe.send(("failed", sentence, traceback.format_exc()))
    finally:
        pipe.close()
