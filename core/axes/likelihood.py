"""A rotary axis by maximum likelihood: the estimator that loses nothing.

Every point p_j of target k lies, but for noise, on a circle about one common axis: at height h_k along it and at radius
r_k from it. The angle on the circle is whatever the joint really did; no commanded displacement enters. With Gaussian
noise of covariance C_j the likelihood is greatest where

    sum_j  e_j' W_j e_j,      e_j = (z_j - h_k,  rho_j - r_k,  r_k (phi_j - beta_k - g_stop))

is least over the axis (two tilts, two shifts), h_k and r_k; z, rho, phi are cylindrical coordinates about the axis and
W_j the inverse of C_j in them. The angles g_stop are free and are eliminated: where a stop shows one target only, the
third component drops out and W_j is the inverse of the axial and radial block of C_j; where it shows several targets
of one link, what is left of it says that they turned by the same angle. All points are equal: the first one plays no
special part.

Minimised by Gauss-Newton with step halving, from the closed form of ``plane_circle``; the information matrix of the
last step gives the covariance. The angles are incidental parameters, so the bound that the estimator reaches is that of
Kanatani (1998, doi 10.1109/34.667887) and Chernov and Lesort (2004, doi 10.1016/j.csda.2003.10.008).
"""

from dataclasses import dataclass, replace

import numpy as np

from core.axes.plane_circle import PlaneCircle, arc_start, plane_circle
from core.axes.points import SweepPoints, require_points
from core.axes.result import AxisFit, outlier_probabilities
from core.errors import AxisUndefined, NotConverged
from core.geometry import Array, Line, cross, perpendicular_basis, rotation_about, wrap_angle

HUBER_LIMIT = 2.0
"""Residual length, in standard deviations, beyond which the robust fit reins a point in."""
SUBSET = 4000
"""More points than this are first fitted by an even selection of that many."""
STRAIGHT = "the points cannot be told from a straight line; expected a longer arc or less noise"
FLAT_ARC = 10.0
"""Where the sagitta stands out of the scatter across the plane by less, both starts are tried."""
SHORT_ARC = 0.2
"""... on arcs whose sagitta is less than this share of their chord."""
MEASURED_RADIUS = 3.0
"""A radius, or its standard deviation's inverse share, below which no axis is claimed."""


@dataclass(frozen=True)
class _State:
    """The parameters of the fit."""

    pivot_m: Array
    """Tilts turn the axis about this point in the middle of the measured ones, so that they stay near their arcs."""
    point_m: Array
    direction: Array
    height_m: Array
    radius_m: Array
    azimuth_rad: Array | None
    """Angle of each target ahead of target 0, where stops are shared."""
    arc_m: Array
    """Length by which angles are turned into arcs: the radius at the start, kept so that derivatives are exact."""


@dataclass(frozen=True)
class _Rows:
    """Whitened residuals and their derivatives: what one Gauss-Newton step needs."""

    matrix: Array
    """(k, c, p)."""
    residual: Array
    """(k, c)."""
    raw: Array
    """Axial, radial and tangential residuals in metres, (k, 3)."""

    @property
    def cost(self) -> float:
        flat = self.residual.ravel()
        return float(flat @ flat)

    def normal_equations(self, weight: Array | None) -> tuple[Array, Array]:
        flat = self.matrix.reshape(-1, self.matrix.shape[2])
        weighted = flat if weight is None else flat * np.repeat(weight, self.matrix.shape[1])[:, None]
        return weighted.T @ flat, weighted.T @ self.residual.ravel()


def fit_rotary_axis(points: SweepPoints, robust: bool = False) -> AxisFit:
    """Find a rotary axis from points along its arcs.

    Args:
        points: from ``points.sweep_points``.
        robust: rein in residuals beyond two standard deviations (Huber 1964), for data with gross errors.

    Returns:
        The axis, its covariance (by the stated noise; by the residuals where none is stated), residuals and outliers.
        The sense of the direction is arbitrary here.

    Raises:
        AxisUndefined: too few points, all at one place, on a straight line, or on the axis.
        NotConverged: the iteration did not end; not seen on data that define an axis.
    """
    shared = points.stop is not None
    unknown = 4 + 2 * points.target_count + (points.target_count - 1 if shared else 0)
    require_points(points, unknown, 2, 4)
    state = _best_start(points, robust)
    if points.covariance_m2 is not None:
        state = _refine(points, state, robust, weights_of=state, tolerance=1e-3)[0]
    return _result(points, *_refine(points, state, robust, weights_of=state))


def _best_start(points: SweepPoints, robust: bool) -> _State:
    """A state near the optimum: in closed form, or fitted to fewer points, or the better of two where arcs are flat.

    Noise is taken as the same in all directions here; skew noise needs to know where the axis is.
    """
    many, skew = points.count > SUBSET, points.covariance_m2 is not None
    points = replace(points, covariance_m2=None)
    if many:
        points = points.only(np.linspace(0, points.count - 1, SUBSET).astype(int))
    flat = plane_circle(points)
    across, sagitta, chord = flat.spread_m
    states = [_state_at(points, flat)]
    if sagitta < min(FLAT_ARC * across, SHORT_ARC * chord):
        states.append(_state_at(points, arc_start(points)))
    if len(states) == 1 and not many:
        return _refine(points, states[0], robust, tolerance=1e-2)[0] if skew else states[0]
    found = [refined for state in states if (refined := _try_refine(points, state, robust))]
    if not found:
        raise NotConverged("the fit of a joint axis did not converge in 100 steps")
    return min(found, key=lambda refined: refined[1].cost)[0]


def _try_refine(points: SweepPoints, state: _State, robust: bool) -> tuple[_State, _Rows, Array | None] | None:
    """From one of several starts; a start that leads nowhere is no error."""
    try:
        return _refine(points, state, robust)
    except (NotConverged, AxisUndefined):
        return None


def _refine(
    points: SweepPoints, state: _State, robust: bool, weights_of: _State | None = None, tolerance: float = 1e-7
) -> tuple[_State, _Rows, Array | None]:
    """Gauss-Newton with step halving, from a state to the least sum of squares.

    Skew noise is resolved into axial, radial and tangential parts as they are at ``weights_of``, and held so: weights
    that turned with the axis would be left out by the derivatives.
    """
    rows = _rows(points, state, weights_of)
    freedom = max(points.count, 1)
    for _ in range(100):
        weight = _huber_weights(rows) if robust else None
        normal, gradient = rows.normal_equations(weight)
        step = -_solve_normal(normal, gradient)
        promise = -float(gradient @ step)
        settled = rows.cost / freedom + _rounding(points, state)
        if promise <= tolerance * settled:
            return state, rows, weight
        before = state
        state, rows = _descend(points, state, rows, step, weight, weights_of)
        if state is before and promise <= 1e-3 * settled:
            return state, rows, weight
    raise NotConverged("the fit of a joint axis did not converge in 100 steps")


def _descend(
    points: SweepPoints, state: _State, rows: _Rows, step: Array, weight: Array | None, weights_of: _State | None
) -> tuple[_State, _Rows]:
    """Take the step, or the largest half, quarter, ... of it that does not raise the weighted sum of squares."""
    cost = _weighted_cost(rows, weight)
    for _ in range(40):
        new_state = _moved(state, step)
        new_rows = _rows(points, new_state, weights_of)
        if _weighted_cost(new_rows, weight) <= cost * (1 + 1e-12):
            return new_state, new_rows
        step = step / 2
    return state, rows


def _weighted_cost(rows: _Rows, weight: Array | None) -> float:
    return rows.cost if weight is None else float(weight @ np.einsum("ij,ij->i", rows.residual, rows.residual))


def _rounding(points: SweepPoints, state: _State) -> float:
    """Sums of squares below this are rounding of the coordinates."""
    sigma = 1.0 if points.sigma_m is None else float(points.sigma_m.min())
    reach = max(float(state.radius_m.max()), float(np.abs(points.point_m[0]).max()))
    return 1e7 * points.count * (1e-14 * reach / sigma) ** 2


def _state_at(points: SweepPoints, start: PlaneCircle) -> _State:
    """A state with the heights and radii that fit an axis best."""
    target, counts = points.target_index(), _counts(points)
    along = (points.point_m - start.point_m) @ start.direction
    point = start.point_m + start.direction * along.mean()
    e1, e2 = perpendicular_basis(start.direction)
    x, y = (points.point_m - point) @ e1, (points.point_m - point) @ e2
    height = np.bincount(target, along - along.mean(), points.target_count) / counts
    radius = np.bincount(target, np.hypot(x, y), points.target_count) / counts
    azimuth = None if points.stop is None else _azimuths(points, np.arctan2(y, x))
    return _State(points.point_m.mean(axis=0), point, start.direction, height, radius, azimuth, radius)


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


def _counts(points: SweepPoints) -> Array:
    return np.maximum(np.bincount(points.target_index(), minlength=points.target_count), 1)


def _moved(state: _State, step: Array) -> _State:
    e1, e2 = perpendicular_basis(state.direction)
    k = len(state.height_m)
    turn = step[0] * e2 - step[1] * e1
    angle = np.sqrt(turn @ turn)
    rotation = rotation_about(turn / angle, angle) if angle > 0 else np.eye(3)
    azimuth = state.azimuth_rad
    if azimuth is not None:
        azimuth = azimuth + np.concatenate([[0.0], step[4 + 2 * k :]])
        # The angles are counted in a basis that follows the direction; a tilt leaves them alone to first order.
    return _State(
        state.pivot_m,
        state.pivot_m + rotation @ (state.point_m + step[2] * e1 + step[3] * e2 - state.pivot_m),
        rotation @ state.direction,
        state.height_m + step[4 : 4 + k],
        state.radius_m + step[4 + k : 4 + 2 * k],
        azimuth,
        state.arc_m,
    )


def _rows(points: SweepPoints, state: _State, weights_of: _State | None) -> _Rows:
    """Residuals and derivatives by (tilt 1, tilt 2, shift 1, shift 2, heights, radii, azimuths)."""
    e1, e2 = perpendicular_basis(state.direction)
    basis = np.stack([e1, e2, state.direction])
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


def _tangential(points: SweepPoints, state: _State, matrix: Array, phi: Array, cylinder: tuple[Array, ...]) -> Array:
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


def _whitened(points: SweepPoints, matrix: Array, raw: Array, local: Array | None, state: _State) -> _Rows:
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
    return _Rows(matrix, residual, raw)


def _along_arc(length: Array) -> Array:
    return np.stack([np.zeros_like(length), np.zeros_like(length), length], axis=1)


def _local_frames(points: SweepPoints, state: _State) -> Array:
    """Axial, radial and tangential unit vectors at each point, as rows, (k, 3, 3)."""
    relative = points.point_m - state.point_m
    outward = relative - np.outer(relative @ state.direction, state.direction)
    outward /= np.maximum(np.sqrt(np.einsum("ij,ij->i", outward, outward)), 1e-300)[:, None]
    local = np.empty((points.count, 3, 3))
    local[:, 0], local[:, 1] = state.direction, outward
    local[:, 2] = cross(state.direction, outward)
    return local


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


def _huber_weights(rows: _Rows) -> Array:
    """Weights that rein in long residuals; scale from their median, as the stated noise is not to be trusted here."""
    length = np.sqrt(np.einsum("ij,ij->i", rows.residual, rows.residual))
    # The median length of two unit normal components is sqrt(2 ln 2).
    scale = max(float(np.median(length)) / np.sqrt(2 * np.log(2)), 1e-300)
    return np.minimum(1.0, HUBER_LIMIT * scale / np.maximum(length, 1e-300))


def _solve_normal(normal: Array, gradient: Array) -> Array:
    return _inverse(normal) @ gradient


def _inverse(normal: Array) -> Array:
    """Inverse of an information matrix, scaled first; unknowns that no point touches (diagonal 0) stay put."""
    diagonal = np.diag(normal)
    touched = diagonal > 0
    scale = np.where(touched, 1.0 / np.sqrt(np.where(touched, diagonal, 1.0)), 0.0)
    scaled = normal * scale[:, None] * scale + np.diag(~touched * 1.0)
    if np.linalg.eigvalsh(scaled)[0] < 1e-14:
        raise AxisUndefined(STRAIGHT)
    return np.linalg.inv(scaled) * scale[:, None] * scale


def _result(points: SweepPoints, state: _State, rows: _Rows, weight: Array | None) -> AxisFit:
    normal, _ = rows.normal_equations(weight)
    covariance = _inverse(normal)
    freedom = _degrees_of_freedom(points, rows)
    total = _weighted_cost(rows, weight)
    factor = np.sqrt(total / freedom) if freedom > 0 else 1.0
    stated = points.sigma_m is not None
    scale = 1.0 if stated else factor**2
    _require_arc(points, state, covariance, factor)
    sigma = float(np.sqrt(np.mean(points.sigma_m**2))) if stated else float(factor)
    along = float((state.pivot_m - state.point_m) @ state.direction)
    raw = rows.raw
    return AxisFit(
        line=Line(state.point_m + along * state.direction, state.direction),
        sliding=False,
        basis=np.stack(perpendicular_basis(state.direction)),
        covariance=covariance[:4, :4] * scale,
        estimator="likelihood",
        sigma_m=sigma,
        noise_factor=float(factor) if stated else 1.0,
        radius_m=state.radius_m,
        height_m=state.height_m - along,
        axial_m=raw[:, 0],
        radial_m=raw[:, 1],
        tangential_m=raw[:, 2],
        used=np.ones(points.count, dtype=bool),
        outlier_probability=_outliers(rows, covariance, total, freedom),
        chi_square=total if stated else float(freedom),
        degrees_of_freedom=freedom,
    )


def _degrees_of_freedom(points: SweepPoints, rows: _Rows) -> int:
    count, components, unknown = rows.matrix.shape
    stops = 0 if points.stop is None else int(points.stop.max()) + 1
    return count * components - stops - unknown


def _outliers(rows: _Rows, covariance: Array, total: float, freedom: int) -> Array:
    """Probabilities by which each point stands out; its own pull on the fit (leverage) is taken off."""
    square = np.einsum("ij,ij->i", rows.residual, rows.residual)
    if len(square) > 100_000:
        return outlier_probabilities(square, np.full(len(square), 2.0), total, freedom)
    pull = rows.matrix @ covariance @ rows.matrix.swapaxes(1, 2)
    own = np.eye(2) - pull[:, :2, :2]
    determinant = np.maximum(own[:, 0, 0] * own[:, 1, 1] - own[:, 0, 1] * own[:, 1, 0], 1e-12)
    a, b = rows.residual[:, 0], rows.residual[:, 1]
    free = (own[:, 1, 1] * a * a - 2 * own[:, 0, 1] * a * b + own[:, 0, 0] * b * b) / determinant
    return outlier_probabilities(free, np.full(len(square), 2.0), total, freedom)


def _require_arc(points: SweepPoints, state: _State, covariance: Array, factor: float) -> None:
    """Raise AxisUndefined where the arcs are too small or too flat for the noise."""
    k = points.target_count
    noise = factor * (1.0 if points.sigma_m is None else float(np.sqrt(np.mean(points.sigma_m**2))))
    largest = float(state.radius_m.max())
    if largest < MEASURED_RADIUS * noise:
        raise AxisUndefined(
            f"the target sits on the axis: it stays within {largest * 1e3:.3g} mm of it, which the noise of "
            f"{noise * 1e3:.3g} mm hides; expected a target well off the axis"
        )
    radius_std = factor * np.sqrt(np.diag(covariance)[4 + k : 4 + 2 * k])
    if np.all(radius_std * MEASURED_RADIUS > state.radius_m):
        raise AxisUndefined(
            f"the points cannot be told from a straight line: the arc's radius is {largest * 1e3:.4g} mm "
            f"+- {radius_std.min() * 1e3:.2g} mm; expected a longer arc or less noise"
        )
