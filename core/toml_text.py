"""Values as a TOML file writes them."""

import re
from collections.abc import Iterable

from core.units import from_si


def toml_text(value: str) -> str:
    """A string as TOML writes it, quoted."""
    escapes = {"\\": "\\\\", '"': '\\"', "\n": "\\n", "\t": "\\t", "\r": "\\r"}
    return '"' + "".join(escapes.get(c) or (f"\\u{ord(c):04x}" if c < " " or c == "\x7f" else c) for c in value) + '"'


def toml_key(key: str) -> str:
    """A key as TOML writes it, quoted only where it has to be."""
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else toml_text(key)


def toml_number(value: float) -> str:
    """A number as TOML writes it, to 15 digits: what a change of unit adds beyond them is noise."""
    return repr(float(f"{value:.15g}") + 0.0)


def toml_numbers(values: Iterable[float]) -> str:
    """A list of numbers as TOML writes it."""
    return "[" + ", ".join(toml_number(v) for v in values) + "]"


def toml_quantity(key: str, value_si: float) -> str:
    """The line ``key = number`` for an SI value, in the unit with which the key ends."""
    return f"{key} = {toml_number(from_si(value_si, key.rpartition('_')[2]))}"
