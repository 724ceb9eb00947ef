"""What a calibrated sim does not know of itself: small motions, one for each independent error of its parameters.

A calibration says how its parameters err together. Each independent combination, one standard deviation large, moves
frames and joints by small amounts; as columns with a prior of one they may take back what the calibration never knew,
and no more, so that its own uncertainty is not told as a cause.
"""

import numpy as np

from core.calibrated_arm import CalibratedArm
from core.gap.effects.candidate import Column
from core.gap.observations import Observations
from core.gap.sim import Part, Slot
from core.geometry import Array, cross
from core.kinematics import link_frames
from core.parameter_covariance import COUPLING, FRAME, Parameter
from core.phi_convention import convention_of
from core.phi_model import PARAMETERS, from_axes, parameter_twists

LEAST_MOTION = 1e-9
"""Smaller motions of a combination are rounding, rad or m."""


def doubt_columns(seen: Observations) -> list[Column]:
    """Columns whose unknown numbers are standard normal if the calibration is right; none of a sim that is exact."""
    arm = seen.calibrated
    if arm is None or arm.covariance is None:
        return []
    roots = arm.covariance.roots()
    steady: dict[Slot, Array] = {}
    varying: dict[Slot, Array] = {}
    for move, root in zip(_moves(arm, seen), roots, strict=True):
        for slot, feature in move:
            if isinstance(feature, float):
                steady[slot] = steady.get(slot, 0.0) + feature * root
            else:
                varying[slot] = varying.get(slot, 0.0) + np.outer(root, feature)
    return [_column(k, steady, varying, seen.count) for k in range(roots.shape[1])]


def _column(k: int, steady: dict[Slot, Array], varying: dict[Slot, Array], count: int) -> Column:
    """What one combination moves notably; of what moves nothing the first slot."""
    out: Column = [(slot, np.broadcast_to(by_root[k], count)) for slot, by_root in steady.items()]
    out += [(slot, by_root[k]) for slot, by_root in varying.items()]
    return [(slot, feature) for slot, feature in out if np.abs(feature).max() > LEAST_MOTION] or out[:1]


def _moves(arm: CalibratedArm, seen: Observations) -> list[list[tuple[Slot, float | Array]]]:
    """What one unit of each parameter moves: by the same at every point, or by a feature, (m,)."""
    twists = _frame_twists(arm)
    active = arm.drives.active(seen.commanded)
    out: list[list[tuple[Slot, float | Array]]] = []
    for parameter in arm.covariance.parameters:
        if parameter.part == FRAME:
            twist = twists[parameter.number - 1, PARAMETERS.index(parameter.name)]
            out.append([(Slot(Part.AXIS, parameter.number, k), float(twist[k])) for k in range(6)])
        elif parameter.part == COUPLING:
            out.append([(Slot(Part.JOINT, parameter.number - 1), _by_coupling(arm, parameter, active))])
        else:
            out.append([(Slot(Part.DRIVE, parameter.number - 1), _by_drive(arm, parameter, active))])
    return out


def _frame_twists(arm: CalibratedArm) -> Array:
    """Turn and shift of what follows a frame by each of its parameters, in the frame before its joint, (n-1, 4, 6)."""
    nominal, robot = arm.nominal, arm.robot
    convention = convention_of(nominal)
    base, model = from_axes(robot.axes_at_zero(), convention)
    # At zero displacement a frame is the same before and after its own joint moves.
    before = link_frames(robot, np.zeros((1, robot.joint_count)))[0, 1:-1]
    twist = parameter_twists(model, base)
    turn, shift = twist[..., :3], twist[..., 3:] + cross(twist[..., :3], before[:, None, :3, 3])
    inverse = np.swapaxes(before[:, :3, :3], 1, 2)[:, None]
    return np.concatenate([(inverse @ turn[..., None])[..., 0], (inverse @ shift[..., None])[..., 0]], axis=-1)


def _by_drive(arm: CalibratedArm, parameter: Parameter, active: Array) -> Array:
    """Active displacement by a constant of its transmission: f(active) stays what was commanded."""
    function, x = arm.drives.transmissions[parameter.number - 1], active[:, parameter.number - 1]
    column = function.form.coefficient_names.index(parameter.name)
    _, slope, gradient = function.form.evaluate(x, function.coefficients)
    # Where the arm's marks define zero, the constants change nothing there.
    at_zero = function.form.evaluate(np.zeros(1), function.coefficients)[2][0] if arm.home is not None else 0.0
    return (-(gradient - at_zero) / slope[:, None])[:, column]


def _by_coupling(arm: CalibratedArm, parameter: Parameter, active: Array) -> Array:
    function = arm.drives.couplings[parameter.number - 1]
    column = function.form.coefficient_names.index(parameter.name)
    return function.form.evaluate(active[:, parameter.number - 2], function.coefficients)[2][:, column]
