"""A sliding axis from points along its straight lines: only a direction (section 2.2 of the paper).

A point of target k runs along a line that is parallel to the axis; where the line is tells nothing about the arm. With
Gaussian noise the likelihood is greatest where the weighted squares of the distances from the lines are least. With
equal noise that is the first principal direction of the points about their target's mean; with unequal or skew noise
the two tilts are iterated from there. What the joint did along the line stays free, as the angle does for a rotary one.
"""

import numpy as np

from core.axes.plane_circle import check_extent
from core.axes.points import SweepPoints, require_points
from core.axes.result import AxisFit, outlier_probabilities
from core.errors import AxisUndefined, NotConverged
from core.geometry import Array, Line, perpendicular_basis


def fit_sliding_axis(points: SweepPoints, robust: bool = False) -> AxisFit:
    """Find the direction of a sliding axis.

    Args:
        points: from ``points.sweep_points``.
        robust: rein in residuals beyond two standard deviations, for data with gross errors.

    Raises:
        AxisUndefined: too few points, or all at one place within the noise.
    """
    unknown = 2 + 2 * points.target_count
    require_points(points, unknown, 2, 3)
    direction = _principal_direction(points)
    for _ in range(50):
        matrix, residual, _ = _rows(points, direction)
        weight = _weights(residual) if robust else np.ones(points.count)
        flat = matrix.reshape(-1, unknown)
        weighted = flat * np.repeat(weight, 2)[:, None]
        covariance = np.linalg.pinv(weighted.T @ flat, rcond=1e-14, hermitian=True)
        step = -covariance @ (weighted.T @ residual.ravel())
        e1, e2 = perpendicular_basis(direction)
        moved = direction + step[0] * e1 + step[1] * e2
        direction = moved / np.linalg.norm(moved)
        if np.hypot(step[0], step[1]) <= 1e-14 + 1e-4 * np.sqrt(covariance[0, 0] + covariance[1, 1]):
            return _result(points, direction, weight, covariance)
    raise NotConverged("the fit of a sliding axis did not converge in 50 steps")


def _principal_direction(points: SweepPoints) -> Array:
    target = points.target_index()
    centred = np.empty_like(points.point_m)
    for k in range(points.target_count):
        mine = target == k
        centred[mine] = points.point_m[mine] - points.point_m[mine].mean(axis=0)
    values, vectors = np.linalg.eigh(centred.T @ centred)
    spread = np.sqrt(np.maximum(values, 0.0) / points.count)
    check_extent(np.array([spread[1], spread[2], spread[2]]), points)
    return vectors[:, 2]


def _rows(points: SweepPoints, direction: Array) -> tuple[Array, Array, Array]:
    """Whitened derivatives (k, 2, p), whitened residuals (k, 2) and residuals in metres (k, 2)."""
    basis = np.stack(perpendicular_basis(direction))
    target, each = points.target_index(), np.arange(points.count)
    middle = points.point_m.mean(axis=0)
    across, along = (points.point_m - middle) @ basis.T, (points.point_m - middle) @ direction
    counts = np.maximum(np.bincount(target, minlength=points.target_count), 1)
    means = (
        np.stack([np.bincount(target, column, points.target_count) for column in across.T], axis=1) / counts[:, None]
    )
    raw = across - means[target]
    matrix = np.zeros((points.count, 2, 2 + 2 * points.target_count))
    matrix[:, 0, 0] = matrix[:, 1, 1] = -along
    matrix[each, 0, 2 + 2 * target] = matrix[each, 1, 3 + 2 * target] = -1.0
    if points.covariance_m2 is not None:
        whitener = np.linalg.inv(np.linalg.cholesky(basis @ points.covariance_m2 @ basis.T))
        return whitener @ matrix, (whitener @ raw[:, :, None])[:, :, 0], raw
    if points.sigma_m is not None:
        return matrix / points.sigma_m[:, None, None], raw / points.sigma_m[:, None], raw
    return matrix, raw, raw


def _weights(residual: Array) -> Array:
    length = np.sqrt(np.einsum("ij,ij->i", residual, residual))
    scale = max(float(np.median(length)) / np.sqrt(2 * np.log(2)), 1e-300)
    return np.minimum(1.0, 2.0 * scale / np.maximum(length, 1e-300))


def _result(points: SweepPoints, direction: Array, weight: Array, covariance: Array) -> AxisFit:
    matrix, residual, raw = _rows(points, direction)
    # The lines' places were set to plain means; with unequal weights the last of the fit moves them.
    places = -covariance @ (matrix.reshape(-1, matrix.shape[2]) * np.repeat(weight, 2)[:, None]).T @ residual.ravel()
    places[:2] = 0.0
    residual = residual + matrix @ places
    raw = raw - places[2:].reshape(-1, 2)[points.target_index()]
    square = np.einsum("ij,ij->i", residual, residual)
    total, freedom = float(weight @ square), 2 * points.count - matrix.shape[2]
    factor = np.sqrt(total / freedom) if freedom > 0 else 1.0
    stated = points.sigma_m is not None
    _require_travel(points, direction, factor, covariance)
    pull = np.einsum("ikp,pq,ikq->i", matrix, covariance, matrix)
    return AxisFit(
        line=Line(points.point_m.mean(axis=0), direction),
        sliding=True,
        basis=np.stack(perpendicular_basis(direction)),
        covariance=covariance[:2, :2] * (1.0 if stated else factor**2),
        estimator="likelihood",
        sigma_m=float(np.sqrt(np.mean(points.sigma_m**2))) if stated else float(factor),
        noise_factor=float(factor) if stated else 1.0,
        radius_m=np.zeros(points.target_count),
        height_m=np.zeros(points.target_count),
        axial_m=np.zeros(points.count),
        radial_m=raw[:, 0],
        tangential_m=raw[:, 1],
        used=np.ones(points.count, dtype=bool),
        outlier_probability=outlier_probabilities(
            square / np.maximum(1.0 - pull / 2, 1e-9), np.full(points.count, 2.0), total, freedom
        ),
        chi_square=total if stated else float(freedom),
        degrees_of_freedom=freedom,
    )


def _require_travel(points: SweepPoints, direction: Array, factor: float, covariance: Array) -> None:
    tilt_std = factor * np.sqrt(covariance[0, 0] + covariance[1, 1])
    if tilt_std > 0.3:
        travel = np.ptp(points.point_m @ direction) * 1e3
        raise AxisUndefined(
            f"the points span {travel:.3g} mm, too little for their noise: the direction would be known to "
            f"{np.rad2deg(tilt_std):.0f} deg only; expected a longer travel or less noise"
        )
