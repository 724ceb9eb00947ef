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
    def _terms(self) -> tuple[np.ndarray, np.ndarray, Array]:
        """Slot and column of every term, (t,), and its feature, (t, m)."""
        number = {slot: k for k, slot in enumerate(self._slots)}
        slot = [number[s] for column in self.columns for s, _ in column]
        of = [c for c, column in enumerate(self.columns) for _ in column]
        feature = np.stack([f * self.scale[c] for c, column in enumerate(self.columns) for _, f in column])
        return np.array(slot), np.array(of), feature

    def fields(self) -> Array:
        """How the points answer to every small motion that a column makes, (m, 3, slots)."""
        return self.sim.fields(self._slots)

    def spread(self, fields: Array) -> Array:
        """The columns, (p, 3, m), with answers of the points to small motions, (slots, 3, m)."""
        slot, of, feature = self._terms
        first = np.searchsorted(of, np.arange(self.count))
        out = fields[slot[first]]
        out *= feature[first][:, None]
        for t in np.setdiff1d(np.arange(len(of)), first):
            out[of[t]] += fields[slot[t]] * feature[t]
        return out

    def some(self, columns: Sequence[int] | np.ndarray) -> "Design":
        """The same with some of the columns."""
        return Design(self.sim, tuple(self.columns[c] for c in columns), self.scale[np.asarray(columns, dtype=int)])

    def whole(self) -> Array:
        """All columns over all points, (m, 3, p); for few columns."""
        return np.ascontiguousarray(self.spread(self.fields().transpose(2, 1, 0)).transpose(2, 1, 0))

    def motions(self, numbers: Array) -> dict[Slot, Array]:
        """The small motions that the columns make with these unknown numbers, (p,)."""
        out: dict[Slot, Array] = {}
        for column, scale, number in zip(self.columns, self.scale, numbers, strict=True):
            for slot, feature in column:
                out[slot] = out.get(slot, 0.0) + feature * (scale * number)
        return out


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
