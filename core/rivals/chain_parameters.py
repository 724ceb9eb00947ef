"""Sets of numbers that describe all joint axes of an arm at rest, with the derivative of the axes.

Each is a way to write the geometry: parameters of the phi-model here, Denavit-Hartenberg parameters in
``denavit_hartenberg.py``. All begin where the nominal axes lie.
"""

from abc import ABC, abstractmethod

import numpy as np

from core.estimate import axis_basis
from core.geometry import Array, Line, cross, transform
from core.phi_convention import Convention
from core.phi_model import PhiModel, axes, from_axes
from core.phi_uncertainty import axes_by_parameters
from core.rivals.rotation_charts import left_jacobian
from core.rotations import rotations_of_vectors


class ChainParameters(ABC):
    """A way to write the geometry of a chain; every parameter is zero at the start."""

    @property
    @abstractmethod
    def size(self) -> int:
        """How many parameters there are."""

    @abstractmethod
    def axes(self, x: Array) -> tuple[Line, ...]:
        """The joint axes at rest for parameters (size,)."""

    @abstractmethod
    def by_parameters(self, x: Array) -> Array:
        """Derivatives of tilts and shifts of every axis, at its point, by the parameters, (4n, size)."""


class PhiParameters(ChainParameters):
    """Shift and turn of the base frame, then the free parameters of the phi-model (appendix of the paper)."""

    def __init__(self, start: tuple[Line, ...], convention: Convention) -> None:
        self._base, self._model = from_axes(start, convention)
        self._free = convention.free

    @property
    def size(self) -> int:
        return 6 + int(self._free.sum())

    def axes(self, x: Array) -> tuple[Line, ...]:
        return axes(self._at(x), self._base_at(x))

    def by_parameters(self, x: Array) -> Array:
        lines, base = self.axes(x), self._base_at(x)
        turns, shifts = np.zeros((6, 3)), np.zeros((6, 3))
        shifts[:3] = np.eye(3)
        turns[3:] = left_jacobian(x[3:6]).T
        by_base = axes_by_twists(lines, turns, shifts, base[:3, 3], np.zeros(6, dtype=int))
        by_model = axes_by_parameters(lines, base, self._at(x))[:, self._free.ravel()]
        return np.concatenate([by_base, by_model], axis=1)

    def _at(self, x: Array) -> PhiModel:
        values = self._model.parameters.copy()
        values[self._free] += x[6:]
        return PhiModel(self._model.phi_rad, *values.T, sliding=self._model.sliding)

    def _base_at(self, x: Array) -> Array:
        turn = rotations_of_vectors(x[None, 3:6])[0]
        return transform(turn @ self._base[:3, :3], self._base[:3, 3] + x[:3])


def axes_by_twists(lines: tuple[Line, ...], turns: Array, shifts: Array, centres_m: Array, first: np.ndarray) -> Array:
    """Tilts and shifts of axes, at their points, by motions of all that follows some place in the chain.

    Args:
        lines: the n axes.
        turns, shifts: angular velocity of each motion, and velocity of its centre, (k, 3).
        centres_m: the centres, (3,) or (k, 3).
        first: index of the first axis that each moves, (k,).

    Returns:
        (4n, k).
    """
    out = np.zeros((4 * len(lines), len(turns)))
    for i, line in enumerate(lines):
        basis, moves = axis_basis(line.direction), first <= i
        out[4 * i : 4 * i + 2] = basis @ cross(turns, line.direction).T * moves
        out[4 * i + 2 : 4 * i + 4] = basis @ (shifts + cross(turns, line.point_m - centres_m)).T * moves
    return out
