"""Columns of candidates over points: derivative of every point with respect to every unknown number."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from core.gap.doings import Doings
from core.gap.effects.candidate import Candidate, Column
from core.gap.sim import Sim, Slot
from core.geometry import Array


@dataclass(frozen=True, eq=False)
class Design:
    """Placement and geometry first, then groups of columns, one a candidate."""

    sim: Sim
    columns: tuple[Column, ...]
    scale: Array
    """What each column is multiplied by, (p,)."""

    @property
    def count(self) -> int:
        return len(self.columns)

    @cached_property
    def _slots(self) -> list[Slot]:
        return list(dict.fromkeys(slot for column in self.columns for slot, _ in column))

    @cached_property
    def _number(self) -> dict[Slot, int]:
        return {slot: k for k, slot in enumerate(self._slots)}

    @cached_property
    def _terms(self) -> tuple[np.ndarray, np.ndarray, Array]:
        """Slot and column of every term that is not steady, (t,), and its feature, (t, m)."""
        terms = [(s, c, f) for c, column in enumerate(self.columns) for s, f in column if not is_steady(f)]
        feature = np.array([f * self.scale[c] for _, c, f in terms]).reshape(len(terms), self.sim.seen.count)
        return np.array([self._number[s] for s, _, _ in terms], int), np.array([c for _, c, _ in terms], int), feature

    @cached_property
    def _steady(self) -> tuple[np.ndarray, Array]:
        """Columns with steady terms, (c,), and what these have of every slot, (c, slots)."""
        columns = [c for c, column in enumerate(self.columns) if any(is_steady(f) for _, f in column)]
        share = np.zeros((len(columns), len(self._slots)))
        for row, c in enumerate(columns):
            for slot, feature in self.columns[c]:
                if is_steady(feature):
                    share[row, self._number[slot]] += feature[0] * self.scale[c]
        return np.array(columns, dtype=int), share

    def fields(self) -> Array:
        """How the points answer to every small motion that a column makes, (m, 3, slots)."""
        return self.sim.fields(self._slots)

    def spread(self, fields: Array) -> Array:
        """The columns, (p, 3, m), with answers of the points to small motions, (slots, 3, m)."""
        fields = np.ascontiguousarray(fields)
        out = np.empty((self.count, *fields.shape[1:]))
        steady, share = self._steady
        out[steady] = 0.0
        written = set(steady.tolist())
        for slot, column, feature in zip(*self._terms, strict=True):
            if column in written:
                out[column] += fields[slot] * feature
            else:
                np.multiply(fields[slot], feature, out=out[column])
                written.add(column)
        if len(steady):
            out[steady] += np.tensordot(share, fields, axes=1)
        return out

    def some(self, columns: Sequence[int] | np.ndarray) -> "Design":
        """The same with some of the columns."""
        return Design(self.sim, tuple(self.columns[c] for c in columns), self.scale[np.asarray(columns, dtype=int)])

    def whole(self) -> Array:
        """All columns over all points, (m, 3, p); for few columns."""
        return np.ascontiguousarray(self.spread(self.fields().transpose(2, 1, 0)).transpose(2, 1, 0))

    def motions(self, numbers: Array) -> dict[Slot, Array]:
        """The small motions that the columns make with these unknown numbers, (p,)."""
        return motions_of(self.columns, self.scale * numbers)


def motions_of(columns: Sequence[Column], numbers: Array) -> dict[Slot, Array]:
    """The small motions that columns make together, (m,) each, with one number for each column, (p,)."""
    out: dict[Slot, Array] = {}
    for column, number in zip(columns, numbers, strict=True):
        for slot, feature in column:
            out[slot] = out.get(slot, 0.0) + feature * number
    return out


def is_steady(feature: Array) -> bool:
    """Whether a feature is one number, spread over all points without a copy of it at each."""
    return feature.strides == (0,) and feature.size > 0


def candidate_columns(candidates: Sequence[Candidate], doings: Doings) -> tuple[list[Column], Array, list[slice]]:
    """Columns of all candidates, their reference sizes, and which belong to which."""
    columns: list[Column] = []
    sizes: list[float] = []
    slices = []
    for candidate in candidates:
        start = len(columns)
        columns += candidate.columns(doings)
        sizes += list(candidate.references)
        slices.append(slice(start, len(columns)))
    return columns, np.array(sizes), slices
