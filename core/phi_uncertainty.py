"""From the uncertainty of joint axes to that of phi-model parameters.

Axes at rest are a smooth one-to-one function of the base frame (6 numbers less what the convention leaves to agreement)
and of the free parameters of every frame. Its Jacobian follows from the twist by which each parameter moves all axes
beyond it; the inverse carries the covariance of the axes over to the parameters, exactly to first order.
"""

import numpy as np

from core.estimate import Geometry, axis_basis
from core.geometry import Array, Line, cross
from core.phi_convention import Convention
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
    free = convention.free.ravel()
    rows = _measured_rows(convention.sliding)
    by_parameters = axes_by_parameters(lines, base, model)[rows][:, free]
    by_base = _axes_by_twists(lines, _base_twists(base, lines, convention), 0)[rows]
    jacobian = np.concatenate([by_base, by_parameters], axis=1)
    inverse = np.linalg.pinv(jacobian, rcond=1e-12)[by_base.shape[1] :]
    covariance = np.zeros((len(free), len(free)))
    covariance[np.ix_(free, free)] = inverse @ axis_covariance[np.ix_(rows, rows)] @ inverse.T
    return Geometry(base, model, np.sqrt(np.maximum(np.diag(covariance), 0.0)).reshape(-1, 4), covariance)


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


def _base_twists(base: Array, lines: tuple[Line, ...], convention: Convention) -> Array:
    """The ways in which axes can move the base frame: three turns and three shifts, less what is agreed."""
    x, y, z, origin = base[:3, :4].T
    turns = [(axis, cross(origin, axis)) for axis in (x, y, z)]
    if _heading_is_agreed(convention):
        turns = turns[:2]
    shifts = [(np.zeros(3), axis) for axis in (x, y, z)]
    if not convention.height_is_free:
        along = lines[convention.origin_joint].direction
        others = axis_basis(along)
        shifts = [(np.zeros(3), axis) for axis in others]
    return np.array([np.concatenate(twist) for twist in (*turns, *shifts)])


def _heading_is_agreed(convention: Convention) -> bool:
    """Where an axis beyond the second gives Y_1 its heading, both angles of frame 1 are free and the heading is not."""
    return convention.heading_joint != 1
