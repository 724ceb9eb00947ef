"""Sizes with units, as they are written in an effect: ``0.2deg``, ``30 ppm``, ``5urad/Nm``."""

import math
import re
from enum import StrEnum

from core.errors import InputError


class Quantity(StrEnum):
    """What a size is."""

    ANGLE = "angle"
    LENGTH = "length"
    FRACTION = "fraction"
    TIME = "time"
    MASS = "mass"
    RATE = "rate"
    GROWTH = "growth"
    COMPLIANCE = "compliance"
    """Angle for a torque."""
    GIVE = "give"
    """Length for a force."""


UNITS = {
    "deg": (Quantity.ANGLE, math.pi / 180),
    "rad": (Quantity.ANGLE, 1.0),
    "mrad": (Quantity.ANGLE, 1e-3),
    "urad": (Quantity.ANGLE, 1e-6),
    "arcsec": (Quantity.ANGLE, math.pi / 180 / 3600),
    "mm": (Quantity.LENGTH, 1e-3),
    "um": (Quantity.LENGTH, 1e-6),
    "m": (Quantity.LENGTH, 1.0),
    "1": (Quantity.FRACTION, 1.0),
    "%": (Quantity.FRACTION, 1e-2),
    "ppm": (Quantity.FRACTION, 1e-6),
    "ms": (Quantity.TIME, 1e-3),
    "s": (Quantity.TIME, 1.0),
    "kg": (Quantity.MASS, 1.0),
    "g": (Quantity.MASS, 1e-3),
    "mm/h": (Quantity.RATE, 1e-3 / 3600),
    "um/h": (Quantity.RATE, 1e-6 / 3600),
    "ppm/K": (Quantity.GROWTH, 1e-6),
    "1/K": (Quantity.GROWTH, 1.0),
    "urad/Nm": (Quantity.COMPLIANCE, 1e-6),
    "mrad/Nm": (Quantity.COMPLIANCE, 1e-3),
    "rad/Nm": (Quantity.COMPLIANCE, 1.0),
    "um/N": (Quantity.GIVE, 1e-6),
    "mm/N": (Quantity.GIVE, 1e-3),
    "m/N": (Quantity.GIVE, 1.0),
}
"""What a unit measures, and one of it in SI units."""

SIZE = re.compile(r"(?P<number>[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?)\s*(?P<unit>.*)")


def read_size(size: str, default_unit: str, text: str) -> tuple[float, Quantity]:
    """A size in SI units, and what it is.

    Args:
        default_unit: of a number that stands alone.
        text: the whole effect, for the message.

    Raises:
        InputError: not a number, or an unknown unit.
    """
    found = SIZE.fullmatch(size)
    if found is None:
        raise InputError(f"effect {text!r}: the size must be a number with or without a unit, got {size!r}")
    unit = found["unit"] or default_unit
    if unit not in UNITS:
        raise InputError(f"effect {text!r}: there is no unit {unit!r}; expected one of {', '.join(UNITS)}")
    quantity, scale = UNITS[unit]
    value = float(found["number"]) * scale
    if not math.isfinite(value):
        raise InputError(f"effect {text!r}: the size must be a finite number, got {size!r}")
    return value, quantity


def quantities_text(quantities: tuple[Quantity, ...]) -> str:
    """What sizes may be, with their units, as part of a sentence."""
    lists = [
        f"{'an' if q is Quantity.ANGLE else 'a'} {q} ({', '.join(u for u, (of, _) in UNITS.items() if of is q)})"
        for q in quantities
    ]
    return " or ".join(lists)
