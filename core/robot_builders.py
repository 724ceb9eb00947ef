"""Robots from rows of parameters: the phi-model's or Denavit and Hartenberg's, and a phi-model back from its robot.

What a source calls 'frame i, which moves with joint i' is frame i of the phi-model itself, with Z_i on axis i. In
the standard notation of Denavit and Hartenberg frame i stands at the far end of link i, behind the constant
transform; ``Robot.moving_frames`` keeps that difference, and ``moving_frame`` undoes it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.errors import RobotError
from core.geometry import Array, apply, invert
from core.phi_model import PhiModel
from core.phi_transforms import link_transform, phi_transform, tool_transform
from core.robot import Coupling, Joint, LinkMass, Robot


@dataclass(frozen=True)
class PhiTool:
    """The end frame of a phi-model: frame n to the tool (equation A3)."""

    phi_rad: float = 0.0
    a_m: float = 0.0
    b_m: float = 0.0
    alpha_rad: float = 0.0
    theta_rad: float = 0.0
    gamma_rad: float = 0.0
    h_m: float = 0.0

    def transform(self) -> Array:
        """From the tool frame to frame n, shape (4, 4)."""
        tool = tool_transform(self.a_m, self.b_m, self.alpha_rad, self.theta_rad, self.gamma_rad, self.h_m)
        return phi_transform(self.phi_rad) @ tool


@dataclass(frozen=True)
class DhRow:
    """One row of standard Denavit-Hartenberg parameters: Rot(z,theta) Trans(0,0,d) Trans(a,0,0) Rot(x,alpha)."""

    theta_rad: float
    d_m: float
    a_m: float
    alpha_rad: float

    def transform(self) -> Array:
        """From frame i to frame i-1 at zero displacement, shape (4, 4)."""
        return link_transform(self.d_m, self.a_m, self.alpha_rad, self.theta_rad)


def robot_from_phi(
    name: str,
    joints: Sequence[Joint],
    model: PhiModel,
    tool: PhiTool | None = None,
    couplings: Sequence[Coupling] = (),
    links: Sequence[LinkMass] = (),
    gravity_direction: tuple[float, float, float] | None = None,
) -> Robot:
    """The robot that a phi-model of n-1 frames describes; without a tool its last frame is frame n.

    Raises:
        RobotError: the model has not one frame less than there are joints.
    """
    if len(model.phi_rad) != len(joints) - 1:
        raise RobotError(f"{len(joints)} joints need {len(joints) - 1} frames, got {len(model.phi_rad)}")
    last = np.eye(4) if tool is None else tool.transform()
    return Robot(
        name=name,
        joints=tuple(joints),
        link_transforms=np.concatenate([model.link_transforms().reshape(-1, 4, 4), last[None]]),
        couplings=tuple(couplings),
        links=tuple(links),
        gravity_direction=gravity_direction,
        phi_rad=model.phi_rad,
    )


def robot_from_dh(
    name: str,
    joints: Sequence[Joint],
    rows: Sequence[DhRow],
    couplings: Sequence[Coupling] = (),
    links: Sequence[LinkMass] = (),
    gravity_direction: tuple[float, float, float] | None = None,
) -> Robot:
    """The robot of standard Denavit-Hartenberg rows, one a joint.

    Args:
        links: masses with centres in the core's frame i (before the constant transform).

    Raises:
        RobotError: there are not as many rows as joints.
    """
    if len(rows) != len(joints):
        raise RobotError(f"{len(joints)} joints need {len(joints)} Denavit-Hartenberg rows, got {len(rows)}")
    transforms = np.array([row.transform() for row in rows]).reshape(-1, 4, 4)
    return Robot(
        name=name,
        joints=tuple(joints),
        link_transforms=transforms,
        moving_frames=transforms,
        couplings=tuple(couplings),
        links=tuple(links),
        gravity_direction=gravity_direction,
    )


def moving_frame(robot: Robot, link: int) -> Array:
    """From the frame that the robot's source calls 'link i' to the core's frame i, (4, 4); link 0: the base."""
    if link == 0 or robot.moving_frames is None:
        return np.eye(4)
    return robot.moving_frames[link - 1]


def from_source_frame(robot: Robot, link: int, point_m: Sequence[float]) -> tuple[float, float, float]:
    """A point of link i, given in the source's frame, in the core's frame i, metres."""
    x, y, z = apply(moving_frame(robot, link), point_m)
    return float(x), float(y), float(z)


def to_source_frame(robot: Robot, link: int, point_m: Sequence[float]) -> tuple[float, float, float]:
    """A point of link i, given in the core's frame i, in the source's frame, metres."""
    x, y, z = apply(invert(moving_frame(robot, link)), point_m)
    return float(x), float(y), float(z)


def phi_model_of(robot: Robot) -> PhiModel:
    """The phi-model of a robot that was described by one: its rows, read back from the link transforms.

    Raises:
        RobotError: the robot's source was not a phi-model.
    """
    if robot.phi_rad is None:
        raise RobotError(f"{robot.name} was not described by a phi-model, so it has no phi angles")
    phi = np.asarray(robot.phi_rad, dtype=float)
    link = invert(phi_transform(phi).reshape(-1, 4, 4)) @ robot.link_transforms[:-1]
    theta = np.arctan2(link[:, 1, 0], link[:, 0, 0])
    alpha = np.arctan2(link[:, 2, 1], link[:, 2, 2])
    b = link[:, 0, 3] * np.cos(theta) + link[:, 1, 3] * np.sin(theta)
    return PhiModel(phi, link[:, 2, 3], b, alpha, theta, robot.sliding)


def phi_tool_of(transform: Array) -> PhiTool | None:
    """The end frame that gives a rigid motion (4, 4) from the tool to frame n; None for the identity.

    Of phi = 0 and phi = 90 degrees the one is taken whose Z_phi is farther from the tool's z-axis.
    """
    if np.array_equal(transform, np.eye(4)):
        return None
    phi = 0.0 if abs(transform[0, 2]) <= abs(transform[1, 2]) else np.pi / 2
    tool = invert(phi_transform(phi)) @ transform
    sine = float(np.hypot(tool[0, 2], tool[1, 2]))
    theta = np.arctan2(tool[0, 2], -tool[1, 2])
    gamma = np.arctan2(tool[2, 0], tool[2, 1])
    x, y, z = tool[:3, 3]
    h = (x * np.sin(theta) - y * np.cos(theta)) / sine
    b = x * np.cos(theta) + y * np.sin(theta)
    alpha = np.arctan2(sine, tool[2, 2])
    return PhiTool(phi, float(z - h * tool[2, 2]), float(b), float(alpha), float(theta), float(gamma), float(h))
