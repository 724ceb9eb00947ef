"""Whether an event makes sense now: asked before it is written, never of what stands in a file."""

from collections.abc import Callable
from typing import Any

import numpy as np

from core.input_files import shown
from core.measurements import MOVE, POSE, SWEEP
from core.robot import Robot
from core.session_events import (
    CheckShot,
    Event,
    Judged,
    NoteWritten,
    OfStep,
    Planned,
    PosesPlanned,
    RobotChosen,
    SessionError,
    ShotTaken,
    Skipped,
    TargetsNamed,
    WentTo,
)
from core.session_plan import Plan, check_plan
from core.session_poses import PosePlan, check_pose_plan
from core.session_robot import robot_of_texts
from core.session_state import State


def check_event(state: State, event: Event) -> None:
    """Refuse an event that does not fit what the session says so far.

    Raises:
        InputError: one sentence says what does not fit, and what was expected.
    """
    check = _CHECKS.get(type(event))
    if check is not None:
        check(state, event)


def check_covariance(name: str, upper: tuple[float, ...] | None) -> None:
    """Refuse a covariance (xx, xy, xz, yy, yz, zz; m^2) that is not positive definite.

    Raises:
        SessionError: it is not.
    """
    if upper is None:
        return
    xx, xy, xz, yy, yz, zz = upper
    matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    scale = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    if not (scale >= 1e-15).all() or np.linalg.eigvalsh(matrix / np.outer(scale, scale))[0] < 1e-12:
        raise SessionError(f"{name}: the covariance is not positive definite")


def _robot(state: State, event: RobotChosen) -> None:
    robot = robot_of_texts(event.toml, tuple(event.files.items()))
    for shot in state.shots:
        _check_numbers(f"shot {shot.id}", robot, shot.taken)
    links = state.target_links
    _check_links(robot, links)
    check_plan(robot, links, state.plan)


def _targets(state: State, event: TargetsNamed) -> None:
    links = {target.name: target.link for target in event.targets}
    if len(links) < len(event.targets):
        raise SessionError("two targets have the same name, expected a name of its own for each")
    if any(not name.strip() or name != name.strip() for name in links):
        raise SessionError("the name of a target is empty or has blanks around it")
    if state.robot is not None:
        _check_links(state.robot, links)
        check_plan(state.robot, links, state.plan)
    for shot in state.shots:
        _check_target(f"shot {shot.id}", links, shot.taken)


def _check_links(robot: Robot, links: dict[str, int]) -> None:
    for name, link in links.items():
        if link > robot.joint_count:
            raise SessionError(
                f"target {name!r} rides on link {link}, expected a link 0..{robot.joint_count} of {robot.name}"
            )


def _plan(state: State, event: Planned) -> None:
    check_plan(_needed_robot(state), state.target_links, Plan(event.sweeps, event.home, event.joint_values))


def _poses(state: State, event: PosesPlanned) -> None:
    check_pose_plan(_needed_robot(state), state.target_links, PosePlan(event.wanted, event.targets))


def _shot(state: State, event: ShotTaken) -> None:
    _check_numbers("the shot", _needed_robot(state), event)
    _check_target("the shot", state.target_links, event)
    check_covariance("the shot", event.covariance_m2)
    if event.record is not None and event.record < state.next_record:
        raise SessionError(f"the shot has record {event.record}, expected {state.next_record} or a later one")
    if event.replaces is not None:
        old = state.shot(event.replaces)
        if old is None or old.superseded_by is not None:
            raise SessionError(f"the shot replaces shot {event.replaces}, which is not there or was replaced before")


def _check_numbers(name: str, robot: Robot, shot: ShotTaken) -> None:
    n = robot.joint_count
    for word in ("commanded", "approach", "speed", "torque_nm", "readback", "wanted"):
        values = getattr(shot, word)
        if (values and len(values) != n) or (word == "commanded" and not values):
            raise SessionError(f"{name}: {word} has {len(values)} values, expected {n}, one a joint of {robot.name}")
    if any(value for value, moved in zip(shot.commanded, robot.commanded, strict=True) if not moved):
        raise SessionError(f"{name} commands a passive joint, expected 0 for it")
    if shot.phase != SWEEP:
        return
    if not (1 <= shot.joint <= n and robot.commanded[shot.joint - 1]):
        raise SessionError(f"{name}: sweep of joint {shot.joint}, expected a joint 1..{n} with a motor")


def _check_target(name: str, links: dict[str, int], shot: ShotTaken) -> None:
    if shot.phase == MOVE:
        if shot.target or shot.point_m is not None:
            raise SessionError(f"{name} is a move, expected no target and no point")
        return
    if shot.target not in links:
        names = ", ".join(shown(target) for target in list(links)[:10]) or "the name of a target"
        raise SessionError(f"{name}: there is no target {shown(shot.target)}, expected one of {names}")
    if shot.phase == POSE:
        if shot.pose < 0:
            raise SessionError(f"{name} is a pose without its number, expected one of at least 0")
        return
    if shot.sweep < 1 or shot.step < 0:
        raise SessionError(
            f"{name}: sweep {shot.sweep}, step {shot.step}, expected a sweep of at least 1 and a step of at least 0"
        )
    if 0 < links[shot.target] < shot.joint:
        raise SessionError(
            f"{name}: target {shot.target!r} rides on link {links[shot.target]} and cannot see joint {shot.joint} move"
        )


def _judged(state: State, event: Judged) -> None:
    if event.verdict == "excluded" and not event.reason.strip():
        raise SessionError("a shot is left out without a reason, expected one")
    missing = set(event.shots) - {shot.id for shot in state.shots}
    if missing:
        raise SessionError(f"there is no shot {min(missing)} to be judged")


def _step(state: State, event: OfStep) -> None:
    if event.key not in {step.key for step in state.steps}:
        raise SessionError(
            f"joint {event.joint}, sweep {event.sweep}, step {event.step}, target {event.target!r}"
            " is not planned, expected a step of the plan"
        )


def _check_shot(state: State, event: CheckShot) -> None:
    if event.target not in state.target_links:
        raise SessionError(f"the check: there is no target {event.target!r}")
    check_covariance("the check", event.covariance_m2)
    before = next((check.target for check in state.checks if check.number == event.check), event.target)
    if before != event.target:
        raise SessionError(f"check {event.check} is of target {before!r}, got a shot at {event.target!r}")


def _note(state: State, event: NoteWritten) -> None:
    if event.shot is not None and state.shot(event.shot) is None:
        raise SessionError(f"there is no shot {event.shot} to write a note about")


def _needed_robot(state: State) -> Robot:
    if state.robot is None:
        raise SessionError("no robot is chosen yet, expected one before plan and shots")
    return state.robot


_CHECKS: dict[type[Event], Callable[[State, Any], None]] = {
    RobotChosen: _robot,
    TargetsNamed: _targets,
    Planned: _plan,
    PosesPlanned: _poses,
    ShotTaken: _shot,
    Judged: _judged,
    Skipped: _step,
    WentTo: _step,
    CheckShot: _check_shot,
    NoteWritten: _note,
}
