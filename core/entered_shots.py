"""Coordinates from a person or a file -> shots of the sweep at hand, each at the step that it belongs to.

Typed lines go to the open steps in their order. Rows of a CSV file go to the open steps of the target that they name;
where they carry the joint's displacement it must be the step's, so that points of another sweep are noticed.
"""

from pathlib import Path

import numpy as np

from core.errors import InputError
from core.instruments import Reading
from core.point_lines import EnteredPoint
from core.points_file import PlainSweep, read_points
from core.session_conditions import Conditions
from core.session_events import SessionError, ShotTaken
from core.session_plan import Step
from core.session_shots import shot_at
from core.session_state import State
from core.units import displacement_units, from_si

SAME_DISPLACEMENT = {False: np.deg2rad(0.05), True: 5e-5}
"""How far a file's displacement may be from the step's, rad or m: rounding of whoever wrote it (sliding: True)."""


def open_steps(state: State) -> tuple[Step, ...]:
    """The steps of the sweep at hand that are still to be done, from the next one on."""
    if state.position is None:
        return ()
    now = state.steps[state.position]
    closed = state.done | state.skipped.keys()
    here = [s for s in state.steps[state.position :] if (s.joint, s.sweep) == (now.joint, now.sweep)]
    return tuple(step for step in here if step.key not in closed)


def shots_of_lines(state: State, points: tuple[EnteredPoint, ...], conditions: Conditions) -> list[ShotTaken]:
    """Shots of the next open steps, one a line.

    Raises:
        InputError: there are no lines, or more of them than open steps.
    """
    steps = open_steps(state)
    if not points:
        raise InputError("no coordinates were entered, expected a line x y z for each shot")
    if len(points) > len(steps):
        raise InputError(_too_many(f"{len(points)} lines of coordinates", state, len(steps)))
    return [_shot(step, Reading(point.point_m), conditions) for step, point in zip(steps, points, strict=False)]


def shots_of_file(state: State, path: Path, conditions: Conditions) -> list[ShotTaken]:
    """Shots of the open steps from a CSV file; see ``core.points_file.read_points`` for its columns.

    Raises:
        InputError: the file cannot be read, names a target that this sweep does not watch, has too many points of one,
            or displacements that are not those of the steps.
    """
    table = read_points(path)
    by_target: dict[str, list[Step]] = {}
    for step in open_steps(state):
        by_target.setdefault(step.target, []).append(step)
    shots = []
    for row in range(len(table.point_m)):
        name = _target_of(table, row, by_target)
        if not by_target[name]:
            raise InputError(_too_many(f"{path.name} has more points of target {name!r}", state, 0))
        step = _taken(table, row, by_target[name], state, path)
        shots.append(_shot(step, _reading(table, row), conditions))
    return shots


def _shot(step: Step, reading: Reading, conditions: Conditions) -> ShotTaken:
    return shot_at(step, conditions.noted(reading), payload_kg=conditions.payload_kg)


def _taken(table: PlainSweep, row: int, steps: list[Step], state: State, path: Path) -> Step:
    """The step of a row: the next one, or the one at its displacement; it is taken off the list."""
    if table.commanded is None or state.robot is None:
        return steps.pop(0)
    joint = steps[0].joint
    slides = bool(state.robot.sliding[joint - 1])
    asked = np.array([step.commanded[joint - 1] for step in steps])
    near = int(np.argmin(np.abs(asked - table.commanded[row])))
    if table.sliding != slides or abs(asked[near] - table.commanded[row]) > SAME_DISPLACEMENT[slides]:
        unit = displacement_units(slides)[0]
        wanted, said = (from_si(float(value), unit) for value in (asked[near], table.commanded[row]))
        raise InputError(
            f"{path.name}, point {row + 1}: joint {joint} at {said:.6g}, but the nearest open stop is at {wanted:.6g}"
            f" {unit}; expected the points of this sweep"
        )
    return steps.pop(near)


def _target_of(table: PlainSweep, row: int, by_target: dict[str, list[Step]]) -> str:
    names = list(by_target)
    if len(table.target_names) == 1 and len(names) == 1 and table.target_names[0] == "target":
        return names[0]
    name = table.target_names[table.target[row]]
    if name not in by_target:
        raise InputError(
            f"point {row + 1}: target {name!r} is not watched in this sweep, or all its stops are done; expected "
            f"{' or '.join(names) or 'no more points'}"
        )
    return name


def _reading(table: PlainSweep, row: int) -> Reading:
    sigma = None if table.sigma_m is None or np.isnan(table.sigma_m[row]) else float(table.sigma_m[row])
    covariance = None if sigma is None else (sigma**2, 0.0, 0.0, sigma**2, 0.0, sigma**2)
    return Reading(tuple(table.point_m[row]), covariance)


def _too_many(what: str, state: State, left: int) -> str:
    step = state.next_step
    if step is None:
        raise SessionError("every planned shot is done; plan more sweeps to enter more points")
    stops = f"{left} shots" if left != 1 else "1 shot"
    return f"{what}, but {stops} of joint {step.joint}, sweep {step.sweep} are still to do; expected no more than that"
