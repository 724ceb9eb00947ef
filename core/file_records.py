"""What records of TOML and JSON files have in common: their place in the file, and how it is told that one is wrong."""

from abc import ABC, abstractmethod
from pathlib import Path

from core.errors import InputError
from core.input_files import shown

HUGE = 1e12
"""No honest number in a file is larger; squares of what passes cannot overflow."""


class FileRecord(ABC):
    """Keys and values at one place of a file."""

    def __init__(self, values: dict, path: Path, place: str, error: type[InputError]) -> None:
        self._values, self._path, self._place, self._error = values, path, place, error

    def wrong(self, key: str, expected: str) -> InputError:
        """The error for a key whose value cannot be used."""
        name = self._name(key)
        said = f"{name} = {shown(self._values[key])}" if key in self._values else f"{name} is missing"
        return self._error(f"{self._path}: {said}, expected {expected}")

    def failed(self, message: str) -> InputError:
        """The error for the record as a whole."""
        return self._error(f"{self._path}: {self._place + ': ' if self._place else ''}{message}")

    def integer(self, key: str) -> int:
        """A whole number."""
        value = self._values.get(key)
        if isinstance(value, bool) or not isinstance(value, int) or abs(value) > HUGE:
            raise self.wrong(key, "a whole number")
        return value

    @abstractmethod
    def _name(self, key: str) -> str:
        """A key with its place, as a message names it."""
