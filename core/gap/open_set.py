"""Named, mixed, or unknown: what the search found, held against smooth functions without a name.

Evidence prefers a flexible stand-in over a slightly wrong name as soon as the noise is small, so it does not decide.
What decides is how much of what could be explained at all a name explains on points kept out of the fit: locally,
against functions of the same variable, and globally, against functions of everything.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from core.gap.effects.candidate import Candidate
from core.gap.evidence import NOTHING, Chosen, Evidence, joined, without
from core.gap.kept_out import KeptOut
from core.gap.plausible import own, plausible
from core.gap.problem import Problem
from core.gap.result import Place
from core.geometry import Array

SMOOTH = frozenset({"zero_offset", "ratio", "eccentricity", "linkage", "axis_wobble", "geometry"})
"""Smooth functions of one joint; so is a mesh with fewer waves than ``RIPPLE``."""
RIPPLE = 6.0
EXACT, EXACTLY = frozenset({"zero_offset", "ratio", "eccentricity", "mesh"}), 0.96
"""Smooth effects whose forms are exact must close nearly all, down to the noise with all else that was found: whatever
is smooth looks like them otherwise."""
NEXT_TO_ALL = 0.99
"""Where they close so much of what can be closed at their joint, what is left beyond the noise is elsewhere."""
FORMED, OUTDONE = frozenset({"zero_offset", "ratio", "eccentricity", "linkage"}), 0.015
"""Effects of one joint of which a function without a name explains no more by such a share of the evidence."""
WAVES, COMPOSED = 2, 0.02
"""So many more waves of one joint, which say such a share of what a mesh does, make no mesh of it."""
FEWEST_TEETH = 3.0
"""Times a turn, or over the whole way of a joint that slides."""
LOCALLY = 0.92
"""Share of what nameless functions close that a name must close to stand."""
MOSTLY = 0.85
"""Such a share, where all that was found at the place closes the rest down to the noise."""
WEAKER = 0.10
"""Of what is closed at one place: the second name there must close so much, or complete the first down to the noise."""
SECOND = 0.3
"""Of the noise: the first must leave so much for a second."""
MOVES = 0.1
"""Of what can be closed: what adds little to the evidence but closes so much is judged all the same."""
AT_FLOOR = 1.5
"""Times the noise (mean squares) that names leave at most where all of them, the small ones too, are real."""
NEXT_TO_NOTHING = 1e-3
"""Of what could be closed: where so little is left of a large gap, no other form would leave it."""
MOST_NAMELESS = 3
COMPLETED = frozenset({"thermal", "drift", "axis_wobble", "linkage", "payload", "compliance", "flexure", "hysteresis"})
"""Effects whose forms are rough: several of one place describe it together."""
BY_TIME = frozenset({"drift", "base_shift", "target_slip", "thermal"})
BY_LOAD = frozenset({"compliance", "flexure", "payload"})
EVERYWHERE = frozenset({"scale", "latency", "quantisation"})


@dataclass(frozen=True)
class Stand:
    """What is said of one place: a name, or that something acts there."""

    place: Place
    groups: tuple[int, ...]
    """Candidates that describe it; nameless ones of an unknown."""
    sizes: tuple[float, ...]
    local: float
    """Share of what nameless functions of the same variable close."""

    @property
    def unknown(self) -> bool:
        return self.place.effect == "unknown"


def chosen_of(some: Sequence[Stand]) -> Chosen:
    """All candidates that describe several causes."""
    return joined(*(Chosen(one.groups, one.sizes) for one in some))


@dataclass(frozen=True, eq=False)
class Judge:
    """Everything needed to weigh names against nameless functions."""

    problem: Problem
    evidence: Evidence
    fold: np.ndarray
    geometry_prior: float
    threshold: float
    floor_m2: float
    found: Chosen
    worth: Chosen
    """Those of what was found that are to be judged."""
    given: Chosen = NOTHING
    """Geometry that needs no judgement: it is there whatever else is."""
    excess: float = 1.0
    """Variance that is left over the noise's when everything flexible has been fitted."""

    @property
    def everything(self) -> Chosen:
        return joined(self.given, self.found)

    @cached_property
    def local(self) -> dict[str, Chosen]:
        """Nameless functions of each variable that matters, given nothing else."""
        return {key: self._nameless(self.given, members, len(members)) for key, members in self._variables.items()}

    @cached_property
    def _variables(self) -> dict[str, np.ndarray]:
        out: dict[str, list[int]] = {}
        for k in self.problem.nameless:
            place = self.problem.candidates[k].place
            key = f"joint {place.joint}" if place.joint is not None else str(place.variable)
            out.setdefault(key, []).append(int(k))
        return {key: np.array(members) for key, members in out.items()}

    def nameless_of(self, variable: str) -> np.ndarray:
        """Nameless functions of one variable."""
        return self._variables.get(variable, np.zeros(0, dtype=int))

    @cached_property
    def rest(self) -> Chosen:
        """Nameless functions that add to all names together."""
        return self._nameless(self.everything, self.problem.nameless, MOST_NAMELESS)

    @cached_property
    def lone(self) -> Chosen:
        """The best nameless functions when no name is given."""
        return self._nameless(self.given, self.problem.nameless, MOST_NAMELESS)

    @cached_property
    def kept_out(self) -> KeptOut:
        groups = dict.fromkeys((*self.everything.groups, *self.worth.groups))
        for chosen in (self.rest, self.lone, *self.local.values()):
            groups |= dict.fromkeys(chosen.groups)
        return KeptOut(self.problem, self.fold, self.geometry_prior, tuple(groups), self.geometry)

    @cached_property
    def open(self) -> KeptOut:
        """The same where every fit finds its own geometry: fair between names and what has none."""
        return replace(self.kept_out, geometry=None)

    @cached_property
    def geometry(self) -> Array:
        """Small changes of geometry as everything that was found leaves them.

        Taken as known: a model without a cause must not hide the loss behind a geometry that nobody believes in.
        """
        everything = joined(self.everything, self.rest)
        problem = self.problem
        index = np.concatenate([np.arange(problem.nuisance), self.evidence.index(everything.groups)]).astype(int)
        prior = np.concatenate([self.evidence.precision, self.evidence.prior(everything)])
        square = problem.sums.square.within(index) + np.diag(prior)
        return np.linalg.solve(square, problem.sums.pull[index])[problem.placement : problem.nuisance]

    @cached_property
    def base_m2(self) -> float:
        """Mean square residual with placement and geometry alone."""
        return self.square(Chosen())

    @cached_property
    def bare_m2(self) -> float:
        """Mean square residual with placement and small geometry alone."""
        return self.kept_out.square_m2(Chosen())

    @cached_property
    def closable_m2(self) -> float:
        return max(self.base_m2 - self.floor_m2, 1e-3 * self.floor_m2)

    def square(self, chosen: Chosen) -> float:
        """With the geometry that is given."""
        return self.kept_out.square_m2(joined(self.given, chosen))

    def expected_m2(self, chosen: Chosen) -> float:
        """What noise lets expect there, with fits as uncertain as they are."""
        noise_m2 = np.full(len(self.fold), self.floor_m2)
        return self.kept_out.expected_m2(joined(self.given, chosen), noise_m2)

    def variable(self, place: Place) -> str:
        """The variable whose nameless functions rival a cause."""
        if place.effect in BY_TIME:
            return "time"
        if place.joint is not None:
            return f"joint {place.joint}"
        if place.frame is not None:
            return f"joint {place.frame + 1}"
        if place.effect == "payload" and "payload" in self._variables:
            return "payload"
        return "configuration"

    def _nameless(self, given: Chosen, among: np.ndarray, most: int) -> Chosen:
        added = Chosen()
        while len(added.groups) < most:
            left = np.array([g for g in among if g not in added.groups], dtype=int)
            if not len(left):
                break
            gains = self.evidence.gains(left, joined(given, added))
            best = int(np.argmax(gains.evidence))
            if not gains.evidence[best] > self.threshold:
                break
            added = added.plus(int(left[best]), float(gains.size[best]))
        return added


def stands(judge: Judge) -> list[Stand]:
    """What can be said of each place where something acts, strongest first."""
    kept = _predicting(judge, _worthy(judge))
    lost = without(judge.worth, kept.groups)
    if lost.groups and judge.square(judge.found) < AT_FLOOR * judge.floor_m2:
        # What the data say most for predicts nothing alone, but all together down to the noise: they belong together.
        kept = _predicting(judge, judge.found)
    out = []
    by_variable: dict[str, list[int]] = {}
    for k, group in enumerate(kept.groups):
        by_variable.setdefault(judge.variable(judge.problem.candidates[group].place), []).append(k)
    places = {variable: _pick(kept, members) for variable, members in by_variable.items()}
    foremost = min(places, key=lambda variable: judge.square(places[variable]), default=None)
    for variable, here in places.items():
        elsewhere, small = _others(judge, variable, kept)
        out += _at(judge, variable, here, elsewhere, small, variable == foremost)
    return _steps_together(out)


def _worthy(judge: Judge) -> Chosen:
    """What the data say much for, and what moves much: placement and geometry hide that from the evidence."""
    whole, found, least = judge.square(judge.found), judge.found, MOVES * judge.closable_m2
    lost = [judge.square(found.without(k)) - whole for k in range(len(found.groups))]
    worth = joined(judge.worth, _pick(found, [k for k, m2 in enumerate(lost) if m2 > least]))
    while rest := [k for k, group in enumerate(found.groups) if group not in worth.groups]:
        # What several small ones do together may hide what one of them closes beside the great.
        left = [judge.square(joined(worth, _pick(found, [k]))) for k in rest]
        best = int(np.argmin(left))
        if judge.square(worth) - left[best] <= least:
            break
        worth = joined(worth, _pick(found, [rest[best]]))
    return worth


def _others(judge: Judge, variable: str, kept: Chosen) -> tuple[Chosen, Chosen]:
    """All that was found at other variables, clutter included: nameless functions here shall not stand in for it.

    And what was found here and is too small to be judged.
    """
    both = joined(kept, judge.found)
    here = [judge.variable(judge.problem.candidates[g].place) == variable for g in both.groups]
    elsewhere = _pick(both, [k for k, one in enumerate(here) if not one])
    return elsewhere, without(_pick(both, [k for k, one in enumerate(here) if one]), kept.groups)


def _steps_together(found: list[Stand]) -> list[Stand]:
    """Steps of the encoders of several joints are one cause."""
    steps = [one for one in found if one.place.effect == "quantisation"]
    if len(steps) < 2:
        return found
    together = chosen_of(steps)
    local = min(one.local for one in steps)
    rest = [one for one in found if one.place.effect != "quantisation"]
    return [*rest, Stand(Place("quantisation"), together.groups, together.sizes, local)]


def _predicting(judge: Judge, chosen: Chosen) -> Chosen:
    """What is left when candidates are dropped that make kept-out points no better."""
    while chosen.groups:
        whole = judge.square(chosen)
        lost = [judge.square(chosen.without(k)) - whole for k in range(len(chosen.groups))]
        least = int(np.argmin(lost))
        if lost[least] > 0:
            break
        chosen = chosen.without(least)
    return chosen


def _at(judge: Judge, variable: str, here: Chosen, elsewhere: Chosen, small: Chosen, foremost: bool) -> list[Stand]:
    """Names at one variable, or that it is unknown what acts there.

    Args:
        foremost: whether nothing elsewhere closes as much alone; numbers of what is weaker are blurred too much to
            doubt its name by them.
    """
    local = judge.local.get(variable, Chosen())
    spot = Spot(judge, here, local, elsewhere)
    named = _names(spot)
    if not named and judge.square(joined(elsewhere, here, small)) < AT_FLOOR * judge.floor_m2:
        # Small causes at the same place are real where they complete the others down to the noise; but smooth
        # functions of one joint together imitate any other, where none of them does most of it alone.
        first = spot.order[0]
        others = small
        if _smooth(spot.candidate(first)):
            others = without(small, [g for g in small.groups if _imitates(judge.problem.candidates[g])])
        beyond = replace(spot, elsewhere=joined(elsewhere, _frames(judge, others)))
        if others.groups and (others is small or beyond.share([first]) >= LOCALLY):
            named = _names(replace(spot, elsewhere=joined(elsewhere, others)))
        beside = joined(small, without(here, [here.groups[k] for k in spot.forms(first)]))
        imitate = any(_smooth(judge.problem.candidates[g]) for g in beside.groups)
        if not named and spot.share([first]) >= MOSTLY and not imitate:
            named = _names(replace(spot, here=_pick(here, spot.forms(first)), elsewhere=joined(elsewhere, beside)))
    right = [one for one in named if not foremost or _right(judge, one, joined(elsewhere, chosen_of(named)))]
    if len(right) < len(named) and right[:1] == named[:1] and spot.share(spot.forms(spot.order[0])) >= LOCALLY:
        # The first suffices: what its second stands in for does not make it wrong.
        named = right
    if named and right == named:
        return named
    groups = joined(local, here)
    return [Stand(unknown_at(variable), groups.groups, groups.sizes, spot.share(spot.order[:1]))]


def _right(judge: Judge, stand: Stand, others: Chosen) -> bool:
    """Whether a name does not only stand in for something: by its numbers, and by what has no name; all else given."""
    rest = without(joined(judge.given, others), stand.groups[:1])
    one = own(judge.problem, judge.evidence, stand.groups[0], stand.sizes[0], rest)
    numbers = plausible(one, judge.problem.sim.seen.chain)
    return numbers and not _outdone(judge, stand, rest) and not _composed(judge, stand)


def _composed(judge: Judge, stand: Stand) -> bool:
    """Whether a mesh is one of many waves of its joint: of such a sum is anything, a bump at one place as well."""
    if stand.place.effect != "mesh":
        return False
    candidates, everything = judge.problem.candidates, judge.everything
    waves = [g for g in judge.found.groups if candidates[g].place.same_as(stand.place) and g not in stand.groups]
    if len(waves) < WAVES:
        return False
    whole, alone = judge.evidence.given(everything), without(everything, waves)
    own_evidence = whole - judge.evidence.given(without(alone, stand.groups))
    return whole - judge.evidence.given(alone) > COMPOSED * own_evidence


def _outdone(judge: Judge, stand: Stand, others: Chosen) -> bool:
    """Whether functions without a name of the same joint are by far more probable than a name whose form is exact.

    What acts elsewhere as well may have left what they explain.
    """
    variable = judge.variable(stand.place)
    alone = all(judge.variable(judge.problem.candidates[g].place) == variable for g in judge.found.groups)
    if stand.place.effect not in FORMED or not alone:
        return False
    gains = judge.evidence.gains(np.array([stand.groups[0], *judge.nameless_of(variable)]), others).evidence
    return bool(gains[1:].max(initial=-np.inf) > (1 + OUTDONE) * gains[0])


def unknown_at(variable: str) -> Place:
    """Something without a name at a joint, or on another variable."""
    if variable.startswith("joint"):
        return Place("unknown", joint=int(variable.split()[1]))
    return Place("unknown", variable=variable)


@dataclass(frozen=True, eq=False)
class Spot:
    """Names found at one variable, held against nameless functions of it."""

    judge: Judge
    here: Chosen
    local: Chosen
    """Nameless functions of the same variable."""
    elsewhere: Chosen
    """What is taken as given."""

    @cached_property
    def without_m2(self) -> float:
        return self.judge.square(self.elsewhere)

    @cached_property
    def ceiling_m2(self) -> float:
        """What can be closed here at all."""
        given = joined(self.elsewhere, self.here)
        return self.without_m2 - min(self.judge.square(joined(given, self.local)), self.judge.square(given))

    def closes_m2(self, which: list[int]) -> float:
        """What some of the names close."""
        return self.without_m2 - self.judge.square(joined(self.elsewhere, _pick(self.here, which)))

    def share(self, which: list[int]) -> float:
        """Of what can be closed."""
        return self.closes_m2(which) / max(self.ceiling_m2, 1e-300)

    @cached_property
    def order(self) -> list[int]:
        """Names by what they close alone, the most first."""
        alone = [self.closes_m2([k]) for k in range(len(self.here.groups))]
        return [int(k) for k in np.argsort(alone)[::-1]]

    @cached_property
    def to_the_noise(self) -> bool:
        """Whether all that was found leaves no more than noise and what nothing flexible could fit, or next to none."""
        judge, everything = self.judge, joined(self.elsewhere, self.here, self.judge.found)
        left_m2 = judge.square(everything)
        noise_m2 = AT_FLOOR * judge.excess * judge.expected_m2(everything)
        return left_m2 < noise_m2 or left_m2 - judge.floor_m2 < NEXT_TO_NOTHING * judge.closable_m2

    def candidate(self, k: int) -> Candidate:
        return self.judge.problem.candidates[self.here.groups[k]]

    def forms(self, k: int) -> list[int]:
        """A name with all that describes the same cause, of effects whose forms are rough."""
        mine = self.candidate(k).place
        same = [k, *(other for other in self.order if other != k and self.candidate(other).place.same_as(mine))]
        return same if mine.effect in COMPLETED else [k]


def _names(spot: Spot) -> list[Stand]:
    """The names that suffice at one variable: one, several forms of one, or two; none: nameless functions do better."""
    first = spot.order[0]
    forms = spot.forms(first)
    likely = spot.candidate(first)
    exact = likely.place.effect in EXACT and _smooth(likely)
    imitates = exact and (likely.place.effect != "mesh" or is_slow(likely))
    share = spot.share([first])
    known = not imitates or spot.to_the_noise or share >= NEXT_TO_ALL
    enough = share >= (EXACTLY if exact else LOCALLY) and known
    if enough or (len(forms) > 1 and spot.share(forms) >= LOCALLY):
        share = share if enough else spot.share(forms)
        second = _second(spot, forms)
        return [_stand(spot, which, share) for which in (forms, second) if which]
    pairs = [[*forms, *spot.forms(k)] for k in spot.order if _make_a_pair(spot, first, k)]
    both = max(pairs, key=spot.closes_m2, default=[])
    if both and spot.share(both) >= LOCALLY:
        closed, rest = spot.closes_m2(both), both[len(forms) :]
        more, completes = closed - spot.closes_m2(forms), spot.share(both) >= EXACTLY and spot.to_the_noise
        if more >= WEAKER * closed or (completes and more > spot.judge.floor_m2):
            return [_stand(spot, which, spot.share(both)) for which in (forms, rest)]
    return _with_a_frame(spot, first)


def _with_a_frame(spot: Spot, first: int) -> list[Stand]:
    """A smooth error of a joint and the frame before it, in their order, where they close all down to the noise."""
    pairs = [[first, k] for k in spot.order if _frame_and_drive(spot, first, k)]
    both = max(pairs, key=spot.closes_m2, default=[])
    if not both or spot.share(both) < EXACTLY:
        return []
    if spot.closes_m2(both) - spot.closes_m2([first]) <= spot.judge.floor_m2:
        return []
    return [_stand(spot, [k], spot.share(both)) for k in both]


def _second(spot: Spot, which: list[int]) -> list[int]:
    """A second name at the same place that closes what the first leaves, where that is more than the noise."""
    closed = spot.closes_m2(which)
    left = spot.ceiling_m2 - closed
    if left < SECOND * spot.judge.floor_m2:
        return []
    sure = spot.share(which) >= EXACTLY
    for k in spot.order:
        pair = k not in which and (
            _make_a_pair(spot, which[0], k)
            or _frame_and_drive(spot, which[0], k)
            or (sure and _differ(spot, which[0], k))
        )
        if pair and spot.closes_m2([*which, *spot.forms(k)]) - closed >= LOCALLY * left:
            return spot.forms(k)
    return []


def _make_a_pair(spot: Spot, first: int, second: int) -> bool:
    """Whether two names at one variable can both be right: two smooth functions of one joint imitate any third."""
    smooth = all(_smooth(spot.candidate(k)) for k in (first, second))
    return _differ(spot, first, second) and not smooth


def _frame_and_drive(spot: Spot, first: int, second: int) -> bool:
    """Whether one is a frame and the other a smooth error of the drive after it, where all leaves no more than noise.

    Together they do not imitate a third of the same joint: a frame moves all that lies beyond.
    """
    both = [spot.candidate(k) for k in (first, second)]
    return all(_smooth(one) for one in both) and sum(_imitates(one) for one in both) == 1 and spot.to_the_noise


def _differ(spot: Spot, first: int, second: int) -> bool:
    """Whether two names are of different effects."""
    one, other = (spot.candidate(k).place for k in (first, second))
    return (one.effect, one.source) != (other.effect, other.source)


def is_slow(candidate: Candidate) -> bool:
    """Whether a mesh has so few teeth that anything smooth looks like it."""
    return candidate.place.effect == "mesh" and candidate.waves < FEWEST_TEETH


def _frames(judge: Judge, chosen: Chosen) -> Chosen:
    """The frames among what was found."""
    return without(chosen, [g for g in chosen.groups if judge.problem.candidates[g].place.effect != "geometry"])


def _imitates(candidate: Candidate) -> bool:
    """Whether it is a function of one joint that, with others, looks like any; frames move all that lies beyond."""
    return _smooth(candidate) and candidate.place.effect != "geometry"


def _smooth(candidate: Candidate) -> bool:
    return candidate.place.effect in SMOOTH or candidate.waves < RIPPLE


def _pick(chosen: Chosen, which: list[int]) -> Chosen:
    return Chosen(tuple(chosen.groups[k] for k in which), tuple(chosen.sizes[k] for k in which))


def _stand(spot: Spot, which: list[int], local: float) -> Stand:
    one = _pick(spot.here, which)
    return Stand(spot.candidate(which[0]).place, one.groups, one.sizes, float(min(local, 1.0)))
