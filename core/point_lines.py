"""Coordinates that somebody typed in or pasted: one line a point, x y z, parted by blanks, commas, semicolons or tabs.

Numbers have a decimal point. A decimal comma is refused and not guessed: ``1,234 5,678 9,012`` may mean two things.
"""

import re
from dataclasses import dataclass

from core.errors import InputError
from core.file_records import HUGE
from core.input_files import shown
from core.units import LENGTH, to_si

MOST_LINES = 2_000
_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_PARTING = re.compile(r"[\s;,]+")
_DECIMAL_COMMA = re.compile(r"(?<![\d,.])[+-]?\d+,\d+(?![\d,.])", re.ASCII)


@dataclass(frozen=True)
class EnteredPoint:
    """One point as it was entered."""

    line: int
    """On which line it stood, from 1."""
    point_m: tuple[float, float, float]


def entered_points(text: str, unit: str) -> tuple[EnteredPoint, ...]:
    """The points that a text gives; blank lines are passed over.

    Args:
        unit: of all numbers, ``mm`` or ``m``.

    Raises:
        InputError: a line is not three numbers; the sentence names it.
    """
    if unit not in LENGTH:
        raise InputError(f"coordinates in {shown(unit)}, expected {' or '.join(LENGTH)}")
    lines = text.splitlines()
    if len(lines) > MOST_LINES:
        raise InputError(f"{len(lines)} lines of coordinates, expected at most {MOST_LINES}")
    return tuple(
        EnteredPoint(number, _point(number, line, unit)) for number, line in enumerate(lines, 1) if line.strip()
    )


def _point(number: int, line: str, unit: str) -> tuple[float, float, float]:
    words = _PARTING.split(line.strip())
    if len(words) != 3 or not all(_NUMBER.fullmatch(word) for word in words):
        hint = ", with a decimal point" if _DECIMAL_COMMA.search(line) else ""
        raise InputError(f"line {number}: {shown(line.strip())}, expected three numbers x y z in {unit}{hint}")
    values = [to_si(float(word), unit) for word in words]
    if not all(abs(value) <= HUGE for value in values):
        raise InputError(f"line {number}: {shown(line.strip())}, expected coordinates of at most {HUGE:g} m")
    return tuple(values)
