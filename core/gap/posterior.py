"""How probable a name is: against every other candidate at every place, and against there being no name for it.

Evidence is worth what the forms of the effects are worth. A form that is off by a small share of what it explains
changes the evidence by that share, so differences below it decide nothing.
"""

from collections.abc import Sequence

import numpy as np
from scipy.special import expit

from core.gap.effects.candidate import motors
from core.gap.evidence import Chosen, joined, without
from core.gap.held_joints import is_offset_of_held, same_where_held
from core.gap.lacking import lacks
from core.gap.open_set import AT_FLOOR, Judge, Stand, chosen_of, is_slow
from core.gap.plausible import AGAINST, gives_at_one_joint, mostly_idle, own, plausible
from core.gap.result import Place
from core.geometry import Array

NO_CAUSE = Place("none")
FORM_ERROR = 0.002
"""Share of the evidence that rough forms of effects can be wrong by."""
LOST_MOTION, LOST_MOTION_ERROR = {"backlash", "hysteresis"}, 0.04
"""The same between play and hysteresis of a joint, of which no form says how it floats."""
NAMED_AT, NAMED_WIDTH = 0.93, 0.012
CLOSES_AT, CLOSES_WIDTH = 0.82, 0.03
"""Share of the gap beyond the floor that names close together at which they are as likely wrong as right: where they
leave more, something without a name is at work and they stand in for it. From simulated worlds with known causes."""
LEAST, MOST = 0.4, 0.99
"""However badly or well names close, so often they are right in those worlds."""
BESIDE_UNKNOWN = 0.4
"""How much less a name is worth that is told after something without a name."""
AT_BEST, LIKE_LOST_MOTION = 0.5, frozenset({"mesh", "quantisation"})
"""Where one joint alone moves, everything is some function of it; where nobody wrote down how points were reached, lost
motion looks like ripple; anything smooth looks like a mesh of few teeth; a load under which one joint alone gives way
looks like what that joint does under any; what leaves much at its own place is likely a relative's: no such name is
likelier than not."""
IDLE_AT_BEST = 0.8
"""Where a form's numbers are mostly idle, a plainer one would do."""
FORETOLD = 2.0
"""Odds of a name whose first number can have one sign only, where it has that sign."""
TWIN_ODDS = 0.05
"""A candidate at least so probable beside the named one is its twin."""


def rivals(judge: Judge, stand: Stand, others: Chosen) -> list[tuple[Place, float]]:
    """Named places with their probabilities, given the other causes, most probable first.

    What would explain more in place of a cause speaks against it only as far as it leaves the cause nothing to explain.
    """
    named = judge.problem.named
    rest = without(joined(judge.given, others, _elsewhere(judge, stand)), stand.groups)
    known = joined(rest, Chosen(stand.groups[1:], stand.sizes[1:]))
    gains = judge.evidence.gains(named, known)
    score = gains.evidence - judge.problem.cost[named]
    score[np.isin(named, known.groups)] = -np.inf
    first: dict[tuple[str | int | None, ...], int] = {}
    for k in np.argsort(score)[::-1]:
        if np.isfinite(score[k]):
            first.setdefault(judge.problem.candidates[named[k]].place.identity, int(k))
    best = list(first.values())
    places = [judge.problem.candidates[named[k]].place for k in best]
    mine = _index(places, stand.place)
    # No cause at all is one more possibility, without evidence and without cost.
    evidence = np.append(score[best], 0.0)
    for k in np.flatnonzero(evidence[:-1] > evidence[mine]):
        beside = known.plus(int(named[best[k]]), float(gains.size[best[k]]))
        adds = judge.evidence.gains(named[best[mine : mine + 1]], beside).evidence[0]
        evidence[k] = min(evidence[k], evidence[mine] - adds + judge.problem.cost[named[best[mine]]])
    wide = np.array([*(judge.problem.width(named[k]) for k in best), 0])
    places.append(NO_CAUSE)
    rough = np.array([LOST_MOTION_ERROR if _both_lose_motion(stand.place, one) else FORM_ERROR for one in places])
    weight = np.exp(_odds(evidence, wide, mine, rough))
    # A name whose sign was foretold has put all its hope there.
    weight[[place.effect in AGAINST for place in places]] *= FORETOLD
    for k, group in enumerate(best):
        # Another name that fits as well, by numbers that its effect never has, is no rival; but play and hysteresis
        # differ soon after the motor turned round alone, where there may be no point.
        near = k != mine and weight[k] >= TWIN_ODDS * weight[mine]
        if near and not _both_lose_motion(stand.place, places[k]):
            one = own(judge.problem, judge.evidence, int(named[group]), float(gains.size[group]), known)
            weight[k] *= plausible(one, judge.problem.sim.seen.chain)
    order = np.argsort(-weight, kind="stable")
    return [(places[k], float(weight[k] / weight.sum())) for k in order]


def _elsewhere(judge: Judge, stand: Stand) -> Chosen:
    """Small causes that were found at other variables: what acts at the same may be the same."""
    candidates, mine = judge.problem.candidates, judge.variable(stand.place)
    return without(judge.found, [g for g in judge.found.groups if judge.variable(candidates[g].place) == mine])


def _index(places: list[Place], place: Place) -> int:
    return next((k for k, one in enumerate(places) if one.same_as(place)), 0)


def _both_lose_motion(one: Place, other: Place) -> bool:
    return one.joint == other.joint and {one.effect, other.effect} == LOST_MOTION


def _odds(evidence: Array, width: np.ndarray, mine: int, rough: Array | float = FORM_ERROR) -> Array:
    """Log odds of each place against the one that stands, which take the roughness of all forms into account.

    A form that is free to do more and yet explains no more does not profit from that: what stands needs no repair.
    """
    odds = evidence - evidence[mine]
    idle = (width > width[mine]) & (odds < 0)
    odds = np.where(idle, odds, blunted(odds, evidence.max(), rough))
    return odds - odds.max()


def blunted(difference: Array, most: Array | float, rough: Array | float = FORM_ERROR) -> Array:
    """Differences of evidence by what forms are worth that explain so much at most."""
    return difference / np.sqrt(1 + (rough * np.maximum(most, 0.0)) ** 2)


def adequate(judge: Judge, named: Chosen, everything: Chosen) -> float:
    """Probability that names are not stand-ins: from what they close of the gap, and of what can be closed at all."""
    closed = judge.square(Chosen()) - judge.square(named)
    possible = judge.square(Chosen()) - judge.square(everything)
    share = float(np.clip(closed / max(possible, 1e-300), 0.0, 1.0))
    return share * (LEAST + (MOST - LEAST) * sufficient(judge, named))


def sufficient(judge: Judge, named: Chosen) -> float:
    """How probable it is that nothing without a name is at work, from the share of the gap that names close, 0..1.

    Small causes that are found and not told count where all together leave no more than noise.
    """
    left = judge.square(named)
    with_small = judge.square(joined(named, judge.found))
    if with_small < AT_FLOOR * judge.floor_m2:
        left = min(left, with_small)
    closed = (judge.square(Chosen()) - left) / judge.closable_m2
    return float(expit((closed - CLOSES_AT) / CLOSES_WIDTH))


def floats(judge: Judge, stand: Stand, named: Sequence[Stand]) -> bool:
    """Whether a joint seems to give and to lose motion, and more is left: so does play that weights hold on a flank."""
    here = {one.place.effect for one in named if one.place.joint == stand.place.joint}
    both = stand.place.effect in LOST_MOTION | {"compliance"} and "compliance" in here and bool(LOST_MOTION & here)
    return both and judge.square(chosen_of(named)) > AT_FLOOR * judge.floor_m2


def has_name(judge: Judge, stand: Stand, others: Chosen) -> float:
    """Probability that some name of the library is right, from how much nameless functions would still add."""
    rest = without(joined(judge.given, others), stand.groups[:1])
    one = own(judge.problem, judge.evidence, stand.groups[0], stand.sizes[0], rest)
    told, most = judge.problem.doings, 1.0
    slow = is_slow(judge.problem.candidates[stand.groups[0]])
    unlogged = stand.place.effect in LIKE_LOST_MOTION and not told.past.complete
    if mostly_idle(one):
        most = IDLE_AT_BEST
    doubtful = len(motors(told)) < 2 or unlogged or slow or gives_at_one_joint(one) or lacks(judge, stand, others)
    if doubtful or is_offset_of_held(told.seen, stand.place):
        most = AT_BEST
    return most * float(expit((stand.local - NAMED_AT) / NAMED_WIDTH))


def twins(
    judge: Judge, stand: Stand, others: Chosen, ranked: list[tuple[Place, float]]
) -> tuple[float, tuple[Place, ...]]:
    """Probability of the place that stands, and the places that the data cannot tell from it, itself first."""
    mine = next((p for place, p in ranked if place.same_as(stand.place)), 0.0)
    alike = [
        place
        for place, p in ranked
        if place is not NO_CAUSE and not place.same_as(stand.place) and p >= TWIN_ODDS * max(mine, 1e-12)
    ]
    same = same_where_held(judge.problem.sim.seen, stand.place)
    alike = [*same, *(place for place in alike if not any(place.same_as(one) for one in same))]
    return mine * has_name(judge, stand, others), (stand.place, *alike[:11])
