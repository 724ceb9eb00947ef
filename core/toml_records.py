"""Tables of a TOML file, asked for by key and type; whatever is wrong is told with file, table, key and value."""

import re
import tomllib
from collections.abc import Iterable

from core.errors import InputError
from core.file_records import HUGE, FileRecord
from core.input_files import InputText, one_line, shown
from core.units import UNIT_WORDS

LIMIT_BYTES = 1_000_000

# A key of thousands of dotted parts takes the parser minutes and all memory; nobody writes one.
_PART = r"""(?:[\w\-]+|"(?:[^"\\\n]|\\.)*"|'[^'\n]*')"""
_ENDLESS_KEY = re.compile(rf"(?<![\w\-\\])(?:{_PART}[ \t]*\.[ \t]*){{32}}")


class TomlTable(FileRecord):
    """One table of a TOML file, with its place for messages."""

    def __contains__(self, key: str) -> bool:
        return key in self._values

    def keys(self) -> Iterable[str]:
        return self._values.keys()

    def only(self, *known: str) -> None:
        """Refuse keys that are not known, so that a slip of the pen does not pass for a default."""
        for key in self._values:
            if key not in known:
                raise self._error(f"{self._path}: {self._place} has no key {shown(key)}; it knows {', '.join(known)}")

    def no_bare(self, *known: str) -> None:
        """Refuse a known quantity whose unit is missing or another one, as ``sigma`` for ``sigma_mm``."""
        for key in self._values:
            for full in known:
                base = full.rpartition("_")[0]
                bare = key == base or (key.startswith(f"{base}_") and key[len(base) + 1 :] in UNIT_WORDS)
                if bare and key not in known:
                    raise self._error(f"{self._path}: {self._name(key)} does not carry its unit, expected {full}")

    def text(self, key: str, default: str | None = None) -> str:
        """A string on one line, not empty; ``default`` None: it has to be there.

        Raises:
            InputError: the key is missing (without a default) or holds something else.
        """
        if key not in self._values and default is not None:
            return default
        value = self._values.get(key)
        if not isinstance(value, str) or not value.strip() or not one_line(value):
            raise self.wrong(key, "a text in quotes, on one line of at most 200 characters")
        return value

    def choice(self, key: str, choices: tuple[str, ...], default: str | None = None) -> str:
        """A string out of a list; ``default`` None: it has to be there.

        Raises:
            InputError: it is missing or another one.
        """
        value = self._values.get(key, default)
        if not isinstance(value, str) or value not in choices:
            raise self.wrong(key, "one of " + ", ".join(f'"{c}"' for c in choices))
        return value

    def flag(self, key: str, default: bool) -> bool:
        """True or false."""
        value = self._values.get(key, default)
        if not isinstance(value, bool):
            raise self.wrong(key, "true or false")
        return value

    def number(self, key: str, default: float | None = None, low: float = -HUGE) -> float:
        """A finite number; ``default`` None: it has to be there.

        Raises:
            InputError: it is missing, no number, below ``low``, or larger than 1e12.
        """
        if key not in self._values and default is not None:
            return default
        value = self._values.get(key)
        if not _is_number(value) or not low <= value <= HUGE:
            least = f" of at least {low:g}" if low > -HUGE else ""
            raise self.wrong(key, f"a number{least}")
        return float(value)

    def numbers(self, key: str, count: int, infinite: bool = False) -> tuple[float, ...]:
        """A list of so many numbers.

        Raises:
            InputError: it is missing, has another length, or holds anything else.
        """
        value = self._values.get(key)
        fits = isinstance(value, list) and len(value) == count
        if not fits or not all(
            _is_number(v) and (abs(v) <= HUGE or (infinite and abs(v) == float("inf"))) for v in value
        ):
            raise self.wrong(key, f"a list of {count} numbers")
        return tuple(float(v) for v in value)

    def is_list(self, key: str) -> bool:
        return isinstance(self._values.get(key), list)

    def table(self, key: str) -> "TomlTable":
        """The sub-table ``[key]``, empty if it is not there."""
        value = self._values.get(key, {})
        if not isinstance(value, dict):
            raise self.wrong(key, f"a table [{key}]")
        return TomlTable(value, self._path, f"[{key}]", self._error)

    def tables(self, key: str) -> "tuple[TomlTable, ...]":
        """The array of tables ``[[key]]``, empty if it is not there."""
        value = self._values.get(key, [])
        if not isinstance(value, list) or not all(isinstance(v, dict) for v in value):
            raise self.wrong(key, f"tables [[{key}]]")
        return tuple(
            TomlTable(v, self._path, f"[[{key}]] number {number}", self._error) for number, v in enumerate(value, 1)
        )

    def free_texts(self, known: tuple[str, ...] = ()) -> dict[str, str]:
        """Every other key with a plain value, as text: what the owner wrote down for himself."""
        plain = {k: v for k, v in self._values.items() if k not in known and not isinstance(v, list | dict)}
        return {k: str(v).lower() if isinstance(v, bool) else str(v) for k, v in plain.items()}

    def _name(self, key: str) -> str:
        key = key if one_line(key) else shown(key)
        return f"{self._place} {key}" if self._place else key


def parse_toml(source: InputText, form: str, error: type[InputError]) -> TomlTable:
    """The top table of a TOML file that says ``format = form``.

    Raises:
        error: it is not TOML (the message has line and column), or of another format.
    """
    if _ENDLESS_KEY.search(source.text):
        raise error(f"{source.path}: a key has more than 32 dotted parts, expected a plain TOML file")
    try:
        values = tomllib.loads(source.text)
    except RecursionError:
        raise error(f"{source.path}: lists or tables are nested too deep, expected a plain TOML file") from None
    except ValueError as wrong:
        raise error(f"{source.path} is not valid TOML: {' '.join(str(wrong).split())}") from None
    top = TomlTable(values, source.path, "", error)
    if values.get("format") != form:
        raise top.wrong("format", f'"{form}"')
    return top


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and value == value
