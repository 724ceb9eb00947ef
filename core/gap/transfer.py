"""The same causes fitted on one part of the points and judged on another that differs in kind."""

import numpy as np

from core.gap.evidence import Chosen
from core.gap.folds import CHECK, FOLDS, regions, times
from core.gap.kept_out import KeptOut, mean_square
from core.gap.problem import Problem
from core.gap.result import Transfer

FEWEST = 12
"""Points on either side."""


def transfers(problem: Problem, geometry_prior: float, chosen: Chosen) -> tuple[Transfer, ...]:
    """All splits that the data allow: base and targets placed alone, and with all causes."""
    out = []
    for fitted_on, predicted, is_fitted in _splits(problem):
        fold = np.where(is_fitted, 0, CHECK)
        if min(np.count_nonzero(is_fitted), np.count_nonzero(~is_fitted)) >= FEWEST:
            out.append(_transfer(problem, geometry_prior, chosen, fold, fold == CHECK, fitted_on, predicted))
    out += _rotated(problem, geometry_prior, chosen)
    return tuple(out)


def _splits(problem: Problem) -> list[tuple[str, str, np.ndarray]]:
    seen, doings = problem.sim.seen, problem.doings
    out = [("sweeps", "poses", seen.swept), ("poses", "sweeps", ~seen.swept)]
    kg = seen.payload_kg
    if np.ptp(kg) > 0:
        light = kg <= kg.min() + 0.5 * np.ptp(kg)
        out.append(("the lighter load", "the heavier load", light))
    if doings.past.complete and seen.swept.any():
        sense = doings.sense[np.arange(seen.count), np.maximum(seen.joint - 1, 0)]
        backward = seen.swept & (sense < 0)
        if backward.any():
            out.append(("all but backward sweeps", "backward sweeps", ~backward))
    out.append(("the first 60 % of the time", "the rest", seen.time <= 0.6))
    return out


def _rotated(problem: Problem, prior: float, chosen: Chosen) -> list[Transfer]:
    """Each fifth of the time, and each region of the joint space, predicted from the others."""
    seen = problem.sim.seen
    region = regions(seen.active, seen.span, FOLDS) % FOLDS
    every = np.ones(seen.count, dtype=bool)
    return [
        _transfer(problem, prior, chosen, fold, every, "all others", f"each {what} in turn")
        for fold, what in (
            (times(seen), "fifth of the time"),
            (np.where(seen.check, CHECK, region), "region of the joints"),
        )
        if len(np.unique(fold)) > 2
    ]


def _transfer(
    problem: Problem,
    prior: float,
    chosen: Chosen,
    fold: np.ndarray,
    judged: np.ndarray,
    fitted_on: str,
    predicted: str,
) -> Transfer:
    as_drawn = KeptOut(problem, fold, prior, (), np.zeros(problem.geometry))
    corrected = KeptOut(problem, fold, prior, chosen.groups)
    judged = judged & corrected.judged
    before, after = mean_square(as_drawn.left_m(Chosen())[judged]), mean_square(corrected.left_m(chosen)[judged])
    return Transfer(fitted_on, predicted, int(np.count_nonzero(judged)), float(np.sqrt(before)), float(np.sqrt(after)))
