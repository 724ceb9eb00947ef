"""A freer form gives way to a plain one that explains nearly as much: hysteresis can do all that play does."""

from dataclasses import replace

import numpy as np

from core.gap.evidence import Chosen, Evidence, joined
from core.gap.problem import Problem
from core.gap.search import Found

PLAINER = 0.95
"""Of the evidence for a hysteresis: where play has as much, it is play."""


def plainer(problem: Problem, evidence: Evidence, found: Found, given: Chosen) -> Found:
    """What was found, with play in place of every hysteresis that explains hardly more.

    Args:
        given: candidates that are there whatever was found.
    """
    chosen, main = (_with_play(problem, evidence, one, given) for one in (found.chosen, found.main))
    worth = main if found.worth is found.main else _with_play(problem, evidence, found.worth, given)
    return replace(found, chosen=chosen, main=main, worth=worth)


def _with_play(problem: Problem, evidence: Evidence, chosen: Chosen, given: Chosen) -> Chosen:
    for k, group in enumerate(chosen.groups):
        place = problem.candidates[group].place
        if place.effect != "hysteresis":
            continue
        play, rest = replace(place, effect="backlash"), chosen.without(k)
        plays = [g for g in problem.named if problem.candidates[g].place.same_as(play) and g not in rest.groups]
        gains = evidence.gains(np.array([group, *plays]), joined(given, rest))
        score = gains.evidence - problem.cost[[group, *plays]]
        best = int(np.argmax(score[1:])) + 1 if plays else 0
        if best and score[best] >= PLAINER * score[0]:
            chosen = Chosen((*rest.groups, int(plays[best - 1])), (*rest.sizes, float(gains.size[best])))
            return _with_play(problem, evidence, chosen, given)
    return chosen
