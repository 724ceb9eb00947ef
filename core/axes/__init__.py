"""Joint axes from measured points: one call for every kind of joint and both estimators."""

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from core.axes.likelihood import fit_rotary_axis
from core.axes.paper import fit_paper_axis
from core.axes.points import SweepPoints, sweep_points
from core.axes.rejection import fit_rejecting, spread
from core.axes.result import AxisFit
from core.axes.sliding import fit_sliding_axis
from core.errors import InputError
from core.geometry import Array, Line

__all__ = ["AxisFit", "fit_axis"]

ESTIMATORS = ("likelihood", "paper")


def fit_axis(
    points_m: ArrayLike,
    *,
    sliding: bool = False,
    estimator: str = "likelihood",
    target: ArrayLike | None = None,
    stop: ArrayLike | None = None,
    sigma_m: ArrayLike | None = None,
    covariance_m2: ArrayLike | None = None,
    commanded: ArrayLike | None = None,
    robust: bool = False,
    reject: bool = False,
) -> AxisFit:
    """Find the axis of one joint from points measured while it alone moved.

    Args:
        points_m: measured points in the instrument's frame, in the order of measurement, (k, 3).
        sliding: True for a prismatic joint: the points lie on straight lines.
        estimator: ``likelihood`` or ``paper`` (equations 3 to 5, 10 and 11).
        target: number of the target of each point, (k,); all targets share the axis.
        stop: number of the standstill of each point, (k,), if several targets of *one link* are seen at each; they are
            then known to have moved by the same displacement.
        sigma_m: standard deviation of one coordinate, one number or (k,). Without it, it is estimated.
        covariance_m2: covariance of each point, (k, 3, 3); beats ``sigma_m``.
        commanded: commanded displacement of each point, (k,); used for nothing but the sense of the direction. Without
            it the positive sense is that of the order of measurement.
        robust: rein in gross errors instead of trusting a normal distribution.
        reject: fit again without points that stand out; they are kept in the result, with ``used`` False.

    Returns:
        The axis with its covariance, the residuals of all points, and what stands out.

    Raises:
        AxisUndefined: too few points, all at one place, on a straight line, or on the axis itself.
        InputError: wrong shapes, numbers that are not finite, an unknown estimator.
    """
    if estimator not in ESTIMATORS:
        raise InputError(f"there is no axis estimator {estimator!r}; expected one of {', '.join(ESTIMATORS)}")
    points = sweep_points(points_m, target, stop, sigma_m, covariance_m2)
    fit_points = partial(fit_sliding_axis if sliding else fit_rotary_axis, robust=robust)
    fit = fit_rejecting(points, fit_points) if reject else fit_points(points)
    fit = _in_positive_sense(points, fit, commanded)
    if estimator == "paper":
        return _paper(points, fit)
    return fit


def _in_positive_sense(points: SweepPoints, fit: AxisFit, commanded: ArrayLike | None) -> AxisFit:
    if positive_sense(points, fit, commanded) >= 0:
        return fit
    # Turning e2 with the direction keeps e1 x e2 = direction; the second tilt and shift change sign.
    signs = np.array([-1.0, 1.0]) if fit.sliding else np.array([-1.0, 1.0, 1.0, -1.0])
    basis = fit.basis * np.array([[1.0], [-1.0]])
    return replace(
        fit,
        line=Line(fit.line.point_m, -fit.line.direction),
        basis=basis,
        covariance=fit.covariance * signs[:, None] * signs,
        height_m=-fit.height_m,
        axial_m=-fit.axial_m,
        tangential_m=-fit.tangential_m,
    )


def positive_sense(points: SweepPoints, fit: AxisFit, commanded: ArrayLike | None = None) -> float:
    """Positive where the direction agrees with the sense of motion, judged by all points.

    With commands: for a rotary axis the sense in which angle minus command is better concentrated on the circle (any
    number of turns, any step); for a sliding one the sign of the covariance. Without: the sum of the steps taken.
    """
    used = fit.used
    target = points.target_index()[used]
    relative = points.point_m[used] - fit.line.point_m
    command = None if commanded is None else np.asarray(commanded, dtype=float)[used]
    if fit.sliding:
        along = relative @ fit.line.direction
        order = np.arange(len(along), dtype=float) if command is None else command
        return sum(_co_moment(along[target == k], order[target == k]) for k in np.unique(target))
    angle = np.arctan2(relative @ fit.basis[1], relative @ fit.basis[0])
    if command is None or np.ptp(command) == 0:
        steps = [np.diff(angle[target == k]) for k in np.unique(target)]
        return float(sum(np.sin(step).sum() for step in steps))
    return sum(_concentration(angle[target == k], command[target == k]) for k in np.unique(target))


def _co_moment(a: Array, b: Array) -> float:
    return float((a - a.mean()) @ (b - b.mean()))


def _concentration(angle: Array, command: Array) -> float:
    along, against = np.exp(1j * (angle - command)).sum(), np.exp(1j * (angle + command)).sum()
    return float(abs(along) - abs(against))


def _paper(points: SweepPoints, fit: AxisFit) -> AxisFit:
    used = fit.used
    if used.all():
        return fit_paper_axis(points, fit)
    inside = replace(
        fit,
        used=np.ones(int(used.sum()), dtype=bool),
        axial_m=fit.axial_m[used],
        radial_m=fit.radial_m[used],
        tangential_m=fit.tangential_m[used],
        outlier_probability=fit.outlier_probability[used],
    )
    return spread(points, fit_paper_axis(points.only(used), inside), used, fit.outlier_probability)
