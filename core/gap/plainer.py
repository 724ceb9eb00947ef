"""A name that only stands in gives way to what explains nearly as much: hysteresis can do all that play does."""

from dataclasses import replace

import numpy as np

from core.gap.evidence import Chosen, Evidence, joined
from core.gap.plausible import own, plausible
from core.gap.problem import Problem
from core.gap.search import MOST_CAUSES, Found, search

PLAINER = 0.95
"""Of the evidence for a free form: where a plain one has as much, it is that."""
MISSED, LEAST_MISSED = 2.0, 8.0
"""Times what a name says more than its replacement, and the least of that in log evidence."""


def plainer(problem: Problem, evidence: Evidence, found: Found, threshold: float, given: Chosen) -> Found:
    """What was found, with what explains hardly less in place of every name that only stands in for something.

    Play is put in place of hysteresis, and anything in place of what has numbers that its effect never has.

    Args:
        threshold: log evidence that noise alone does not reach.
        given: candidates that are there whatever was found.
    """

    def better(some: Chosen, whole: Chosen) -> Chosen:
        for k in range(len(some.groups)):
            other = _replaced(problem, evidence, some, k, given)
            if not _blurred(problem, evidence, some, other, k, whole, given):
                some = other
        return some

    chosen = better(found.chosen, found.chosen)
    joints = [[problem.candidates[g].place.joint for g in some.groups] for some in (found.chosen, chosen)]
    if gone := [one for one, other in zip(*joints, strict=True) if one != other]:
        chosen = joined(chosen, _left(problem, evidence, chosen, gone, threshold, given))
    main = better(found.main, chosen)
    worth = main if found.worth is found.main else better(found.worth, chosen)
    return replace(found, chosen=chosen, main=main, worth=worth)


def _left(
    problem: Problem, evidence: Evidence, chosen: Chosen, gone: list[int | None], threshold: float, given: Chosen
) -> Chosen:
    """What a choice leaves at other joints than those that are gone from it: they may have stood in for two."""
    known = joined(given, chosen)
    among = [g for g in problem.named if g not in known.groups and problem.candidates[g].place.joint not in gone]
    most = MOST_CAUSES - len(chosen.groups)
    return search(evidence, np.array(among, dtype=int), problem.cost, threshold, known, most).chosen


def _blurred(
    problem: Problem, evidence: Evidence, some: Chosen, other: Chosen, k: int, whole: Chosen, given: Chosen
) -> bool:
    """Whether a name is missed far more, once all that was found stands beside it, than where it seems to stand in.

    Numbers that its effect never has are then those of a blurred look.
    """
    mine, instead = some.groups[k], other.groups[k]
    if mine == instead or mine not in whole.groups:
        return False
    alone = evidence.given(joined(given, some)) - evidence.given(joined(given, other))
    rest = whole.without(whole.groups.index(mine))
    beside = evidence.given(joined(given, whole)) - evidence.given(joined(given, rest))
    if instead not in rest.groups:
        beside -= float(evidence.gains(np.array([instead]), joined(given, rest)).evidence[0])
    return beside > MISSED * max(alone, LEAST_MISSED)


def _replaced(problem: Problem, evidence: Evidence, chosen: Chosen, k: int, given: Chosen) -> Chosen:
    """A choice with its k-th candidate replaced, where that only stands in."""
    group, rest = chosen.groups[k], chosen.without(k)
    others, chain = joined(given, rest), problem.sim.seen.chain
    place = problem.candidates[group].place
    impossible = not plausible(own(problem, evidence, group, chosen.sizes[k], others), chain)
    if not impossible and place.effect != "hysteresis":
        return chosen
    play = replace(place, effect="backlash")
    places = {int(g): problem.candidates[g].place for g in problem.named if g not in others.groups}
    # Steps of another size at the same joint are another form, too.
    other = {g for g, p in places.items() if not p.same_as(place) or place.effect == "quantisation"}
    among = np.array([g for g, p in places.items() if (g in other if impossible else p.same_as(play))])
    if not len(among):
        return chosen
    gains = evidence.gains(among, others)
    mine = float(evidence.gains(np.array([group]), others).evidence[0]) - problem.cost[group]
    score = gains.evidence - problem.cost[among]
    for best in np.argsort(score)[::-1]:
        if score[best] < PLAINER * mine:
            break
        size = float(gains.size[best])
        if plausible(own(problem, evidence, int(among[best]), size, others), chain):
            groups, sizes = list(chosen.groups), list(chosen.sizes)
            groups[k], sizes[k] = int(among[best]), size
            return Chosen(tuple(groups), tuple(sizes))
    return chosen
