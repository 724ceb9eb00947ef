"""How well models predict points that they have not seen, fold by fold."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from core.gap.evidence import Chosen
from core.gap.folds import CHECK
from core.gap.problem import Problem
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
    def judged(self) -> np.ndarray:
        """Points that count: those with weight, and the owner's validation rows."""
        return (self.problem.white.weight > 0) | (self.fold == CHECK)

    @cached_property
    def _sums(self) -> tuple[Array, Array]:
        """Whitened squares and pulls of each fold, (folds, u, u) and (folds, u)."""
        white = self.problem.white
        x, y = white.rows(self.plain), white.rows(self.problem.residual_m)
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
        return index, np.concatenate([self.problem.nuisance_precision(self.geometry_prior), *prior])

    def left_m(self, chosen: Chosen, geometry: bool = True) -> Array:
        """Residuals of every point, predicted from the other folds, (m, 3).

        Args:
            geometry: False: the geometry stays the sim's; only base and targets are placed.
        """
        index, prior = self.index(chosen)
        if not geometry:
            keep = np.ones(len(index), dtype=bool)
            keep[self.problem.placement : self.problem.nuisance] = False
            index, prior = index[keep], prior[keep]
        squares, pulls = self._sums
        out = np.empty_like(self.problem.residual_m)
        whole, pull = squares[:CHECK].sum(axis=0), pulls[:CHECK].sum(axis=0)
        for f in np.unique(self.fold):
            square = whole - squares[f] if f != CHECK else whole
            right = pull - pulls[f] if f != CHECK else pull
            numbers = np.linalg.solve(square[np.ix_(index, index)] + np.diag(prior), right[index])
            mine = self.fold == f
            out[mine] = self.problem.residual_m[mine] - self.plain[mine][:, :, index] @ numbers
        return out

    def square_m2(self, chosen: Chosen, geometry: bool = True) -> float:
        """Mean square length of those residuals, m^2."""
        return mean_square(self.left_m(chosen, geometry)[self.judged])

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
