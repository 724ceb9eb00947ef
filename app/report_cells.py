"""Numbers in the cells of a shown table: rounded to their uncertainty, decimal points one below the other."""

from dataclasses import replace

import numpy as np

from app.report_page import Cell
from core.wording import decimals_for, fixed

NOTHING = Cell("", numeric=True)


def number(value: float, std: float | None = None, decimals: int = 3, mark: str = "") -> Cell:
    """A number rounded to two digits of its standard uncertainty, or to ``decimals``; empty where it is not known."""
    if value is None or not np.isfinite(value):
        return NOTHING
    digits = decimals if std is None else decimals_for(std, decimals)
    whole, _, part = fixed(float(value), digits).partition(".")
    return Cell(whole, f".{part}" if part else "", numeric=True, mark=mark)


def uncertainty(std: float, decimals: int = 3) -> Cell:
    """A standard uncertainty with two digits; empty where there is none."""
    return number(std, std, decimals) if np.isfinite(std) and std > 0 else NOTHING


def count(value: int) -> Cell:
    """A whole number."""
    return Cell(str(value), numeric=True)


def aligned(groups: list[list[list[Cell]]]) -> tuple[tuple[tuple[Cell, ...], ...], ...]:
    """Groups of rows with room for the longest decimals in every column, rowspans and colspans allowed for."""
    widths: dict[int, int] = {}
    for group in groups:
        for row, places in zip(group, _places(group), strict=True):
            for cell, column in zip(row, places, strict=True):
                widths[column] = max(widths.get(column, 0), len(cell.tail) - 1)
    return tuple(
        tuple(
            tuple(
                replace(cell, tail_width=widths[column]) if cell.numeric and widths[column] > 0 else cell
                for cell, column in zip(row, places, strict=True)
            )
            for row, places in zip(group, _places(group), strict=True)
        )
        for group in groups
    )


def _places(group: list[list[Cell]]) -> list[list[int]]:
    """The column in which each cell of a group stands."""
    taken: dict[int, int] = {}
    out = []
    for row in group:
        column, places = 0, []
        for cell in row:
            while taken.get(column, 0) > 0:
                column += 1
            places.append(column)
            for k in range(column, column + cell.columns):
                taken[k] = cell.rows
            column += cell.columns
        out.append(places)
        taken = {k: v - 1 for k, v in taken.items()}
    return out
