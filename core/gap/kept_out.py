"""How well models predict points that they have not seen, fold by fold."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from core.gap.evidence import Chosen
from core.gap.folds import CHECK, placeable
from core.gap.problem import KNOWN, Problem
from core.geometry import Array


@dataclass(frozen=True, eq=False)
class KeptOut:
    """A problem with some of its candidates, cut into folds."""

    problem: Problem
    fold: np.ndarray
    """(m,)"""
    geometry_prior: float
    groups: tuple[int, ...]
    """Candidates that models can be made of."""
    geometry: Array | None = None
    """Changes of geometry that are taken as known, in the units of their columns; None: every fit finds its own."""

    @cached_property
    def _columns(self) -> np.ndarray:
        slices = self.problem.slices
        own = [np.arange(slices[g].start, slices[g].stop) for g in self.groups]
        return np.concatenate([np.arange(self.problem.nuisance), *own]).astype(int)

    @cached_property
    def plain(self) -> Array:
        """Columns over points, m for one unknown number, (m, 3, u)."""
        return self.problem.design.some(self._columns).whole()

    @cached_property
    def residual_m(self) -> Array:
        """Residuals without what known geometry makes, (m, 3)."""
        if self.geometry is None:
            return self.problem.residual_m
        own = slice(self.problem.placement, self.problem.nuisance)
        return self.problem.residual_m - self.plain[:, :, own] @ self.geometry

    @cached_property
    def judged(self) -> np.ndarray:
        """Points that count: those with weight and the owner's validation rows, where other folds place the target."""
        used = self.problem.white.weight > 0
        counted = used | (self.fold == CHECK)
        placed = counted & placeable(self.problem.sim.seen, self.fold, used)
        return placed if placed.any() else counted

    @cached_property
    def _plain_sums(self) -> tuple[Array, Array, Array]:
        """Squares, pulls and totals of the judged points of each fold, without weights."""
        u = self.plain.shape[2]
        squares, pulls, totals = np.zeros((CHECK + 1, u, u)), np.zeros((CHECK + 1, u)), np.zeros(CHECK + 1)
        for f in range(CHECK + 1):
            mine = (self.fold == f) & self.judged
            flat, aim = self.plain[mine].reshape(-1, u), self.residual_m[mine].ravel()
            squares[f], pulls[f], totals[f] = flat.T @ flat, flat.T @ aim, aim @ aim
        return squares, pulls, totals

    @cached_property
    def _sums(self) -> tuple[Array, Array]:
        """Whitened squares and pulls of each fold, (folds, u, u) and (folds, u)."""
        white = replace(self.problem.white, piece=self.fold)
        x, y = white.rows(self.plain), white.rows(self.residual_m)
        squares, pulls = [], []
        for f in range(CHECK + 1):
            mine = self.fold == f
            flat = x[mine].reshape(-1, x.shape[2])
            squares.append(flat.T @ flat)
            pulls.append(flat.T @ y[mine].ravel())
        return np.array(squares), np.array(pulls)

    def index(self, chosen: Chosen) -> tuple[np.ndarray, Array]:
        """Columns of placement, geometry and chosen candidates among those kept here, and their prior precision."""
        widths = {g: self.problem.slices[g].stop - self.problem.slices[g].start for g in self.groups}
        starts, at = {}, self.problem.nuisance
        for g in self.groups:
            starts[g] = at
            at += widths[g]
        own = [np.arange(starts[g], starts[g] + widths[g]) for g in chosen.groups]
        index = np.concatenate([np.arange(self.problem.nuisance), *own]).astype(int)
        prior = [np.full(widths[g], 1 / s**2) for g, s in zip(chosen.groups, chosen.sizes, strict=True)]
        return index, np.concatenate([self._nuisance_precision, *prior])

    @property
    def _nuisance_precision(self) -> Array:
        return self.problem.nuisance_precision(self.geometry_prior if self.geometry is None else KNOWN)

    def left_m(self, chosen: Chosen) -> Array:
        """Residuals of every point, predicted from the other folds, (m, 3)."""
        index, _ = self.index(chosen)
        out = np.empty_like(self.residual_m)
        for f, numbers in self._by_fold(chosen):
            mine = self.fold == f
            out[mine] = self.residual_m[mine] - self.plain[mine][:, :, index] @ numbers
        return out

    def square_m2(self, chosen: Chosen) -> float:
        """Mean square length of those residuals over the points that count, m^2."""
        index, _ = self.index(chosen)
        squares, pulls, totals = self._plain_sums
        sum_m2 = sum(
            totals[f] - 2 * pulls[f, index] @ numbers + numbers @ squares[f][np.ix_(index, index)] @ numbers
            for f, numbers in self._by_fold(chosen)
        )
        return float(max(sum_m2, 0.0) / max(np.count_nonzero(self.judged), 1))

    def expected_m2(self, chosen: Chosen, noise_m2: Array) -> float:
        """Mean square of those residuals that noise and estimates as uncertain as they are let expect, m^2.

        Args:
            noise_m2: mean square length of the noise of each point, (m,).
        """
        index, prior = self.index(chosen)
        folds, squares, _ = self._others
        plain, _, _ = self._plain_sums
        total = float(noise_m2[self.judged].sum())
        for f, square in zip(folds, squares, strict=True):
            covariance = np.linalg.inv(square[np.ix_(index, index)] + np.diag(prior))
            total += float(np.sum(covariance * plain[f][np.ix_(index, index)]))
        return total / max(np.count_nonzero(self.judged), 1)

    def _by_fold(self, chosen: Chosen) -> Iterator[tuple[int, Array]]:
        """Each fold with the estimates from all others."""
        index, prior = self.index(chosen)
        folds, squares, pulls = self._others
        inner = squares[:, index[:, None], index] + np.diag(prior)
        yield from zip(folds, np.linalg.solve(inner, pulls[:, index, None])[:, :, 0], strict=True)

    @cached_property
    def _others(self) -> tuple[list[int], Array, Array]:
        """The folds that there are, and whitened squares and pulls of all points outside of each."""
        squares, pulls = self._sums
        folds = np.unique(self.fold)
        taken = (folds != CHECK)[:, None]
        square = squares[:CHECK].sum(axis=0) - np.where(taken[:, :, None], squares[folds], 0.0)
        return folds.tolist(), square, pulls[:CHECK].sum(axis=0) - np.where(taken, pulls[folds], 0.0)

    def fitted(self, chosen: Chosen) -> tuple[np.ndarray, Array, Array]:
        """Columns, estimates and their covariance from all folds together."""
        index, prior = self.index(chosen)
        squares, pulls = self._sums
        inner = squares[:CHECK].sum(axis=0)[np.ix_(index, index)] + np.diag(prior)
        covariance = np.linalg.inv(inner)
        return index, covariance @ pulls[:CHECK].sum(axis=0)[index], covariance


def mean_square(left_m: Array) -> float:
    """Mean square length, m^2; 0 of nothing."""
    return float(np.mean(np.sum(left_m**2, axis=1))) if len(left_m) else 0.0
