"""A rotary axis as the paper finds it: equations 1 to 5, without any commanded displacement.

The axis is the z-axis of a phi-model link from the measuring frame, with unknowns a, b, alpha, theta. In its frame a
point has coordinates (x, y, z)_j; j = 0 is the first point of its target. Two cost functions are minimised together,

    f1 = sum_j (z_j - z_0)^2                                                                            (3)
    f2 = sum_j [(x_j - x_0)(x_j + x_0) + (y_j - y_0)(y_j + y_0)]^2                                      (4)

by Gauss-Newton with the 2(n-1) x 4 Jacobian (5). The method prescribes no weights: f1 is in m^2 and f2 in m^4, so that
the balance between them depends on the unit, and the first point enters every equation. A sliding axis (9 to 11) has
a = b = 0 and two unknowns; the spread of x_j and of y_j about the first point is minimised (10).

Both are kept as they were published, for comparison. Their covariance is propagated from the noise of the points
through the Gauss-Newton fixed point, the common first point included.
"""

from dataclasses import replace

import numpy as np

from core.axes.plane_circle import plane_circle
from core.axes.points import SweepPoints, require_points
from core.axes.result import AxisFit
from core.errors import NotConverged
from core.geometry import Array, Line, cross, perpendicular_basis
from core.phi_transforms import link_to, link_transform, phi_transform


def fit_paper_axis(points: SweepPoints, reference: AxisFit) -> AxisFit:
    """The paper's estimate of a rotary or sliding axis.

    Args:
        points: from ``points.sweep_points``; targets count, shared stops and noise weights do not.
        reference: the likelihood fit of the same points; it tells the kind of axis and the noise level, and its sense
            of direction is kept.

    Raises:
        AxisUndefined: too few points, all at one place, on a straight line.
        NotConverged: the Gauss-Newton iteration did not end.
    """
    sliding = reference.sliding
    require_points(points, 2 if sliding else 4, 2, 4)
    first = _first_of_target(points)
    phi_rad = _phi_away_from(reference.line)
    row = _start(points, reference, phi_rad)
    unknown = [2, 3] if sliding else [0, 1, 2, 3]
    for _ in range(200):
        error, jacobian, _ = _equations(points, first, phi_rad, row, sliding)
        step = -np.linalg.solve(jacobian.T @ jacobian, jacobian.T @ error)
        row[unknown] += step
        if np.abs(step).max() < 1e-13 + 1e-12 * np.abs(row).max():
            return _result(points, first, phi_rad, row, reference)
    raise NotConverged("the paper's estimator did not converge in 200 Gauss-Newton steps")


def _first_of_target(points: SweepPoints) -> np.ndarray:
    """Row of the first point of each point's target, (k,)."""
    _, first = np.unique(points.target_index(), return_index=True)
    return first[points.target_index()]


def _phi_away_from(line: Line) -> float:
    """phi_0 such that Z_phi, in the xy-plane of the measuring frame, is normal to the axis."""
    return float(np.arctan2(line.direction[0], -line.direction[1]))


def _start(points: SweepPoints, reference: AxisFit, phi_rad: float) -> Array:
    line = reference.line
    if not reference.sliding:
        flat = plane_circle(points)
        line = Line(flat.point_m, flat.direction * np.sign(flat.direction @ line.direction))
    return np.array(link_to(line, phi_transform(phi_rad), reference.sliding, 1.0, 0))


def _equations(
    points: SweepPoints, first: np.ndarray, phi_rad: float, row: Array, sliding: bool
) -> tuple[Array, Array, Array]:
    """Errors (2m,), their derivatives by the unknowns (2m, u), and by the local coordinates of a point (2, k, 3)."""
    phi_frame = phi_transform(phi_rad)
    frame = phi_frame @ link_transform(*row)
    rotation, origin = frame[:3, :3], frame[:3, 3]
    local = (points.point_m - origin) @ rotation
    later = np.flatnonzero(first != np.arange(points.count))
    # Unit changes of a, b, alpha, theta move the frame by these velocities and turns, seen in the frame itself.
    z_phi = rotation.T @ phi_frame[:3, 2]
    arm = rotation.T @ (origin - phi_frame[:3, 3])
    x_axis = np.array([1.0, 0.0, 0.0])
    zero = np.zeros((points.count, 3))
    moves = np.stack(
        [zero - z_phi, zero - x_axis, -cross(x_axis, local), -cross(z_phi, local + arm)], axis=2
    )  # (k, 3, 4)
    if sliding:
        moves = moves[:, :, 2:]
        error = (local - local[first])[later][:, :2].T.ravel()
        jacobian = (moves - moves[first])[later][:, :2].transpose(1, 0, 2).reshape(2 * len(later), -1)
        unit = np.zeros((2, points.count, 3))
        unit[0, :, 0] = unit[1, :, 1] = 1.0
        return error, jacobian, unit
    square = local[:, 0] ** 2 + local[:, 1] ** 2
    flat = local * np.array([2.0, 2.0, 0.0])
    square_moves = np.einsum("ki,kiu->ku", flat, moves)
    error = np.concatenate([(local[:, 2] - local[first, 2])[later], (square - square[first])[later]])
    jacobian = np.concatenate([(moves[:, 2] - moves[first, 2])[later], (square_moves - square_moves[first])[later]])
    gradient = np.zeros((2, points.count, 3))
    gradient[0, :, 2] = 1.0
    gradient[1] = flat
    return error, jacobian, gradient


def _result(points: SweepPoints, first: np.ndarray, phi_rad: float, row: Array, reference: AxisFit) -> AxisFit:
    sliding = reference.sliding
    frame = phi_transform(phi_rad) @ link_transform(*row)
    direction = frame[:3, 2]
    middle = points.point_m.mean(axis=0)
    line = Line(frame[:3, 3], direction)
    line = Line(middle if sliding else line.foot_of(middle), direction)
    basis = np.stack(perpendicular_basis(direction))
    covariance = _covariance(points, first, phi_rad, row, reference, line, basis)
    x, y, z = np.vstack([basis, direction]) @ (points.point_m - line.point_m).T
    target = points.target_index()
    rho = np.hypot(x, y)
    mean = [_target_means(v, target, points.target_count) for v in (x, y, z, rho)]
    return replace(
        reference,
        line=line,
        basis=basis,
        covariance=covariance,
        estimator="paper",
        radius_m=np.zeros(points.target_count) if sliding else mean[3],
        height_m=np.zeros(points.target_count) if sliding else mean[2],
        axial_m=np.zeros(points.count) if sliding else z - mean[2][target],
        radial_m=(x - mean[0][target]) if sliding else rho - mean[3][target],
        tangential_m=(y - mean[1][target]) if sliding else np.zeros(points.count),
    )


def _target_means(values: Array, target: np.ndarray, count: int) -> Array:
    return np.bincount(target, values, count) / np.maximum(np.bincount(target, minlength=count), 1)


def _covariance(
    points: SweepPoints, first: np.ndarray, phi_rad: float, row: Array, reference: AxisFit, line: Line, basis: Array
) -> Array:
    """Noise of the points through the fixed point of (5) to tilts and shifts of the axis at its point."""
    sliding = reference.sliding
    _, jacobian, gradient = _equations(points, first, phi_rad, row, sliding)
    phi_frame = phi_transform(phi_rad)
    frame = phi_frame @ link_transform(*row)
    later = np.flatnonzero(first != np.arange(points.count))
    if points.covariance_m2 is not None:
        noise = points.covariance_m2
    else:
        sigma = points.sigma_m if points.sigma_m is not None else np.full(points.count, reference.sigma_m)
        noise = sigma[:, None, None] ** 2 * np.eye(3)
    local_noise = frame[:3, :3].T @ noise @ frame[:3, :3]
    pull = -np.linalg.solve(jacobian.T @ jacobian, jacobian.T).reshape(jacobian.shape[1], 2, len(later))
    # What each point does to the unknowns: its own equations, and those that it enters as the first point.
    effect = np.zeros((jacobian.shape[1], points.count, 3))
    for equation in range(2):
        effect[:, later] += pull[:, equation, :, None] * gradient[equation, later]
        np.add.at(effect, (slice(None), first[later]), -pull[:, equation, :, None] * gradient[equation, first[later]])
    of_unknowns = np.einsum("uki,kij,vkj->uv", effect, local_noise, effect)
    carry = _axis_by_unknowns(phi_frame, frame, line, basis, sliding)
    return carry @ of_unknowns @ carry.T


def _axis_by_unknowns(phi_frame: Array, frame: Array, line: Line, basis: Array, sliding: bool) -> Array:
    """Derivatives of tilts and shifts at the axis point by a, b, alpha, theta (sliding: tilts by alpha, theta)."""
    z_phi, x_axis = phi_frame[:3, 2], frame[:3, 0]
    tilts = np.stack([cross(x_axis, line.direction), cross(z_phi, line.direction)], axis=1)
    if sliding:
        return basis @ tilts
    turns = np.stack([cross(x_axis, line.point_m - frame[:3, 3]), cross(z_phi, line.point_m - phi_frame[:3, 3])])
    shifts = np.stack([z_phi, x_axis, *turns], axis=1)
    return np.concatenate([basis @ np.column_stack([np.zeros((3, 2)), tilts]), basis @ shifts])
