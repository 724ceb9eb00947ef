"""A sweep while it is being measured: what the last shot is worth, and what would be known if one stopped now.

The axis is fitted anew after every shot (a fraction of a millisecond). A shot is judged by all the others: its residual
is compared with their scatter, its own pull on the fit taken off, so that one bad shot does not excuse itself.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from core.arc_needed import ArcNeeded, arc_needed
from core.arm import slide, turn
from core.axes import AxisFit, fit_axis
from core.displacement import Displacements, displacements
from core.errors import AxisUndefined, NotConverged
from core.geometry import Array, apply, invert
from core.kinematics import link_frames
from core.robot import Robot

DOUBTFUL = 0.02
"""A shot that noise alone would put so far out less often than this is doubtful."""
WRONG = 1e-4
"""... and less often than this, it is to be measured again."""


class Verdict(StrEnum):
    """What to do with a shot."""

    KEEP = "keep"
    DOUBTFUL = "doubtful"
    AGAIN = "measure again"
    EARLY = "too early to say"


@dataclass(frozen=True)
class LiveSweep:
    """The state of a sweep after its latest shot. Arrays have one entry a shot, in the order of measurement."""

    fit: AxisFit | None
    """The axis so far; None: not yet defined, see ``waiting_for``."""
    waiting_for: str
    """Why there is no axis yet, in a sentence; empty when there is one."""
    verdicts: tuple[Verdict, ...]
    chances: Array
    """Chance that noise alone puts a shot so far out; NaN: too early to say."""
    displacements: Displacements | None
    """About the axis so far, from the first stop."""
    lacks: ArcNeeded | None = None
    """How much arc is missing, while there is no axis; None: it cannot be told, or there is an axis."""

    @property
    def last(self) -> Verdict:
        return self.verdicts[-1] if self.verdicts else Verdict.EARLY


def live_sweep(
    points_m: ArrayLike,
    commanded: ArrayLike,
    *,
    sliding: bool = False,
    target: ArrayLike | None = None,
    covariance_m2: ArrayLike | None = None,
) -> LiveSweep:
    """Judge a sweep in progress.

    Args:
        points_m: shots so far, excluded ones left out, (k, 3).
        commanded: commanded displacement of the swept joint for each shot, rad or m, (k,).
        sliding: whether the joint slides.
        target: index of the target of each shot, (k,), where several ride on the swept link.
        covariance_m2: stated covariance of each shot, (k, 3, 3).
    """
    points, command = np.asarray(points_m, dtype=float).reshape(-1, 3), np.asarray(commanded, dtype=float)
    count = len(points)
    try:
        fit = fit_axis(points, sliding=sliding, target=target, covariance_m2=covariance_m2, commanded=command)
    except (AxisUndefined, NotConverged) as error:
        lacks = None if sliding else _lacking(points, command, target, covariance_m2)
        return LiveSweep(None, str(error), (Verdict.EARLY,) * count, np.full(count, np.nan), None, lacks)
    judged = fit.degrees_of_freedom >= 3
    chances = fit.outlier_probability if judged else np.full(count, np.nan)
    moved = displacements(fit, points, target=target, commanded=command)
    return LiveSweep(fit, "", tuple(_verdict(chance) for chance in chances), chances, moved)


def expected_point(fit: AxisFit, last_point_m: ArrayLike, step: float) -> Array:
    """Where a target will be after one more commanded step of the swept joint, (3,): along its arc or line so far.

    Args:
        fit: the axis so far.
        last_point_m: where it was last seen, (3,).
        step: commanded change of the joint, rad or m.
    """
    move = slide if fit.sliding else turn
    return move(fit.line, np.array([step]), np.asarray(last_point_m, dtype=float)[None, :])[0]


def carried_point(
    robot: Robot, base: Array, link: int, point_m: ArrayLike, before: ArrayLike, after: ArrayLike
) -> Array:
    """Where the nominal arm carries a point of a link from one configuration to another, (3,).

    Args:
        base: from the robot's base frame to the frame of the point, (4, 4).
        link: that the point rides on, 0: it stays.
        point_m: where it is before, (3,).
        before, after: net displacements, rad or m, (n,).
    """
    if link == 0:
        return np.asarray(point_m, dtype=float)
    first, second = base @ link_frames(robot, np.stack([before, after]))[:, link - 1]
    return apply(second @ invert(first), point_m)


def place_std_at(fit: AxisFit, point_m: ArrayLike) -> float:
    """Standard uncertainty of the axis' place where it passes a point, say the tool, in metres; NaN where it slides."""
    if fit.sliding:
        return float("nan")
    along = float((np.asarray(point_m) - fit.line.point_m) @ fit.line.direction)
    carry = np.hstack([along * np.eye(2), np.eye(2)])
    return float(np.sqrt(np.trace(carry @ fit.covariance @ carry.T)))


def _lacking(
    points_m: Array, commanded: Array, target: ArrayLike | None, covariance_m2: ArrayLike | None
) -> ArcNeeded | None:
    """What the target with the most shots lacks."""
    if len(points_m) == 0:
        return None
    which = np.zeros(len(points_m), dtype=int) if target is None else np.asarray(target)
    mine = which == np.bincount(which).argmax()
    sigma = None
    if covariance_m2 is not None:
        sigma = float(np.sqrt(np.trace(np.asarray(covariance_m2), axis1=1, axis2=2).mean() / 3))
    return arc_needed(points_m[mine], commanded[mine], sigma)


def _verdict(chance: float) -> Verdict:
    if np.isnan(chance):
        return Verdict.EARLY
    if chance < WRONG:
        return Verdict.AGAIN
    return Verdict.DOUBTFUL if chance < DOUBTFUL else Verdict.KEEP
