"""One worker and its queue: callbacks ask, the worker acts, and what goes wrong reaches the operator in a sentence.

Callbacks of the web server run on many threads at once and in no order. Everything that measures, decides or computes
goes through here, one after the other, so that nothing is done twice and the page never freezes.
"""

import contextlib
import logging
import queue
import threading
from collections.abc import Callable

from core.errors import TrueaxisError

LOG = logging.getLogger("trueaxis")
Report = Callable[[str], None]
REST_S = 0.3
"""How long nothing must have been asked before the worker thinks ahead."""


class Jobs:
    """A queue of jobs with one worker thread."""

    def __init__(self) -> None:
        self._idle: Callable[[], None] = lambda: None
        self._queue: queue.Queue[tuple[Callable[[], None], Report] | None] = queue.Queue()
        self._busy = threading.Event()
        self._worker = threading.Thread(target=self._work, daemon=True, name="trueaxis-jobs")
        self._worker.start()

    @property
    def busy(self) -> bool:
        """Whether something is being done or waits."""
        return self._busy.is_set() or not self._queue.empty()

    def when_idle(self, think: Callable[[], None]) -> None:
        """Let the worker do this whenever nothing was asked for a while after a job."""
        self._idle = think

    def ask(self, job: Callable[[], None], report: Report) -> None:
        """Put a job at the end of the queue.

        Args:
            job: takes and returns nothing.
            report: called with one sentence for the operator if the job fails; the trace goes to the log.
        """
        self._queue.put((job, report))

    @staticmethod
    def at_once(job: Callable[[], None], report: Report) -> None:
        """Do a short job now, on the caller's thread, whatever the worker is at: to stop it, say."""
        _do(job, report)

    def wait(self) -> None:
        """Block until everything that was asked for is done."""
        self._queue.join()

    def close(self) -> None:
        """Finish what is queued and end the worker."""
        self._queue.put(None)
        self._worker.join(timeout=10)

    def _work(self) -> None:
        while (item := self._next()) is not None:
            job, report = item
            self._busy.set()
            try:
                _do(job, report)
            finally:
                self._busy.clear()
                self._queue.task_done()
        self._queue.task_done()

    def _next(self) -> tuple[Callable[[], None], Report] | None:
        """What was asked next; while nothing is, the worker thinks ahead once."""
        with contextlib.suppress(queue.Empty):
            return self._queue.get(timeout=REST_S)
        try:
            self._idle()
        except Exception:
            LOG.exception("thinking ahead failed")
        return self._queue.get()


def _do(job: Callable[[], None], report: Report) -> None:
    """Do a job; what goes wrong is reported in a sentence, the trace goes to the log."""
    try:
        job()
    except TrueaxisError as error:
        LOG.info("refused: %s", error)
        report(str(error))
    except Exception as error:
        LOG.exception("a job failed")
        report(f"This did not work ({type(error).__name__}: {error}). Nothing was lost; the log has the details.")
