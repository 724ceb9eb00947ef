"""Residuals and columns divided by what the noise makes of them: unit variance, no correlation."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from core.geometry import Array


@dataclass(frozen=True, eq=False)
class Whitening:
    """The noise of points in the order of measurement."""

    root: Array
    """Inverse of the Cholesky factor of each point's covariance, (m, 3, 3)."""
    weight: Array
    """Of each point, 0: left out, 1: taken in full, (m,)."""
    correlation: float = 0.0
    """Of a point's noise with that of the point before it."""
    piece: np.ndarray | None = None
    """Pieces that are taken as unrelated, so that one may be kept out, (m,); None: all is one."""

    def rows(self, values: Array, first: int = 0, before: Array | None = None) -> Array:
        """Values (r, 3, ...) of rows first.. whitened; ``before``: those of the row before the first, (1, 3, ...)."""
        r = slice(first, first + len(values))
        out = self._one(values, r)
        if not self.correlation:
            return out
        previous = np.concatenate(
            [np.zeros_like(out[:1]) if before is None else self._one(before, slice(first - 1, first)), out[:-1]]
        )
        linked = self._linked[r].reshape(-1, *([1] * (out.ndim - 1)))
        mixed = (out - self.correlation * previous) / np.sqrt(1 - self.correlation**2)
        return np.where(linked, mixed, out)

    @cached_property
    def _linked(self) -> np.ndarray:
        """Points whose noise follows on that of a point before that is taken, (m,)."""
        taken = self.weight > 0
        linked = taken & np.concatenate([[False], taken[:-1]])
        if self.piece is not None:
            linked[1:] &= self.piece[1:] == self.piece[:-1]
        return linked

    def _one(self, values: Array, rows: slice) -> Array:
        flat = values.reshape(len(values), 3, -1)
        out = (self.root[rows] @ flat) * np.sqrt(self.weight[rows])[:, None, None]
        return out.reshape(values.shape)


def whitening(covariance_m2: Array, weight: Array, correlation: float = 0.0) -> Whitening:
    """For covariances (m, 3, 3) and weights (m,)."""
    return Whitening(np.linalg.inv(np.linalg.cholesky(covariance_m2)), weight, correlation)
