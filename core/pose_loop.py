"""The loop closed: poses are wanted, commanded, measured and compared, before compensation and after it.

A pose is wanted where the nominal arm would have the tool for some commands. Sent as they are, these show what the arm
misses without a calibration; the compensated commands (``core/compensation.py``) show what is left with it. Both ways
end in one measure: the measured pose less the wanted one. No model of the arm is in it but the robot's base frame and
the places of the targets on the last link.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from core.geometry import Array
from core.kinematics import nominal_net
from core.standstills import SAME_COMMAND
from core.verification import ModelErrors, Verification, compared, predicted


@dataclass(frozen=True)
class Attempts:
    """Visits of wanted poses that were commanded in one way."""

    row: np.ndarray
    """Rows of the measured poses, (a,)."""
    goal: np.ndarray
    """Index of the wanted pose of each, (a,)."""
    errors: ModelErrors
    """Measured less wanted."""

    @property
    def count(self) -> int:
        return len(self.row)

    def last(self, goal: int) -> int | None:
        """Which of them was the last visit of a wanted pose; None: there was none."""
        made = np.flatnonzero(self.goal == goal)
        return int(made[-1]) if len(made) else None


@dataclass(frozen=True)
class PoseLoop:
    """What came of wanted poses."""

    found: Verification
    wanted: Array
    """Commands of the nominal arm, one row a wanted pose, in the order of their first visit, (g, n)."""
    nominal: Attempts
    """Sent as they are."""
    compensated: Attempts
    """Sent compensated."""

    @property
    def both(self) -> np.ndarray:
        """Wanted poses that were visited in both ways, (b,)."""
        return np.intersect1d(self.nominal.goal, self.compensated.goal)

    @property
    def improvement_position(self) -> float:
        """Ratio of mean position errors, nominal to compensated, over poses visited in both ways; NaN without any."""
        return self._improvement(lambda errors: errors.position.value)

    @property
    def improvement_orientation(self) -> float:
        """The same for orientations."""
        return self._improvement(lambda errors: errors.orientation.value)

    def goal_of(self, wanted: tuple[float, ...]) -> int | None:
        """Index of the wanted pose that these commands of the nominal arm mean, (n,); None: it was not visited."""
        if not len(self.wanted):
            return None
        away = np.abs(self.wanted - np.array(wanted)).max(axis=1)
        return int(np.argmin(away)) if away.min() <= 2 * SAME_COMMAND else None

    def _improvement(self, sizes: Callable[[ModelErrors], Array]) -> float:
        rows = [(self.nominal.last(int(goal)), self.compensated.last(int(goal))) for goal in self.both]
        before, after = sizes(self.nominal.errors), sizes(self.compensated.errors)
        pairs = np.array([(before[a], after[b]) for a, b in rows if a is not None and b is not None]).reshape(-1, 2)
        pairs = pairs[np.isfinite(pairs).all(axis=1)]
        return float(pairs[:, 0].mean() / pairs[:, 1].mean()) if len(pairs) and pairs[:, 1].any() else np.nan


def pose_loop(found: Verification) -> PoseLoop:
    """What came of the wanted poses of a verification's campaign."""
    seen, arm, measured = found.measured.seen, found.arm, found.measured
    rounded = np.round(seen.wanted / SAME_COMMAND).astype(np.int64)
    _, first, which = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    goal = np.argsort(order)[which.ravel()]
    wanted_pose = arm.base @ predicted(arm.nominal, nominal_net(arm.nominal, seen.wanted), measured)

    def attempts(keep: np.ndarray) -> Attempts:
        row = np.flatnonzero(keep)
        return Attempts(row, goal[row], compared(measured.some(row), wanted_pose[row]))

    return PoseLoop(found, seen.wanted[first[order]], attempts(~seen.compensated), attempts(seen.compensated))
