"""What gravity asks of joints and links, in the sim's own base frame."""

from dataclasses import dataclass

import numpy as np

from core.geometry import Array, apply, cross
from core.kinematics import link_frames
from core.robot import Robot

STANDARD_GRAVITY = 9.80665


@dataclass(frozen=True, eq=False)
class Loads:
    """Moments of the weights beyond a place, for the arm's own links and for one kilogram at the tool."""

    joint_own: Array
    """At every joint's origin, in the frame that moves with it, (m, n, 3), N m."""
    joint_kilogram: Array
    joint_offset: Array
    """Moment about each joint's axis of one kilogram moved by a metre along each axis of the last frame, (m, n, 3)."""
    force_own: Array
    """Weight beyond every joint in the frame that moves with it, (m, n, 3), N."""
    force_kilogram: Array
    middle_own: Array
    """At the middle of every link, of what lies beyond it, in the frame of the link, (m, n, 3), N m."""
    middle_kilogram: Array
    middle_offset: Array
    """Moment there of one kilogram moved by one metre along x, y or z of the last frame, (m, n, 3, offset 3)."""
    middle_m: Array
    """Middles of the links, in the frames that move with them, (n, 3)."""
    carried_kg: Array
    """Mass of all links beyond each, (n,)."""
    link_kg: Array
    """Mass of each link, (n,)."""


def loads(robot: Robot, net: Array) -> Loads | None:
    """Loads at net displacements (m, n); None where the direction of gravity is not known."""
    if robot.gravity_direction is None:
        return None
    frames = link_frames(robot, net)
    n = robot.joint_count
    down = STANDARD_GRAVITY * np.array(robot.gravity_direction)
    mass = np.array([link.mass_kg for link in robot.links]) if robot.links else np.zeros(n)
    centre = np.array([link.centre_m for link in robot.links]) if robot.links else np.zeros((n, 3))
    places = apply(frames[:, :n], centre)
    # Sums over links i..n: what hangs on joint i.
    beyond_kg = np.cumsum(mass[::-1])[::-1]
    beyond_moment = np.cumsum((mass[:, None] * places)[:, ::-1], axis=1)[:, ::-1]
    to_frame = np.swapaxes(frames[:, :n, :3, :3], -1, -2)
    origin, tool = frames[:, :n, :3, 3], frames[:, n, None, :3, 3]
    middle_m = robot.link_transforms[:, :3, 3] / 2
    middle = apply(frames[:, :n], middle_m)
    without_own_kg = np.append(beyond_kg[1:], 0.0)
    without_own = np.concatenate([beyond_moment[:, 1:], np.zeros_like(beyond_moment[:, :1])], axis=1)

    def local(vectors: Array) -> Array:
        return (to_frame @ vectors[..., None])[..., 0]

    weight = np.broadcast_to(down, origin.shape)
    return Loads(
        joint_own=local(cross(beyond_moment - beyond_kg[:, None] * origin, down)),
        joint_kilogram=local(cross(tool - origin, down)),
        joint_offset=_offsets(frames, down),
        force_own=local(beyond_kg[:, None] * weight),
        force_kilogram=local(weight),
        middle_own=local(cross(without_own - without_own_kg[:, None] * middle, down)),
        middle_kilogram=local(cross(tool - middle, down)),
        middle_offset=to_frame @ _turning(frames, down)[:, None],
        middle_m=middle_m,
        carried_kg=without_own_kg,
        link_kg=mass,
    )


def _turning(frames: Array, down: Array) -> Array:
    """Moment of one kilogram moved by one metre along each axis of the last frame, base frame, (m, 3, offset 3)."""
    along = np.swapaxes(frames[:, -2, :3, :3], 1, 2)
    return np.swapaxes(cross(along, down), 1, 2)


def _offsets(frames: Array, down: Array) -> Array:
    """The same about every joint's axis, (m, n, offset 3)."""
    return np.einsum("mic,mck->mik", frames[:, :-1, :3, 2], _turning(frames, down))
