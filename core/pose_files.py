"""Poses as CSV files: those that are wanted, and those to be commanded instead.

Columns, units in their names:

    pose                    what the pose is called; optional, else its number in the file
    x_mm, y_mm, z_mm        where the tool's origin is to be (or _m)
    qw, qx, qy, qz          its orientation as a unit quaternion, or
    rx_deg, ry_deg, rz_deg  as turns about the fixed axes x, then y, then z: Rz(rz) Ry(ry) Rx(rx) (or _rad)
    q1_deg, q2_deg, ...     joint values near which the arm is to take the pose: the branch (_rad; _mm, _m); optional

Other columns are left alone.
"""

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from core.errors import CampaignError
from core.geometry import Array
from core.input_files import decoded
from core.measurement_columns import POINT, Columns, match_columns
from core.robot import Robot
from core.rotations import quaternions, rotations_of_quaternions, rotations_of_turns, turns_of_rotations
from core.text_table import TextTable, read_text_table, text_table
from core.units import ANGLE, LENGTH, displacement_units, from_si

QUATERNION = ("qw", "qx", "qy", "qz")
TURNS = ("rx", "ry", "rz")
_JOINT_COLUMN = re.compile(r"q\d+(?=_|$)", re.ASCII)
LARGEST_BYTES = 8_000_000
"""Of poses that come through a browser."""
UNIT_SLACK = 1e-3
"""A quaternion longer or shorter than 1 by more than this is a mistake and not rounding."""


@dataclass(frozen=True)
class PoseTable:
    """Poses of a file, with how they were written."""

    path: Path
    names: tuple[str, ...]
    """What each pose is called, (m,)."""
    lines: tuple[int, ...]
    """The line of the file that each stands on, (m,)."""
    poses: Array
    """From the tool to the frame in which they are given, (m, 4, 4), m."""
    near: Array | None
    """Commands near which the arm is to take each pose, rad or m, (m, n); None: not given."""
    units: dict[str, str]
    """Unit of each column that has one, by its base name, in the order in which they are written."""
    quaternion: Array | None
    """The quaternions as they were given, (m, 4); None: the orientations were given as turns."""


def read_poses(path: Path | str, robot: Robot) -> PoseTable:
    """The poses of a CSV file.

    Raises:
        CampaignError: a column or a cell is not as expected; the message names row, column and value.
    """
    return _poses(read_text_table(Path(path), "a pose")[0], robot)


def poses_of_bytes(data: bytes, name: str, robot: Robot) -> PoseTable:
    """The poses of a CSV file that was sent or pasted; cells may be parted by tabs, as spreadsheets copy them.

    Args:
        data: the bytes of the file.
        name: what messages call it.
        robot: tells which joints have a command, and their units.

    Raises:
        CampaignError: it is too large, or as for ``read_poses``.
    """
    if len(data) > LARGEST_BYTES:
        raise CampaignError(f"{name} has {len(data) / 1e6:.1f} MB, expected at most {LARGEST_BYTES / 1e6:g} MB")
    source = decoded(Path(name), data, CampaignError)
    head = source.text.partition("\n")[0]
    if "\t" in head and "," not in head:
        source = replace(source, text=source.text.replace("\t", ","))
    return _poses(text_table(source, "a pose"), robot)


def _poses(table: TextTable, robot: Robot) -> PoseTable:
    moving = {f"q{i + 1}": displacement_units(robot.joints[i].slides) for i in np.flatnonzero(robot.commanded)}
    units = {**{base: LENGTH for base in POINT}, **{base: ANGLE for base in TURNS}, **moving}
    _require_known_joints(table, robot)
    columns = match_columns(table, units, {"pose", *QUATERNION})
    place = _numbers(columns, POINT)
    rotation, quaternion = _orientations(columns)
    poses = np.zeros((table.count, 4, 4))
    poses[:, :3, :3], poses[:, :3, 3], poses[:, 3, 3] = rotation, place, 1.0
    written = (*POINT, *(TURNS if quaternion is None else ()))
    return PoseTable(
        path=table.path,
        names=_names(table),
        lines=tuple(table.lines),
        poses=poses,
        near=_near(columns, tuple(moving), robot),
        units={base: columns.name(base)[len(base) + 1 :] for base in written},
        quaternion=quaternion,
    )


def poses_csv(table: PoseTable, robot: Robot, poses: Array, commanded: Array, status: Sequence[str]) -> str:
    """Poses to be commanded, in the columns of the table that asked for them, with joint commands and a status.

    Args:
        table: the poses that were asked for.
        robot: tells which joints have a command, and their units.
        poses: to be commanded, (m, 4, 4); a row that holds NaN is left empty.
        commanded: the joint commands, (m, n), rad or m.
        status: of each pose.
    """
    motors = np.flatnonzero(robot.commanded)
    joint_units = [displacement_units(robot.joints[i].slides)[0] for i in motors]
    angles = QUATERNION if table.quaternion is not None else tuple(f"{base}_{table.units[base]}" for base in TURNS)
    header = ["pose", *(f"{base}_{table.units[base]}" for base in POINT), *angles]
    header += [*(f"q{i + 1}_{unit}" for i, unit in zip(motors, joint_units, strict=True)), "status"]
    given = ~np.isnan(poses).any(axis=(1, 2))
    cells = np.full((len(poses), len(header) - 2), "", dtype=object)
    values = [
        *(from_si(poses[given, k, 3], table.units[base]) for k, base in enumerate(POINT)),
        *_written(table, poses[given, :3, :3], given),
        *(from_si(commanded[given, i], unit) for i, unit in zip(motors, joint_units, strict=True)),
    ]
    for k, column in enumerate(values):
        cells[given, k] = [f"{value + 0.0:.15g}" for value in column]
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(header)
    writer.writerows([name, *row, said] for name, row, said in zip(table.names, cells, status, strict=True))
    return out.getvalue()


def wanted_csv(names: Sequence[str], robot: Robot, poses: Array, near: Array) -> str:
    """Wanted poses in mm with quaternions, and the joint values near which the arm is to take them.

    Args:
        names: what each pose is called.
        robot: tells which joints have a command, and their units.
        poses: from the tool to the frame in which they are given, (m, 4, 4), m.
        near: commands, (m, n), rad or m.
    """
    motors = np.flatnonzero(robot.commanded)
    units = [displacement_units(robot.joints[i].slides)[0] for i in motors]
    header = ["pose", *(f"{base}_mm" for base in POINT), *QUATERNION]
    header += [f"q{i + 1}_{unit}" for i, unit in zip(motors, units, strict=True)]
    columns = [from_si(poses[:, k, 3], "mm") for k in range(3)] + list(quaternions(poses[:, :3, :3]).T)
    columns += [from_si(near[:, i], unit) for i, unit in zip(motors, units, strict=True)]
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(header)
    for name, row in zip(names, np.stack(columns, axis=1).tolist(), strict=True):
        writer.writerow([name, *(f"{value + 0.0:.12g}" for value in row)])
    return out.getvalue()


def _written(table: PoseTable, rotations: Array, given: np.ndarray) -> list[Array]:
    """Columns of orientations as the table has them; of two quaternions the one nearer to what was asked for."""
    if table.quaternion is None:
        turns = turns_of_rotations(rotations).T
        return [from_si(turn, table.units[base]) for turn, base in zip(turns, TURNS, strict=True)]
    found = quaternions(rotations)
    side = np.einsum("mi,mi->m", found, table.quaternion[given])
    return list((found * np.where(side < 0, -1.0, 1.0)[:, None]).T)


def _numbers(columns: Columns, bases: tuple[str, ...]) -> Array:
    """Columns that have to be there with a number in every cell, in SI units, (m, k)."""
    for base in bases:
        name = columns.name(base)
        columns.table.check(name, np.isnan(columns.si(base)), "a number")
    return np.stack([columns.si(base) for base in bases], axis=1)


def _orientations(columns: Columns) -> tuple[Array, Array | None]:
    """Rotations (m, 3, 3), and the quaternions (m, 4) if they were given as such."""
    table = columns.table
    four, three = [name for name in QUATERNION if name in table], [base for base in TURNS if base in columns]
    if four and three:
        both = f"{columns.name(three[0])} and {four[0]}"
        raise table.header_wrong(f"columns {both} give the orientation twice, expected one way of writing it")
    if not four and not three:
        raise table.header_wrong("no orientation, expected columns qw, qx, qy, qz or rx_deg, ry_deg, rz_deg")
    if three:
        return rotations_of_turns(_numbers(columns, TURNS)), None
    missing = [name for name in QUATERNION if name not in table]
    if missing:
        raise table.header_wrong(f"column {missing[0]} is missing, expected {', '.join(QUATERNION)}")
    values = np.stack([table.numbers(name) for name in QUATERNION], axis=1)
    for k, name in enumerate(QUATERNION):
        table.check(name, np.isnan(values[:, k]), "a number")
    length = np.linalg.norm(values, axis=1)
    wrong = np.abs(length - 1) > UNIT_SLACK
    if wrong.any():
        row = int(np.argmax(wrong))
        raise table.failed(row, f"columns {', '.join(QUATERNION)}: length {length[row]:.6g}, expected 1")
    return rotations_of_quaternions(values), values


def _names(table: TextTable) -> tuple[str, ...]:
    if "pose" not in table:
        return tuple(str(number) for number in range(1, table.count + 1))
    words = table.words("pose")
    table.check("pose", np.array([not word for word in words]), "what the pose is called")
    return tuple(words)


def _require_known_joints(table: TextTable, robot: Robot) -> None:
    """Refuse q columns of joints that the robot does not have, or that take no command."""
    known = [f"q{i + 1}" for i in np.flatnonzero(robot.commanded)]
    for name in table.columns:
        found = _JOINT_COLUMN.match(name)
        if found and found[0] not in known:
            raise table.header_wrong(f"column {name} is of no joint with a command, expected {', '.join(known)}")


def _near(columns: Columns, bases: tuple[str, ...], robot: Robot) -> Array | None:
    """Commands that choose the branch, 0 for passive joints; the columns go together."""
    if not columns.any_of(bases):
        return None
    near = np.zeros((columns.table.count, robot.joint_count))
    near[:, np.flatnonzero(robot.commanded)] = _numbers(columns, bases)
    return near
