"""What a plan should also hold, so that effects which its points could not tell apart are told apart."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.gap.advice import block_sums
from core.gap.expected_evidence import columns_of, size_for
from core.gap.experiments import Block, blocks_for
from core.gap.isolability import APART, Isolability, Isolated
from core.gap.isolability_field import Field
from core.gap.problem import Problem
from core.gap.result import Place
from core.geometry import Array


@dataclass(frozen=True)
class Parting:
    """What an addition does for one effect."""

    effect: Place
    parted: tuple[Place, ...]
    """Rivals that it sets apart."""
    left: tuple[Place, ...]
    """Rivals that stay."""
    apart: float
    """Sum of the separations that count."""
    shows: bool = False
    """Whether it brings to light, at the stated size, what the plan alone would not show at all."""


@dataclass(frozen=True)
class Addition:
    """A block of points, and every effect that it brings to light or sets apart from some rival."""

    words: str
    points: int
    partings: tuple[Parting, ...]

    @property
    def pairs(self) -> int:
        """How many pairs of an effect and a rival it sets apart."""
        return sum(len(one.parted) for one in self.partings)

    @property
    def shown(self) -> int:
        """How many effects it brings to light."""
        return sum(one.shows for one in self.partings)


def additions(found: Isolability) -> tuple[Addition, ...]:
    """Blocks that each, added to the plan alone, show an effect or set one apart from a rival, the most useful first.

    The blocks are those that a diagnosis would ask for afterwards (``core/gap/experiments.py``).
    """
    doubtful = [one for one in found.effects if not one.named]
    every = sorted({g for one in doubtful for g in _groups(one)})
    columns = np.concatenate([np.arange(found.problem.nuisance), columns_of(found.problem, every)])
    out = []
    for block, joint in _blocks(found, doubtful):
        concerned = [one for one in doubtful if joint is None or joint in _joints(one)]
        sums = BlockSums(columns, block_sums(found.problem, block, every, columns))
        tried = [_parting(found, one, sums) for one in concerned]
        partings = [parting for parting in tried if parting.parted or parting.shows]
        if partings:
            out.append(Addition(block.words, block.count, tuple(partings)))
    return tuple(sorted(out, key=lambda one: -(one.pairs + one.shown)))


def best_for(effect: Place, tried: Sequence[Addition]) -> tuple[Addition, Parting] | None:
    """The addition that sets an effect apart from most rivals, then the one with fewest points; None: none does."""
    ways = [(one, parting) for one in tried for parting in one.partings if parting.effect == effect]
    return max(ways, key=lambda way: (way[1].shows, len(way[1].parted), -way[0].points, way[1].apart), default=None)


@dataclass(frozen=True, eq=False)
class BlockSums:
    """Sums that further points add, over some columns of a problem."""

    columns: np.ndarray
    square: Array

    def over(self, problem: Problem, groups: Sequence[int]) -> Array:
        """For nuisance and some of the candidates."""
        wanted = np.concatenate([np.arange(problem.nuisance), columns_of(problem, groups)])
        at = np.searchsorted(self.columns, wanted)
        return self.square[np.ix_(at, at)]


def _groups(one: Isolated) -> tuple[int, ...]:
    return (*one.granted.groups, one.group, *(rival.group for rival in one.rivals))


def _joints(one: Isolated) -> set[int]:
    """Joints whose sweeps may tell of an effect or its rivals."""
    places = (one.place, *(rival.place for rival in one.rivals))
    return {joint for place in places for joint in (place.joint, place.source) if joint is not None}


def _blocks(found: Isolability, doubtful: Sequence[Isolated]) -> list[tuple[Block, int | None]]:
    """Blocks that could be added, with the joint whose sweep they are; None: they may tell of everything."""
    joints = sorted({joint for one in doubtful for joint in _joints(one)})
    common = {block.words: (block, None) for block in blocks_for(found.problem.sim.seen, None)} if doubtful else {}
    own = {block.words: (block, joint) for joint in joints for block in blocks_for(found.problem.sim.seen, joint)}
    return list({**own, **common}.values())


def _parting(found: Isolability, one: Isolated, sums: BlockSums) -> Parting:
    """What further points do for an effect."""
    groups = (one.group, *(rival.group for rival in one.rivals))
    field = Field(found.problem, one.granted, groups, sums.over(found.problem, (*one.granted.groups, *groups)))
    if not one.limit.shown:
        limit = size_for(field.evidence, found.needed[list(groups)])
        return Parting(one.place, (), (), 0.0, shows=bool(limit[0] <= one.size))
    apart = field.separations(np.array([0]), np.array([one.size])).apart[0, field.place[1:]]
    places = [(rival.place, bool(far)) for rival, far in zip(one.rivals, apart >= APART, strict=True)]
    parted = tuple(place for place, far in places if far)
    left = tuple(place for place, far in places if not far)
    return Parting(one.place, parted, left, float(np.minimum(apart, APART).sum()))
