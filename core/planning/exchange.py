"""The best few out of many possible sightings: optimal design of experiments by exchange.

Sightings i = 1..N would add A_i'A_i (``core/planning/information.py``); a given number of them is chosen so that the
information M leaves as little uncertainty as can be, by one of two criteria:

    I (also called V)   trace(L M^-1), the expected mean square error over the poses that matter (``Required.loss``)
    D                   -log det M, the volume of the unknowns' confidence ellipsoid

From a random choice on, the best sighting is added and the worst one taken away until both are the same: exchange of
one point at a time (Fedorov 1972, Theory of Optimal Experiments; Mitchell 1974, Technometrics 16(2), 203, with
excursions of length one), as used for robots by Sun and Hollerbach (2008, Active robot calibration algorithm, IEEE
ICRA, 1276). With C = M^-1, D = A C A' and E = A C L C A' (3 x 3 each), adding a sighting changes the criteria by

    trace(L M^-1):  -trace((I + D)^-1 E)        log det M:  log det(I + D)

and taking it away by the same with -D for D and the sign turned. Both stand for all sightings at once, and one exchange
changes C by a matrix of rank three, so that thousands of candidates take seconds.
"""

from dataclasses import dataclass

import numpy as np

from core.errors import InputError
from core.geometry import Array

CRITERIA = ("I", "D")
MOST_EXCHANGES = 4000
WORTHWHILE = 1e-7
"""Exchanges end when one improves the criterion by less than this (share of it; of log det: absolute)."""
REFRESHED = 64
"""Steps after which everything is computed anew, so that rounding does not pile up."""


@dataclass(frozen=True)
class Choice:
    """Which sightings were chosen."""

    index: np.ndarray
    """Ascending, (count,)."""
    exchanges: int
    history: Array
    """The criterion after each exchange: trace(L M^-1), or -log det M, (exchanges + 1,)."""


def choose(candidates: Array, count: int, prior: Array, rng: np.random.Generator, loss: Array | None = None) -> Choice:
    """Choose sightings; none is taken twice.

    Args:
        candidates: A of every candidate, (N, 3, p).
        count: how many are to be chosen.
        prior: information that is there anyway, (p, p), positive definite.
        rng: of the first choice.
        loss: L of the I-criterion, (p, p); None: D.

    Raises:
        InputError: there are fewer candidates than are to be chosen.
    """
    if len(candidates) < count:
        raise InputError(f"there are {len(candidates)} candidates only, expected at least {count} to choose from")
    chosen = np.sort(rng.permutation(len(candidates))[:count])
    design = _Design(candidates, prior, loss, chosen)
    history = [design.value()]
    for _ in range(MOST_EXCHANGES if count < len(candidates) else 0):
        design.change(design.best_to_add(), +1)
        design.change(design.worst_member(), -1)
        value = design.value()
        scale = abs(history[-1]) if loss is not None else 1.0
        if not value < history[-1] - WORTHWHILE * scale:
            break
        history.append(value)
        chosen = np.flatnonzero(design.member)
    return Choice(chosen, len(history) - 1, np.array(history))


class _Design:
    """The chosen sightings with everything that a step needs of all candidates."""

    def __init__(self, candidates: Array, prior: Array, loss: Array | None, first: np.ndarray) -> None:
        self._a, self._prior, self._root = candidates, prior, None if loss is None else _root(loss)
        self.member = np.zeros(len(candidates), dtype=bool)
        self.member[first] = True
        self._steps = 0
        self._refresh()

    def value(self) -> float:
        """The criterion, the less the better."""
        if self._root is not None:
            return float(np.sum((self._root @ self._covariance) * self._root))
        return float(np.linalg.slogdet(self._covariance)[1])

    def best_to_add(self) -> int:
        gain = self._worth(+1)
        return int(np.argmax(np.where(self.member, -np.inf, gain)))

    def worst_member(self) -> int:
        loss = self._worth(-1)
        return int(np.argmin(np.where(self.member, loss, np.inf)))

    def change(self, index: int, sign: int) -> None:
        """Add (+1) or take away (-1) a sighting: C -+ U (I +- D)^-1 U' with U = C A'."""
        self.member[index] = sign > 0
        self._steps += 1
        if self._steps % REFRESHED == 0:
            self._refresh()
            return
        u = self._ac[index].T.copy()
        inner = np.linalg.inv(np.eye(3) + sign * (self._a[index] @ u))
        along = self._a.reshape(-1, len(u)) @ u @ inner * sign
        self._covariance = self._covariance - sign * u @ inner @ u.T
        self._ac -= (along @ u.T).reshape(self._a.shape)
        if self._root is not None:
            self._acr -= (along @ (self._root @ u).T).reshape(*self._a.shape[:2], -1)

    def _refresh(self) -> None:
        chosen = self._a[self.member].reshape(-1, self._a.shape[2])
        self._covariance = np.linalg.inv(self._prior + chosen.T @ chosen)
        self._ac = self._a @ self._covariance
        self._acr = None if self._root is None else self._ac @ self._root.T

    def _worth(self, sign: int) -> Array:
        """What adding (+1) gains, or taking away (-1) costs, for every candidate, (N,)."""
        d = np.eye(3) + sign * np.einsum("nip,njp->nij", self._ac, self._a)
        if self._root is None:
            return sign * np.linalg.slogdet(d)[1]
        e = np.einsum("nip,njp->nij", self._acr, self._acr)
        return np.trace(np.linalg.solve(d, e), axis1=1, axis2=2)


def _root(loss: Array) -> Array:
    """R with R'R = L, (r, p)."""
    values, vectors = np.linalg.eigh(loss)
    kept = values > 1e-14 * values[-1]
    return np.sqrt(values[kept])[:, None] * vectors[:, kept].T
