"""Residuals of points about a rotary axis, and their derivatives: what one Gauss-Newton step needs.

See ``likelihood.py`` for the model. Unknowns, in this order: two tilts about the pivot, two shifts, the heights and the
radii of the targets, and the azimuths of all targets but the first where stops are shared.
"""

from dataclasses import dataclass

import numpy as np

from core.axes.plane_circle import PlaneCircle
from core.axes.points import SweepPoints
from core.geometry import Array, cross, perpendicular_basis, rotation_about, wrap_angle

BLOCK = 16_384
"""Points are worked on in blocks of so many."""


@dataclass(frozen=True)
class RotaryState:
    """The parameters of the fit."""

    pivot_m: Array
    """Tilts turn the axis about this point in the middle of the measured ones, so that they stay near their arcs."""
    point_m: Array
    basis: Array
    """e1, e2 and the direction of the axis, as rows, (3, 3); a tilt carries all three along."""
    height_m: Array
    radius_m: Array
    azimuth_rad: Array | None
    """Angle of each target ahead of target 0, where stops are shared."""
    arc_m: Array
    """Length by which angles are turned into arcs: the radius at the start, kept so that derivatives are exact."""

    @property
    def direction(self) -> Array:
        return self.basis[2]


@dataclass(frozen=True)
class Rows:
    """Whitened residuals and their derivatives: what one Gauss-Newton step needs."""

    blocks: tuple[Array, ...]
    """Derivatives, (k, c, p), cut along k into blocks that stay in the processor's cache."""
    residual: Array
    """(k, c)."""
    raw: Array
    """Axial, radial and tangential residuals in metres, (k, 3)."""

    @property
    def cost(self) -> float:
        flat = self.residual.ravel()
        return float(flat @ flat)

    @property
    def matrix(self) -> Array:
        """All derivatives in one array, (k, c, p)."""
        return self.blocks[0] if len(self.blocks) == 1 else np.concatenate(self.blocks)

    @property
    def unknowns(self) -> int:
        return self.blocks[0].shape[2]

    def normal_equations(self, weight: Array | None) -> tuple[Array, Array]:
        """Information matrix (p, p) and gradient (p,) of half the weighted sum of squares; weight: (k,)."""
        normal, gradient, at = np.zeros((self.unknowns, self.unknowns)), np.zeros(self.unknowns), 0
        for block in self.blocks:
            rows = slice(at, at + len(block))
            at = rows.stop
            flat = block.reshape(-1, self.unknowns)
            weighted = flat if weight is None else flat * np.repeat(weight[rows], block.shape[1])[:, None]
            normal += weighted.T @ flat
            gradient += weighted.T @ self.residual[rows].ravel()
        return normal, gradient


def state_at(points: SweepPoints, start: PlaneCircle) -> RotaryState:
    """A state with the heights and radii that fit an axis best."""
    target, counts = points.target_index(), points_of_targets(points)
    along = (points.point_m - start.point_m) @ start.direction
    point = start.point_m + start.direction * along.mean()
    basis = np.array([*perpendicular_basis(start.direction), start.direction])
    x, y = basis[:2] @ (points.point_m - point).T
    height = np.bincount(target, along - along.mean(), points.target_count) / counts
    radius = np.bincount(target, np.hypot(x, y), points.target_count) / counts
    azimuth = None if points.stop is None else _azimuths(points, np.arctan2(y, x))
    return RotaryState(points.point_m.mean(axis=0), point, basis, height, radius, azimuth, radius)


def moved(state: RotaryState, step: Array) -> RotaryState:
    """The state after a step of the unknowns."""
    e1, e2, _ = state.basis
    k = len(state.height_m)
    turn = step[0] * e2 - step[1] * e1
    angle = float(np.sqrt(turn @ turn))
    rotation = rotation_about(turn / angle, angle) if angle > 0 else np.eye(3)
    azimuth = state.azimuth_rad
    if azimuth is not None:
        azimuth = azimuth + np.concatenate([[0.0], step[4 + 2 * k :]])
    return RotaryState(
        state.pivot_m,
        state.pivot_m + rotation @ (state.point_m + step[2] * e1 + step[3] * e2 - state.pivot_m),
        state.basis @ rotation.T,
        state.height_m + step[4 : 4 + k],
        state.radius_m + step[4 + k : 4 + 2 * k],
        azimuth,
        state.arc_m,
    )


def rows_at(points: SweepPoints, state: RotaryState, weights_of: RotaryState | None) -> Rows:
    """Residuals and derivatives by (tilt 1, tilt 2, shift 1, shift 2, heights, radii, azimuths).

    Skew noise is resolved along the axis, away from it and along the arc as these are at ``weights_of``.
    """
    if points.count <= BLOCK or points.stop is not None:
        return _block_at(points, state, weights_of)
    parts = [_block_at(points.only(slice(at, at + BLOCK)), state, weights_of) for at in range(0, points.count, BLOCK)]
    return Rows(
        tuple(part.blocks[0] for part in parts),
        np.concatenate([part.residual for part in parts]),
        np.concatenate([part.raw for part in parts]),
    )


def _block_at(points: SweepPoints, state: RotaryState, weights_of: RotaryState | None) -> Rows:
    basis = state.basis
    x, y, z = basis @ (points.point_m - state.point_m).T
    lever_x, lever_y, lever_z = basis @ (state.pivot_m - state.point_m)
    rho = np.maximum(np.hypot(x, y), 1e-300)
    cosine, sine = x / rho, y / rho
    shared = points.stop is not None
    k, count = points.target_count, points.count
    matrix = np.zeros((count, 3 if shared else 2, 4 + 2 * k + (k - 1 if shared else 0)))
    matrix[:, 0, 0], matrix[:, 0, 1] = x - lever_x, y - lever_y
    matrix[:, 1, 0], matrix[:, 1, 1] = (lever_z - z) * cosine, (lever_z - z) * sine
    matrix[:, 1, 2], matrix[:, 1, 3] = -cosine, -sine
    raw = np.zeros((count, 3))
    if points.target is None:
        matrix[:, 0, 4] = matrix[:, 1, 5] = -1.0
        raw[:, 0], raw[:, 1] = z - state.height_m[0], rho - state.radius_m[0]
    else:
        each = np.arange(count)
        matrix[each, 0, 4 + points.target] = matrix[each, 1, 4 + k + points.target] = -1.0
        raw[:, 0], raw[:, 1] = z - state.height_m[points.target], rho - state.radius_m[points.target]
    if shared:
        raw[:, 2] = _tangential(points, state, matrix, np.arctan2(y, x), (cosine, sine, z - lever_z, rho))
    local = None
    if points.covariance_m2 is not None:
        local = _local_frames(points, state if weights_of is None else weights_of)
    return _whitened(points, matrix, raw, local, state)


def _azimuths(points: SweepPoints, phi: Array) -> Array:
    """Angle of each target ahead of target 0 in the stops that they share; 0 where none is shared."""
    target, stops = points.target_index(), points.stop
    first = np.full(stops.max() + 1, np.nan)
    first[stops[target == 0]] = phi[target == 0]
    ahead = phi - first[stops]
    known = np.isfinite(ahead)
    unit = np.exp(1j * np.where(known, ahead, 0.0)) * known
    sums = np.bincount(target, unit.real, points.target_count) + 1j * np.bincount(
        target, unit.imag, points.target_count
    )
    return np.angle(sums)


def points_of_targets(points: SweepPoints) -> Array:
    return np.maximum(np.bincount(points.target_index(), minlength=points.target_count), 1)


def _tangential(
    points: SweepPoints, state: RotaryState, matrix: Array, phi: Array, cylinder: tuple[Array, ...]
) -> Array:
    """Fill the third row of the derivatives and return the residual along the arc."""
    cosine, sine, along, rho = cylinder
    target = points.target_index()
    arc = state.arc_m[target]
    by_sine, by_cosine = arc / rho * sine, arc / rho * cosine
    matrix[:, 2, 0], matrix[:, 2, 1] = along * by_sine, -along * by_cosine
    matrix[:, 2, 2], matrix[:, 2, 3] = by_sine, -by_cosine
    later = np.flatnonzero(target > 0)
    matrix[later, 2, 4 + 2 * points.target_count + target[later] - 1] = -arc[later]
    ahead = phi - state.azimuth_rad[target]
    weight = arc**2
    unit = np.exp(1j * ahead)
    mean = np.bincount(points.stop, weight * unit.real) + 1j * np.bincount(points.stop, weight * unit.imag)
    return arc * wrap_angle(ahead - np.angle(mean)[points.stop])


def _local_frames(points: SweepPoints, state: RotaryState) -> Array:
    """Axial, radial and tangential unit vectors at each point, as rows, (k, 3, 3)."""
    relative = points.point_m - state.point_m
    outward = relative - np.outer(relative @ state.direction, state.direction)
    outward /= np.maximum(np.sqrt(np.einsum("ij,ij->i", outward, outward)), 1e-300)[:, None]
    local = np.empty((points.count, 3, 3))
    local[:, 0], local[:, 1] = state.direction, outward
    local[:, 2] = cross(state.direction, outward)
    return local


def _whitened(points: SweepPoints, matrix: Array, raw: Array, local: Array | None, state: RotaryState) -> Rows:
    """Divide by the noise, and eliminate what each stop's free angle can explain."""
    components = matrix.shape[1]
    residual = raw[:, :components]
    if local is not None:
        factor = _whitener(points.covariance_m2, local)[:, :components, :components]
        matrix, residual = factor @ matrix, (factor @ residual[:, :, None])[:, :, 0]
        arc = factor[:, :, 2] * state.arc_m[points.target_index()][:, None] if components == 3 else None
    elif points.sigma_m is not None:
        scale = 1.0 / points.sigma_m
        matrix *= scale[:, None, None]
        residual = residual * scale[:, None]
        arc = _along_arc(scale * state.arc_m[points.target_index()]) if components == 3 else None
    else:
        arc = _along_arc(state.arc_m[points.target_index()]) if components == 3 else None
    if arc is not None:
        matrix, residual = _without_stop_angles(points.stop, arc, matrix, residual)
    return Rows((matrix,), residual, raw)


def _along_arc(length: Array) -> Array:
    return np.stack([np.zeros_like(length), np.zeros_like(length), length], axis=1)


def _whitener(covariance_m2: Array, local: Array) -> Array:
    """Lower triangular factors L^-1 of C = L L' in (axial, radial, tangential) coordinates, (k, 3, 3).

    The leading block of L^-1 is that of the leading block of C: dropping the tangential component marginalises it.
    """
    factor = np.linalg.cholesky(local @ covariance_m2 @ local.swapaxes(1, 2))
    return np.linalg.inv(factor)


def _without_stop_angles(stop: np.ndarray, arc: Array, matrix: Array, residual: Array) -> tuple[Array, Array]:
    """Project rows onto what no common turn of a stop's points can explain."""
    stops = stop.max() + 1
    strength = np.bincount(stop, np.einsum("ij,ij->i", arc, arc), stops)
    columns = np.concatenate([matrix, residual[:, :, None]], axis=2)
    along = np.einsum("ij,ijk->ik", arc, columns)
    sums = np.zeros((stops, along.shape[1]))
    np.add.at(sums, stop, along)
    columns = columns - arc[:, :, None] * (sums / strength[:, None])[stop][:, None, :]
    return columns[:, :, :-1], columns[:, :, -1]
