"""Targets and sweeps to begin with on any robot: what table 1 of the paper does, put as a rule.

The last joint comes first. A joint is watched by a target far out on the arm; where its motor drives the next joint
through a linkage, one target rides on the link itself, which moves with nothing else, and a second one beyond it shows
the passive motion.
"""

import numpy as np

from core.robot import Robot
from core.session_events import TargetEntry
from core.session_plan import PlannedSweep
from core.units import displacement_units, to_si

SPAN_RAD, SPAN_M = np.deg2rad(50.0), 0.2
STOPS = 16
MARGIN = 0.05
"""Share of a joint's range that is left to the robot's own stops at each end."""


def suggested_targets(robot: Robot) -> tuple[TargetEntry, ...]:
    """One target on the last link, and one on each link whose motor drives the next joint."""
    n = robot.joint_count
    links = [n, *(link for link in range(n - 1, 0, -1) if robot.coupling_from(link) is not None)]
    return tuple(TargetEntry(f"T{k}", link) for k, link in enumerate(links, 1))


def suggested_sweeps(robot: Robot, links: dict[str, int]) -> tuple[PlannedSweep, ...]:
    """One sweep a joint, the last joint first, with the targets (name: link) that show it; see ``unseen_joints``."""
    held = held_place(robot)
    sweeps = []
    for joint in _swept(robot):
        targets = targets_for(robot, joint, links)
        if targets:
            low, high = _ends(robot, joint, 0.0 if held is None else held[joint - 1])
            sweeps.append(PlannedSweep(joint, 1, low, high, STOPS, targets, held=held))
    return tuple(sweeps)


def unseen_joints(robot: Robot, links: dict[str, int]) -> tuple[str, ...]:
    """A sentence for each joint that no target (name: link) shows, with the target that would."""
    sentences = []
    for joint in _swept(robot):
        if not targets_for(robot, joint, links):
            exactly = robot.coupling_from(joint) is not None
            where = (
                f"link {joint} itself, because its motor moves joint {joint + 1} too" if exactly else f"link {joint}"
            )
            beyond = "" if exactly or joint == robot.joint_count else " or beyond"
            sentences.append(f"joint {joint} is seen by no target, expected one on {where}{beyond}")
    return tuple(sentences)


def targets_for(robot: Robot, joint: int, links: dict[str, int]) -> tuple[str, ...]:
    """The targets that show a joint: the furthest one, or one on its own link and the next one beyond; may be none."""
    beyond = {name: link for name, link in links.items() if link > joint}
    own = next((name for name, link in links.items() if link == joint), None)
    if robot.coupling_from(joint) is None:
        return (max(beyond, key=lambda name: beyond[name]),) if beyond else (() if own is None else (own,))
    if own is None:
        return ()
    return (own, min(beyond, key=lambda name: beyond[name])) if beyond else (own,)


def held_place(robot: Robot) -> tuple[float, ...] | None:
    """Where all joints wait while one is swept, rad or m, (n,): zero, or mid-range where zero is out of reach.

    None: zero for all.
    """
    limits = np.array([joint.limits for joint in robot.joints])
    inside = (limits[:, 0] <= 0) & (limits[:, 1] >= 0)
    if inside.all():
        return None
    middle = np.where(np.isfinite(limits), limits, 0.0).mean(axis=1)
    return tuple(np.where(inside, 0.0, [_round(robot, k, at, 1.0) for k, at in enumerate(middle)]).tolist())


def _swept(robot: Robot) -> list[int]:
    """Joints with a motor, the last one first."""
    return [joint for joint in range(robot.joint_count, 0, -1) if robot.commanded[joint - 1]]


def _ends(robot: Robot, joint: int, held: float) -> tuple[float, float]:
    """How far a joint is swept to both sides of where it is held, rad or m, within its limits."""
    low, high = (limit - held for limit in robot.joints[joint - 1].limits)
    margin = MARGIN * (high - low) if np.isfinite(high - low) else 0.0
    low, high = low + margin, high - margin
    span = min(SPAN_M if robot.sliding[joint - 1] else SPAN_RAD, high - low)
    middle = float(np.clip(0.0, low + span / 2, high - span / 2))
    return _round(robot, joint - 1, middle - span / 2, 0.1), _round(robot, joint - 1, middle + span / 2, 0.1)


def _round(robot: Robot, k: int, value: float, unit: float) -> float:
    """A displacement of joint k (0..) as a person would write it, to a multiple of ``unit`` degrees or millimetres."""
    scale = to_si(unit, displacement_units(bool(robot.sliding[k]))[0])
    return float(np.round(value / scale) * scale)
