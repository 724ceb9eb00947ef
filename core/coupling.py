"""Passive motion of the next joint: what the motor of joint i does to joint i+1 (section 3, equations 14 and 15)."""

from dataclasses import dataclass, replace

import numpy as np

from core.arm import slide, turn
from core.arm_jacobian import by_axis
from core.axes.result import AxisFit, outlier_probabilities
from core.displacement import Displacements, displacements
from core.function_fit import FunctionFit, SweepCurve, choose_function, fit_function
from core.geometry import Array, Line, cross, rotation_about
from core.motion_forms import coupling_form
from core.robot import Coupling

FAMILIES = ("proportional", "gear", "arctangent")
LEAST_KEPT = 0.8
"""At least this share of the stops of a curve is kept, however they lie."""


@dataclass(frozen=True)
class CarriedPoints:
    """Points on link i+1 as they would be if joint i had not moved (equation 14), and what that rests on."""

    point_m: Array
    """(k, 3)."""
    stop: np.ndarray
    target: np.ndarray
    active: Array
    """Active displacement of joint i from zero at each stop, (stops,)."""
    active_std: Array
    """(stops,)."""
    active_by_axis: Array
    """Change of it by tilts and shifts of axis i, (stops, e)."""
    point_by_active: Array
    """Change of the carried points by the displacement that was taken off them, (k, 3)."""
    point_by_axis: Array
    """Change of the carried points by tilts and shifts of axis i, (k, 3, e)."""
    axis_covariance: Array
    """Of tilts and shifts of axis i, (e, e)."""


def carry_back(
    points_m: Array,
    stop: np.ndarray,
    target: np.ndarray,
    axis: AxisFit,
    net: Array,
    moved: Displacements,
    active: Array,
) -> CarriedPoints:
    """Undo the motion of joint i on points of link i+1.

    Args:
        points_m: points with the joints below i already undone, (k, 3).
        stop, target: of each point, (k,).
        axis: the axis of joint i at zero.
        net: net displacement of joint i at each stop, (stops,).
        moved: displacements of joint i as observed in this sweep.
        active: its active displacement from zero, (stops,).
    """
    line, back = axis.line, -net[stop]
    points = slide(line, back, points_m) if axis.sliding else turn(line, back, points_m)
    rotations = rotation_about(line.direction, np.zeros(len(back)) if axis.sliding else back)
    away = (
        np.broadcast_to(line.direction, points.shape) if axis.sliding else cross(line.direction, points - line.point_m)
    )
    return CarriedPoints(
        points,
        stop,
        target,
        active,
        np.full(len(active), float(np.nanmean(moved.std))),
        moved.axis_effect,
        -away,
        by_axis(line, axis.sliding, points, points_m, rotations, back),
        axis.covariance,
    )


def passive_curve(next_axis: AxisFit, points: CarriedPoints, gain: float) -> SweepCurve:
    """Passive displacement of joint i+1 against the active one of joint i, with all that makes it uncertain.

    Args:
        next_axis: the axis of joint i+1 when joint i stands at zero.
        points: on link i+1 or beyond it, carried back.
        gain: nominal gain, which guides the unwrapping.
    """
    seen, local = np.unique(points.stop, return_inverse=True)
    whole = replace(next_axis, used=np.ones(len(local), dtype=bool))
    active = points.active[seen]
    found = displacements(whole, points.point_m, stop=local, target=points.target, commanded=gain * active)
    by_point, weight = _angle_by_point(next_axis, points.point_m)
    total = np.bincount(local, weight)
    by_active = np.bincount(local, weight * np.einsum("ki,ki->k", by_point, points.point_by_active)) / total
    columns = np.einsum("ki,kie->ke", by_point, points.point_by_axis) * weight[:, None]
    by_axis_below = np.stack([np.bincount(local, column) for column in columns.T], axis=1) / total[:, None]
    # An error of the active displacement moves the point both ways: up the curve and along it.
    slope = by_active - gain
    effect = np.hstack([found.axis_effect, by_axis_below + slope[:, None] * points.active_by_axis[seen]])
    sizes = len(next_axis.covariance), len(points.axis_covariance)
    covariance = np.zeros((sum(sizes), sum(sizes)))
    covariance[: sizes[0], : sizes[0]], covariance[sizes[0] :, sizes[0] :] = (
        next_axis.covariance,
        points.axis_covariance,
    )
    return SweepCurve(active, found.value, np.hypot(found.std, slope * points.active_std[seen]), effect, covariance)


def stops_that_stand_out(curve: SweepCurve) -> np.ndarray:
    """Stops of a passive curve that lie off a smooth one, boolean, (stops,).

    The curve is smooth whatever its family, so a parabola through all but the worst stops tells which stand out.
    """
    design = np.stack([np.ones_like(curve.displacement), curve.displacement, curve.displacement**2], axis=1)
    keep = np.ones(len(curve.y), dtype=bool)
    while keep.sum() > max(6, LEAST_KEPT * len(keep)):
        rows, weight = design[keep], 1.0 / curve.std[keep]
        q, _ = np.linalg.qr(rows * weight[:, None])
        residual = curve.y[keep] * weight
        residual = residual - q @ (q.T @ residual)
        free = np.maximum(1.0 - np.sum(q**2, axis=1), 1e-6)
        total, freedom = float(residual @ residual), int(keep.sum()) - 3
        chance = outlier_probabilities(residual**2 / free, np.ones(len(residual)), total, freedom)
        worst = int(np.argmin(chance))
        if chance[worst] * len(chance) >= 1e-3:
            break
        keep[np.flatnonzero(keep)[worst]] = False
    return ~keep


def without_stops(curve: SweepCurve, out: np.ndarray) -> SweepCurve:
    """The curve without some of its stops."""
    keep = ~out
    return SweepCurve(
        curve.displacement[keep], curve.y[keep], curve.std[keep], curve.axis_effect[keep], curve.axis_covariance
    )


def fit_coupling(coupling: Coupling, curves: tuple[SweepCurve, ...]) -> FunctionFit:
    """Fit the coupling function: active displacement of joint i to passive displacement of joint i+1.

    The passive motion is seen from the first stop of each sweep on; where that is, is fitted with the constants.

    Raises:
        InputError: the robot's description names a family that does not exist.
        NotConverged: no family could be fitted.
    """
    if coupling.form != "auto":
        form = coupling_form(coupling.form, coupling.gain)
        return fit_function(form, curves, level=True, nominal_slope=coupling.gain)
    forms = tuple((coupling_form(name, coupling.gain), 1.0) for name in FAMILIES)
    return choose_function(forms, curves, level=True, nominal_slope=coupling.gain)


def _angle_by_point(axis: AxisFit, points_m: Array) -> tuple[Array, Array]:
    """Gradient of the displacement about (along) an axis by the point, (k, 3), and the point's weight, (k,)."""
    line: Line = axis.line
    if axis.sliding:
        return np.broadcast_to(line.direction, points_m.shape), np.ones(len(points_m))
    along = cross(line.direction, points_m - line.point_m)
    square = np.einsum("ki,ki->k", along, along)
    return along / square[:, None], square
