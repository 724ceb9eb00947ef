"""How much of an effect can be seen: what placement of base and targets and the arm's small clutter cannot absorb."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from tests.benchmarks.withheld.rigid import Array
from tests.benchmarks.withheld.sessions import Session

SIGMA_M = 25e-6
"""Standard deviation of one coordinate of a point."""
CLUTTER = 3e-5
"""Standard deviation of each link's six small errors, rad and m, that every arm of the suite has."""


@dataclass(frozen=True)
class Absorber:
    """First-order columns of everything that a diagnosis has to leave free, over a session's measured rows."""

    session: Session

    @cached_property
    def columns(self) -> Array:
        """Base (6), targets (3 each), links (6 each, over their prior), in standard deviations, (3 k, columns)."""
        session, rows = self.session, self.session.measured
        at, point = session.nominal, session.nominal_m[rows]
        base = session.base[:3, :3]
        k, n = len(point), session.arm.count
        columns = [_twists(np.tile(np.eye(3), (k, 1, 1)), point - session.base[:3, 3])]
        last = base @ at.end_rotation[rows, -1]
        columns += [last * (session.target[rows] == t)[:, None, None] for t in range(session.targets)]
        for i in range(n - 1):
            frame = base @ at.end_rotation[rows, i]
            origin = at.end_origin[rows, i] @ base.T + session.base[:3, 3]
            columns.append(CLUTTER * _twists(frame, point - origin))
        return np.concatenate(columns, axis=2).reshape(3 * k, -1) / SIGMA_M

    @cached_property
    def prior(self) -> Array:
        """Precision of each column, (columns,): placement is free, links have their prior."""
        free = 6 + 3 * self.session.targets
        return np.concatenate([np.full(free, 1e-9), np.ones(self.columns.shape[1] - free)])

    @cached_property
    def _factor(self) -> tuple[Array, bool]:
        gram = self.columns.T @ self.columns + np.diag(self.prior)
        # Placement columns may be redundant (a target on the axis): a ridge far below any prior keeps it solvable.
        return cho_factor(gram + 1e-12 * np.trace(gram) / len(gram) * np.eye(len(gram)))

    def left(self, shift_m: Array) -> float:
        """Rms a coordinate, in standard deviations, of shifts (k, 3) after the best absorption."""
        return float(np.sqrt(max(self._product(shift_m, shift_m), 0.0) / shift_m.size))

    def alike(self, a: Array, b: Array) -> float:
        """Cosine between what is left of two shifts: 1 where one can stand for the other."""
        both = self._product(a, a) * self._product(b, b)
        return float(self._product(a, b) / np.sqrt(both)) if both > 0 else 0.0

    def _product(self, a: Array, b: Array) -> float:
        """Inner product, in standard deviations, of what is left of two shifts (k, 3)."""
        y, z = a.ravel() / SIGMA_M, b.ravel() / SIGMA_M
        return float(y @ z - (self.columns.T @ y) @ cho_solve(self._factor, self.columns.T @ z))


def raw(shift_m: Array) -> float:
    """Rms a coordinate, in standard deviations, of shifts about their mean."""
    return float(np.sqrt(((shift_m - shift_m.mean(axis=0)) ** 2).mean()) / SIGMA_M)


def _twists(frame: Array, lever: Array) -> Array:
    """Shift of points for small turns about, then shifts along, the axes of frames (k, 3, 3): (k, 3, 6)."""
    turns = np.cross(np.swapaxes(frame, 1, 2), lever[:, None, :])
    return np.concatenate([np.swapaxes(turns, 1, 2), frame], axis=2)
