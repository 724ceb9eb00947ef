"""What to measure next when causes remain that the data cannot tell apart.

For two rivals e and f and a block of points that could be measured, the noncentrality

    lambda = b' (H_ee - H_ef H_ff^-1 H_fe) b

with the sums of columns of data and block together (placement and geometry taken out, b the estimate of e) says how
many squared standard deviations would then lie between them (T-optimality; Atkinson and Fedorov 1975, doi
10.1093/biomet/62.1.57).
"""

from dataclasses import replace

import numpy as np

from core.gap.analysis import Analysis
from core.gap.design import Design, candidate_columns
from core.gap.doings import doings
from core.gap.evidence import Chosen
from core.gap.experiments import Block, blocks_for, observe_block
from core.gap.held_joints import is_offset_of_held, words_to_measure
from core.gap.problem import Problem
from core.gap.result import Place, Rivals
from core.geometry import Array

STRUCTURAL = 1.3
"""A block that multiplies the noncentrality by less separates nothing."""
ENOUGH = 9.0
CANNOT = (
    "No block of points that could be measured here separates these: find out otherwise (mastering marks, a drawing, "
    "a scale bar, a target on the link before), or take either."
)


def advice(analysis: Analysis, places: tuple[Place, ...]) -> Rivals:
    """The measurement that would separate the first two of some places best, and by how much."""
    problem = analysis.problem
    if is_offset_of_held(problem.sim.seen, places[0]):
        return Rivals(places, words_to_measure(places[0]), 0.0)
    groups = [_best_group(analysis, place) for place in places[:2]]
    columns, sums, precision, estimate = _known(analysis, groups)
    now = _noncentrality(sums, precision, problem, estimate)
    best: tuple[float, Block] | None = None
    for block in blocks_for(problem.sim.seen, places[0].joint or places[1].joint):
        then = _noncentrality(sums + block_sums(problem, block, groups, columns), precision, problem, estimate)
        if best is None or then > best[0]:
            best = (then, block)
    if best is None or best[0] < max(STRUCTURAL * now, ENOUGH):
        return Rivals(places, CANNOT, 0.0)
    words = f"Measure {best[1].words} ({best[1].count} points)."
    return Rivals(places, words, float(np.sqrt(best[0])))


def _best_group(analysis: Analysis, place: Place) -> int:
    """The candidate that describes a place best when it stands alone."""
    of = [k for k in analysis.problem.named if analysis.problem.candidates[k].place.same_as(place)]
    return int(max(of, key=lambda k: analysis.found.alone[k]))


def _known(analysis: Analysis, groups: list[int]) -> tuple[np.ndarray, Array, Array, Array]:
    """Columns of nuisance and both rivals, their sums so far, prior precision, and the estimate of the first."""
    problem, evidence = analysis.problem, analysis.evidence
    index = np.concatenate([np.arange(problem.nuisance), evidence.index(groups)]).astype(int)
    sums = problem.sums.square.within(index)
    sizes = analysis.found.alone_size[groups]
    first = Chosen((groups[0],), (float(sizes[0]),))
    prior = evidence.prior(Chosen(tuple(groups), tuple(float(size) for size in sizes)))
    precision = np.concatenate([problem.nuisance_precision(analysis.geometry_prior), prior])
    return index, sums, precision, evidence.solution(first)


def block_sums(problem: Problem, block: Block, groups: list[int], columns: np.ndarray) -> Array:
    """The sums that a block would add, with the noise that the points so far have on average."""
    seen = observe_block(problem.sim.seen, block)
    told = doings(seen)
    own, _, _ = candidate_columns([problem.candidates[g] for g in groups], told)
    places = problem.sim.target_m
    added = len(block.campaign.targets) - len(places)
    offset = np.array([(0.12, -0.09, 0.08)])
    sim = replace(problem.sim, seen=seen, target_m=np.vstack([places, *([places[-1:] + offset] * added)]))
    design = Design(sim, (*problem.nuisance_columns(seen), *own), problem.design.scale[columns])
    weight = np.sqrt(np.mean(np.sum(problem.white.root**2, axis=(1, 2))) / 3)
    flat = (design.whole() * weight).reshape(-1, len(columns))
    return flat.T @ flat


def _noncentrality(sums: Array, precision: Array, problem: Problem, estimate: Array) -> float:
    e = slice(problem.nuisance, problem.nuisance + len(estimate))
    rest = np.ones(len(sums), dtype=bool)
    rest[e] = False
    inner = sums[np.ix_(rest, rest)] + np.diag(precision[rest])
    across = sums[e][:, rest]
    return float(estimate @ (sums[e, e] - across @ np.linalg.solve(inner, across.T)) @ estimate)
