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
LEAST_BEFORE = 6
"""Shots that must have made an axis known before the next one can be called a slip."""
FAR_OFF = 30.0
"""So many standard deviations off their circle a slip lies: far beyond what a short arc leaves open of it."""


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
    slip = count > LEAST_BEFORE and not sliding and _is_slip(points, command, target, covariance_m2)
    try:
        fit = fit_axis(points, sliding=sliding, target=target, covariance_m2=covariance_m2, commanded=command)
    except (AxisUndefined, NotConverged) as error:
        lacks = None if sliding else _lacking(points, command, target, covariance_m2)
        chances = _chances(np.full(count, np.nan), slip)
        return LiveSweep(None, str(error), tuple(map(_verdict, chances)), chances, None, lacks)
    judged = fit.degrees_of_freedom >= 3
    chances = _chances(fit.outlier_probability if judged else np.full(count, np.nan), slip)
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


def _chances(chances: Array, slip: bool) -> Array:
    """Chances of all shots; the last one has none where it is a slip."""
    return np.append(chances[:-1], 0.0) if slip else chances


def _is_slip(points_m: Array, commanded: Array, target: ArrayLike | None, covariance_m2: ArrayLike | None) -> bool:
    """Whether the last shot lies far off the circle of all the earlier ones, (k - 1, 3), of a rotary joint.

    A wrong target or a slip of the pen can bend the arc so much that the axis goes through it, or that none is left to
    judge it by.
    """
    which = np.zeros(len(points_m), dtype=int) if target is None else np.asarray(target)
    stated = None if covariance_m2 is None else np.asarray(covariance_m2)[:-1]
    if which[-1] not in which[:-1]:
        return False
    names, earlier = np.unique(which[:-1], return_inverse=True)
    try:
        before = fit_axis(points_m[:-1], target=earlier, covariance_m2=stated, commanded=commanded[:-1])
    except (AxisUndefined, NotConverged):
        return False
    mine = int(np.searchsorted(names, which[-1]))
    away = points_m[-1] - before.line.point_m
    along = float(away @ before.line.direction)
    outward = float(np.linalg.norm(away - along * before.line.direction))
    off = np.hypot(along - before.height_m[mine], outward - before.radius_m[mine])
    return bool(off > FAR_OFF * before.sigma_m * before.noise_factor)


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
