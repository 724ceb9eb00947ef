"""Parameters of causes in the units of people, by the SI unit at the end of their names."""

import math
from dataclasses import dataclass

import numpy as np

from core.gap.result import DetectionLimit, Parameter

DEGREE = 180.0 / np.pi
PARTS = ("ratio", "scale", "error", "growth", "fraction")
"""Plain numbers of these names are small and read best as parts in a million."""


@dataclass(frozen=True)
class Unit:
    """A unit of SI at the end of a name, and what is shown instead."""

    ending: str
    shown_ending: str
    symbol: str
    scale: float
    """How many of the shown unit make one of SI."""


UNITS = (
    Unit("_rad_per_nm", "_urad_per_nm", "µrad/Nm", 1e6),
    Unit("_m_per_nm", "_um_per_nm", "µm/Nm", 1e6),
    Unit("_m_per_n", "_um_per_n", "µm/N", 1e6),
    Unit("_rad_per_m", "_deg_per_mm", "deg/mm", DEGREE * 1e-3),
    Unit("_m_per_rad", "_mm_per_deg", "mm/deg", 1e3 / DEGREE),
    Unit("_rad_per_s", "_deg_per_h", "deg/h", DEGREE * 3600.0),
    Unit("_m_per_s", "_mm_per_h", "mm/h", 3.6e6),
    Unit("_rad_per_k", "_deg_per_k", "deg/K", DEGREE),
    Unit("_m_per_k", "_mm_per_k", "mm/K", 1e3),
    Unit("_1_per_k", "_ppm_per_k", "ppm/K", 1e6),
    Unit("_per_k", "_ppm_per_k", "ppm/K", 1e6),
    Unit("_per_s", "_ppm_per_h", "ppm/h", 3.6e9),
    Unit("_rad", "_deg", "deg", DEGREE),
    Unit("_nm", "_nm", "Nm", 1.0),
    Unit("_kg", "_kg", "kg", 1.0),
    Unit("_m", "_mm", "mm", 1e3),
    Unit("_s", "_s", "s", 1.0),
    Unit("_k", "_k", "K", 1.0),
    Unit("_1", "", "", 1.0),
)
"""The first ending that fits counts."""
PART = Unit("_1", "_ppm", "ppm", 1e6)
PLAIN = Unit("", "", "", 1.0)
LARGEST = {"rad": 0.5, "m": 0.5, "1": 0.5}
"""Sizes, in SI units, that no effect of a working arm exceeds."""


@dataclass(frozen=True)
class ShownParameter:
    """A parameter as files and pages have it."""

    name: str
    """With its unit, as in ``amplitude_deg``."""
    words: str
    """Without it: ``amplitude``."""
    symbol: str
    value: float
    std: float


def shown_parameter(parameter: Parameter) -> ShownParameter:
    """A parameter in mm, degrees and parts in a million."""
    unit = unit_of(parameter.name)
    stem = parameter.name[: len(parameter.name) - len(unit.ending)]
    return ShownParameter(
        stem + unit.shown_ending,
        stem.replace("_", " "),
        unit.symbol,
        parameter.value * unit.scale,
        parameter.std * unit.scale,
    )


def unit_of(name: str) -> Unit:
    """The unit in which a parameter of this name is shown."""
    if name.endswith("_1") and name.split("_")[-2] in PARTS:
        return PART
    return next((unit for unit in UNITS if name.endswith(unit.ending)), PLAIN)


def shown_limit(limit: DetectionLimit) -> tuple[float, str]:
    """The size of a detection limit in a unit of people, and that unit; a plain number in parts in a million.

    Infinite where no size that an arm could have would have been seen: what placement absorbs has no limit.
    """
    unit = PART if limit.unit == "1" else unit_of(f"size_{limit.unit}")
    size = limit.size if limit.size <= LARGEST.get(limit.unit, math.inf) else math.inf
    return size * unit.scale, unit.symbol or limit.unit
