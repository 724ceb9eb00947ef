"""A table of text cells from a CSV file, converted column by column; a cell that cannot be is named by row and column.

Rows are named by their line in the file. A conversion tries the whole column at once and looks for the culprit
only when that fails, so that clean files of any length stay fast.
"""

import csv
import io
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from core.errors import CampaignError
from core.file_records import HUGE
from core.geometry import Array
from core.input_files import InputText, read_text, shown

LIMIT_BYTES = 64_000_000
MOST_ROWS = 2_000_000
MOST_COLUMNS = 1_000
_NUMBER = re.compile(r"\s*[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?\s*", re.ASCII)
EXACT = 2.0**53 - 1
"""Whole numbers beyond this one are not exact as floating-point numbers."""


@dataclass(frozen=True)
class TextTable:
    """The cells of a CSV file by columns, and the line of the file that each row stands on."""

    path: Path
    columns: dict[str, Sequence[str]]
    """Cells of each column, by its name in the header."""
    lines: Sequence[int]

    @property
    def count(self) -> int:
        return len(self.lines)

    def __contains__(self, column: str) -> bool:
        return column in self.columns

    def wrong(self, row: int, column: str, expected: str) -> CampaignError:
        """The error for a cell, by row index: file, line, column, value and what was expected."""
        cell = self.columns[column][row].strip()
        said = shown(cell) if cell else "empty"
        return self.failed(row, f"column {column}: {said}, expected {expected}")

    def failed(self, row: int, message: str) -> CampaignError:
        """The error for a row, by row index."""
        return CampaignError(f"{self.path}, row {self.lines[row]}, {message}")

    def header_wrong(self, message: str) -> CampaignError:
        """The error for the header."""
        return CampaignError(f"{self.path}, row 1: {message}")

    def check(self, column: str, wrong: np.ndarray, expected: str) -> None:
        """Refuse the first cell of a column for which ``wrong`` (boolean, one a row) is true."""
        if wrong.any():
            raise self.wrong(int(np.argmax(wrong)), column, expected)

    def words(self, column: str) -> list[str]:
        """The cells of a column without blanks around them."""
        return [cell.strip() for cell in self.columns[column]]

    def numbers(self, column: str, limit: float = HUGE) -> Array:
        """A column as floating-point numbers, NaN where a cell is empty, shape (rows,).

        Raises:
            CampaignError: a cell holds text, nan, an infinity or a number beyond the limit.
        """
        cells = self.columns[column]
        try:
            values = np.array([float(cell) if cell else np.nan for cell in cells])
        except ValueError:
            return self._slowly(column, limit)
        joined = "".join(cells)
        odd = "_" in joined or not joined.isascii()
        if odd or np.count_nonzero(~np.isfinite(values)) != sum(not cell for cell in cells):
            return self._slowly(column, limit)
        if values.size and np.nanmax(np.abs(values), initial=0.0) > limit:
            return self._slowly(column, limit)
        return values

    def integers(self, column: str, absent: int) -> np.ndarray:
        """A column as whole numbers, ``absent`` where a cell is empty, integer (rows,).

        Raises:
            CampaignError: a cell holds anything but a whole number.
        """
        values = self.numbers(column, EXACT)
        missing = np.isnan(values)
        values = np.where(missing, 0.0, values)
        self.check(column, values != np.rint(values), "a whole number")
        return np.where(missing, absent, values.astype(np.int64))

    def _slowly(self, column: str, limit: float) -> Array:
        """Cell by cell, to find the one that is no number."""
        values = np.full(self.count, np.nan)
        for row, cell in enumerate(self.columns[column]):
            if not cell.strip():
                continue
            if not _NUMBER.fullmatch(cell):
                raise self.wrong(row, column, "a number")
            values[row] = float(cell)
            if not abs(values[row]) <= limit:
                raise self.wrong(row, column, f"a number between {-limit:g} and {limit:g}")
        return values


def read_text_table(path: Path, thing: str = "a measured point") -> tuple[TextTable, bytes]:
    """A CSV file with a header, and its bytes.

    Args:
        thing: what a row stands for, for messages.

    Raises:
        CampaignError: missing, empty, too large, not UTF-8, a column twice, a ragged row, or no row at all.
    """
    source = read_text(path, LIMIT_BYTES, CampaignError)
    return text_table(source, thing), source.data


def text_table(source: InputText, thing: str = "a measured point") -> TextTable:
    """The table in the text of a CSV file; arguments and errors as for ``read_text_table``."""
    path = source.path
    reader = csv.reader(io.StringIO(source.text, newline=""), strict=True)
    lines: list[int] = []
    try:
        header = _header(source, next(reader, []))
        columns = _by_columns(
            _rows(source, ((reader.line_num, row) for row in reader), len(header), lines), len(header)
        )
    except csv.Error as wrong:
        told = " ".join(str(wrong).split())
        raise CampaignError(f"{path}, row {reader.line_num}: {told}, expected plain CSV") from None
    if not lines:
        raise CampaignError(f"{path} has a header and no rows, expected one row for {thing}")
    return TextTable(path, dict(zip(header, columns, strict=True)), lines)


def _header(source: InputText, cells: list[str]) -> list[str]:
    header = [cell.strip() for cell in cells]
    if len(header) > MOST_COLUMNS:
        raise CampaignError(f"{source.path}, row 1: {len(header)} columns, expected at most {MOST_COLUMNS}")
    if len(header) == 1 and (";" in header[0] or "\t" in header[0]):
        raise CampaignError(
            f"{source.path}, row 1: {shown(header[0])} holds no comma, expected columns parted by commas"
        )
    seen = set()
    for name in header:
        if name in seen:
            raise CampaignError(f"{source.path}, row 1: column {shown(name)} stands twice, expected each name once")
        seen.add(name)
    return header


def _rows(
    source: InputText, numbered: Iterable[tuple[int, list[str]]], width: int, lines: list[int]
) -> Iterator[list[str]]:
    """The rows that are not blank; ``lines`` gathers where they stand."""
    for line, row in numbered:
        if len(row) != width:
            if not row:
                continue
            raise CampaignError(f"{source.path}, row {line}: {len(row)} cells, expected {width} as in the header")
        if len(lines) >= MOST_ROWS:
            raise CampaignError(f"{source.path} has more than {MOST_ROWS} rows, expected at most as many")
        lines.append(line)
        yield row


def _by_columns(rows: Iterator[list[str]], width: int) -> list[list[str]]:
    """Rows turned into columns, some thousands at a time, so that not all rows are in memory as well."""
    columns: list[list[str]] = [[] for _ in range(width)]
    while chunk := list(islice(rows, 10_000)):
        for column, cells in zip(columns, zip(*chunk, strict=True), strict=True):
            column.extend(cells)
    return columns
