"""Measurements -> measurements.csv, in millimetres and degrees; columns that hold nothing are left out."""

from collections.abc import Sequence

import numpy as np

from core.geometry import Array
from core.measurement_columns import COVARIANCE, POINT, QUATERNION, SIMULATED
from core.measurements import POSE, SWEEP, Campaign, Measurements
from core.robot import Robot
from core.units import displacement_units, from_si, speed_units

_UPPER = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


def measurements_csv(campaign: Campaign) -> str:
    """The text of a campaign's measurements.csv."""
    columns = _columns(campaign)
    rows = [",".join(columns), *(",".join(row) for row in zip(*columns.values(), strict=True))]
    return "\n".join(rows) + "\n"


def _columns(campaign: Campaign) -> dict[str, Sequence[str]]:
    """Header and cells of every column, in the order of the contract's table."""
    table, robot = campaign.measurements, campaign.robot
    names = np.array([*(_quoted(target.name) for target in campaign.targets), ""], dtype=object)
    columns: dict[str, Sequence[str]] = {"record": _whole(table.record), "phase": list(table.phase)}
    columns |= _indices(table) | _approaches(table) | {"target": list(names[table.target])}
    for i in np.flatnonzero(robot.commanded):
        columns |= _quantity(f"q{i + 1}", displacement_units(robot.joints[i].slides)[0], table.commanded[:, i])
    columns |= _lengths(POINT, table.point_m) | _uncertainty(campaign)
    return columns | _conditions(table, robot)


def _indices(table: Measurements) -> dict[str, Sequence[str]]:
    swept, posed = table.phase == SWEEP, table.phase == POSE
    columns: dict[str, Sequence[str]] = {}
    if swept.any():
        for name in ("joint", "sweep", "step"):
            columns[name] = _whole(getattr(table, name), swept)
    if posed.any():
        columns["pose"] = _whole(table.pose, posed)
    if table.check.any():
        columns["use"] = ["check" if check else "fit" for check in table.check]
    return columns


def _approaches(table: Measurements) -> dict[str, Sequence[str]]:
    """``approach`` for the joint that a sweep moves, one column a joint for what else is known."""
    others = table.approach.copy()
    rows = np.flatnonzero(table.joint > 0)
    own = np.zeros(table.count, dtype=np.int64)
    own[rows] = others[rows, table.joint[rows] - 1]
    others[rows, table.joint[rows] - 1] = 0
    columns = {"approach": _whole(own)} if own.any() else {}
    return columns | {f"approach{i + 1}": _whole(others[:, i]) for i in np.flatnonzero(others.any(axis=0))}


def _uncertainty(campaign: Campaign) -> dict[str, Sequence[str]]:
    """Nothing where the instrument's sigma says it all, one sigma a point where that does, else whole matrices."""
    table, stated = campaign.measurements, campaign.instrument.sigma_m
    known = np.isfinite(table.covariance_m2).all(axis=(1, 2))
    covariance = table.covariance_m2[known]
    variance = covariance[:, 0, 0]
    round_ones = (np.abs(covariance - variance[:, None, None] * np.eye(3)) <= 1e-14 * variance[:, None, None]).all()
    if round_ones and (not known.any() or (stated and (np.abs(variance - stated**2) <= 1e-14 * stated**2).all())):
        return {}
    if round_ones:
        sigma = np.full(table.count, np.nan)
        sigma[known] = np.sqrt(variance)
        return _quantity("sigma", "mm", sigma)
    entries = [table.covariance_m2[:, i, j] for i, j in _UPPER]
    columns: dict[str, Sequence[str]] = {}
    for base, entry in zip(COVARIANCE, entries, strict=True):
        columns |= _quantity(base, "mm2", entry)
    return columns


def _conditions(table: Measurements, robot: Robot) -> dict[str, Sequence[str]]:
    columns: dict[str, Sequence[str]] = {}
    for base, unit in (("time", "s"), ("temperature", "c"), ("arm_temperature", "c"), ("payload", "kg")):
        value = getattr(table, f"{base}_{unit}")
        if value is not None:
            columns |= _quantity(base, unit, value)
    for i, joint in enumerate(robot.joints):
        columns |= _one_of(table.speed, f"speed{i + 1}", speed_units(joint.slides)[0], i)
        columns |= _one_of(table.torque_nm, f"tau{i + 1}", "n" if joint.slides else "nm", i)
        columns |= _one_of(table.readback, f"read{i + 1}", displacement_units(joint.slides)[0], i)
        columns |= _one_of(table.wanted, f"want{i + 1}", displacement_units(joint.slides)[0], i)
    if table.target_quaternion is not None:
        columns |= {name: _numbers(q) for name, q in zip(QUATERNION, table.target_quaternion.T, strict=True)}
    if table.simulated_point_m is not None:
        columns |= _lengths(SIMULATED, table.simulated_point_m)
    return columns


def _one_of(values: Array | None, base: str, unit: str, joint: int) -> dict[str, Sequence[str]]:
    return {} if values is None else _quantity(base, unit, values[:, joint])


def _lengths(bases: tuple[str, ...], points_m: Array) -> dict[str, Sequence[str]]:
    columns: dict[str, Sequence[str]] = {}
    for base, values in zip(bases, points_m.T, strict=True):
        columns |= _quantity(base, "mm", values)
    return columns


def _quantity(base: str, unit: str, values: Array) -> dict[str, Sequence[str]]:
    return {f"{base}_{unit}": _numbers(from_si(values, unit))}


def _numbers(values: Array) -> list[str]:
    """Cells with 15 digits, which a change of unit leaves exact; empty where there is no number."""
    return ["" if value != value else f"{value:.15g}" for value in values.tolist()]


def _whole(values: np.ndarray, rows: np.ndarray | None = None) -> list[str]:
    wanted = np.ones(len(values), dtype=bool) if rows is None else rows
    return [str(value) if want else "" for value, want in zip(values.tolist(), wanted.tolist(), strict=True)]


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"' if any(c in name for c in ',"') else name
