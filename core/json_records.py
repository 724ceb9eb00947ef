"""Records of a JSON file, asked for by key and type; whatever is wrong is told with file, place, key and value."""

import json
from pathlib import Path

import numpy as np

from core.errors import InputError
from core.file_records import HUGE, FileRecord
from core.geometry import Array
from core.input_files import one_line, read_text

LIMIT_BYTES = 64_000_000


class JsonRecord(FileRecord):
    """One object of a JSON file, with its place for messages."""

    def __init__(self, values: dict, path: Path, place: str = "") -> None:
        super().__init__(values, path, place, InputError)

    def __contains__(self, key: str) -> bool:
        """Whether there is such a key with something else than null."""
        return self._values.get(key) is not None

    def names(self) -> tuple[str, ...]:
        """All keys, in the order of the file."""
        return tuple(self._values)

    def get(self, key: str) -> object:
        """Whatever stands under a key, unchecked; None: nothing."""
        return self._values.get(key)

    def text(self, key: str) -> str:
        """A string on one line."""
        value = self._values.get(key)
        if not isinstance(value, str) or not one_line(value):
            raise self.wrong(key, "a text on one line")
        return value

    def choice(self, key: str, choices: tuple[str, ...]) -> str:
        """A string out of a list."""
        value = self._values.get(key)
        if not isinstance(value, str) or value not in choices:
            raise self.wrong(key, f"one of {', '.join(choices)}")
        return value

    def flag(self, key: str) -> bool:
        """True or false."""
        value = self._values.get(key)
        if not isinstance(value, bool):
            raise self.wrong(key, "true or false")
        return value

    def number(self, key: str) -> float:
        """A number of at most 1e12."""
        value = self._values.get(key)
        if not _is_number(value):
            raise self.wrong(key, "a number")
        return float(value)

    def numbers(self, key: str, shape: tuple[int, ...]) -> Array:
        """Nested lists of numbers of a given shape."""
        value = self._values.get(key)
        if not _has_shape(value, shape):
            raise self.wrong(key, f"a list of {' x '.join(map(str, shape))} numbers")
        return np.array(value, dtype=float).reshape(shape)

    def optional_numbers(self, key: str, count: int) -> tuple[float | None, ...]:
        """A list of so many numbers, null where there is none."""
        value = self._values.get(key)
        if not isinstance(value, list) or len(value) != count or not all(v is None or _is_number(v) for v in value):
            raise self.wrong(key, f"a list of {count} numbers or nulls")
        return tuple(None if v is None else float(v) for v in value)

    def record(self, key: str) -> "JsonRecord":
        """The object under a key."""
        value = self._values.get(key)
        if not isinstance(value, dict):
            raise self.wrong(key, "an object")
        return JsonRecord(value, self._path, self._name(key))

    def records(self, key: str) -> "tuple[JsonRecord, ...]":
        """The list of objects under a key."""
        value = self._values.get(key)
        if not isinstance(value, list) or not all(isinstance(v, dict) for v in value):
            raise self.wrong(key, "a list of objects")
        return tuple(JsonRecord(v, self._path, f"{self._name(key)}[{k}]") for k, v in enumerate(value))

    def _name(self, key: str) -> str:
        return f"{self._place}.{key}" if self._place else key


def read_json(path: Path, form: str) -> JsonRecord:
    """The object of a JSON file that says ``format = form``.

    Raises:
        InputError: it is missing, too large, not JSON, or of another format.
    """
    record = read_object(path, f" with format {form!r}")
    if record.get("format") != form:
        raise record.wrong("format", f'"{form}"')
    return record


def read_object(path: Path, described: str = "") -> JsonRecord:
    """The object that a JSON file holds; ``described`` says in a message what is expected of it.

    Raises:
        InputError: it is missing, too large, or not JSON.
    """
    source = read_text(path, LIMIT_BYTES, InputError)
    try:
        values = json.loads(source.text, parse_constant=_refused)
    except RecursionError:
        raise InputError(f"{path}: lists or objects are nested too deep, expected a plain JSON file") from None
    except ValueError as wrong:
        raise InputError(f"{path} is not valid JSON: {' '.join(str(wrong).split())}") from None
    if not isinstance(values, dict):
        raise InputError(f"{path} holds a {type(values).__name__}, expected an object{described}")
    return JsonRecord(values, path)


def _refused(word: str) -> float:
    raise ValueError(f"{word} is not a number")


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= HUGE


def _has_shape(value: object, shape: tuple[int, ...]) -> bool:
    if not shape:
        return _is_number(value)
    return isinstance(value, list) and len(value) == shape[0] and all(_has_shape(v, shape[1:]) for v in value)
