"""Joint axes from measured points: one call for every kind of joint and both estimators."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from core.axes.likelihood import fit_rotary_axis
from core.axes.paper import fit_paper_axis
from core.axes.points import SweepPoints, sweep_points
from core.axes.result import AxisFit
from core.axes.sliding import fit_sliding_axis
from core.errors import InputError
from core.geometry import Array, Line

__all__ = ["AxisFit", "fit_axis"]

ESTIMATORS = ("likelihood", "paper")
LARGEST_REJECTED_SHARE = 0.2


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
    fit = _fit(points, sliding, robust)
    if reject:
        fit = _without_outliers(points, fit, robust)
    fit = _in_positive_sense(points, fit, commanded)
    if estimator == "paper":
        return _paper(points, fit)
    return fit


def _fit(points: SweepPoints, sliding: bool, robust: bool) -> AxisFit:
    return fit_sliding_axis(points, robust) if sliding else fit_rotary_axis(points, robust)


def _without_outliers(points: SweepPoints, fit: AxisFit, robust: bool) -> AxisFit:
    """Take out the point that stands out most, fit again, and so on while any does."""
    used, found = np.ones(points.count, dtype=bool), fit
    for _ in range(int(LARGEST_REJECTED_SHARE * points.count)):
        if not found.outliers.any():
            break
        rows = np.flatnonzero(used)
        used[rows[np.argmin(found.outlier_probability)]] = False
        found = _fit(points.only(used), fit.sliding, robust)
    return fit if used.all() else _spread(points, found, used, fit)


def _spread(points: SweepPoints, found: AxisFit, used: np.ndarray, first: AxisFit) -> AxisFit:
    """The fit of the used points with residuals of all of them."""
    axial, radial, tangential, probability = (np.zeros(points.count) for _ in range(4))
    probability[used] = found.outlier_probability
    axial[used], radial[used], tangential[used] = found.axial_m, found.radial_m, found.tangential_m
    left_out = np.flatnonzero(~used)
    x, y, z = np.vstack([found.basis, found.line.direction]) @ (points.point_m[left_out] - found.line.point_m).T
    target = points.target_index()
    if found.sliding:
        inside = points.only(used).point_m @ found.basis.T
        for k in np.unique(target[left_out]):
            rows = left_out[target[left_out] == k]
            middle = inside[target[used] == k].mean(axis=0) if np.any(target[used] == k) else np.zeros(2)
            radial[rows], tangential[rows] = (points.point_m[rows] @ found.basis.T - middle).T
    else:
        axial[left_out] = z - found.height_m[target[left_out]]
        radial[left_out] = np.hypot(x, y) - found.radius_m[target[left_out]]
    return replace(
        found,
        axial_m=axial,
        radial_m=radial,
        tangential_m=tangential,
        used=used,
        outlier_probability=np.where(used, probability, first.outlier_probability),
    )


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
    return _spread(points, fit_paper_axis(points.only(used), inside), used, fit)
