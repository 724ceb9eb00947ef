"""A name that only stands in gives way to what explains nearly as much: hysteresis can do all that play does."""

from dataclasses import replace

import numpy as np

from core.gap.evidence import Chosen, Evidence, joined
from core.gap.plausible import own, plausible
from core.gap.problem import Problem
from core.gap.search import Found

PLAINER = 0.95
"""Of the evidence for a free form: where a plain one has as much, it is that."""


def plainer(problem: Problem, evidence: Evidence, found: Found, given: Chosen) -> Found:
    """What was found, with what explains hardly less in place of every name that only stands in for something.

    Play is put in place of hysteresis, and anything in place of what has numbers that its effect never has.

    Args:
        given: candidates that are there whatever was found.
    """

    def better(chosen: Chosen) -> Chosen:
        for k in range(len(chosen.groups)):
            chosen = _replaced(problem, evidence, chosen, k, given)
        return chosen

    chosen, main = better(found.chosen), better(found.main)
    return replace(found, chosen=chosen, main=main, worth=main if found.worth is found.main else better(found.worth))


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
