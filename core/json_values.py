"""Numbers as the JSON files carry them: twelve digits, null for what is not known, units of people."""

import json
import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

Json = dict[str, object]


def json_text(value: object) -> str:
    """The text of a JSON file, ended by a newline.

    Raises:
        ValueError: a number in it is not finite.
    """
    return json.dumps(value, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def number(value: float, decimals: int = 15) -> float | None:
    """A number to twelve significant digits and so many decimals; None where it is not finite."""
    value = float(value)
    return round(float(f"{value:.12g}"), decimals) + 0.0 if math.isfinite(value) else None


def numbers(values: ArrayLike, decimals: int = 15) -> list | float | None:
    """An array of any shape as nested lists of ``number``."""
    values = np.asarray(values, dtype=float)
    return number(values, decimals) if values.ndim == 0 else [numbers(row, decimals) for row in values]


def mm(length_m: ArrayLike) -> list | float | None:
    """Lengths in mm, any shape; what rounding leaves of a zero is zero."""
    return numbers(np.asarray(length_m, dtype=float) * 1e3, 12)


def degrees(angle_rad: ArrayLike) -> list | float | None:
    """Angles in degrees, any shape; what rounding leaves of a zero is zero."""
    return numbers(np.rad2deg(angle_rad), 12)


def named(names: Iterable[str], values: ArrayLike) -> dict[str, float | None]:
    """Numbers by name, in the order of the names."""
    return {name: number(value, 12) for name, value in zip(names, np.asarray(values, dtype=float), strict=True)}


def transform_mm(transform: ArrayLike) -> list:
    """A 4x4 rigid motion with its translation in mm."""
    out = np.array(transform, dtype=float)
    out[:3, 3] *= 1e3
    return numbers(out)


def root_mean_square(values: ArrayLike) -> float:
    """Root mean square; NaN of nothing."""
    values = np.asarray(values, dtype=float)
    return float(np.sqrt(np.mean(values**2))) if values.size else math.nan
