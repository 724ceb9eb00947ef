"""A form with many numbers that stands in for two plainer causes gives way to them.

A search takes one cause at a time: the tilts and shifts of an axis do at once what a drive's error and a wrong frame
do together, and neither of the two is better than they are.
"""

from dataclasses import replace

import numpy as np

from core.gap.evidence import Chosen, Evidence, joined
from core.gap.problem import Problem
from core.gap.search import Found, search, without_the_least

MANY_NUMBERS = 5
"""A form with so many can stand in for two others."""
PAIR = 2


def split(problem: Problem, evidence: Evidence, found: Found, threshold: float, given: Chosen) -> Found:
    """What was found, with two other causes in place of every form of many numbers that says less than they do.

    Args:
        threshold: log evidence that noise alone does not reach.
        given: candidates that are there whatever was found.
    """
    chosen = found.chosen
    for group in found.chosen.groups:
        if problem.width(group) >= MANY_NUMBERS:
            chosen = _in_two(problem, evidence, chosen, group, threshold, given)
    if chosen.groups == found.chosen.groups:
        return found
    main = without_the_least(evidence, chosen, given)
    return replace(found, chosen=chosen, main=main, worth=main)


def _in_two(
    problem: Problem, evidence: Evidence, chosen: Chosen, group: int, threshold: float, given: Chosen
) -> Chosen:
    """A choice with the best two of other places in place of one, where they say more by far than noise would."""
    rest = chosen.without(chosen.groups.index(group))
    known, place = joined(given, rest), problem.candidates[group].place
    others = [g for g in problem.named if g not in known.groups and not problem.candidates[g].place.same_as(place)]
    pair = search(evidence, np.array(others, dtype=int), problem.cost, threshold, known, PAIR).chosen
    mine, theirs = joined(given, chosen), joined(known, pair)
    more = evidence.given(theirs) - evidence.given(mine)
    more -= sum(problem.cost[g] for g in pair.groups) - problem.cost[group]
    return joined(rest, pair) if len(pair.groups) == PAIR and more > threshold else chosen
