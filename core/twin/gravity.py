"""What gravity does to the joints and links of a simulated arm."""

from dataclasses import dataclass

import numpy as np

from core.errors import InputError
from core.geometry import Array, apply
from core.robot import Robot

STANDARD_GRAVITY = 9.80665


@dataclass(frozen=True)
class Loads:
    """Weights on the links of an arm, wherever it stands."""

    link: np.ndarray
    """The link that each weight rides on, 1..n, integer (k,)."""
    force_n: Array
    """(k, 3), in the instrument's frame."""
    place_m: Array
    """(m, k, 3)"""

    def moments(self, beyond: int, about_m: Array) -> Array:
        """Moment of the weights on links ``beyond``..n about one point a row, (m, 3), N m."""
        rides = self.link >= beyond
        return np.cross(self.place_m[:, rides] - about_m[:, None], self.force_n[rides]).sum(axis=1)

    def force(self, beyond: int) -> Array:
        """Sum of the weights on links ``beyond``..n, (3,), N."""
        return self.force_n[self.link >= beyond].sum(axis=0)


def own_loads(robot: Robot, frames_at_rest: Array, motions: Array, payload_kg: float, links: bool = True) -> Loads:
    """The weights of an arm's links and of a payload at the tool's point.

    Args:
        frames_at_rest: frames 1..n at rest in the instrument's frame, (n, 4, 4).
        motions: how each link has moved from rest, (m, n, 4, 4).
        links: False: the payload alone.

    Raises:
        InputError: the robot has no masses or no direction of gravity.
    """
    if robot.gravity_direction is None or (links and not robot.links):
        raise InputError(f"{robot.name} has no masses or no direction of gravity, so no load can act on it")
    n = robot.joint_count
    masses, riding, rest = [payload_kg], [n], [apply(frames_at_rest[-1], robot.link_transforms[-1][:3, 3])]
    for number, link in enumerate(robot.links if links else (), 1):
        masses.append(link.mass_kg)
        riding.append(number)
        rest.append(apply(frames_at_rest[number - 1], link.centre_m))
    link = np.array(riding)
    # Gravity is known in the robot's base frame, which stands in frame 1 as the nominal robot says.
    to_instrument = frames_at_rest[0][:3, :3] @ robot.base_transform[:3, :3].T
    down = to_instrument @ np.array(robot.gravity_direction)
    force = STANDARD_GRAVITY * np.array(masses)[:, None] * down
    return Loads(link, force, apply(motions[:, link - 1], np.array(rest)))


def joint_loads(loads: Loads, frames_at_rest: Array, motions: Array, sliding: np.ndarray) -> Array:
    """The torque (N m) or force (N) of the loads on every joint, (m, n); positive: it pushes in the joint's sense."""
    out = np.empty(motions.shape[:2])
    for i in range(motions.shape[1]):
        axis = motions[:, i, :3, :3] @ frames_at_rest[i, :3, 2]
        origin = apply(motions[:, i], frames_at_rest[i, :3, 3])
        load = loads.force(i + 1) if sliding[i] else loads.moments(i + 1, origin)
        out[:, i] = np.sum(axis * load, axis=1)
    return out


def drive_loads(robot: Robot, on_joints: Array) -> Array:
    """The torque (N m) or force (N) that each motor has to hold, (m, n), from those on the joints (m, n).

    A motor that also turns the next joint through a linkage feels that joint's load times the gain (virtual work):
    where a parallelogram keeps the forearm level, the upper arm's motor does not carry the forearm's lever.
    """
    held = on_joints.copy()
    held[:, :-1] += robot.coupling_gains[1:] * on_joints[:, 1:]
    return held
