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

from core.axes.plane_circle import arc_start, plane_circle
from core.axes.points import SweepPoints, require_points
from core.axes.result import AxisFit, outlier_probabilities
from core.axes.rotary_rows import RotaryState, Rows, moved, rows_at, state_at
from core.errors import AxisUndefined, NotConverged
from core.geometry import Array, Line

HUBER_LIMIT = 2.0
"""Residual length, in standard deviations, beyond which the robust fit reins a point in."""
SUBSET = 4000
"""More points than this are first fitted by an even selection of that many."""
STRAIGHT = "the points cannot be told from a straight line; expected a longer arc or less noise"
FLAT_ARC = 10.0
"""Where the sagitta stands out of the scatter across the plane by less, both starts are tried."""
LARGEST_TILT_RAD = 0.3
"""Standard uncertainty of the direction beyond which no axis is claimed."""
SHORT_ARC = 0.2
"""... on arcs whose sagitta is less than this share of their chord."""
MEASURED_RADIUS = 3.0
"""A radius, or its standard deviation's inverse share, below which no axis is claimed."""


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
        state = _refine(points, state, robust, weights_of=state, tolerance=1e-3).state
    return _result(points, _refine(points, state, robust, weights_of=state))


@dataclass(frozen=True)
class _Optimum:
    """Where Gauss-Newton ended."""

    state: RotaryState
    rows: Rows
    weight: Array | None
    """Of each point, in a robust fit."""
    covariance: Array
    """Inverse of the information matrix, (p, p)."""


def _best_start(points: SweepPoints, robust: bool) -> RotaryState:
    """A state near the optimum: in closed form, or fitted to fewer points, or the better of two where arcs are flat.

    Noise is taken as the same in all directions here; skew noise needs to know where the axis is.
    """
    many, skew = points.count > SUBSET, points.covariance_m2 is not None
    points = replace(points, covariance_m2=None)
    if many:
        points = points.only(np.linspace(0, points.count - 1, SUBSET).astype(int))
    flat = plane_circle(points)
    across, sagitta, chord = flat.spread_m
    states = [state_at(points, flat)]
    if sagitta < min(FLAT_ARC * across, SHORT_ARC * chord):
        states.append(state_at(points, arc_start(points)))
    if len(states) == 1 and not many:
        return _refine(points, states[0], robust, tolerance=1e-2).state if skew else states[0]
    found = [refined for state in states if (refined := _try_refine(points, state, robust))]
    if not found:
        raise NotConverged("the fit of a joint axis did not converge in 100 steps")
    return min(found, key=lambda refined: refined.rows.cost).state


def _try_refine(points: SweepPoints, state: RotaryState, robust: bool) -> _Optimum | None:
    """From one of several starts; a start that leads nowhere is no error."""
    try:
        return _refine(points, state, robust)
    except (NotConverged, AxisUndefined):
        return None


def _refine(
    points: SweepPoints,
    state: RotaryState,
    robust: bool,
    weights_of: RotaryState | None = None,
    tolerance: float = 1e-7,
) -> _Optimum:
    """Gauss-Newton with step halving, from a state to the least sum of squares.

    Skew noise is resolved into axial, radial and tangential parts as they are at ``weights_of``, and held so: weights
    that turned with the axis would be left out by the derivatives.
    """
    rows = rows_at(points, state, weights_of)
    freedom = max(points.count, 1)
    for _ in range(100):
        weight = _huber_weights(rows) if robust else None
        normal, gradient = rows.normal_equations(weight)
        covariance = _inverse(normal)
        step = -covariance @ gradient
        promise = -float(gradient @ step)
        settled = rows.cost / freedom + _rounding(points, state)
        if promise <= tolerance * settled:
            return _Optimum(state, rows, weight, covariance)
        before = state
        state, rows = _descend(points, state, rows, step, weight, weights_of)
        if state is before and promise <= 1e-3 * settled:
            return _Optimum(state, rows, weight, covariance)
    raise NotConverged("the fit of a joint axis did not converge in 100 steps")


def _descend(
    points: SweepPoints,
    state: RotaryState,
    rows: Rows,
    step: Array,
    weight: Array | None,
    weights_of: RotaryState | None,
) -> tuple[RotaryState, Rows]:
    """Take the step, or the largest half, quarter, ... of it that does not raise the weighted sum of squares."""
    cost = _weighted_cost(rows, weight)
    for _ in range(40):
        new_state = moved(state, step)
        new_rows = rows_at(points, new_state, weights_of)
        if _weighted_cost(new_rows, weight) <= cost * (1 + 1e-12):
            return new_state, new_rows
        step = step / 2
    return state, rows


def _weighted_cost(rows: Rows, weight: Array | None) -> float:
    return rows.cost if weight is None else float(weight @ np.einsum("ij,ij->i", rows.residual, rows.residual))


def _rounding(points: SweepPoints, state: RotaryState) -> float:
    """Sums of squares below this are rounding of the coordinates."""
    sigma = 1.0 if points.sigma_m is None else float(points.sigma_m.min())
    reach = max(float(state.radius_m.max()), float(np.abs(points.point_m[0]).max()))
    return 1e7 * points.count * (1e-14 * reach / sigma) ** 2


def _huber_weights(rows: Rows) -> Array:
    """Weights that rein in long residuals; scale from their median, as the stated noise is not to be trusted here."""
    length = np.sqrt(np.einsum("ij,ij->i", rows.residual, rows.residual))
    # The median length of two unit normal components is sqrt(2 ln 2).
    scale = max(float(np.median(length)) / np.sqrt(2 * np.log(2)), 1e-300)
    return np.minimum(1.0, HUBER_LIMIT * scale / np.maximum(length, 1e-300))


def _inverse(normal: Array) -> Array:
    """Inverse of an information matrix, scaled first; unknowns that no point touches (diagonal 0) stay put."""
    diagonal = normal.diagonal()
    touched = diagonal > 0
    scale = 1.0 / np.sqrt(np.where(touched, diagonal, 1.0))
    values, vectors = np.linalg.eigh(normal * scale[:, None] * scale)
    values = values[np.sum(~touched) :]
    if values[0] < 1e-14:
        raise AxisUndefined(STRAIGHT)
    scaled = vectors[:, -len(values) :] * scale[:, None]
    return (scaled / values) @ scaled.T


def _result(points: SweepPoints, found: _Optimum) -> AxisFit:
    state, rows, weight, covariance = found.state, found.rows, found.weight, found.covariance
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
        basis=state.basis[:2],
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


def _degrees_of_freedom(points: SweepPoints, rows: Rows) -> int:
    stops = 0 if points.stop is None else int(points.stop.max()) + 1
    return rows.residual.size - stops - rows.unknowns


def _outliers(rows: Rows, covariance: Array, total: float, freedom: int) -> Array:
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


def _require_arc(points: SweepPoints, state: RotaryState, covariance: Array, factor: float) -> None:
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
    tilt_std = factor * float(np.sqrt(covariance[0, 0] + covariance[1, 1]))
    if tilt_std > LARGEST_TILT_RAD:
        raise AxisUndefined(
            f"the direction of the axis would be known to {np.rad2deg(tilt_std):.0f} deg only; "
            "expected a longer arc or less noise"
        )
