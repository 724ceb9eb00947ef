"""Named, mixed, or unknown: what the search found, held against smooth functions without a name.

Evidence prefers a flexible stand-in over a slightly wrong name as soon as the noise is small, so it does not decide.
What decides is how much of what could be explained at all a name explains on points kept out of the fit: locally,
against functions of the same variable, and globally, against functions of everything.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from core.gap.effects.candidate import Candidate
from core.gap.evidence import NOTHING, Chosen, Evidence, joined
from core.gap.kept_out import KeptOut
from core.gap.problem import Problem
from core.gap.result import Place
from core.geometry import Array

SMOOTH = frozenset({"zero_offset", "ratio", "eccentricity", "linkage", "axis_wobble", "geometry"})
"""Smooth functions of one joint; so is a mesh with fewer waves a turn than ``RIPPLE``."""
RIPPLE = 6.0
EXACT, EXACTLY = frozenset({"zero_offset", "ratio", "eccentricity", "mesh"}), 0.96
"""Smooth effects whose forms are exact must close nearly all: whatever is smooth looks like them otherwise."""
LOCALLY, GLOBALLY = 0.92, 0.75
"""Shares of what nameless functions close that a name must close to stand."""
WEAKER = 0.10
"""Of what is closed at one place: the second name there must close so much."""
MOVES = 0.1
"""Of what can be closed: what adds little to the evidence but closes so much is judged all the same."""
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
    def geometry(self) -> Array:
        """Small changes of geometry as everything that was found leaves them.

        Taken as known: a model without a cause must not hide the loss behind a geometry that nobody believes in.
        """
        everything = joined(self.everything, self.rest)
        problem = self.problem
        index = np.concatenate([np.arange(problem.nuisance), self.evidence.index(everything.groups)]).astype(int)
        prior = np.concatenate([self.evidence.precision, self.evidence.prior(everything)])
        square = problem.sums.square[np.ix_(index, index)] + np.diag(prior)
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
    out = []
    by_variable: dict[str, list[int]] = {}
    for k, group in enumerate(kept.groups):
        by_variable.setdefault(judge.variable(judge.problem.candidates[group].place), []).append(k)
    for variable, members in by_variable.items():
        out += _at(judge, variable, _pick(kept, members), _elsewhere(judge, variable, kept))
    return _steps_together(out)


def _worthy(judge: Judge) -> Chosen:
    """What the data say much for, and what moves much: placement and geometry hide that from the evidence."""
    whole, found = judge.square(judge.found), judge.found
    lost = [judge.square(found.without(k)) - whole for k in range(len(found.groups))]
    return joined(judge.worth, _pick(found, [k for k, m2 in enumerate(lost) if m2 > MOVES * judge.closable_m2]))


def _elsewhere(judge: Judge, variable: str, kept: Chosen) -> Chosen:
    """All that was found at other variables, clutter included: nameless functions here shall not stand in for it."""
    both = joined(kept, judge.found)
    candidates = judge.problem.candidates
    return _pick(both, [k for k, g in enumerate(both.groups) if judge.variable(candidates[g].place) != variable])


def _steps_together(found: list[Stand]) -> list[Stand]:
    """Steps of the encoders of several joints are one cause."""
    steps = [one for one in found if one.place.effect == "quantisation"]
    if len(steps) < 2:
        return found
    together = joined(*(Chosen(one.groups, one.sizes) for one in steps))
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


def _at(judge: Judge, variable: str, here: Chosen, elsewhere: Chosen) -> list[Stand]:
    """Names at one variable, or that it is unknown what acts there."""
    without = judge.square(elsewhere)
    local = judge.local.get(variable, Chosen())
    ceiling = without - min(judge.square(joined(elsewhere, here, local)), judge.square(joined(elsewhere, here)))
    closes = [without - judge.square(joined(elsewhere, _pick(here, [k]))) for k in range(len(here.groups))]
    order = list(np.argsort(closes)[::-1])
    first = order[0]
    share = closes[first] / max(ceiling, 1e-300)
    same = [k for k in order if _place(judge, here, k).same_as(_place(judge, here, first))]
    plain = judge.problem.candidates[here.groups[first]]
    if share >= (EXACTLY if plain.place.effect in EXACT and _smooth(plain) else LOCALLY):
        return [_stand(judge, here, same if _place(judge, here, first).effect in COMPLETED else [first], share)]
    if len(same) > 1 and _place(judge, here, first).effect in COMPLETED:
        together = (without - judge.square(joined(elsewhere, _pick(here, same)))) / max(ceiling, 1e-300)
        if together >= LOCALLY:
            return [_stand(judge, here, same, together)]
    pairs = [k for k in order[1:] if _make_a_pair(judge, here, first, k)]
    best = max(
        ((without - judge.square(joined(elsewhere, _pick(here, [first, k]))), k) for k in pairs), default=(0.0, -1)
    )
    if best[1] >= 0 and best[0] / max(ceiling, 1e-300) >= LOCALLY and best[0] - closes[first] >= WEAKER * best[0]:
        together = best[0] / max(ceiling, 1e-300)
        return [_stand(judge, here, [first], together), _stand(judge, here, [best[1]], together)]
    if not variable.startswith("joint"):
        place = Place("unknown", variable=variable)
    else:
        place = Place("unknown", joint=int(variable.split()[1]))
    groups = joined(local, here)
    return [Stand(place, groups.groups, groups.sizes, share)]


def _make_a_pair(judge: Judge, here: Chosen, first: int, second: int) -> bool:
    """Whether two names at one variable can both be right: two smooth functions of one joint imitate any third."""
    names = [judge.problem.candidates[here.groups[k]] for k in (first, second)]
    same = (names[0].place.effect, names[0].place.source) == (names[1].place.effect, names[1].place.source)
    return not same and not all(_smooth(name) for name in names)


def _smooth(candidate: Candidate) -> bool:
    orders = dict(candidate.fixed)
    return candidate.place.effect in SMOOTH or orders.get("order_1", np.inf) < RIPPLE


def _place(judge: Judge, chosen: Chosen, k: int) -> Place:
    return judge.problem.candidates[chosen.groups[k]].place


def _pick(chosen: Chosen, which: list[int]) -> Chosen:
    return Chosen(tuple(chosen.groups[k] for k in which), tuple(chosen.sizes[k] for k in which))


def _stand(judge: Judge, chosen: Chosen, which: list[int], local: float) -> Stand:
    one = _pick(chosen, which)
    return Stand(judge.problem.candidates[one.groups[0]].place, one.groups, one.sizes, float(min(local, 1.0)))
