"""From the uncertainty of joint axes to that of phi-model parameters.

Each parameter moves all axes beyond its frame by a known twist, and the base frame moves all axes together. By the rule
of section 4 the base frame has six freedoms of its own, two parameters of frame 1 are fixed, and axes are a one-to-one
function of both: the inverse of its Jacobian carries the covariance of the axes over to the parameters, exactly to
first order. Where the rule had to be completed (``phi_convention.py``) the base frame follows from the axes by that
rule, its motion is taken off those of the axes, and the parameters follow from what is left.
"""

import numpy as np

from core.estimate import Geometry, axis_basis
from core.geometry import Array, Line, cross
from core.phi_convention import Convention, base_frame
from core.phi_model import PhiModel, from_axes, near, parameter_twists


def geometry_from_axes(
    lines: tuple[Line, ...], convention: Convention, axis_covariance: Array, nominal: PhiModel
) -> Geometry:
    """The phi-model of an arm with covariance, from its axes at rest.

    Args:
        lines: axes at zero displacement, n of them.
        convention: phi angles and base-frame rule.
        axis_covariance: of tilts and shifts of the axes, (4n, 4n); see ``ArmEstimate``.
        nominal: the nominal model; angles are written near its angles.

    Raises:
        RobotError: a Z_phi is parallel to the axis that follows it.
    """
    base, model = from_axes(lines, convention)
    model = near(model, nominal)
    by_axes = parameters_by_axes(lines, base, model, convention)
    # A sliding axis has no place: its shifts are not known, and change nothing.
    covariance = by_axes @ np.where(np.isnan(axis_covariance), 0.0, axis_covariance) @ by_axes.T
    return Geometry(base, model, np.sqrt(np.maximum(np.diag(covariance), 0.0)).reshape(-1, 4), covariance)


def parameters_by_axes(lines: tuple[Line, ...], base: Array, model: PhiModel, convention: Convention) -> Array:
    """Derivatives of all parameters by tilts and shifts of all axes, (4(n-1), 4n); 0 where fixed by agreement."""
    out = np.zeros((convention.free.size, 4 * len(lines)))
    out[convention.free.ravel()] = _free_by_axes(lines, base, model, convention)
    return out


def _free_by_axes(lines: tuple[Line, ...], base: Array, model: PhiModel, convention: Convention) -> Array:
    """Derivatives of the free parameters by tilts and shifts of all axes, (free, 4n)."""
    free, measured = convention.free.ravel(), _measured_rows(convention.sliding)
    by_parameters = axes_by_parameters(lines, base, model)[measured][:, free]
    by_base = _axes_by_twists(lines, np.eye(6), 0)[measured]
    out = np.zeros((int(free.sum()), 4 * len(lines)))
    if convention.is_of_section_4:
        out[:, measured] = np.linalg.pinv(np.hstack([by_base, by_parameters]), rcond=1e-12)[6:]
        return out
    left = np.eye(4 * len(lines))[measured] - by_base @ _base_by_axes(lines, base, convention)
    return np.linalg.pinv(by_parameters, rcond=1e-12) @ left


def axes_by_parameters(lines: tuple[Line, ...], base: Array, model: PhiModel) -> Array:
    """Derivatives of tilts and shifts of every axis, at its point, by every parameter: (4n, 4(n-1))."""
    twists = parameter_twists(model, base)
    columns = [_axes_by_twists(lines, twists[i], i + 1) for i in range(len(twists))]
    return np.concatenate(columns, axis=1)


def _axes_by_twists(lines: tuple[Line, ...], twists: Array, first: int) -> Array:
    """Tilts and shifts of axes ``first``.. under each of some twists (angular, linear at the origin): (4n, twists)."""
    out = np.zeros((4 * len(lines), len(twists)))
    for k, line in enumerate(lines[first:], first):
        basis = axis_basis(line.direction)
        out[4 * k : 4 * k + 2] = basis @ cross(twists[:, :3], line.direction).T
        out[4 * k + 2 : 4 * k + 4] = basis @ (twists[:, 3:] + cross(twists[:, :3], line.point_m)).T
    return out


def _measured_rows(sliding: np.ndarray) -> np.ndarray:
    """Rows of tilts and shifts that mean something: a sliding axis has no place."""
    measured = np.ones((len(sliding), 4), dtype=bool)
    measured[sliding, 2:] = False
    return np.flatnonzero(measured.ravel())


def _base_by_axes(lines: tuple[Line, ...], base: Array, convention: Convention) -> Array:
    """Twist of the base frame by tilts and shifts of all axes, (6, 4n), by central differences of its rule."""
    out = np.zeros((6, 4 * len(lines)))
    step = 1e-6
    for k, line in enumerate(lines):
        for column, (tilt, shift) in enumerate(_unit_moves(line)):
            ends = []
            for sign in (step, -step):
                moved = Line(line.point_m + sign * shift, line.direction + sign * tilt)
                ends.append(base_frame((*lines[:k], moved, *lines[k + 1 :]), convention))
            change = (ends[0] - ends[1]) / (2 * step)
            spin = change[:3, :3] @ base[:3, :3].T
            turn = np.array([spin[2, 1] - spin[1, 2], spin[0, 2] - spin[2, 0], spin[1, 0] - spin[0, 1]]) / 2
            out[:3, 4 * k + column] = turn
            out[3:, 4 * k + column] = change[:3, 3] - cross(turn, base[:3, 3])
    return out


def _unit_moves(line: Line) -> list[tuple[Array, Array]]:
    """Changes of direction and point for unit tilts and shifts of an axis."""
    e1, e2 = axis_basis(line.direction)
    still = np.zeros(3)
    return [(e1, still), (e2, still), (still, e1), (still, e2)]
