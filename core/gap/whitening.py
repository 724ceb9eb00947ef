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

    def rows(self, values: Array) -> Array:
        """Values of the points, (m, 3, ...), whitened."""
        out = self.apart(values)
        if self.correlation:
            own, before = (part.reshape(-1, *([1] * (out.ndim - 1))) for part in self._mix)
            mixed = own * out
            mixed[1:] -= before[1:] * out[:-1]
            return mixed
        return out

    def apart(self, values: Array) -> Array:
        """Values of the points, (m, 3, ...), each whitened by itself."""
        flat = values.reshape(len(values), 3, -1)
        return (self._weighed_root @ flat).reshape(values.shape)

    @cached_property
    def _weighed_root(self) -> Array:
        return self.root * np.sqrt(self.weight)[:, None, None]

    def unlink(self, columns: Array) -> None:
        """Columns of values, (p, 3, m), each whitened by itself: less the point before, in place."""
        if not self.correlation:
            return
        own, before = self._mix
        for column in columns:
            linked = before[1:] * column[:, :-1]
            column *= own
            column[:, 1:] -= linked

    @cached_property
    def _mix(self) -> tuple[Array, Array]:
        """What is taken of each point and of the point before, (m,) each."""
        rest = np.sqrt(1 - self.correlation**2)
        return np.where(self._linked, 1 / rest, 1.0), np.where(self._linked, self.correlation / rest, 0.0)

    @cached_property
    def _linked(self) -> np.ndarray:
        """Points whose noise follows on that of a point before that is taken, (m,)."""
        taken = self.weight > 0
        linked = taken & np.concatenate([[False], taken[:-1]])
        if self.piece is not None:
            linked[1:] &= self.piece[1:] == self.piece[:-1]
        return linked


def whitening(covariance_m2: Array, weight: Array, correlation: float = 0.0) -> Whitening:
    """For covariances (m, 3, 3) and weights (m,)."""
    return Whitening(np.linalg.inv(np.linalg.cholesky(covariance_m2)), weight, correlation)
