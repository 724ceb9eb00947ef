"""What the drives did, seen from the refined arm: the curves that go with the functions of the refinement.

The residual of a point along its arc, divided by its radius, is what its joint did beyond its function. Added to the
function's own displacement it gives the displacement as observed from the refined axes.
"""

from dataclasses import dataclass, replace

import numpy as np

from core.arm_jacobian import ArmState, Observations, Prediction, active_displacements
from core.function_fit import FunctionFit, SweepCurve
from core.geometry import Array
from core.motion_forms import MotionFunction
from core.walk_from_base import SweepMotion


@dataclass(frozen=True)
class Seen:
    """The points of a refinement with their residuals."""

    observations: Observations
    prediction: Prediction
    covariance_m2: Array
    """(m, 3, 3)."""
    used: np.ndarray
    """(m,)."""


def refined_motions(motions: tuple[SweepMotion, ...], state: ArmState, seen: Seen) -> tuple[SweepMotion, ...]:
    """The sweeps' curves by the refined arm; rows of ``seen`` are those of the sweeps, one after the other."""
    active = active_displacements(state, seen.observations)
    out, at = [], 0
    for motion in motions:
        rows = slice(at, at + len(motion.found.sweep.rows))
        at = rows.stop
        out.append(_refined(motion, state, seen, active, rows))
    return tuple(out)


def with_curves(
    fits: tuple[FunctionFit | None, ...], curves: tuple[tuple[SweepCurve, ...], ...], home: bool, slopes: Array
) -> tuple[FunctionFit | None, ...]:
    """Fits of functions with residuals from refined curves, one tuple of curves a joint.

    Curves count displacement from zero, so that a fit's ``start`` is zero.
    """
    return tuple(
        fit if fit is None or not mine else _with_residuals(fit, mine, home, float(slope))
        for fit, mine, slope in zip(fits, curves, slopes, strict=True)
    )


def _refined(motion: SweepMotion, state: ArmState, seen: Seen, active: Array, rows: slice) -> SweepMotion:
    sweep = motion.found.sweep
    index = sweep.joint - 1
    own = np.zeros(len(sweep.rows), dtype=bool)
    own[motion.found.axis_rows] = True
    excess, std = _excess(seen, rows, index, own, sweep.stop, np.zeros((len(sweep.rows), 3)))
    stops = np.isfinite(excess)
    by_stop = _first_of_stop(active[rows, index], sweep.stop)
    asked = _first_of_stop(seen.observations.asked[rows, index], sweep.stop)
    displacement = by_stop + np.nan_to_num(excess)
    none = np.zeros((int(stops.sum()), 0))
    curve = SweepCurve(displacement[stops], asked[stops], std[stops], none, np.zeros((0, 0)))
    if motion.passive is None:
        return replace(motion, curve=curve)
    # What joint i did beyond its function also moved the target of joint i+1; it is taken off first.
    carried = seen.prediction.by_net[rows, :, index] * np.nan_to_num(excess)[sweep.stop][:, None]
    beyond, beyond_std = _excess(seen, rows, index + 1, seen.observations.link[rows] > index + 1, sweep.stop, carried)
    passive = MotionFunction(state.couplings[index + 1].form, state.couplings[index + 1].coefficients)(by_stop) + beyond
    lever = _lever(seen, rows, index, seen.observations.link[rows] > index + 1)
    beyond_std = np.hypot(beyond_std, lever * np.nan_to_num(std))
    both = np.isfinite(passive) & stops
    none = np.zeros((int(both.sum()), 0))
    return replace(
        motion,
        curve=curve,
        passive=SweepCurve(displacement[both], passive[both], beyond_std[both], none, np.zeros((0, 0))),
    )


def _excess(
    seen: Seen, rows: slice, index: int, wanted: np.ndarray, stop: np.ndarray, carried: Array
) -> tuple[Array, Array]:
    """Displacement of a joint beyond its function at each stop, and its standard deviation, (stops,); NaN: not seen."""
    arm = seen.prediction.by_net[rows, :, index]
    residual = (seen.observations.point_m - seen.prediction.point_m)[rows] - carried
    square = np.einsum("mi,mi->m", arm, arm)
    counts = wanted & seen.used[rows] & (square > 0)
    square = np.where(counts, square, 1.0)
    variance = np.einsum("mi,mij,mj->m", arm, seen.covariance_m2[rows], arm) / square**2
    weight = np.where(counts, 1.0 / np.where(counts, variance, 1.0), 0.0)
    count = int(stop.max()) + 1
    total = np.bincount(stop, weight, count)
    mean = np.bincount(stop, weight * np.einsum("mi,mi->m", arm, residual) / square, count)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(total > 0, mean / total, np.nan), np.where(total > 0, 1.0 / np.sqrt(total), np.nan)


def _lever(seen: Seen, rows: slice, index: int, wanted: np.ndarray) -> float:
    """Angle about axis i+1 that a target on its link seems to turn by for a unit turn about axis i."""
    own, below = seen.prediction.by_net[rows, :, index + 1][wanted], seen.prediction.by_net[rows, :, index][wanted]
    return float(np.mean(np.einsum("mi,mi->m", own, below) / np.einsum("mi,mi->m", own, own)))


def _first_of_stop(values: Array, stop: np.ndarray) -> Array:
    return values[np.unique(stop, return_index=True)[1]]


def _with_residuals(fit: FunctionFit, curves: tuple[SweepCurve, ...], home: bool, slope: float) -> FunctionFit:
    function = MotionFunction(fit.form, fit.coefficients)
    at_zero = float(function(0.0)) if home else 0.0
    residual = tuple(c.y - function(c.displacement) + at_zero for c in curves)
    before = np.concatenate([(b := c.y - slope * c.displacement) - b.mean() for c in curves])
    return replace(
        fit,
        start=np.zeros(len(curves)),
        residual=residual,
        rms_before=float(np.sqrt(np.mean(before**2))),
        rms_after=float(np.sqrt(np.mean(np.concatenate(residual) ** 2))),
        chi_square=float(sum(np.sum((r / c.std) ** 2) for r, c in zip(residual, curves, strict=True))),
    )
