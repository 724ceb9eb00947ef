"""Products of columns with each other, X'X: worked out where they are asked for, as most never are."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from core.geometry import Array


@dataclass(frozen=True, eq=False)
class Stack:
    """Groups of one width."""

    groups: np.ndarray
    """Their numbers, ascending, (g,)."""
    columns: np.ndarray
    """(g, w)"""
    squares: Array
    """Products of the columns of each group, (g, w, w)."""


class Products(ABC):
    """X'X of columns, some of them in groups."""

    slices: tuple[slice, ...]
    """Columns of each group."""

    @abstractmethod
    def rows(self, index: np.ndarray) -> Array:
        """Products of some columns with all, (k, p)."""

    @abstractmethod
    def times(self, numbers: Array) -> Array:
        """X'X numbers, (p, d), for numbers (p, d)."""

    @cached_property
    @abstractmethod
    def stacks(self) -> tuple[Stack, ...]:
        """Products within each group."""

    @property
    @abstractmethod
    def count(self) -> int:
        """Number of columns."""

    def within(self, index: np.ndarray) -> Array:
        """Products of some columns with each other, (k, k)."""
        return self.rows(index)[:, index]

    def block(self, group: int) -> Array:
        """Products of the columns of one group, (w, w)."""
        width = self.slices[group].stop - self.slices[group].start
        stack = next(one for one in self.stacks if one.columns.shape[1] == width)
        return stack.squares[np.searchsorted(stack.groups, group)]

    @cached_property
    def whole(self) -> Array:
        """All of them, (p, p)."""
        return self.rows(np.arange(self.count))


class Remembering(Products):
    """Products of which each row is worked out once."""

    @abstractmethod
    def fresh_rows(self, index: np.ndarray) -> Array:
        """Products of some columns with all, (k, p), worked out."""

    def rows(self, index: np.ndarray) -> Array:
        known, rows = self._known
        missing = np.unique(index[~known[index]])
        if len(missing):
            rows[missing] = self.fresh_rows(missing)
            known[missing] = True
        return rows[index]

    @cached_property
    def _known(self) -> tuple[np.ndarray, Array]:
        """Which rows were asked for, (p,), and those, (p, p): memory is taken as they are filled in."""
        return np.zeros(self.count, dtype=bool), np.empty((self.count, self.count))


@dataclass(frozen=True, eq=False)
class OfColumns(Remembering):
    """Products of columns that are at hand."""

    columns: Array
    """X', (p, n)."""
    slices: tuple[slice, ...]

    @property
    def count(self) -> int:
        return len(self.columns)

    def fresh_rows(self, index: np.ndarray) -> Array:
        return self.columns[index] @ self.columns.T

    def times(self, numbers: Array) -> Array:
        return self.columns @ (self.columns.T @ numbers)

    @cached_property
    def stacks(self) -> tuple[Stack, ...]:
        squares = [self.columns[own] @ self.columns[own].T for own in self.slices]
        return tuple(Stack(g, c, np.array([squares[k] for k in g])) for g, c in widths(self.slices))


@dataclass(frozen=True, eq=False)
class OfSquare(Products):
    """Products that are known."""

    square: Array
    """(p, p)"""
    slices: tuple[slice, ...]

    @property
    def count(self) -> int:
        return len(self.square)

    def rows(self, index: np.ndarray) -> Array:
        return self.square[index]

    def times(self, numbers: Array) -> Array:
        return self.square @ numbers

    @cached_property
    def stacks(self) -> tuple[Stack, ...]:
        return tuple(Stack(g, c, self.square[c[:, :, None], c[:, None, :]]) for g, c in widths(self.slices))


@dataclass(frozen=True, eq=False)
class Reduced(Remembering):
    """Products without what the first columns explain."""

    products: Products
    first: Array
    """Products of the first columns with all, (n, p)."""
    solved: Array
    """Estimates of the first columns from all, (n, p)."""

    @property
    def slices(self) -> tuple[slice, ...]:
        return self.products.slices

    @property
    def count(self) -> int:
        return self.products.count

    def fresh_rows(self, index: np.ndarray) -> Array:
        return self.products.rows(index) - self.first[:, index].T @ self.solved

    def times(self, numbers: Array) -> Array:
        return self.products.times(numbers) - self.first.T @ (self.solved @ numbers)

    @cached_property
    def stacks(self) -> tuple[Stack, ...]:
        out = []
        for one in self.products.stacks:
            first, solved = (np.moveaxis(part[:, one.columns], 0, 2) for part in (self.first, self.solved))
            out.append(Stack(one.groups, one.columns, one.squares - first @ np.swapaxes(solved, 1, 2)))
        return tuple(out)


def widths(slices: Sequence[slice]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Groups of each width, (g,), and their columns, (g, w)."""
    of = np.array([s.stop - s.start for s in slices], dtype=int)
    starts = np.array([s.start for s in slices], dtype=int)
    out = []
    for width in np.unique(of):
        groups = np.flatnonzero(of == width)
        out.append((groups, starts[groups, None] + np.arange(width)))
    return out
