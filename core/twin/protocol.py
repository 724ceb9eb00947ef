"""The order of a measurement: which joint moves when, where the others stand, and how every motor got there.

Sweeps are made as the paper makes them: one motor moves and all others stand still, so the joint that follows its
motion is commanded by its nominal passive motion (section 3.1). A sweep starts half a step before its first point, so
that every point is reached in one sense, and the arm returns to its centre afterwards.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from core.geometry import Array
from core.kinematics import active_commands
from core.measurements import POSE, SWEEP
from core.robot import Robot
from core.session_plan import commands_for

TURNING_SPEEDS_RAD_S = tuple(np.deg2rad([4.0, 16.0, 9.0]))
SLIDING_SPEEDS_M_S = (0.02, 0.08, 0.045)
"""Speeds of a sweep that is measured in motion, one point after the other."""


@dataclass(frozen=True)
class SweepPlan:
    """One joint moves from low to high, about the centre, and targets are seen at each stop."""

    joint: int
    low: float
    high: float
    """Displacements of the motor from its centre, rad or m."""
    points: int
    targets: tuple[str, ...]


@dataclass(frozen=True)
class Protocol:
    """Sweeps in their order, then poses."""

    sweeps: tuple[SweepPlan, ...]
    poses: Array
    """Displacements of the motors from the centre, (p, n)."""
    pose_targets: tuple[str, ...]
    seconds_a_shot: float = 40.0
    both_ways: bool = False
    """Each sweep is made forwards and then backwards over the same steps."""
    in_motion: bool = False
    """Sweeps are measured while the joint moves, at changing speeds, and the speeds are recorded."""


@dataclass(frozen=True)
class Stop:
    """One standstill (or one pass) and what is seen there."""

    phase: str
    motors: Array
    """What the motors are asked for, (n,)."""
    targets: tuple[int, ...]
    joint: int = 0
    sweep: int = 0
    step: int = -1
    pose: int = -1
    speed: float = 0.0
    """Of the moving joint's motor, rad/s or m/s."""
    before: tuple[Array, ...] = ()
    """Where the motors are brought first, without measuring."""


@dataclass(frozen=True)
class Schedule:
    """A protocol laid out as rows of a campaign. Row k is seen at stop ``stop[k]``."""

    robot: Robot
    stops: tuple[Stop, ...]
    stop: np.ndarray
    """(m,)"""
    target: np.ndarray
    """(m,)"""
    time_s: Array
    """(m,)"""

    @cached_property
    def motors(self) -> Array:
        """What the motors are asked for at each stop, (s, n)."""
        return np.array([stop.motors for stop in self.stops])

    @cached_property
    def commanded(self) -> Array:
        """What the controller is told at each stop, (s, n)."""
        return commands_for(self.robot, self.motors)

    @cached_property
    def path(self) -> tuple[Array, np.ndarray]:
        """All places of the motors in order, (w, n), and the index of each stop among them, (s,)."""
        places: list[Array] = []
        where = []
        for stop in self.stops:
            places.extend([*stop.before, stop.motors])
            where.append(len(places) - 1)
        return np.array(places), np.array(where)

    @cached_property
    def path_senses(self) -> np.ndarray:
        """Sense in which each motor last moved, at every place of the path, (w, n).

        At the beginning all of them stand where they came to from below.
        """
        places, _ = self.path
        moved = np.sign(np.round(np.diff(places, axis=0, prepend=places[:1]), 12)).astype(int)
        senses, sense = np.empty_like(moved), np.ones(moved.shape[1], dtype=int)
        for k, step in enumerate(moved):
            sense = np.where(step == 0, sense, step)
            senses[k] = sense
        return senses

    @cached_property
    def approach(self) -> np.ndarray:
        """Sense in which each motor reached each stop, (s, n), +1 or -1."""
        return self.path_senses[self.path[1]]

    @cached_property
    def speed(self) -> Array:
        """Speeds of the motors at each stop, (s, n)."""
        speeds = np.zeros_like(self.motors)
        for k, stop in enumerate(self.stops):
            if stop.joint:
                speeds[k, stop.joint - 1] = stop.speed
        return speeds

    @cached_property
    def air_c(self) -> Array:
        """Temperature of the air, (m,): it swings by half a degree as the day goes by."""
        return 21.0 + 0.5 * np.sin(2 * np.pi * self.time_s / 5400.0)

    @cached_property
    def arm_c(self) -> Array:
        """Temperature of the arm, (m,): it warms up by 8 degrees, most of it in the first hour."""
        return 21.0 + 8.0 * (1.0 - np.exp(-self.time_s / 2400.0))

    def column(self, name: str) -> np.ndarray:
        """One attribute of the stops, a value a row, (m,)."""
        return np.array([getattr(stop, name) for stop in self.stops])[self.stop]


def lay_out(robot: Robot, centre: Array, protocol: Protocol, names: tuple[str, ...]) -> Schedule:
    """The rows of a protocol.

    Args:
        centre: commands about which everything is measured, (n,).
        names: the targets' names in the campaign's order.
    """
    still = active_commands(robot, centre)[0]
    stops: list[Stop] = []
    counts: dict[int, int] = {}
    for plan in protocol.sweeps:
        counts[plan.joint] = counts.get(plan.joint, 0) + 1
        stops += _sweep_stops(robot, plan, protocol, still, counts[plan.joint], names)
    targets = tuple(names.index(name) for name in protocol.pose_targets)
    for k, displaced in enumerate(protocol.poses):
        stops.append(Stop(POSE, still + displaced, targets, pose=k, before=() if k else (still,)))
    stop = np.repeat(np.arange(len(stops)), [len(s.targets) for s in stops])
    time_s = protocol.seconds_a_shot * np.arange(1.0, len(stop) + 1)
    target = np.concatenate([np.array(s.targets, dtype=int) for s in stops])
    return Schedule(robot, tuple(stops), stop, target, time_s)


def _sweep_stops(
    robot: Robot, plan: SweepPlan, protocol: Protocol, still: Array, number: int, names: tuple[str, ...]
) -> list[Stop]:
    along = np.zeros(robot.joint_count)
    along[plan.joint - 1] = 1.0
    places = np.linspace(plan.low, plan.high, plan.points)
    overshoot = (plan.high - plan.low) / (plan.points - 1) / 2
    speeds = SLIDING_SPEEDS_M_S if robot.joints[plan.joint - 1].slides else TURNING_SPEEDS_RAD_S
    targets = tuple(names.index(name) for name in plan.targets)
    stops: list[Stop] = []
    for sense in (1, -1) if protocol.both_ways else (1,):
        start = still + (plan.low - overshoot if sense > 0 else plan.high + overshoot) * along
        before = (start,) if stops else (still, start)
        for step in range(plan.points)[::sense]:
            speed = sense * speeds[step % len(speeds)] if protocol.in_motion else 0.0
            motors = still + places[step] * along
            stops.append(Stop(SWEEP, motors, targets, plan.joint, number, step, speed=speed, before=before))
            before = ()
    return stops
