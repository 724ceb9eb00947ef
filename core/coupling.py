"""Passive motion of the next joint: what the motor of joint i does to joint i+1 (section 3, equations 14 and 15)."""

import numpy as np

from core.arm import slide, turn
from core.axes.result import AxisFit
from core.displacement import displacements
from core.function_fit import FunctionFit, SweepCurve, choose_function, fit_function
from core.geometry import Array, Line
from core.motion_forms import coupling_form
from core.robot import Coupling

FAMILIES = ("proportional", "gear", "arctangent")


def carried_back(points_m: Array, axis: Line, displacement: Array, sliding: bool) -> Array:
    """Points (k, 3) as they would be if joint i had not moved: equation 14, one displacement a point (k,)."""
    return slide(axis, -displacement, points_m) if sliding else turn(axis, -displacement, points_m)


def passive_curve(
    next_axis: AxisFit, points_m: Array, stop: np.ndarray, target: np.ndarray, active: Array, gain: float, std: Array
) -> SweepCurve:
    """Passive displacement of joint i+1 against the active one of joint i.

    Args:
        next_axis: the axis of joint i+1 when joint i stands at zero, with these points as ``used``.
        points_m: points on link i+1 (or beyond it, held), already carried back by the motion of joint i, (k, 3).
        stop, target: of each point, (k,).
        active: active displacement of joint i from zero at each stop, (stops,).
        gain: nominal gain, which guides the unwrapping.
        std: standard deviation of the active displacements, (stops,).
    """
    seen = np.unique(stop)
    local = np.searchsorted(seen, stop)
    found = displacements(next_axis, points_m, stop=local, target=target, commanded=gain * active[seen])
    noise = np.sqrt(found.std**2 + (gain * std[seen]) ** 2)
    return SweepCurve(active[seen], found.value, noise, -found.axis_effect, next_axis.covariance)


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
