"""How strongly the data speak for each candidate: the marginal likelihood of its columns with one unknown size.

Each group of columns has a Gaussian prior whose scale is chosen from a grid with a wide log-normal hyperprior, so that
a group of one column and a group of sixty compete on equal terms (automatic Occam factor; MacKay 1992, doi
10.1162/neco.1992.4.3.415). Placement and geometry are integrated out first.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from core.gap.gram import Gram
from core.gap.products import Reduced
from core.geometry import Array

SIZES = 10.0 ** np.linspace(-2.0, 3.0, 21)
"""Scales of a group, in units of one noise standard deviation rms over the coordinates."""
LEAST_PRECISION = 1e-12
"""Of a nuisance column beside its own square."""
NARROW = 3
"""Groups of so few columns are multiplied all at once."""
HYPER = 0.5 * np.log10(SIZES) ** 2


@dataclass(frozen=True, eq=False)
class Chosen:
    """Candidates that are taken as given, with the scales of their priors."""

    groups: tuple[int, ...] = ()
    sizes: tuple[float, ...] = ()

    def plus(self, group: int, size: float) -> "Chosen":
        return Chosen((*self.groups, group), (*self.sizes, size))

    def without(self, k: int) -> "Chosen":
        return Chosen(self.groups[:k] + self.groups[k + 1 :], self.sizes[:k] + self.sizes[k + 1 :])


NOTHING = Chosen()


def joined(*parts: Chosen) -> Chosen:
    """All of several choices, each candidate once."""
    groups: dict[int, float] = {}
    for part in parts:
        for group, size in zip(part.groups, part.sizes, strict=True):
            groups.setdefault(group, size)
    return Chosen(tuple(groups), tuple(groups.values()))


def without(chosen: Chosen, groups: Sequence[int]) -> Chosen:
    """A choice less some candidates."""
    kept = [k for k, g in enumerate(chosen.groups) if g not in groups]
    return Chosen(tuple(chosen.groups[k] for k in kept), tuple(chosen.sizes[k] for k in kept))


@dataclass(frozen=True, eq=False)
class Gains:
    """For each of some groups: log evidence gained over what is given, and the scale that gains it."""

    evidence: Array
    size: Array


@dataclass(frozen=True, eq=False)
class Evidence:
    """The sums with the nuisance numbers integrated out."""

    sums: Gram
    nuisance: int
    """The first so many columns are nuisance."""
    precision: Array
    """Prior precision of the nuisance columns, (nuisance,)."""

    @property
    def slices(self) -> tuple[slice, ...]:
        """Columns of each group."""
        return self.sums.square.slices

    @cached_property
    def _eliminated(self) -> tuple[Reduced, Array, Array, float]:
        n = self.nuisance
        first = self.sums.square.rows(np.arange(n))
        own = first[:, :n]
        # Base and targets may stand for each other: what no prior tells apart, rounding must not either.
        inner = own + np.diag(np.maximum(self.precision, LEAST_PRECISION * np.diag(own)))
        factor = cho_factor(inner)
        placed, noise = (cho_solve(factor, part[:n]) for part in (self.sums.pull, self.sums.null_pulls))
        pull = self.sums.pull - first.T @ placed
        nulls = self.sums.null_pulls - first.T @ noise
        explained = self.sums.pull[:n] @ placed
        occam = np.linalg.slogdet(inner)[1] - np.sum(np.log(np.maximum(self.precision, 1e-300)))
        return Reduced(self.sums.square, first, cho_solve(factor, first)), pull, nulls, 0.5 * (explained - occam)

    @property
    def square(self) -> Reduced:
        """X'X without what nuisance explains."""
        return self._eliminated[0]

    @property
    def pull(self) -> Array:
        return self._eliminated[1]

    @property
    def nuisance_evidence(self) -> float:
        """Log evidence of the nuisance columns themselves, up to a constant."""
        return self._eliminated[3]

    def index(self, groups: Sequence[int]) -> np.ndarray:
        """Columns of some groups."""
        return np.concatenate([np.arange(self.slices[g].start, self.slices[g].stop) for g in groups] or [[]]).astype(
            int
        )

    def prior(self, chosen: Chosen) -> Array:
        """Prior precision of the columns of chosen groups."""
        widths = [self.slices[g].stop - self.slices[g].start for g in chosen.groups]
        return np.repeat([1 / size**2 for size in chosen.sizes], widths)

    def solution(self, chosen: Chosen) -> Array:
        """Estimates of the columns of chosen groups."""
        index = self.index(chosen.groups)
        return np.linalg.solve(self.square.within(index) + np.diag(self.prior(chosen)), self.pull[index])

    def given(self, chosen: Chosen) -> float:
        """Log evidence of chosen groups together, with their scales, above nuisance alone."""
        if not chosen.groups:
            return 0.0
        index = self.index(chosen.groups)
        prior = self.prior(chosen)
        inner = self.square.within(index) + np.diag(prior)
        explained = self.pull[index] @ np.linalg.solve(inner, self.pull[index])
        occam = np.linalg.slogdet(inner)[1] - np.sum(np.log(prior))
        hyper = sum(0.5 * np.log10(size) ** 2 for size in chosen.sizes)
        return float(0.5 * (explained - occam) - hyper)

    def gains(self, groups: np.ndarray, chosen: Chosen = NOTHING) -> Gains:
        """What each group would add to what is chosen."""
        evidence, size = np.empty(len(groups)), np.empty(len(groups))
        for places, squares, pulls in self.conditioned(groups, chosen):
            spectrum, pulls = _spectra(squares, pulls[:, :, None])
            evidence[places], size[places] = (part[:, 0] for part in best_sizes(spectrum, pulls))
        return Gains(evidence, size)

    @property
    def null_pulls(self) -> Array:
        """Pulls of draws of noise without what nuisance explains, (p, draws)."""
        return self._eliminated[2]

    @cached_property
    def bases(self) -> list[tuple[np.ndarray, Array, Array]]:
        """Group numbers, eigenvalues and eigenvectors of their squares, for groups of one width each."""
        out = []
        for one in self.square.stacks:
            values, vectors = np.linalg.eigh((one.squares + np.swapaxes(one.squares, 1, 2)) / 2)
            out.append((one.groups, np.clip(values, 0.0, None), vectors))
        return out

    def null_maxima(self, cost: Array) -> Array:
        """Largest log evidence less the cost of choosing, over all groups, of each draw of noise, (draws,)."""
        best = np.full(self.sums.null_pulls.shape[1], -np.inf)
        for mine, spectrum, vectors in self.bases:
            index = np.array([np.arange(self.slices[g].start, self.slices[g].stop) for g in mine])
            evidence, _ = best_sizes(spectrum, np.swapaxes(vectors, 1, 2) @ self.null_pulls[index])
            best = np.maximum(best, (evidence - cost[mine, None]).max(axis=0))
        return best

    def conditioned(self, groups: np.ndarray, chosen: Chosen = NOTHING) -> Iterator[tuple[np.ndarray, Array, Array]]:
        """Squares and pulls of groups of one width at a time, what is chosen taken out."""
        pull = self.pull
        if chosen.groups:
            index = self.index(chosen.groups)
            across = self.square.rows(index)
            solved = np.linalg.inv(across[:, index] + np.diag(self.prior(chosen))) @ across
            pull = pull - pull[index] @ solved
        place = np.full(len(self.slices), -1)
        place[groups] = np.arange(len(groups))
        for one in self.square.stacks:
            places = place[one.groups]
            mine = places >= 0
            if not mine.any():
                continue
            columns, squares = one.columns[mine], one.squares[mine]
            if chosen.groups:
                squares = squares - _between(across, solved, columns)
            yield places[mine], squares, pull[columns]


def _between(across: Array, solved: Array, columns: np.ndarray) -> Array:
    """Products over the first axis of (k, p) each, for columns (g, w) of each group with each other, (g, w, w)."""
    if columns.shape[1] > NARROW:
        return np.moveaxis(across[:, columns], 0, 2) @ np.moveaxis(solved[:, columns], 0, 1)
    left, right = across.T[columns], solved.T[columns]
    return np.einsum("gak,gbk->gab", left, right)


def _spectra(squares: Array, pulls: Array) -> tuple[Array, Array]:
    """Eigenvalues (g, k) of the squares and the pulls (g, k, d) in their eigenvectors."""
    values, vectors = np.linalg.eigh((squares + np.swapaxes(squares, 1, 2)) / 2)
    return np.clip(values, 0.0, None), np.swapaxes(vectors, 1, 2) @ pulls


def best_sizes(spectrum: Array, pulls: Array) -> tuple[Array, Array]:
    """Log evidence at the best scale, and the scale, (g, d) each."""
    power = pulls**2
    grown = 1 + SIZES[:, None, None] ** 2 * spectrum
    occam = 0.5 * np.log(grown).sum(axis=2) + HYPER[:, None]
    table = 0.5 * np.einsum("sgk,gkd->sgd", SIZES[:, None, None] ** 2 / grown, power) - occam[:, :, None]
    best = table.argmax(axis=0)
    return np.take_along_axis(table, best[None], axis=0)[0], SIZES[best]
