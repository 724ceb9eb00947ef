"""Units as they stand in other people's files, and what they are in SI; the core itself knows only the latter."""

import math

SCALES = {
    **{"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180.0, "rad_s": 1.0, "deg_s": math.pi / 180.0},
    **{"m": 1.0, "mm": 1e-3, "m_s": 1.0, "mm_s": 1e-3, "mm2": 1e-6},
    **{"s": 1.0, "c": 1.0, "kg": 1.0, "nm": 1.0, "n": 1.0},
}
"""One of the unit in SI units (temperatures stay in degrees Celsius)."""

ANGLE = ("deg", "rad")
LENGTH = ("mm", "m")
ANGULAR_SPEED = ("deg_s", "rad_s")
LINEAR_SPEED = ("mm_s", "m_s")

UNIT_WORDS = frozenset(
    [*SCALES, "cm", "um", "km", "in", "inch", "ft", "m2", "um2", "mrad", "urad", "gon", "grad", "arcsec", "turn", "rev"]
) | frozenset(["ms", "us", "ns", "min", "h", "f", "k", "g", "lb", "mm_min", "rpm", "mnm", "ncm", "degrees", "radians"])
"""Endings of a name that are meant as a unit, known here or not."""


def displacement_units(slides: bool) -> tuple[str, str]:
    """The units in which a joint's displacement may be written, the customary one first."""
    return LENGTH if slides else ANGLE


def speed_units(slides: bool) -> tuple[str, str]:
    """The units in which a joint's speed may be written, the customary one first."""
    return LINEAR_SPEED if slides else ANGULAR_SPEED


def to_si(value: float, unit: str) -> float:
    """A value in SI units.

    Raises:
        KeyError: the unit is not one of ``SCALES``.
    """
    return value * SCALES[unit]


def from_si(value: float, unit: str) -> float:
    """An SI value in the given unit; twelve digits survive the way there and back."""
    return value / SCALES[unit]
