"""A plain CSV of the points of one sweep: what somebody with nothing but a laser tracker has."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from core.geometry import Array
from core.measurement_columns import POINT, Columns, match_columns
from core.text_table import TextTable, read_text_table
from core.units import ANGLE, LENGTH


@dataclass(frozen=True)
class PlainSweep:
    """Points of targets that one joint moves, k of them; rows in which nothing was seen are left out."""

    point_m: Array
    """Measured points, (k, 3)."""
    target: np.ndarray
    """Index into ``target_names``, integer (k,)."""
    target_names: tuple[str, ...]
    stop: np.ndarray
    """Index of the standstill of each point, 0.., in the order of measurement, integer (k,)."""
    commanded: Array | None
    """Commanded displacement of the joint at each point, rad or m, (k,); None: not recorded."""
    sliding: bool | None
    """Whether the joint slides, as the unit of its commands tells; None: not known."""
    sigma_m: Array | None
    """Standard deviation of one coordinate of each point, (k,), NaN where not stated; None: nowhere stated."""


def read_points(path: Path | str) -> PlainSweep:
    """The points of one sweep from a CSV file.

    Columns: x, y, z (_mm or _m); optional target, step, q (_deg, _rad, _mm or _m) and sigma (_mm or _m). Without a
    step each target's points count 0, 1, .. in the order of the rows.

    Raises:
        CampaignError: a column or a cell is not as expected; the message names row, column and value.
    """
    table, _ = read_text_table(Path(path))
    units = {**{base: LENGTH for base in (*POINT, "sigma")}, "q": (*ANGLE, *LENGTH)}
    columns = match_columns(table, units, {"target", "step"})
    for base in POINT:
        columns.name(base)
    point = columns.together(POINT)
    assert point is not None
    seen = ~np.isnan(point[:, 0])
    if not seen.any():
        raise table.wrong(0, columns.name("x"), "a number in at least one row")
    names, target = _targets(table)
    commanded = _commanded(columns)
    return PlainSweep(
        point_m=point[seen],
        target=target[seen],
        target_names=names,
        stop=_stops(table, target)[seen],
        commanded=None if commanded is None else commanded[seen],
        sliding=None if commanded is None else columns.name("q")[2:] in LENGTH,
        sigma_m=_sigma(columns, seen),
    )


def _targets(table: TextTable) -> tuple[tuple[str, ...], np.ndarray]:
    if "target" not in table:
        return ("target",), np.zeros(table.count, dtype=np.int64)
    words = table.words("target")
    table.check("target", np.array([not word for word in words]), "a target's name")
    names = tuple(dict.fromkeys(words))
    index = {name: number for number, name in enumerate(names)}
    return names, np.array([index[word] for word in words])


def _stops(table: TextTable, target: np.ndarray) -> np.ndarray:
    """Standstills numbered in the order in which they were first met."""
    if "step" in table:
        step = table.integers("step", -1)
        table.check("step", step < 0, "a whole number of at least 0")
    else:
        order, count = np.argsort(target, kind="stable"), np.bincount(target)
        step = np.empty(table.count, dtype=np.int64)
        step[order] = np.arange(table.count) - np.repeat(np.cumsum(count) - count, count)
    _, first, which = np.unique(step, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[which]


def _commanded(columns: Columns) -> Array | None:
    if "q" not in columns:
        return None
    commanded = columns.si("q")
    columns.table.check(columns.name("q"), np.isnan(commanded), "a number")
    return commanded


def _sigma(columns: Columns, seen: np.ndarray) -> Array | None:
    if "sigma" not in columns:
        return None
    sigma = columns.si("sigma")
    columns.table.check(columns.name("sigma"), sigma <= 0, "a number above 0")
    return sigma[seen]
