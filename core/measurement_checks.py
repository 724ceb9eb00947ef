"""What the rows of a campaign must agree on: records, joints, limits, and which target can see which joint."""

from collections.abc import Sequence

import numpy as np

from core.geometry import Array
from core.input_files import shown
from core.measurement_columns import Columns
from core.measurements import Target
from core.robot import Robot
from core.text_table import TextTable
from core.units import from_si

LIMIT_TOLERANCE = 1e-9
"""How far a command may exceed a joint limit, rad or m: rounding in the file, no more."""


def check_records(table: TextTable, record: np.ndarray) -> None:
    """Refuse a record number that stands twice."""
    order = np.argsort(record, kind="stable")
    again = np.flatnonzero(np.diff(record[order]) == 0)
    if len(again):
        first, second = (int(row) for row in order[again[0] : again[0] + 2])
        raise table.wrong(second, "record", f"a number of its own (row {table.lines[first]} has it too)")


def check_sweeps(table: TextTable, robot: Robot, joint: np.ndarray, swept: np.ndarray) -> None:
    """Refuse sweeps of a joint that the robot does not have, or that nothing commands."""
    there = (joint >= 1) & (joint <= robot.joint_count)
    table.check("joint", swept & ~there, f"a joint 1..{robot.joint_count}")
    passive = swept & ~robot.commanded[np.where(there, joint, 1) - 1]
    table.check("joint", passive, "a joint with a motor (this one is passive)")


def check_targets(table: TextTable, targets: Sequence[Target], joint: np.ndarray, target: np.ndarray) -> None:
    """Refuse a sweep's target on a link before the swept joint: it cannot see that joint; the floor is a watch."""
    link = np.array([*(t.link for t in targets), 0])[target]
    blind = (joint > 0) & (link > 0) & (link < joint)
    if blind.any():
        row = int(np.argmax(blind))
        raise table.failed(
            row,
            f"column target: {shown(targets[target[row]].name)} rides on link {link[row]} and cannot see joint"
            f" {joint[row]} move, expected a target on link {joint[row]} or beyond, or on link 0",
        )


def check_limits(columns: Columns, robot: Robot, commanded: Array) -> None:
    """Refuse commands beyond the joint limits, telling both in the column's own unit."""
    for i in np.flatnonzero(robot.commanded):
        low, high = robot.joints[i].limits
        beyond = (commanded[:, i] < low - LIMIT_TOLERANCE) | (commanded[:, i] > high + LIMIT_TOLERANCE)
        if beyond.any():
            base = f"q{i + 1}"
            name = columns.name(base)
            unit = name[len(base) + 1 :]
            limits = f"{from_si(low, unit):.9g} to {from_si(high, unit):.9g} {unit}"
            columns.table.check(name, beyond, f"a value within the limits of joint {i + 1}, {limits}")
