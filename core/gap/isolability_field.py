"""The candidates that compete for planned points: what each would have to reach, and how far apart they stand."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from core.gap.detection import UNITS
from core.gap.effects.candidate import Candidate
from core.gap.evidence import Chosen, Evidence
from core.gap.expected_evidence import expected_evidence, granting
from core.gap.parameter_units import LARGEST
from core.gap.posterior import blunted
from core.gap.problem import Problem
from core.gap.result import Place
from core.geometry import Array

STATED = 3.0
"""Noise standard deviations rms by which an effect moves the points when its rivals are named."""
LARGEST_M = 0.1
"""What is not seen when it moves the targets by so much is not seen at all."""
COMPONENTS = {"sine", "cosine", "x", "y", "z"}
"""What numbers of one quantity differ by in their names."""


@dataclass(frozen=True)
class Limit:
    """The smallest size of an effect that would be found in some four campaigns of five; infinite: none would."""

    rms_m: float
    """What it moves the sighted targets by, rms, m, before base and targets are placed anew."""
    size: float
    """Of its parameter; NaN: it has none of its own."""
    unit: str
    """``rad``, ``m``, ``1``, .. of that parameter; empty: it has none of its own."""

    @property
    def shown(self) -> bool:
        return math.isfinite(self.rms_m)


@dataclass(frozen=True, eq=False)
class Separations:
    """Of each acting candidate from every place."""

    apart: Array
    """Standard deviations, (acting, places); infinite from its own."""
    rival: np.ndarray
    """The candidate at each place that comes nearest, (acting, places)."""

    def nearer_than(self, least: float, acting: int) -> list[int]:
        """Places less than so far away, nearest first."""
        order = np.argsort(self.apart[acting], kind="stable")
        return [int(p) for p in order if self.apart[acting, p] < least]


@dataclass(frozen=True, eq=False)
class Field:
    """Some candidates of a problem; they are counted 0, 1, ... here."""

    problem: Problem
    granted: Chosen
    groups: tuple[int, ...]
    """Their numbers in the problem."""
    more: Array | None = None
    """Sums of further points; see ``granting``."""

    @cached_property
    def evidence(self) -> Evidence:
        return granting(self.problem, self.granted, self.groups, self.more)

    @cached_property
    def cost(self) -> Array:
        return self.problem.cost[list(self.groups)]

    @cached_property
    def place(self) -> np.ndarray:
        """Number of the place of every candidate, 0 the first, (g,)."""
        numbers: dict[Place, int] = {}
        return np.array([numbers.setdefault(place_of(self.problem, g), len(numbers)) for g in self.groups], dtype=int)

    @cached_property
    def strength(self) -> Array:
        """What a size of one moves the coordinates by, in noise standard deviations rms, (g,)."""
        square, count = self.problem.sums.square, max(self.problem.sums.count, 1)
        return np.sqrt([np.trace(square.block(g)) / count for g in self.groups])

    @cached_property
    def stated(self) -> Array:
        """The size at which each moves the points by ``STATED`` standard deviations of noise, (g,)."""
        return np.where(self.strength > 0, STATED / np.maximum(self.strength, 1e-300), 0.0)

    @cached_property
    def moved_m(self) -> Array:
        """What a size of one moves the targets by, rms, m, (g,)."""
        return self.strength * np.sqrt(3) * noise_rms_m(self.problem)

    def standing_for(self, asked: np.ndarray, limit: Array) -> np.ndarray:
        """One candidate for every place among the asked: the plainest, or of a grid of choices the middle one.

        Args:
            limit: the size from which each candidate would be seen, (g,).
        """
        out = []
        for place in dict.fromkeys(self.place[asked]):
            mine = asked[self.place[asked] == place]
            free = [k for k in mine if _chosen_from_grid(self.problem.candidates[self.groups[k]])]
            order = sorted(free, key=lambda k: limit[k] * max(self.strength[k], 1e-300))
            out.append(order[len(order) // 2] if len(order) == len(mine) else mine[0])
        return np.array(out, dtype=int)

    def separations(self, acting: np.ndarray, size: Array) -> Separations:
        """How far acting candidates of some sizes, (acting,), are from every place."""
        score = expected_evidence(self.evidence, acting, size) - self.cost
        count = int(self.place.max()) + 1
        best, rival = np.empty((len(acting), count)), np.empty((len(acting), count), dtype=int)
        for p in range(count):
            mine = np.flatnonzero(self.place == p)
            rival[:, p] = mine[score[:, mine].argmax(axis=1)]
            best[:, p] = score[:, mine].max(axis=1)
        rows, own = np.arange(len(acting)), self.place[acting]
        right = best[rows, own][:, None]
        apart = np.sqrt(2 * np.maximum(blunted(right - best, right), 0.0))
        apart[rows, own] = np.inf
        return Separations(apart, rival)

    def limit(self, k: int, size: float) -> Limit:
        """A size of a candidate in the terms of people."""
        group = self.groups[k]
        unit = one_quantity(self.problem.candidates[group].names)
        own = size * float(np.linalg.norm(self.problem.design.scale[self.problem.slices[group]]))
        rms_m = size * float(self.moved_m[k]) if math.isfinite(size) else math.inf
        seen = rms_m <= LARGEST_M and own <= LARGEST.get(unit, math.inf)
        return Limit(rms_m if seen else math.inf, (own if seen else math.inf) if unit else math.nan, unit)


def place_of(problem: Problem, group: int) -> Place:
    """The place of a candidate; the record at which something changes could be any."""
    return replace(problem.candidates[group].place, record=None)


def noise_rms_m(problem: Problem) -> float:
    """Noise of one coordinate, rms over the shots, m."""
    return float(np.sqrt(np.trace(problem.sim.seen.stated_covariance_m2, axis1=1, axis2=2).mean() / 3))


def one_quantity(names: Sequence[str]) -> str:
    """The SI unit of numbers that are the components of one quantity; empty: they are not."""
    stems = {"_".join(part for part in name.split("_") if part not in COMPONENTS) for name in names}
    return next((unit for unit in UNITS if names[0].endswith(f"_{unit}")), "") if len(stems) == 1 else ""


def _chosen_from_grid(candidate: Candidate) -> bool:
    """Whether an order, an angle or a moment was chosen that could be any."""
    return candidate.place.record is not None or bool(candidate.fixed)
