"""A robot arm as a chain of joints: one record for every way of describing it.

Whatever the source says (phi-model, Denavit-Hartenberg, URDF), the chain is kept as

    T_tool_to_base(g) = T_base . M_1(g_1) . C_1 . M_2(g_2) . C_2 ... M_n(g_n) . C_n

with ``M_i`` a turn about, or a slide along, the z-axis of frame i, and ``C_i`` the constant transform from
frame i+1 (after the last joint: the tool) to frame i. ``g_i`` is the net displacement of joint i: what
its motor does (active) plus what the motor of joint i-1 does to it through a linkage (passive).
"""

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from core.errors import RobotError
from core.geometry import Array, Line


class JointKind(StrEnum):
    """How a joint moves."""

    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"
    PASSIVE = "passive"
    """A turning joint without a motor, driven by a coupling alone; it has no command of its own."""


@dataclass(frozen=True)
class Joint:
    """One joint: how it moves, how far, and what is known of its drive."""

    kind: JointKind
    limits: tuple[float, float] = (-np.inf, np.inf)
    """Lowest and highest displacement, rad (m where it slides)."""
    drive_ratio: float | None = None
    """Turns of the joint for one turn of the last gear before it, N in section 4 of the paper."""
    transmission: str = "auto"
    """Name of the transmission function's family, or ``auto``: chosen by evidence."""

    def __post_init__(self) -> None:
        low, high = self.limits
        if not low < high:
            raise RobotError(f"joint limits must be two numbers, the lower first, got [{low}, {high}]")
        if self.drive_ratio is not None and not (np.isfinite(self.drive_ratio) and self.drive_ratio != 0):
            raise RobotError(f"a drive ratio must be a finite number other than 0, got {self.drive_ratio}")

    @property
    def slides(self) -> bool:
        return self.kind is JointKind.PRISMATIC


@dataclass(frozen=True)
class Coupling:
    """The nominal passive motion of joint ``target`` for the active motion of joint ``source`` = target - 1."""

    source: int
    target: int
    gain: float
    """Passive displacement of ``target`` for one unit of active displacement of ``source``."""
    compensated: bool = True
    """True: commands are net displacements and the controller undoes the coupling; False: motor side."""
    form: str = "auto"
    """Name of the coupling function's family, or ``auto``: chosen by evidence."""

    def __post_init__(self) -> None:
        if self.target != self.source + 1:
            raise RobotError(
                f"a coupling goes from a joint to the next one up, got from = {self.source}, to = {self.target}"
            )
        if not np.isfinite(self.gain):
            raise RobotError(
                f"the gain of coupling {self.source} -> {self.target} must be a finite number, got {self.gain}"
            )


@dataclass(frozen=True)
class LinkMass:
    """Mass of a link and its centre in the frame that moves with the joint before it."""

    mass_kg: float
    centre_m: tuple[float, float, float]

    def __post_init__(self) -> None:
        if not (np.isfinite(self.mass_kg) and self.mass_kg >= 0):
            raise RobotError(f"a link's mass must be a number >= 0 kg, got {self.mass_kg}")


@dataclass(frozen=True)
class Robot:
    """A serial arm of n joints."""

    name: str
    joints: tuple[Joint, ...]
    link_transforms: Array
    """Constant transform from frame i+1 to frame i for i = 1..n (the last: tool to frame n), (n, 4, 4), m."""
    base_transform: Array = field(default_factory=lambda: np.eye(4))
    """From frame 1 at rest to the base frame, (4, 4)."""
    moving_frames: Array | None = None
    """From the frame that the source calls 'link i' to frame i, (n, 4, 4); None: they are the same."""
    couplings: tuple[Coupling, ...] = ()
    links: tuple[LinkMass, ...] = ()
    gravity_direction: tuple[float, float, float] | None = None
    """Unit vector in the base frame; None: not known."""
    phi_rad: Array | None = None
    """The phi angles of frames 1..n-1 if the source is a phi-model, shape (n-1,)."""

    def __post_init__(self) -> None:
        n = len(self.joints)
        if n == 0:
            raise RobotError("a robot needs at least one joint, got none")
        transforms = np.asarray(self.link_transforms, dtype=float)
        if transforms.shape != (n, 4, 4) or not np.isfinite(transforms).all():
            raise RobotError(f"{n} joints need {n} finite link transforms, got an array of shape {transforms.shape}")
        object.__setattr__(self, "link_transforms", transforms)
        for coupling in self.couplings:
            if not 1 <= coupling.source < coupling.target <= n:
                raise RobotError(
                    f"coupling {coupling.source} -> {coupling.target} names a joint that is not there (joints 1..{n})"
                )
        targets = [c.target for c in self.couplings]
        if len(set(targets)) != len(targets):
            raise RobotError(f"each joint can be driven by one coupling only, got couplings to joints {targets}")
        for number, joint in enumerate(self.joints, 1):
            if joint.kind is JointKind.PASSIVE and number not in targets:
                raise RobotError(f"joint {number} is passive and no coupling drives it")

    @property
    def joint_count(self) -> int:
        return len(self.joints)

    @property
    def sliding(self) -> np.ndarray:
        """Which joints slide, boolean, shape (n,)."""
        return np.array([joint.slides for joint in self.joints])

    @property
    def commanded(self) -> np.ndarray:
        """Which joints have a command of their own, boolean, shape (n,)."""
        return np.array([joint.kind is not JointKind.PASSIVE for joint in self.joints])

    @property
    def coupling_gains(self) -> Array:
        """Nominal gain of the coupling into each joint, 0 where there is none, shape (n,)."""
        gains = np.zeros(self.joint_count)
        for coupling in self.couplings:
            gains[coupling.target - 1] = coupling.gain
        return gains

    @property
    def coupling_compensated(self) -> np.ndarray:
        """Whether the controller itself undoes the coupling into each joint, boolean, shape (n,)."""
        compensated = np.ones(self.joint_count, dtype=bool)
        for coupling in self.couplings:
            compensated[coupling.target - 1] = coupling.compensated
        return compensated

    def coupling_into(self, joint: int) -> Coupling | None:
        """The coupling that drives a joint (1..n), if there is one."""
        return next((c for c in self.couplings if c.target == joint), None)

    def coupling_from(self, joint: int) -> Coupling | None:
        """The coupling that a joint (1..n) drives, if there is one."""
        return next((c for c in self.couplings if c.source == joint), None)

    def axes_at_zero(self) -> tuple[Line, ...]:
        """The joint axes in the base frame when every displacement is zero."""
        frame, axes = self.base_transform, []
        for link in self.link_transforms:
            axes.append(Line(frame[:3, 3], frame[:3, 2]))
            frame = frame @ link
        return tuple(axes)
