"""How much evidence a diagnosis may expect for every candidate when one of them acts, before any point is measured.

With X the whitened columns after placement and geometry are taken out, A = X'X, an effect whose numbers are drawn as
N(0, t^2) makes pulls whose mean square along the eigenvectors V of a rival's own block is

    t^2 sum_c (A V)_c^2 + spectrum,

the first from the effect, summed over its columns c, the second from noise. Log evidence at a fixed scale is linear in
these squares, so its expectation is exact: what a rival explains of the effect less what its freedom costs it (the
Occam factor of ``core/gap/evidence.py``).
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from core.gap.analysis import AS_CALIBRATED
from core.gap.evidence import Chosen, Evidence, best_sizes
from core.gap.gram import Gram
from core.gap.problem import Problem
from core.gap.products import OfSquare
from core.geometry import Array

TRIED = 10.0 ** np.linspace(-4.0, 4.0, 161)
"""Sizes of an effect, in noise standard deviations rms over the coordinates."""


def columns_of(problem: Problem, groups: Sequence[int]) -> np.ndarray:
    """The columns of some candidates in a problem, (k,)."""
    parts = [np.arange(problem.slices[g].start, problem.slices[g].stop) for g in groups]
    return np.concatenate(parts or [np.zeros(0)]).astype(int)


def granting(problem: Problem, granted: Chosen, groups: Sequence[int], more: Array | None = None) -> Evidence:
    """The sums for some candidates, others granted beside placement and geometry.

    Args:
        groups: candidates 0, 1, ... of what is returned.
        more: sums of further points, over the columns of nuisance, of what is granted and of the groups, (k, k).
    """
    index = np.concatenate(
        [np.arange(problem.nuisance), columns_of(problem, granted.groups), columns_of(problem, groups)]
    ).astype(int)
    square = problem.sums.square.whole[np.ix_(index, index)]
    widths = [problem.slices[g].stop - problem.slices[g].start for g in granted.groups]
    prior = np.repeat([1 / size**2 for size in granted.sizes], widths)
    precision = np.concatenate([problem.nuisance_precision(AS_CALIBRATED), prior])
    ends = len(precision) + np.cumsum([0, *(problem.slices[g].stop - problem.slices[g].start for g in groups)])
    slices = tuple(slice(int(a), int(b)) for a, b in pairwise(ends))
    sums = Gram(
        OfSquare(square if more is None else square + more, slices),
        np.zeros(len(index)),
        0.0,
        problem.sums.count,
        np.zeros((len(index), 0)),
    )
    return Evidence(sums, len(precision), precision)


def expected_evidence(evidence: Evidence, acting: Sequence[int], size: Array) -> Array:
    """Log evidence of every group when each of some groups acts, (acting, groups).

    Args:
        size: standard deviation of the numbers of each acting group, (acting,).
    """
    across = evidence.square.rows(evidence.index(acting))
    widths = [evidence.slices[g].stop - evidence.slices[g].start for g in acting]
    starts = np.cumsum([0, *widths[:-1]])
    out = np.empty((len(acting), len(evidence.slices)))
    for groups, spectrum, vectors in evidence.bases:
        index = np.array([np.arange(evidence.slices[g].start, evidence.slices[g].stop) for g in groups])
        pulls = np.moveaxis(across[:, index], 0, 1) @ vectors
        power = np.add.reduceat(pulls**2, starts, axis=1) * size[None, :, None] ** 2 + spectrum[:, None, :]
        out[:, groups] = best_sizes(spectrum, np.sqrt(np.swapaxes(power, 1, 2)))[0].T
    return out


def size_for(evidence: Evidence, needed: Array) -> Array:
    """The size from which each group gathers so much log evidence for itself, infinite where none does, (groups,)."""
    out = np.empty(len(evidence.slices))
    for groups, spectrum, _ in evidence.bases:
        power = TRIED**2 * spectrum[:, :, None] ** 2 + spectrum[:, :, None]
        grown, _ = best_sizes(spectrum, np.sqrt(power))
        for g, row in zip(groups, np.maximum.accumulate(grown, axis=1), strict=True):
            reached = row[-1] >= needed[g]
            out[g] = np.exp(np.interp(needed[g], row, np.log(TRIED))) if reached else np.inf
    return out
