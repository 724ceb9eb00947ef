"""measurements.csv -> Measurements: every column of a campaign, checked cell by cell, in SI units."""

from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path

import numpy as np

from core.errors import CampaignError
from core.geometry import Array
from core.input_files import shown
from core.measurement_checks import check_limits, check_records, check_sweeps, check_targets
from core.measurement_columns import POINT, QUATERNION, SIMULATED, Columns, find_columns
from core.measurements import MOVE, POSE, SWEEP, Measurements, Target
from core.point_covariance import stated_covariance
from core.robot import Robot
from core.text_table import TextTable, read_text_table

PHASES = (SWEEP, POSE, MOVE)


def read_measurements(
    path: Path, robot: Robot, targets: Sequence[Target], sigma_m: float | None, limited: bool = True
) -> tuple[Measurements, bytes]:
    """The measurements of a campaign in the order of their records, and the bytes of the file.

    Args:
        sigma_m: the instrument's stated standard deviation of one coordinate, for rows that state none.
        limited: whether values beyond the joint limits are errors (they are not where joints were read back).

    Raises:
        CampaignError: anything in the file is not as expected; the message names row, column and value.
    """
    table, data = read_text_table(path)
    columns = find_columns(table, robot)
    phase = _coded(table, "phase", PHASES)
    phases = np.array(PHASES)[phase]
    record = _required_integers(table, "record", np.ones(table.count, dtype=bool))
    check_records(table, record)
    commanded = _commanded(columns, robot)
    if limited:
        check_limits(columns, robot, commanded)
    joint, sweep, step = _sweep_columns(table, robot, phases == SWEEP)
    target = _target(table, targets, phases == MOVE)
    point = _points(columns, phases == MOVE)
    check_targets(table, targets, joint, target)
    measurements = Measurements(
        record=record,
        phase=phases,
        joint=joint,
        sweep=sweep,
        step=step,
        pose=_pose(table, phases == POSE),
        target=target,
        commanded=commanded,
        point_m=point,
        covariance_m2=stated_covariance(columns, point, sigma_m),
        check=_check(table),
        approach=_approach(table, robot, joint),
        **_conditions(columns, robot),
    )
    return _in_order(measurements, np.argsort(record, kind="stable")), data


def _in_order(measurements: Measurements, order: np.ndarray) -> Measurements:
    if (np.diff(order) == 1).all():
        return measurements
    columns = {field.name: getattr(measurements, field.name) for field in fields(measurements)}
    return replace(measurements, **{name: value[order] for name, value in columns.items() if value is not None})


def _column(table: TextTable, column: str, why: str = "") -> str:
    if column not in table:
        raise CampaignError(f"{table.path}, row 1: column {column} is missing{why}")
    return column


def _coded(table: TextTable, column: str, choices: Sequence[str]) -> np.ndarray:
    """Cells as indices into a list of words."""
    codes = {word: code for code, word in enumerate(choices)}
    found = np.array([codes.get(word, -1) for word in table.words(_column(table, column))])
    table.check(column, found < 0, f"one of {', '.join(shown(choice) for choice in choices)}")
    return found


def _required_integers(table: TextTable, column: str, rows: np.ndarray, low: int | None = None) -> np.ndarray:
    """Whole numbers in the given rows (boolean), at least ``low``; -1 elsewhere."""
    why = "" if rows.all() else f"; it is needed in row {table.lines[int(np.argmax(rows))]}"
    cells = table.columns[_column(table, column, why)]
    values = table.integers(column, -1)
    least = "" if low is None else f" of at least {low}"
    empty = np.array([not cell.strip() for cell in cells])
    wrong = empty if low is None else empty | (values < low)
    table.check(column, rows & wrong, f"a whole number{least}")
    return np.where(rows, values, -1)


def _sweep_columns(table: TextTable, robot: Robot, swept: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Joint (else 0), number of the sweep (else 0) and step (else -1) of each row."""
    if not swept.any():
        none = np.zeros(table.count, dtype=np.int64)
        return none, none.copy(), none - 1
    joint = np.where(swept, _required_integers(table, "joint", swept), 0)
    check_sweeps(table, robot, joint, swept)
    sweep = np.where(swept, _required_integers(table, "sweep", swept, low=1), 0)
    return joint, sweep, _required_integers(table, "step", swept, low=0)


def _pose(table: TextTable, posed: np.ndarray) -> np.ndarray:
    if not posed.any():
        return np.full(table.count, -1)
    return _required_integers(table, "pose", posed, low=0)


def _target(table: TextTable, targets: Sequence[Target], moved: np.ndarray) -> np.ndarray:
    """Index of each row's target, -1 for moves."""
    codes = {target.name.strip(): code for code, target in enumerate(targets)} | {"": -1}
    found = np.array([codes.get(word, -2) for word in table.words(_column(table, "target"))])
    table.check("target", moved & (found != -1), "nothing, as a move measures no target")
    names = ", ".join(shown(target.name) for target in targets[:10]) or "a target of campaign.toml"
    table.check("target", ~moved & (found < 0), f"one of {names}")
    return found


def _points(columns: Columns, moved: np.ndarray) -> Array:
    for base in POINT:
        columns.name(base)
    point = columns.together(POINT)
    assert point is not None
    measured = moved & ~np.isnan(point[:, 0])
    columns.table.check(columns.name("x"), measured, "nothing, as a move measures no point")
    return point


def _commanded(columns: Columns, robot: Robot) -> Array:
    commanded = np.zeros((columns.table.count, robot.joint_count))
    for i in np.flatnonzero(robot.commanded):
        base = f"q{i + 1}"
        commanded[:, i] = columns.si(base)
        columns.table.check(columns.name(base), np.isnan(commanded[:, i]), "a number")
    return commanded


def _check(table: TextTable) -> np.ndarray:
    if "use" not in table:
        return np.zeros(table.count, dtype=bool)
    return _coded(table, "use", ("fit", "check", "")) == 1


def _approach(table: TextTable, robot: Robot, joint: np.ndarray) -> np.ndarray:
    """Sense of approach of every joint; ``approach`` alone speaks of the joint that a sweep moves."""
    approach = np.zeros((table.count, robot.joint_count), dtype=np.int64)
    for i in range(robot.joint_count):
        if f"approach{i + 1}" in table:
            approach[:, i] = _sense(table, f"approach{i + 1}")
    if "approach" in table:
        sense = _sense(table, "approach")
        rows = np.flatnonzero((joint > 0) & (sense != 0))
        approach[rows, joint[rows] - 1] = sense[rows]
    return approach


def _sense(table: TextTable, column: str) -> np.ndarray:
    sense = table.integers(column, 0)
    table.check(column, np.abs(sense) > 1, "+1, -1, 0 or nothing")
    return sense


def _conditions(columns: Columns, robot: Robot) -> dict[str, Array | None]:
    """The optional columns, as arguments of ``Measurements``."""
    single = {base: columns.si(base) if base in columns else None for base in ("time", "temperature", "payload")}
    arm = columns.si("arm_temperature") if "arm_temperature" in columns else None
    return {
        "time_s": single["time"],
        "temperature_c": single["temperature"],
        "arm_temperature_c": arm,
        "payload_kg": single["payload"],
        "speed": _per_joint(columns, robot, "speed", 0.0),
        "torque_nm": _per_joint(columns, robot, "tau", np.nan),
        "readback": _per_joint(columns, robot, "read", np.nan),
        "wanted": _per_joint(columns, robot, "want", np.nan),
        "target_quaternion": _quaternion(columns.table),
        "simulated_point_m": columns.together(SIMULATED),
    }


def _per_joint(columns: Columns, robot: Robot, kind: str, absent: float) -> Array | None:
    """One column a joint, (rows, n); a joint without a column, or an empty cell, holds ``absent``."""
    bases = [f"{kind}{joint}" for joint in range(1, robot.joint_count + 1)]
    if not columns.any_of(bases):
        return None
    values = np.full((columns.table.count, robot.joint_count), absent)
    for i, base in enumerate(bases):
        if base in columns:
            column = columns.si(base)
            values[:, i] = np.where(np.isnan(column), absent, column)
    return values


def _quaternion(table: TextTable) -> Array | None:
    if not any(column in table for column in QUATERNION):
        return None
    values = np.stack([table.numbers(_column(table, column)) for column in QUATERNION], axis=1)
    empty = np.isnan(values)
    for column, lacking in zip(QUATERNION, empty.T, strict=True):
        table.check(column, lacking & ~empty.all(axis=1), f"a number, as {', '.join(QUATERNION)} go together")
    length = np.sqrt((values**2).sum(axis=1))
    table.check(QUATERNION[0], np.abs(length - 1.0) > 0.01, "four numbers of a unit quaternion")
    return values / length[:, None]
