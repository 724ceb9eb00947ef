"""Solving ahead: the solution of what is measured so far, computed while nobody waits, so that it is there when asked.

What is kept belongs to the very campaign that it was computed from; any other one is solved when it is asked for.
"""

import pickle
import threading
from concurrent.futures import Future, ThreadPoolExecutor

from core.calibration import Calibration, calibrate
from core.measurements import Campaign


class SolveAhead:
    """The last campaign that was solved or is being solved, with its solution. Any thread may ask."""

    def __init__(self) -> None:
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="trueaxis-ahead")
        self._lock = threading.Lock()
        self._key: bytes | None = None
        self._found: Future[Calibration] | None = None

    def prepare(self, campaign: Campaign) -> None:
        """Begin to solve a campaign, unless another one is being solved; errors are said when it is asked for."""
        key = _key(campaign)
        with self._lock:
            if key != self._key and (self._found is None or self._found.done()):
                self._key, self._found = key, self._pool.submit(calibrate, campaign)

    def solution(self, campaign: Campaign) -> Calibration:
        """The solution of a campaign: at once if it was computed from the very same one.

        Raises:
            TrueaxisError: as for ``calibrate``.
        """
        key = _key(campaign)
        with self._lock:
            found = self._found if key == self._key else None
        if found is None:
            found = Future()
            found.set_result(calibrate(campaign))
            with self._lock:
                self._key, self._found = key, found
        return found.result()


def _key(campaign: Campaign) -> bytes:
    """All that a campaign holds, to the last bit."""
    return pickle.dumps(campaign)
