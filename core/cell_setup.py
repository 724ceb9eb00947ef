"""Setting up a cell: a new session on a robot, and changes of targets and sweeps that leave a plan that can be made.

What an operator changes may not pull the ground from under what is planned: sweeps and test poses that a change makes
impossible are taken out first, in events of their own, so that an undo brings them back.
"""

import msgspec
import numpy as np

from core.errors import InputError
from core.geometry import Array
from core.input_files import shown
from core.kinematics import active_commands
from core.robot import Robot
from core.session_events import (
    Event,
    Fact,
    InstrumentChosen,
    Planned,
    PosesPlanned,
    RobotChosen,
    TargetEntry,
    TargetsNamed,
    Titled,
)
from core.session_plan import PlannedSweep
from core.session_state import State
from core.suggested_plan import suggested_sweeps, suggested_targets
from core.units import displacement_units, to_si

COMMAND_LIMIT = 1e6


def new_cell_events(chosen: RobotChosen, robot: Robot, title: str, instrument: InstrumentChosen) -> list[Event]:
    """What a session on a robot begins with: suggested targets and sweeps, to be changed to what is really there."""
    targets = suggested_targets(robot)
    sweeps = suggested_sweeps(robot, {target.name: target.link for target in targets})
    return [Titled(title), chosen, TargetsNamed(targets), instrument, Planned(sweeps)]


def same_cell_events(state: State) -> list[Event]:
    """What a session on the same robot, targets, instrument, plan and facts as another begins with; no shots.

    Raises:
        InputError: that session has no robot.
    """
    if not state.robot_toml:
        raise InputError("this session has no robot, expected one to begin another with")
    events: list[Event] = [Titled(state.title), RobotChosen(state.robot_toml, dict(state.robot_files))]
    events.append(TargetsNamed(tuple(TargetEntry(t.name, t.link, t.point_m, t.sigma_m) for t in state.targets)))
    events.append(InstrumentChosen(state.instrument.kind, state.instrument.sigma_m, state.instrument.description))
    events.append(Planned(state.plan.sweeps, state.plan.home, state.plan.joint_values))
    if state.poses.wanted:
        events.append(PosesPlanned(state.poses.wanted, state.poses.targets))
    return events + [Fact(key, value) for key, value in state.facts.items()]


def changed_targets(state: State, targets: tuple[TargetEntry, ...]) -> list[Event]:
    """The events that give a session these targets, after what they make impossible was taken out of the plan.

    Raises:
        InputError: no target is left.
    """
    if not targets:
        raise InputError("the last target cannot be removed, expected at least one")
    links = {target.name: target.link for target in targets}
    sweeps = tuple(row for row in (_seen(row, links) for row in state.plan.sweeps) if row is not None)
    events: list[Event] = []
    if sweeps != state.plan.sweeps:
        events.append(Planned(sweeps, state.plan.home, state.plan.joint_values))
    last = 0 if state.robot is None else state.robot.joint_count
    if any(links.get(name) != last for name in state.poses.targets):
        events.append(PosesPlanned((), ()))
    return [*events, TargetsNamed(targets)]


def changed_sweeps(state: State, sweeps: tuple[PlannedSweep, ...]) -> list[Event]:
    """The event that gives a session these sweeps; the last joint's come first."""
    ordered = tuple(sorted(sweeps, key=lambda row: (-row.joint, row.sweep)))
    return [Planned(ordered, state.plan.home, state.plan.joint_values)]


def planned_sweep(
    state: State,
    joint: int,
    sweep: int,
    ends: tuple[float, float],
    stops: int,
    targets: tuple[str, ...],
    both_ways: bool,
    held: tuple[float, ...] | None,
) -> PlannedSweep:
    """A sweep as an operator enters it.

    Args:
        joint: that is swept, 1..n.
        ends: its command at both ends, rad or m.
        held: commands of all joints about which it is made, rad or m, (n,); None: home.

    Raises:
        InputError: there is no such joint, or too few stops.
    """
    robot = state.robot
    if robot is None or not 1 <= joint <= robot.joint_count:
        raise InputError(f"joint {joint}, expected one of the robot's joints")
    if not 2 <= stops <= 10_000:
        raise InputError(f"{stops} stops, expected 2 to 10000")
    if not targets:
        raise InputError(f"joint {joint}: no target, expected the name of at least one")
    where = held if held is not None else state.plan.home
    at = np.zeros(robot.joint_count) if where is None else np.array(where)
    low, high = sorted(end - at[joint - 1] for end in ends)
    return PlannedSweep(joint, sweep, float(low), float(high), stops, targets, both_ways, held)


def ends_of(robot: Robot, state: State, row: PlannedSweep) -> tuple[float, float]:
    """The commands of the swept joint at both ends of a sweep, rad or m."""
    held = row.held if row.held is not None else state.plan.home
    at = 0.0 if held is None else held[row.joint - 1]
    return at + row.low, at + row.high


def commands_of_text(robot: Robot, text: str, what: str) -> tuple[float, ...] | None:
    """Commands of all joints that somebody typed, in degrees and millimetres, as rad and m, (n,); None: nothing typed.

    Args:
        what: they are, for the message.

    Raises:
        InputError: they are not one number a joint, or not within the limits.
    """
    words = text.replace(",", " ").replace(";", " ").split()
    if not words:
        return None
    if len(words) != robot.joint_count:
        raise InputError(f"{what}: {len(words)} numbers, expected {robot.joint_count}, one a joint, or nothing")
    return tuple(_command(robot, k, word, what) for k, word in enumerate(words))


def text_of_commands(robot: Robot, commands: tuple[float, ...] | Array | None) -> str:
    """The same the other way round."""
    if commands is None:
        return ""
    scales = [to_si(1.0, displacement_units(joint.slides)[0]) for joint in robot.joints]
    return " ".join(f"{value / scale:.6g}" for value, scale in zip(commands, scales, strict=True))


def home_events(state: State, home: tuple[float, ...] | None) -> list[Event]:
    """The event that sets the commands at the arm's marks; the motors of the sweeps go where they went.

    Raises:
        InputError: there is no robot.
    """
    robot = state.robot
    if robot is None:
        raise InputError("no robot is chosen yet, expected one before its home")
    zero = (0.0,) * robot.joint_count
    before = active_commands(robot, np.array(state.plan.home or zero))[0]
    after = active_commands(robot, np.array(home or zero))[0]
    sweeps = tuple(row if row.held is not None else _moved(row, before, after) for row in state.plan.sweeps)
    return [Planned(sweeps, home, state.plan.joint_values)]


def _moved(row: PlannedSweep, before: Array, after: Array) -> PlannedSweep:
    shift = float(before[row.joint - 1] - after[row.joint - 1])
    return _with(row, low=row.low + shift, high=row.high + shift)


def _with(row: PlannedSweep, **changes: object) -> PlannedSweep:
    return msgspec.structs.replace(row, **changes)


def _seen(row: PlannedSweep, links: dict[str, int]) -> PlannedSweep | None:
    """A sweep with those of its targets that are there and see it; None: none is left."""
    names = tuple(name for name in row.targets if name in links and not 0 < links[name] < row.joint)
    if names == row.targets:
        return row
    return _with(row, targets=names) if names else None


def _command(robot: Robot, k: int, word: str, what: str) -> float:
    unit = displacement_units(robot.joints[k].slides)[0]
    try:
        value = to_si(float(word), unit)
    except ValueError:
        value = float("nan")
    low, high = robot.joints[k].limits
    if not (abs(value) <= COMMAND_LIMIT and low - 1e-9 <= value <= high + 1e-9):
        scale = to_si(1.0, unit)
        limits = f"{low / scale:.6g} to {high / scale:.6g} {unit}"
        raise InputError(f"{what}: joint {k + 1} = {shown(word)}, expected a number from {limits}")
    return value
