"""Whether probabilities mean what they say: effects drawn on this very robot and protocol, named as real ones are.

Everything happens in sums over points, so a world costs one product: the pulls of an effect of random place, shape and
size, of noise, and of a little of something that no name describes.
"""

from dataclasses import dataclass

import numpy as np

from core.gap.evidence import Evidence, best_sizes
from core.gap.posterior import blunted
from core.gap.problem import Problem
from core.gap.result import Reliability
from core.geometry import Array

WORLDS, SEED = 60, 23
SIZES = (0.03, 3.0)
"""Of effects, in noise standard deviations rms over the coordinates, drawn evenly by their logarithm."""
STRANGE = 0.15
"""Rms size of what no name describes, as a share of the effect."""
EDGES = np.array([0.0, 0.2, 0.4, 0.6, 0.8, 0.95, 1.0 + 1e-9])


def reliability(problem: Problem, evidence: Evidence, threshold: float) -> Reliability | None:
    """Probabilities said of the first name in drawn worlds, and how often it was right; None: nothing to draw."""
    drawn = _drawn(problem, evidence)
    if drawn is None:
        return None
    places = _places(problem)
    score = np.full((len(problem.candidates), len(drawn.truth)), -np.inf)
    for groups, spectrum, vectors in evidence.bases:
        if not problem.candidates[groups[0]].named and not any(problem.candidates[g].named for g in groups):
            continue
        index = np.array([np.arange(problem.slices[g].start, problem.slices[g].stop) for g in groups])
        pulls = np.swapaxes(vectors, 1, 2) @ drawn.pulls[index]
        score[groups] = best_sizes(spectrum, pulls)[0] - problem.cost[groups, None]
    score[problem.nameless] = -np.inf
    by_place = np.full((places.max() + 1, score.shape[1]), -np.inf)
    np.maximum.at(by_place, places[problem.named], score[problem.named])
    top = by_place.max(axis=0)
    said = 1 / np.sum(np.exp(blunted(by_place - top, top)), axis=0)
    right = by_place.argmax(axis=0) == places[drawn.truth]
    return _table(said[top > threshold], right[top > threshold])


@dataclass(frozen=True, eq=False)
class Drawn:
    """Worlds: the candidate that is true in each, (w,), and the pulls of all columns, (p, w)."""

    truth: np.ndarray
    pulls: Array


def _drawn(problem: Problem, evidence: Evidence) -> Drawn | None:
    rng = np.random.default_rng(SEED)
    places = _places(problem)
    named, nameless = problem.named, problem.nameless
    seen = [g for g in named if np.trace(evidence.square.block(g)) > 1.0]
    if not seen or not len(nameless):
        return None
    worlds = min(WORLDS, evidence.null_pulls.shape[1])
    numbers, truth = np.zeros((len(evidence.pull), worlds)), np.zeros(worlds, dtype=int)
    kinds = np.unique(places[seen])
    for w in range(worlds):
        kind = rng.choice(kinds)
        truth[w] = rng.choice([g for g in seen if places[g] == kind])
        size = np.exp(rng.uniform(*np.log(SIZES))) * np.sqrt(problem.sums.count)
        for g, share in ((truth[w], 1.0), (rng.choice(nameless), STRANGE)):
            own = problem.slices[g]
            shape = rng.standard_normal(own.stop - own.start)
            energy = float(shape @ evidence.square.block(g) @ shape)
            numbers[own, w] += shape * (share * size / np.sqrt(max(energy, 1e-12)))
    return Drawn(truth, evidence.null_pulls[:, :worlds] + evidence.square.times(numbers))


def _places(problem: Problem) -> np.ndarray:
    """Number of the place of every candidate, (c,)."""
    known: dict[tuple[object, ...], int] = {}
    out = []
    for candidate in problem.candidates:
        p = candidate.place
        out.append(known.setdefault((p.effect, p.joint, p.source, p.frame, p.target, p.variable), len(known)))
    return np.array(out)


def _table(said: Array, right: np.ndarray) -> Reliability | None:
    if not len(said):
        return None
    which = np.digitize(said, EDGES) - 1
    bins = np.unique(which)
    return Reliability(
        np.array([said[which == b].mean() for b in bins]),
        np.array([right[which == b].mean() for b in bins]),
        np.array([int(np.count_nonzero(which == b)) for b in bins]),
    )
