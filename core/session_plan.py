"""What is to be measured: sweeps in their order, laid out as steps with the commands to send to the robot.

A sweep moves one motor and holds all others still (section 3.1 of the paper), so the joint that the moving motor
drives through a linkage is commanded by its nominal passive motion. A pass starts half an interval before its first
stop, or at the joint's limit, so that every stop is reached in one sense.
"""

from dataclasses import dataclass
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta

from core.errors import InputError
from core.geometry import Array
from core.kinematics import active_commands
from core.robot import Robot
from core.session_values import Line, Number, Numbers, PositiveInt
from core.units import displacement_units, from_si

StepKey = tuple[int, int, int, int, str]
"""Joint, sweep, step, sense (+1 forwards, -1 backwards), target."""
MOST_SHOTS = 200_000
LIMIT_TOLERANCE = 1e-9
"""How far a command may exceed a joint limit, rad or m: rounding, no more."""


class PlannedSweep(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One row of table 1."""

    joint: PositiveInt
    sweep: PositiveInt
    """1 for the first sweep of this joint."""
    low: Number
    high: Number
    """Displacements of the motor from where it is held, rad or m."""
    stops: Annotated[int, Meta(ge=2, le=1_000_000)]
    targets: Annotated[tuple[Line, ...], Meta(min_length=1, max_length=100)]
    """Seen at each stop; a second one, on the link before, shows the dependency."""
    both_ways: bool = False
    """Forwards, then backwards over the same stops."""
    held: Numbers | None = None
    """Commands about which this sweep is made, where all other joints stay, rad or m, (n,); None: home."""

    @property
    def shots(self) -> int:
        """How many shots it takes."""
        return self.stops * len(self.targets) * (2 if self.both_ways else 1)


@dataclass(frozen=True)
class Plan:
    """All sweeps, and where everything is measured from."""

    sweeps: tuple[PlannedSweep, ...] = ()
    home: tuple[float, ...] | None = None
    """Commands at the arm's marks, (n,); None: zero."""
    joint_values: str = "commanded"


@dataclass(frozen=True)
class Step:
    """One shot to be taken."""

    joint: int
    sweep: int
    step: int
    sense: int
    target: str
    commanded: tuple[float, ...]
    """To send to the robot, rad or m, (n,)."""
    start: tuple[float, ...] | None
    """Commands to go to first, so that the stop is reached in the pass's sense; None: go on from the last stop."""

    @property
    def key(self) -> StepKey:
        return self.joint, self.sweep, self.step, self.sense, self.target

    @property
    def sweep_key(self) -> tuple[int, int]:
        """Joint and number of the sweep that it is a part of."""
        return self.joint, self.sweep


def check_plan(robot: Robot, targets: dict[str, int], plan: Plan) -> None:
    """Refuse a plan that this robot cannot make or these targets (name: link) cannot show.

    Raises:
        InputError: one sentence says which sweep and why.
    """
    n = robot.joint_count
    if plan.home is not None and len(plan.home) != n:
        raise InputError(f"the plan's home has {len(plan.home)} values, expected {n}, one a joint of {robot.name}")
    shots = sum(row.shots for row in plan.sweeps)
    if shots > MOST_SHOTS:
        raise InputError(f"the plan asks for {shots} shots, expected at most {MOST_SHOTS}")
    seen = set()
    for row in plan.sweeps:
        name = f"the plan's joint {row.joint}, sweep {row.sweep}"
        if row.joint > n or not robot.commanded[row.joint - 1]:
            raise InputError(f"{name}: expected a joint 1..{n} with a motor")
        if (row.joint, row.sweep) in seen:
            raise InputError(f"{name} stands twice, expected every sweep once")
        seen.add((row.joint, row.sweep))
        if row.held is not None and len(row.held) != n:
            raise InputError(f"{name} is held at {len(row.held)} values, expected {n}, one a joint of {robot.name}")
        if not row.low < row.high:
            raise InputError(f"{name} goes from {row.low:g} to {row.high:g}, expected the lower value first")
        _check_targets(name, row, targets)
    _check_limits(robot, plan)


def steps_of(robot: Robot, plan: Plan) -> tuple[Step, ...]:
    """Every shot of a plan in its order."""
    return tuple(step for row in plan.sweeps for step in _sweep_steps(robot, row, _still(robot, plan, row)))


def extra_step(robot: Robot, plan: Plan, row: PlannedSweep, command: float, number: int, target: str) -> Step:
    """A shot outside the plan, in the manner of one of its sweeps, reached in the positive sense.

    Args:
        command: of the swept joint, rad or m.
        number: of the step, beyond those of the plan.

    Raises:
        InputError: the command is beyond the joint's limits.
    """
    still = _still(robot, plan, row)
    along = np.zeros(robot.joint_count)
    along[row.joint - 1] = 1.0
    held = commands_for(robot, still[None])[0, row.joint - 1]
    half = (row.high - row.low) / (row.stops - 1) / 2
    there, before = commands_for(robot, still + np.array([[command - held], [command - held - half]]) * along)
    limits = np.array([joint.limits for joint in robot.joints])
    beyond = np.flatnonzero((there < limits[:, 0] - LIMIT_TOLERANCE) | (there > limits[:, 1] + LIMIT_TOLERANCE))
    if len(beyond):
        raise InputError(f"the extra stop {_beyond(robot, int(beyond[0]), float(there[beyond[0]]))}")
    start = tuple(np.clip(before, limits[:, 0], limits[:, 1]).tolist())
    return Step(row.joint, row.sweep, number, 1, target, tuple(there.tolist()), start)


def commands_for(robot: Robot, motors: Array) -> Array:
    """The commands that make a controller move its motors so, (k, n): the inverse of ``active_commands``."""
    commanded = np.array(motors, dtype=float)
    gains = np.where(robot.coupling_compensated & robot.commanded, robot.coupling_gains, 0.0)
    commanded[:, 1:] += gains[1:] * motors[:, :-1]
    return commanded


def _check_targets(name: str, row: PlannedSweep, targets: dict[str, int]) -> None:
    for k, target in enumerate(row.targets):
        if target not in targets:
            raise InputError(f"{name}: there is no target {target!r}, expected one of {', '.join(targets)}")
        if 0 < targets[target] < row.joint:
            raise InputError(
                f"{name}: target {target!r} rides on link {targets[target]} and cannot see joint {row.joint} move"
            )
        if target in row.targets[:k]:
            raise InputError(f"{name}: target {target!r} stands twice")


def _check_limits(robot: Robot, plan: Plan) -> None:
    limits = np.array([joint.limits for joint in robot.joints])
    for row in plan.sweeps:
        ends = np.tile(_still(robot, plan, row), (2, 1))
        ends[:, row.joint - 1] += [row.low, row.high]
        commanded = commands_for(robot, ends)
        beyond = (commanded < limits[:, 0] - LIMIT_TOLERANCE) | (commanded > limits[:, 1] + LIMIT_TOLERANCE)
        if beyond.any():
            end, joint = np.argwhere(beyond)[0]
            told = _beyond(robot, int(joint), float(commanded[end, joint]))
            raise InputError(f"the plan's joint {row.joint}, sweep {row.sweep} {told}")


def _beyond(robot: Robot, joint: int, command: float) -> str:
    """That a command is beyond the limits of a joint, 0.., in words."""
    unit = displacement_units(bool(robot.sliding[joint]))[0]
    low, high = (from_si(float(limit), unit) for limit in robot.joints[joint].limits)
    return (
        f"commands joint {joint + 1} to {from_si(command, unit):.6g} {unit}, beyond its limits {low:.6g} to"
        f" {high:.6g} {unit}"
    )


def _still(robot: Robot, plan: Plan, row: PlannedSweep) -> Array:
    """What the motors are asked for where a sweep is held, (n,)."""
    held = row.held if row.held is not None else plan.home
    return active_commands(robot, np.zeros(robot.joint_count) if held is None else np.array(held))[0]


def _sweep_steps(robot: Robot, row: PlannedSweep, still: Array) -> list[Step]:
    along = np.zeros(robot.joint_count)
    along[row.joint - 1] = 1.0
    places = np.linspace(row.low, row.high, row.stops)
    half = (row.high - row.low) / (row.stops - 1) / 2
    commands = [tuple(c) for c in commands_for(robot, still + places[:, None] * along).tolist()]
    limits = np.array([joint.limits for joint in robot.joints])
    beyond = commands_for(robot, still + np.array([[row.low - half], [row.high + half]]) * along)
    before = np.clip(beyond, limits[:, 0], limits[:, 1]).tolist()
    steps = []
    for sense in (1, -1) if row.both_ways else (1,):
        start: tuple[float, ...] | None = tuple(before[0 if sense > 0 else 1])
        for index in range(row.stops)[::sense]:
            for target in row.targets:
                steps.append(Step(row.joint, row.sweep, index, sense, target, commands[index], start))
                start = None
    return steps
