"""What a plan is made for: the arm as far as it is known, its targets, what looks at them, how well it repeats."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from core.arm import carry
from core.arm_jacobian import ArmState, Layout, Observations, Prediction, net_displacements, predict
from core.errors import InputError
from core.geometry import Array, apply
from core.kinematics import active_commands, link_frames
from core.measurements import Target
from core.phi_convention import Convention, convention_of
from core.planning.sight import Sight
from core.robot import Robot

OPEN_RAD, OPEN_M = np.pi, 0.5
"""How far a joint without limits goes to either side."""


@dataclass(frozen=True)
class Repeats:
    """How well the arm comes back, and how thick it is where it stands in the way."""

    link_sigma_m: float = 0.0
    """Standard deviation of one coordinate of a point on any link, from one visit to the next."""
    joint_sigma: Array | None = None
    """Standard deviation of each joint's displacement, rad or m, (n,); None: nothing beyond the links'."""

    def __post_init__(self) -> None:
        if not (np.isfinite(self.link_sigma_m) and self.link_sigma_m >= 0):
            raise InputError(f"a repeatability must be a number of at least 0 m, got {self.link_sigma_m}")
        if self.joint_sigma is not None and not (np.asarray(self.joint_sigma) >= 0).all():
            raise InputError(f"the repeatability of each joint must be at least 0, got {self.joint_sigma}")


@dataclass(frozen=True)
class Body:
    """The arm as it stands in the way of a sight: rods from one joint to the next."""

    radius_m: float = 0.05
    tool_radius_m: float = 0.03
    """Of the last link."""

    def __post_init__(self) -> None:
        if not (0 < self.radius_m < np.inf and 0 < self.tool_radius_m < np.inf):
            raise InputError(f"radii of an arm must be above 0 m, got {self.radius_m} and {self.tool_radius_m}")


@dataclass(frozen=True, eq=False)
class Site:
    """Everything that a plan rests on; compared by identity."""

    robot: Robot
    """The nominal robot: its limits and its controller's gains."""
    state: ArmState
    """The arm as far as it is known, in the instrument's frame, with a place at rest for every target."""
    targets: tuple[Target, ...]
    sight: Sight
    skeleton_m: Array
    """Where the joints and the tool's point are when every net displacement is zero, instrument's frame, (n + 1, 3)."""
    home: Array | None = None
    """Commands at the arm's marks, from where displacement counts, (n,)."""
    coupled: np.ndarray | None = None
    """Which joints' passive motion is calibrated, boolean, (n,); None: every one that there is."""
    repeats: Repeats = field(default_factory=Repeats)
    body: Body = field(default_factory=Body)

    def __post_init__(self) -> None:
        n = self.robot.joint_count
        if len(self.targets) != len(self.state.rest_points_m) or not self.targets:
            raise InputError(f"{len(self.targets)} targets need as many places, and at least one is needed")
        if self.skeleton_m.shape != (n + 1, 3):
            raise InputError(f"a skeleton of {n} joints needs {n + 1} points, got {len(self.skeleton_m)}")
        for name, values in (("home pose", self.home), ("repeatability of joints", self.repeats.joint_sigma)):
            if values is not None and np.shape(values) != (n,):
                raise InputError(f"the {name} needs {n} values, one a joint, got {np.size(values)}")
        if self.coupled is None:
            object.__setattr__(self, "coupled", np.array([c is not None for c in self.state.couplings]))

    @cached_property
    def links(self) -> np.ndarray:
        """The link of each target, (t,)."""
        return np.array([target.link for target in self.targets])

    @cached_property
    def placed(self) -> np.ndarray:
        """Which targets ride on a link and have a place that is known, boolean, (t,)."""
        return (self.links > 0) & np.isfinite(self.state.rest_points_m).all(axis=1)

    @cached_property
    def limits(self) -> Array:
        """Lowest and highest command that a plan may use, (n, 2); an open end is once round, or a metre, away."""
        most = np.where(self.robot.sliding, OPEN_M, OPEN_RAD)
        low, high = np.array([joint.limits for joint in self.robot.joints]).T
        low = np.where(np.isfinite(low), low, np.where(np.isfinite(high), high - 2 * most, -most))
        high = np.where(np.isfinite(high), high, low + 2 * most)
        return np.stack([low, high], axis=1) * self.robot.commanded[:, None]

    @cached_property
    def centre(self) -> Array:
        """The commands at the marks, or zero, (n,)."""
        return np.zeros(self.robot.joint_count) if self.home is None else self.home

    @cached_property
    def convention(self) -> Convention:
        """Where the frames of the phi-model go."""
        return convention_of(self.robot)

    @cached_property
    def layout(self) -> Layout:
        """The unknowns of a calibration: axes, functions, calibrated couplings, targets."""
        every = self.robot.commanded
        return Layout.of(self.state, self.robot.sliding, every, self.coupled)

    def observations(self, commanded: Array, target: np.ndarray) -> Observations:
        """Sightings of targets (m,) under commands (m, n), before anything is measured."""
        return Observations(
            point_m=np.zeros((len(target), 3)),
            target=target,
            link=self.links[target],
            asked=active_commands(self.robot, commanded - self.centre),
            sliding=self.robot.sliding,
            home=self.home is not None,
        )

    def predict(self, commanded: Array, target: np.ndarray) -> Prediction:
        """Where targets (m,) will be under commands (m, n), and their derivatives by all unknowns."""
        return predict(self.state, self.observations(commanded, target), self.layout)

    def net(self, commanded: Array) -> Array:
        """How far each joint will be from its zero under commands (m, n), (m, n)."""
        return net_displacements(self.state, self.observations(commanded, np.zeros(len(commanded), dtype=int)))

    def carried(self, net: Array, link: np.ndarray, rest_points_m: Array) -> Array:
        """Where points on links (m,) are for net displacements (m, n), (m, 3)."""
        return carry(self.state.axes, self.robot.sliding, net, link, rest_points_m)

    def with_targets(self, targets: tuple[Target, ...], rest_points_m: Array) -> "Site":
        """The same site with other targets."""
        return replace(self, targets=targets, state=replace(self.state, rest_points_m=np.asarray(rest_points_m)))


def skeleton(robot: Robot, base: Array) -> Array:
    """Joints and tool of a robot at rest, (n + 1, 3), with its base placed by a transform (4, 4)."""
    return apply(base, link_frames(robot, np.zeros((1, robot.joint_count)))[0, :, :3, 3])
