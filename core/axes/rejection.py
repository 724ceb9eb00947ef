"""Fits without points that stand out: these are named and kept, not fitted."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from core.axes.points import SweepPoints
from core.axes.result import AxisFit
from core.errors import AxisUndefined, NotConverged
from core.geometry import Array

LARGEST_REJECTED_SHARE = 0.2
"""No more than this share of a sweep is rejected; data that ask for more are not a few gross errors."""
MOST_TRIALS = 500
"""A sweep of more points than this is not searched for the one that spoils it."""
CLEARLY_LESS = 0.5
"""The scatter without a point that spoils the fit, over the least scatter without any other."""

FitPoints = Callable[[SweepPoints], AxisFit]


def fit_rejecting(points: SweepPoints, fit_points: FitPoints) -> AxisFit:
    """Take out the point that stands out most, fit again, and so on while any does.

    Args:
        points: the points of a sweep.
        fit_points: the estimator.

    Returns:
        The fit with ``used`` False, and residuals, for the points that were taken out.

    Raises:
        AxisUndefined, NotConverged: as the estimator, where no single point is to blame for it.
    """
    used, probability = np.ones(points.count, dtype=bool), np.zeros(points.count)
    try:
        found = fit_points(points)
    except (AxisUndefined, NotConverged):
        culprit = _culprit(points, fit_points)
        if culprit is None:
            raise
        used[culprit] = False
        found = fit_points(points.only(used))
    while found.outliers.any() and np.sum(~used) < LARGEST_REJECTED_SHARE * points.count:
        worst = int(np.argmin(found.outlier_probability))
        row = np.flatnonzero(used)[worst]
        probability[row], used[row] = found.outlier_probability[worst], False
        found = fit_points(points.only(used))
    return found if used.all() else spread(points, found, used, probability)


def spread(points: SweepPoints, found: AxisFit, used: np.ndarray, probability: Array) -> AxisFit:
    """The fit of the used points with residuals of all of them.

    Args:
        points: all points.
        found: the fit of the used ones.
        used: which they are, boolean, (k,).
        probability: outlier probability of those that are not used, (k,).
    """
    axial, radial, tangential = (np.zeros(points.count) for _ in range(3))
    axial[used], radial[used], tangential[used] = found.axial_m, found.radial_m, found.tangential_m
    left_out = np.flatnonzero(~used)
    x, y, z = np.vstack([found.basis, found.line.direction]) @ (points.point_m[left_out] - found.line.point_m).T
    target = points.target_index()[left_out]
    if found.sliding:
        middle = _middle_of_targets(points, found, used)
        radial[left_out], tangential[left_out] = np.stack([x, y]) - middle[target].T
    else:
        axial[left_out] = z - found.height_m[target]
        radial[left_out] = np.hypot(x, y) - found.radius_m[target]
    everyone = probability.copy()
    everyone[used] = found.outlier_probability
    return replace(
        found, axial_m=axial, radial_m=radial, tangential_m=tangential, used=used, outlier_probability=everyone
    )


def _middle_of_targets(points: SweepPoints, found: AxisFit, used: np.ndarray) -> Array:
    """Where the line of each target passes, in the fit's basis, (targets, 2)."""
    inside = (points.point_m[used] - found.line.point_m) @ found.basis.T
    target = points.target_index()[used]
    counts = np.maximum(np.bincount(target, minlength=points.target_count), 1)
    return np.stack([np.bincount(target, column, points.target_count) for column in inside.T], axis=1) / counts[:, None]


def _culprit(points: SweepPoints, fit_points: FitPoints) -> int | None:
    """The one point whose absence turns hopeless data into good ones; None: there is none."""
    if points.count > MOST_TRIALS:
        return None
    scatter = np.full(points.count, np.inf)
    for k in range(points.count):
        try:
            found = fit_points(points.only(np.arange(points.count) != k))
        except (AxisUndefined, NotConverged):
            continue
        scatter[k] = found.sigma_m * found.noise_factor
    best, second = np.partition(scatter, 1)[:2] if points.count > 1 else (np.inf, np.inf)
    return int(np.argmin(scatter)) if np.isfinite(best) and best < CLEARLY_LESS * second else None
