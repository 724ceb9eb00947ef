"""A simulated cell: the robot that its maker drew, the arm that stands there, and how it is measured."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from core.arm import Arm
from core.geometry import Array, Line, apply, invert, joint_motion
from core.kinematics import link_frames
from core.measurements import Target
from core.phi_model import PhiModel, frames
from core.robot import Robot
from core.robot_writer import phi_robot_toml
from core.twin.instruments import PointInstrument
from core.twin.noise import Repeatability
from core.twin.protocol import Protocol, Schedule, lay_out


@dataclass(frozen=True)
class Truth:
    """What an arm really is: the answers of a calibration, in the instrument's frame."""

    arm: Arm
    base: Array
    """From frame 1 to the instrument's frame, (4, 4)."""
    phi: PhiModel
    rest_points_m: Array
    """The targets when every net displacement is zero, (t, 3)."""
    links: np.ndarray
    """The link of each target, (t,)."""
    home: Array
    """Commands at which every net displacement is zero, (n,)."""

    def frames_at_rest(self) -> Array:
        """From frames 1..n to the instrument's frame when every net displacement is zero, (n, 4, 4)."""
        return frames(self.phi, np.zeros(len(self.phi.sliding)), self.base)

    def tool_poses(self, commanded: ArrayLike) -> Array:
        """Where the tool really goes for commands (m, n): T_tool_to_base in the arm's own frame 1, (m, 4, 4)."""
        net = self.arm.net(commanded)
        tool = self.frames_at_rest()[-1] @ self.arm.robot.link_transforms[-1]
        moved = chain(self.arm.axes, self.phi.sliding, net)[:, -1] @ tool
        return invert(self.base) @ moved


@dataclass(frozen=True, eq=False)
class Cell:
    """Everything about a simulated campaign but its random numbers."""

    title: str
    robot: Robot
    """The nominal robot."""
    nominal: PhiModel
    """Its phi-model."""
    truth: Truth
    targets: tuple[Target, ...]
    protocol: Protocol
    instrument: PointInstrument
    repeatability: Repeatability = field(default_factory=Repeatability)
    home: Array | None = None
    """The commands at the marks, if the owner knows them, (n,); else everything is measured about zero commands."""
    stiffness: Array | None = None
    """Of the joints against a load that the sim does not have, N m/rad or N/m, (n,); None: rigid."""
    notes: tuple[tuple[str, str], ...] = ()

    @property
    def centre(self) -> Array:
        """Commands about which the sweeps are made, (n,)."""
        return np.zeros(self.robot.joint_count) if self.home is None else self.home

    @property
    def target_links(self) -> np.ndarray:
        """The link of each target, (t,)."""
        return self.truth.links

    @cached_property
    def schedule(self) -> Schedule:
        """The rows of a campaign, without what is measured."""
        return lay_out(self.robot, self.centre, self.protocol, tuple(target.name for target in self.targets))

    @cached_property
    def points_m(self) -> Array:
        """Where the targets truly are, row by row, on a healthy arm that repeats exactly, (m, 3)."""
        rows = self.schedule
        net = self.truth.arm.net(rows.commanded)
        motions = chain(self.truth.arm.axes, self.robot.sliding, net)
        return carried(motions[rows.stop], self.target_links[rows.target], self.truth.rest_points_m[rows.target])

    @cached_property
    def bodies(self) -> np.ndarray:
        """Which rows show the same link in the same standstill, numbered 0.., (m,); -1 for targets on the floor."""
        rows = self.schedule
        links = self.target_links[rows.target]
        _, numbers = np.unique(rows.stop * (self.robot.joint_count + 1) + links, return_inverse=True)
        return np.where(links > 0, numbers, -1)

    def robot_toml(self) -> str:
        """The nominal robot as the text of a robot.toml."""
        return phi_robot_toml(self.robot, self.nominal)


def chain(lines: tuple[Line, ...], sliding: np.ndarray, net: Array) -> Array:
    """How each link moves with the joints before it, in the frame of the axes: shape (m, n, 4, 4) for net (m, n)."""
    moved = np.empty((*net.shape, 4, 4))
    so_far = np.eye(4)
    for i, line in enumerate(lines):
        so_far = so_far @ joint_motion(line, net[:, i], bool(sliding[i]))
        moved[:, i] = so_far
    return moved


def carried(motions: Array, link: np.ndarray, rest_points_m: Array) -> Array:
    """Points on links 0..n, (m,), at rest (m, 3), moved by the links' motions (m, n, 4, 4): (m, 3)."""
    moved = apply(motions[np.arange(len(link)), np.maximum(link, 1) - 1], rest_points_m)
    return np.where((link > 0)[:, None], moved, rest_points_m)


def attached(robot: Robot, true_frames: Array, links: ArrayLike, points_m: ArrayLike) -> Array:
    """Points that a drawing shows at the nominal robot at rest, (t, 3), on the links of the true arm: (t, 3).

    Each point keeps its coordinates in the frame that moves with its link.
    """
    at_rest = link_frames(robot, np.zeros((1, robot.joint_count)))[0]
    carry = true_frames @ invert(at_rest[:-1])
    return apply(carry[np.asarray(links) - 1], np.asarray(points_m, dtype=float))
