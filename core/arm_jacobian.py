"""Where an arm's parameters put the measured points, and how the points move with every parameter.

A point on link L is ``p = M_1 M_2 ... M_L p_rest``; M_i turns about (slides along) axis i at rest by net_i. With
``y_i = M_i ... M_L p_rest`` and ``R_i`` the rotation of M_1 ... M_i:

    dp / dnet_i     = R_{i-1} (d_i x (y_i - c_i))                                sliding: R_{i-1} d_i
    dp / dtwist_i   = R_{i-1} (v(y_i) - rot_i v(y_{i+1})),   v(y) = w x (y - c_i) + s
    dp / dp_rest    = R_L

where the twist (w, s) tilts or shifts axis i. Net displacements follow from commands through the inverse of the
transmission functions and through the couplings; their derivatives by the constants follow from the implicit function
theorem. Everything is exact and vectorised over points.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from core.estimate import axis_basis
from core.geometry import Array, Line, perpendicular_basis, rotation_about, skew
from core.motion_forms import MotionFunction


@dataclass(frozen=True)
class ArmState:
    """The values of all parameters."""

    axes: tuple[Line, ...]
    transmissions: tuple[MotionFunction, ...]
    """Without offsets: they map to commanded active displacement counted as in ``Observations.asked``."""
    couplings: tuple[MotionFunction | None, ...]
    rest_points_m: Array
    """Targets when every net displacement is zero, in the instrument's frame, (t, 3)."""


@dataclass(frozen=True)
class Observations:
    """The points of all sweeps, and what was asked of the motors for each."""

    point_m: Array
    """(m, 3)."""
    target: np.ndarray
    """Index of the target, (m,)."""
    link: np.ndarray
    """The link that it rides on, (m,)."""
    asked: Array
    """Commanded active displacement of every motor, from the arm's marks or from the zero of commands, (m, n)."""
    sliding: np.ndarray
    """Which joints slide, (n,)."""
    home: bool
    """Whether the arm's marks define zero."""

    @cached_property
    def levels(self) -> tuple[tuple[Array, np.ndarray], ...]:
        """Of every joint, the distinct commands and which of them each point has: most joints stand still mostly."""
        return tuple(np.unique(column, return_inverse=True) for column in self.asked.T)


@dataclass(frozen=True)
class Layout:
    """Which parameters are estimated, and where each stands in the vector of unknowns."""

    axes: tuple[slice | None, ...]
    """Tilts and shifts (sliding: tilts) of each axis; None: held."""
    transmissions: tuple[slice | None, ...]
    couplings: tuple[slice | None, ...]
    targets: slice
    size: int

    @staticmethod
    def of(state: ArmState, sliding: np.ndarray, swept: np.ndarray, coupled: np.ndarray) -> "Layout":
        """Lay out the unknowns: axes and transmissions of swept joints, observed couplings, all targets."""
        at = 0

        def take(count: int, wanted: bool) -> slice | None:
            nonlocal at
            if not wanted or count == 0:
                return None
            at += count
            return slice(at - count, at)

        joints = range(len(sliding))
        axes = tuple(take(2 if sliding[i] else 4, bool(swept[i])) for i in joints)
        drives = tuple(take(len(state.transmissions[i].coefficients), bool(swept[i])) for i in joints)
        couplings = tuple(
            take(0 if (c := state.couplings[i]) is None else len(c.coefficients), bool(coupled[i])) for i in joints
        )
        targets = take(3 * len(state.rest_points_m), True)
        return Layout(axes, drives, couplings, targets if targets is not None else slice(0, 0), at)


@dataclass(frozen=True)
class Prediction:
    """Predicted points with derivatives."""

    point_m: Array
    """(m, 3)."""
    jacobian: Array
    """By the unknowns of a layout, (m, 3, p)."""
    by_net: Array
    """By the net displacement of each joint, (m, 3, n)."""


def moved(state: ArmState, layout: Layout, step: Array) -> ArmState:
    """The state after a step of the unknowns."""
    axes = tuple(
        line if place is None else _moved_axis(line, step[place])
        for line, place in zip(state.axes, layout.axes, strict=True)
    )
    return ArmState(
        axes,
        tuple(_moved_function(f, p, step) for f, p in zip(state.transmissions, layout.transmissions, strict=True)),
        tuple(_moved_function(f, p, step) for f, p in zip(state.couplings, layout.couplings, strict=True)),
        state.rest_points_m + step[layout.targets].reshape(-1, 3),
    )


def predict(state: ArmState, seen: Observations, layout: Layout) -> Prediction:
    """Predict the points and their derivatives by all unknowns."""
    n = len(state.axes)
    active, by_constants = _active(state, seen)
    net, slopes, by_coupling = _net(state, active)
    net = np.where(seen.link[:, None] > np.arange(n), net, 0.0)
    below, rotations = _positions(state, seen, net)
    jacobian = np.zeros((len(seen.point_m), 3, layout.size))
    by_net = np.zeros((len(seen.point_m), 3, n))
    frame = np.broadcast_to(np.eye(3), rotations[0].shape)
    for i in range(n):
        rides = seen.link > i
        if not rides.any():
            break
        by_net[:, :, i] = _by_net(state.axes[i], bool(seen.sliding[i]), below[i], frame) * rides[:, None]
        if layout.axes[i] is not None:
            columns = by_axis(state.axes[i], bool(seen.sliding[i]), below[i], below[i + 1], rotations[i], net[:, i])
            jacobian[:, :, layout.axes[i]] = np.einsum("mij,mjk->mik", frame, columns) * rides[:, None, None]
        frame = frame @ rotations[i]
    _add_functions(jacobian, layout, by_net, slopes, by_constants, by_coupling)
    each = np.arange(len(seen.point_m))
    for axis in range(3):
        jacobian[each, :, layout.targets.start + 3 * seen.target + axis] = frame[:, :, axis]
    return Prediction(below[0], jacobian, by_net)


def active_displacements(state: ArmState, seen: Observations) -> Array:
    """Active displacements of all joints at every point, (m, n)."""
    return _active(state, seen)[0]


def net_displacements(state: ArmState, seen: Observations) -> Array:
    """Net displacements of all joints at every point, (m, n)."""
    return _net(state, _active(state, seen)[0])[0]


def by_axis(line: Line, sliding: bool, after: Array, before: Array, rotation: Array, net: Array) -> Array:
    """Derivatives of moved points by tilts and shifts of the axis they moved about, (m, 3, 4); sliding: (m, 3, 2).

    Args:
        line, sliding: the axis.
        after, before: the points after and before the motion, (m, 3).
        rotation: of the motion, (m, 3, 3).
        net: its displacement, (m,).
    """
    e1, e2 = axis_basis(line.direction)
    if sliding:
        return net[:, None, None] * np.stack([e1, e2], axis=1)
    out = np.empty((len(net), 3, 4))
    # A tilt towards e1 is a turn about e2, one towards e2 a turn about -e1.
    for column, turn in enumerate((e2, -e1)):
        matrix = skew(turn).T
        out[:, :, column] = (after - line.point_m) @ matrix - (
            rotation @ ((before - line.point_m) @ matrix)[:, :, None]
        )[:, :, 0]
    for column, shift in ((2, e1), (3, e2)):
        out[:, :, column] = shift - rotation @ shift
    return out


def _moved_axis(line: Line, step: Array) -> Line:
    e1, e2 = perpendicular_basis(line.direction)
    turn = step[0] * e2 - step[1] * e1
    angle = float(np.sqrt(turn @ turn))
    direction = rotation_about(turn / angle, angle) @ line.direction if angle > 0 else line.direction
    if len(step) == 2:
        return Line(line.point_m, direction)
    return Line(line.point_m + step[2] * e1 + step[3] * e2, direction)


def _moved_function(function: MotionFunction | None, place: slice | None, step: Array) -> MotionFunction | None:
    if function is None or place is None:
        return function
    return replace(function, coefficients=function.coefficients + step[place])


def _active(state: ArmState, seen: Observations) -> tuple[Array, list[Array]]:
    """Active displacements (m, n), and their derivatives by the constants of their own function, (m, p_i) each."""
    active, gradients = np.empty_like(seen.asked), []
    for i, function in enumerate(state.transmissions):
        commands, which = seen.levels[i]
        at_zero, _, gradient_at_zero = function.form.evaluate(np.zeros(1), function.coefficients)
        displacement = function.inverse(commands + (at_zero[0] if seen.home else 0.0))
        _, slope, gradient = function.form.evaluate(displacement, function.coefficients)
        if seen.home:
            gradient = gradient - gradient_at_zero
        active[:, i] = displacement[which]
        gradients.append((-gradient / slope[:, None])[which])
    return active, gradients


def _net(state: ArmState, active: Array) -> tuple[Array, list[Array | None], list[Array | None]]:
    """Net displacements, slopes of the couplings into each joint, and their derivatives by their constants."""
    net, slopes, gradients = active.copy(), [], []
    for i, coupling in enumerate(state.couplings):
        if coupling is None:
            slopes.append(None)
            gradients.append(None)
            continue
        value, slope, gradient = coupling.form.evaluate(active[:, i - 1], coupling.coefficients)
        net[:, i] += value
        slopes.append(slope)
        gradients.append(gradient)
    return net, slopes, gradients


def _positions(state: ArmState, seen: Observations, net: Array) -> tuple[list[Array], list[Array]]:
    """y_1 .. y_{n+1} of every point, (m, 3) each, and the rotations of the joints' motions, (m, 3, 3) each."""
    below = [state.rest_points_m[seen.target]]
    rotations = []
    identity = np.broadcast_to(np.eye(3), (len(net), 3, 3))
    for i in range(len(state.axes) - 1, -1, -1):
        line, point = state.axes[i], below[0]
        if seen.sliding[i]:
            rotations.insert(0, identity)
            below.insert(0, point + net[:, i, None] * line.direction)
        else:
            rotation = _rotations(line.direction, net[:, i])
            rotations.insert(0, rotation)
            below.insert(0, line.point_m + (rotation @ (point - line.point_m)[:, :, None])[:, :, 0])
    return below, rotations


def _rotations(direction: Array, angle_rad: Array) -> Array:
    """Rotations about one direction by many angles, (m, 3, 3): Rodrigues with its matrices formed once."""
    k = skew(direction)
    basis = np.stack([np.eye(3), k, k @ k]).reshape(3, 9)
    return (np.stack([np.ones_like(angle_rad), np.sin(angle_rad), 1 - np.cos(angle_rad)], axis=1) @ basis).reshape(
        -1, 3, 3
    )


def _by_net(line: Line, sliding: bool, after: Array, frame: Array) -> Array:
    if sliding:
        return frame @ line.direction
    arm = (after - line.point_m) @ skew(line.direction).T
    return (frame @ arm[:, :, None])[:, :, 0]


def _add_functions(
    jacobian: Array,
    layout: Layout,
    by_net: Array,
    slopes: list[Array | None],
    by_constants: list[Array],
    by_coupling: list[Array | None],
) -> None:
    """Chain rule: points by net displacements, these by the constants of transmissions and couplings."""
    n = by_net.shape[2]
    for i in range(n):
        if layout.transmissions[i] is not None:
            by_active = by_net[:, :, i]
            if i + 1 < n and slopes[i + 1] is not None:
                by_active = by_active + by_net[:, :, i + 1] * slopes[i + 1][:, None]
            jacobian[:, :, layout.transmissions[i]] = by_active[:, :, None] * by_constants[i][:, None, :]
        if layout.couplings[i] is not None:
            jacobian[:, :, layout.couplings[i]] = by_net[:, :, i, None] * by_coupling[i][:, None, :]
