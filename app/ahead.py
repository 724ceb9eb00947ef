"""Solving ahead: the solution of what is measured so far, computed while nobody waits, so that it is there when asked.

What is kept belongs to the very campaign that it was computed from; any other one is solved when it is asked for.
"""

import pickle
import time

from core.calibration import Calibration, calibrate
from core.errors import TrueaxisError
from core.measurements import Campaign

LONGEST_S = 0.15
"""A solution that takes longer is not computed ahead: a shot that is asked for meanwhile would have to wait."""


class SolveAhead:
    """The last campaign that was solved, with its solution."""

    def __init__(self) -> None:
        self._key: bytes | None = None
        self._found: Calibration | None = None
        self._slow = False

    def prepare(self, campaign: Campaign) -> None:
        """Solve a campaign if that is quick; one that cannot be solved is left for when it is asked for."""
        if self._slow or self._key == _key(campaign):
            return
        try:
            self.solution(campaign)
        except TrueaxisError:
            # The operator did not ask yet, and is told in a sentence when asking.
            return

    def solution(self, campaign: Campaign) -> Calibration:
        """The solution of a campaign: at once if it was computed from the very same one.

        Raises:
            TrueaxisError: as for ``calibrate``.
        """
        key = _key(campaign)
        if self._found is None or key != self._key:
            start = time.perf_counter()
            found = calibrate(campaign)
            self._slow = time.perf_counter() - start > LONGEST_S
            self._key, self._found = key, found
        return self._found


def _key(campaign: Campaign) -> bytes:
    """All that a campaign holds, to the last bit."""
    return pickle.dumps(campaign)
