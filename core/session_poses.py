"""Poses at which the arm is verified: what is wanted, which targets show it, and how new ones are chosen.

A pose is wanted as the commands with which the nominal arm would take it. The operator sends these, or the compensated
commands that the calibration makes of them, and looks how far the tool ends from where the nominal arm would have it.
"""

from dataclasses import dataclass

import numpy as np

from core.errors import InputError
from core.geometry import Array
from core.kinematics import active_commands
from core.robot import Robot
from core.session_plan import LIMIT_TOLERANCE, Plan, commands_for
from core.units import displacement_units, from_si

MOST_POSES = 1000
SHARE = 0.8
"""New poses stay within this share of each swept range, so that compensated commands stay within limits as well."""


@dataclass(frozen=True)
class PosePlan:
    """The poses to be verified, in their order."""

    wanted: tuple[tuple[float, ...], ...] = ()
    """Commands of the nominal arm, rad or m, (n,) each."""
    targets: tuple[str, ...] = ()
    """Seen at each pose; three or more of them, not on one line, show the whole pose."""


def check_pose_plan(robot: Robot, links: dict[str, int], plan: PosePlan) -> None:
    """Refuse poses that this robot cannot be sent to or these targets (name: link) cannot show.

    Raises:
        InputError: one sentence says which pose and why.
    """
    n = robot.joint_count
    if plan.wanted and not plan.targets:
        raise InputError("poses are planned without a target to be seen at them, expected at least one")
    for name in plan.targets:
        if links.get(name) != n:
            on_last = ", ".join(t for t, link in links.items() if link == n) or "none is there"
            raise InputError(f"target {name!r} does not show the tool, expected one on link {n}: {on_last}")
    if len(set(plan.targets)) < len(plan.targets):
        raise InputError("a target stands twice among those of the poses")
    for number, wanted in enumerate(plan.wanted, 1):
        if len(wanted) != n:
            raise InputError(f"pose {number} has {len(wanted)} commands, expected {n}, one a joint of {robot.name}")
        _check_limits(robot, number, np.array(wanted))


def new_poses(robot: Robot, plan: Plan, count: int, seed: int) -> tuple[tuple[float, ...], ...]:
    """Poses at random within the ranges of the planned sweeps, where a calibration has seen the arm.

    Args:
        robot: of the session.
        plan: its sweeps; joints without one stay at home.
        count: how many poses.
        seed: of the random numbers.

    Raises:
        InputError: no sweep is planned, or the number is not 1..1000.
    """
    if not 1 <= count <= MOST_POSES:
        raise InputError(f"{count} poses, expected 1 to {MOST_POSES}")
    if not plan.sweeps:
        raise InputError("no sweep is planned, expected some that say how far each joint may move")
    home = active_commands(robot, np.zeros(robot.joint_count) if plan.home is None else np.array(plan.home))
    low, high = _swept_ranges(robot, plan, home[0])
    middle, half = (low + high) / 2, SHARE * (high - low) / 2
    moved = np.random.default_rng(seed).uniform(middle - half, middle + half, (count, robot.joint_count))
    commanded = commands_for(robot, home + moved)
    # Joints that follow one another may leave their limits together where none does alone.
    limits = np.array([joint.limits for joint in robot.joints])
    return tuple(tuple(row) for row in np.clip(commanded, limits[:, 0], limits[:, 1]).tolist())


def _check_limits(robot: Robot, number: int, commanded: Array) -> None:
    for i in np.flatnonzero(robot.commanded):
        low, high = robot.joints[i].limits
        if not low - LIMIT_TOLERANCE <= commanded[i] <= high + LIMIT_TOLERANCE:
            unit = displacement_units(robot.joints[i].slides)[0]
            there, low, high = (from_si(float(value), unit) for value in (commanded[i], low, high))
            raise InputError(
                f"pose {number} commands joint {i + 1} to {there:.6g} {unit}, beyond its limits {low:.6g} to "
                f"{high:.6g} {unit}"
            )


def _swept_ranges(robot: Robot, plan: Plan, home: Array) -> tuple[Array, Array]:
    """How far from home the sweeps bring each motor at least and at most, (n,) each; without one it stays as held."""
    held = [home if row.held is None else active_commands(robot, np.array(row.held))[0] for row in plan.sweeps]
    ranges: dict[int, list[float]] = {}
    for row, still in zip(plan.sweeps, held, strict=True):
        k = row.joint - 1
        ranges.setdefault(k, []).extend(float(still[k] - home[k]) + end for end in (row.low, row.high))
    rest = held[0] - home
    ends = [(min(ranges[k]), max(ranges[k])) if k in ranges else (rest[k], rest[k]) for k in range(robot.joint_count)]
    low, high = np.array(ends).T
    return low, high
