"""Forward kinematics of any robot, vectorised over configurations.

Displacements are rad (m where a joint slides). 'Commanded' is what stands in the q columns, 'net' is how
far a joint really is from its zero: active plus passive motion (section 3 of the paper).
"""

import numpy as np
from numpy.typing import ArrayLike

from core.errors import RobotError
from core.geometry import Array, cross
from core.robot import Robot


def active_commands(robot: Robot, commanded: ArrayLike) -> Array:
    """The displacement that each motor is asked to make, shape (m, n).

    A controller that compensates a coupling takes the nominal passive motion off the net command (figure 3):
    ``A_i = c_i - gain_i A_{i-1}``; without compensation the command is the motor's own, ``A_i = c_i``.
    """
    active = _configurations(robot, commanded).copy()
    gains, compensated = robot.coupling_gains, robot.coupling_compensated
    active[:, ~robot.commanded] = 0.0
    for i in range(1, robot.joint_count):
        if gains[i] and compensated[i] and robot.commanded[i]:
            active[:, i] -= gains[i] * active[:, i - 1]
    return active


def nominal_net(robot: Robot, commanded: ArrayLike) -> Array:
    """The net displacement that the nominal model believes in, shape (m, n)."""
    active = active_commands(robot, commanded)
    net = active.copy()
    net[:, 1:] += robot.coupling_gains[1:] * active[:, :-1]
    return net


def joint_motions(robot: Robot, net: ArrayLike) -> Array:
    """The motions M_i about or along the z-axes, shape (m, n, 4, 4)."""
    net = _configurations(robot, net)
    motions = np.zeros((*net.shape, 4, 4))
    motions[..., range(4), range(4)] = 1.0
    turning = ~robot.sliding
    cosine, sine = np.cos(net[:, turning]), np.sin(net[:, turning])
    motions[:, turning, 0, 0], motions[:, turning, 1, 1] = cosine, cosine
    motions[:, turning, 0, 1], motions[:, turning, 1, 0] = -sine, sine
    motions[:, ~turning, 2, 3] = net[:, ~turning]
    return motions


def link_frames(robot: Robot, net: ArrayLike) -> Array:
    """Where frames 1..n and the tool are after each joint has moved: T_frame_to_base, shape (m, n + 1, 4, 4).

    Frame i is taken after joint i moved, so a target on link i keeps its coordinates in it.
    """
    motions = joint_motions(robot, net)
    m, n = motions.shape[:2]
    frames = np.empty((m, n + 1, 4, 4))
    frame = np.broadcast_to(robot.base_transform, (m, 4, 4))
    for i in range(n):
        frame = frame @ motions[:, i]
        frames[:, i] = frame
        frame = frame @ robot.link_transforms[i]
    frames[:, n] = frame
    return frames


def forward(robot: Robot, net: ArrayLike) -> Array:
    """The tool's pose, T_tool_to_base, shape (m, 4, 4), for net displacements of shape (m, n)."""
    return link_frames(robot, net)[:, -1]


def joint_jacobian(robot: Robot, net: ArrayLike) -> Array:
    """Derivative of the tool's pose with respect to the net displacements, shape (m, 6, n).

    Rows 0..2: velocity of the tool's origin, rows 3..5: angular velocity, both in the base frame.
    """
    frames = link_frames(robot, net)
    axes, origins = frames[:, :-1, :3, 2], frames[:, :-1, :3, 3]
    sliding = robot.sliding[None, :, None]
    velocity = np.where(sliding, axes, cross(axes, frames[:, -1:, :3, 3] - origins))
    turning = np.where(sliding, 0.0, axes)
    return np.concatenate([velocity, turning], axis=2).swapaxes(1, 2)


def _configurations(robot: Robot, displacements: ArrayLike) -> Array:
    q = np.atleast_2d(np.asarray(displacements, dtype=float))
    if q.ndim != 2 or q.shape[1] != robot.joint_count:
        raise RobotError(
            f"{robot.name} has {robot.joint_count} joints, so configurations need the shape "
            f"(m, {robot.joint_count}), got {np.shape(displacements)}"
        )
    return q
