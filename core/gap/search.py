"""Which few named candidates account for the residuals: one after the other, each reconsidered given the rest."""

from dataclasses import dataclass

import numpy as np

from core.gap.evidence import NOTHING, Chosen, Evidence, Gains, joined
from core.geometry import Array

MOST_CAUSES = 6
LEAST_SHARE = 0.05
"""Of all log evidence: what adds less to the others is an imperfection of a stronger cause, or clutter."""


@dataclass(frozen=True, eq=False)
class Found:
    """The candidates that were chosen, strongest first, and how each stood when nothing was chosen yet."""

    chosen: Chosen
    alone: Array
    """Log evidence of each candidate standing alone, less the cost of choosing, by candidate; -inf: not searched."""
    alone_size: Array
    worth: Chosen
    """Those of them that are more than an imperfection of a stronger one, each reconsidered when those are dropped."""
    main: Chosen
    """The same, none reconsidered: the greater ones of many that are all there."""
    log_evidence: float
    """Of all that is chosen, costs included, above placement and geometry alone."""


def search(
    evidence: Evidence,
    among: np.ndarray,
    cost: Array,
    threshold: float,
    given: Chosen = NOTHING,
    most: int = MOST_CAUSES,
) -> Found:
    """Forward choice with exchange.

    Args:
        among: candidates to look through.
        cost: of choosing each candidate, by candidate.
        threshold: log evidence that noise alone does not reach.
        given: candidates that are there whatever is found.
    """
    alone, alone_size = np.full(len(cost), -np.inf), np.ones(len(cost))
    chosen = Chosen()
    while len(chosen.groups) < min(most, len(among)):
        gains, score = _scores(evidence, among, cost, joined(given, chosen))
        if not chosen.groups:
            alone[among], alone_size[among] = score, gains.size
        best = int(np.argmax(score))
        if not score[best] > threshold:
            break
        chosen = chosen.plus(int(among[best]), float(gains.size[best]))
        if len(chosen.groups) > 1:
            chosen = _exchanged(evidence, among, cost, chosen, given)
    chosen = _needed(evidence, cost, chosen, given, threshold)
    total = evidence.given(joined(given, chosen)) - sum(cost[g] for g in chosen.groups)
    main = without_the_least(evidence, chosen, given)
    worth = worth_naming(evidence, among, cost, chosen, main, given)
    return Found(chosen, alone, alone_size, worth, main, float(total))


def _needed(evidence: Evidence, cost: Array, chosen: Chosen, given: Chosen, threshold: float) -> Chosen:
    """What is left when candidates are dropped that say no more than noise beside those that came after them."""
    while len(chosen.groups) > 1:
        whole = evidence.given(joined(given, chosen))
        adds = [whole - evidence.given(joined(given, chosen.without(k))) for k in range(len(chosen.groups))]
        adds = np.array(adds) - cost[list(chosen.groups)]
        least = int(np.argmin(adds))
        if adds[least] > threshold:
            break
        chosen = chosen.without(least)
    return chosen


def worth_naming(
    evidence: Evidence, among: np.ndarray, cost: Array, chosen: Chosen, main: Chosen, given: Chosen
) -> Chosen:
    """What is left when candidates that add next to nothing to the others are dropped, each reconsidered then."""
    if len(main.groups) == len(chosen.groups):
        return main
    kept = _exchanged(evidence, among, cost, main, given)
    return without_the_least(evidence, kept, given)


def without_the_least(evidence: Evidence, chosen: Chosen, given: Chosen) -> Chosen:
    """What is left when candidates are dropped that add next to nothing to the others."""
    while len(chosen.groups) > 1:
        bare, whole = evidence.given(given), evidence.given(joined(given, chosen))
        lost = [whole - evidence.given(joined(given, chosen.without(k))) for k in range(len(chosen.groups))]
        least = int(np.argmin(lost))
        if lost[least] >= LEAST_SHARE * (whole - bare):
            break
        chosen = chosen.without(least)
    return chosen


def _scores(evidence: Evidence, among: np.ndarray, cost: Array, chosen: Chosen) -> tuple[Gains, Array]:
    gains = evidence.gains(among, chosen)
    score = gains.evidence - cost[among]
    score[np.isin(among, chosen.groups)] = -np.inf
    return gains, score


def _exchanged(evidence: Evidence, among: np.ndarray, cost: Array, chosen: Chosen, given: Chosen) -> Chosen:
    """Each chosen candidate once reconsidered, the others given."""
    for _ in range(len(chosen.groups)):
        rest = chosen.without(0)
        gains, score = _scores(evidence, among, cost, joined(given, rest))
        best = int(np.argmax(score))
        chosen = rest.plus(int(among[best]), float(gains.size[best]))
    return chosen
