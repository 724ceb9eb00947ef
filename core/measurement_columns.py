"""Which column of measurements.csv holds which quantity, and in which unit.

A quantity is a base name and a unit, as in ``q1_deg``. Columns that nobody knows are left alone, unless they look
like a known quantity whose unit is missing, unsuitable or misspelt: then silence would lose data.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from core.errors import CampaignError
from core.geometry import Array
from core.robot import Robot
from core.text_table import TextTable
from core.units import LENGTH, SCALES, UNIT_WORDS, displacement_units, speed_units

PLAIN = ("record", "phase", "joint", "sweep", "step", "pose", "use", "approach", "target")
QUATERNION = ("target_qw", "target_qx", "target_qy", "target_qz")
POINT, SIMULATED = ("x", "y", "z"), ("sim_x", "sim_y", "sim_z")
COVARIANCE = ("cov_xx", "cov_xy", "cov_xz", "cov_yy", "cov_yz", "cov_zz")
_NUMBERED = re.compile(r"(q|speed|tau|read|want|approach)(\d{1,6})(?:_(.*))?", re.ASCII)


@dataclass(frozen=True)
class Columns:
    """The columns of a table, found by quantity."""

    table: TextTable
    names: dict[str, str]
    """Full column name of each quantity that the table has, by base name."""
    units: dict[str, tuple[str, ...]]
    """Units that each quantity may have, by base name."""

    def __contains__(self, base: str) -> bool:
        return base in self.names

    def name(self, base: str) -> str:
        """The full name of a quantity's column.

        Raises:
            CampaignError: the table has no such column.
        """
        if base not in self.names:
            raise CampaignError(f"{self.table.path}, row 1: column {self.expected(base)} is missing")
        return self.names[base]

    def si(self, base: str) -> Array:
        """A column in SI units, NaN where a cell is empty, shape (rows,)."""
        name = self.name(base)
        return self.table.numbers(name) * SCALES[name[len(base) + 1 :]]

    def together(self, bases: tuple[str, ...]) -> Array | None:
        """Columns that are given together or not at all, in SI units, (rows, k); None where the table has none.

        Raises:
            CampaignError: only some of the columns are there, or only some of the cells of a row are filled.
        """
        if not any(base in self for base in bases):
            return None
        values = np.stack([self.si(base) for base in bases], axis=1)
        empty = np.isnan(values)
        partly = empty.any(axis=1) & ~empty.all(axis=1)
        if partly.any():
            row = int(np.argmax(partly))
            names = [self.name(base) for base in bases]
            raise self.table.wrong(
                row,
                names[int(np.argmax(empty[row]))],
                f"a number, as {', '.join(names)} go together, or all of them empty",
            )
        return values

    def any_of(self, bases: Iterable[str]) -> bool:
        return any(base in self for base in bases)

    def expected(self, base: str) -> str:
        """How the column of a quantity may be called."""
        return " or ".join(f"{base}_{unit}" for unit in self.units[base])


def find_columns(table: TextTable, robot: Robot) -> Columns:
    """The columns of a campaign's measurements on a robot.

    Raises:
        CampaignError: a known quantity lacks its unit, has an unsuitable one, stands twice, or belongs to a joint
            that the robot does not have.
    """
    units = _campaign_units(robot)
    plain = {*PLAIN, *QUATERNION, *(f"approach{joint}" for joint in range(1, robot.joint_count + 1))}
    for name in table.columns:
        if name not in plain:
            _check_joint(table, name.lower(), robot)
    return match_columns(table, units, plain)


def match_columns(table: TextTable, units: dict[str, tuple[str, ...]], plain: set[str]) -> Columns:
    """The columns that hold given quantities.

    Args:
        units: base name of each quantity and the units that it may have.
        plain: names that stand for themselves.

    Raises:
        CampaignError: a known quantity lacks its unit, has an unsuitable one or stands twice.
    """
    full = {f"{base}_{unit}": base for base, allowed in units.items() for unit in allowed}
    columns = Columns(table, {}, units)
    for name in table.columns:
        base = full.get(name)
        if base is None:
            if name not in plain:
                _check_near_miss(columns, name, full, plain)
        elif base in columns.names:
            raise CampaignError(f"{table.path}, row 1: columns {columns.names[base]} and {name} both give {base}")
        else:
            columns.names[base] = name
    return columns


def _campaign_units(robot: Robot) -> dict[str, tuple[str, ...]]:
    units: dict[str, tuple[str, ...]] = {base: LENGTH for base in (*POINT, *SIMULATED, "sigma")}
    units |= {"time": ("s",), "temperature": ("c",), "arm_temperature": ("c",), "payload": ("kg",)}
    units |= {base: ("mm2",) for base in COVARIANCE}
    for number, joint in enumerate(robot.joints, 1):
        if robot.commanded[number - 1]:
            units[f"q{number}"] = displacement_units(joint.slides)
        units[f"read{number}"] = units[f"want{number}"] = displacement_units(joint.slides)
        units[f"speed{number}"] = speed_units(joint.slides)
        units[f"tau{number}"] = ("n",) if joint.slides else ("nm",)
    return units


def _check_joint(table: TextTable, name: str, robot: Robot) -> None:
    """Refuse a numbered column of a joint that the robot does not have, or that takes no command."""
    found = _NUMBERED.fullmatch(name)
    if not found or (found[3] is not None and found[3] not in UNIT_WORDS):
        return
    joint = int(found[2])
    if not 1 <= joint <= robot.joint_count:
        raise CampaignError(
            f"{table.path}, row 1: column {name} belongs to joint {joint}, expected joints 1..{robot.joint_count}"
        )
    if found[1] == "q" and not robot.commanded[joint - 1]:
        raise CampaignError(f"{table.path}, row 1: column {name}: joint {joint} is passive and has no q column")


def _check_near_miss(columns: Columns, name: str, full: dict[str, str], plain: set[str]) -> None:
    """Refuse a column that is a known one but for its unit or its capitals; leave the others alone."""
    low = name.lower()
    if low in full or low in plain:
        raise CampaignError(f"{columns.table.path}, row 1: column {name} is spelt otherwise, expected {low}")
    if low in columns.units:
        raise CampaignError(
            f"{columns.table.path}, row 1: column {name} has no unit in its name, expected {columns.expected(low)}"
        )
    for base in columns.units:
        if low.startswith(f"{base}_") and low[len(base) + 1 :] in UNIT_WORDS:
            raise CampaignError(
                f"{columns.table.path}, row 1: column {name} has an unsuitable unit, expected {columns.expected(base)}"
            )
