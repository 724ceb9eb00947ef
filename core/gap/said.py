"""What is said of the gap: names in their order, and what has no name before or after them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from core.gap.analysis import Analysis
from core.gap.evidence import Chosen, joined, without
from core.gap.open_set import AT_FLOOR, EVERYWHERE, Judge, Stand, chosen_of, stands, unknown_at
from core.gap.posterior import sufficient
from core.gap.result import UNKNOWN, Place

TOLD_SHARE = 0.01
"""Of the gap: a change of geometry that closes less, or a name that adds less to something unknown, is not told."""
SURE_OF_REST = 0.1
"""What nameless functions must still close, as a share of the gap, to be told as something unknown."""
MANY, MANY_LEAVE = 3, 4.0
"""Names that together leave too much: none of their joints is where something acts. More of them than that must leave
less than so many floors (mean squares), or they only imitate something else."""
ONE_JOINT, LEAVES = 0.8, 2.0
"""Of the evidence for functions of time or configuration: where one joint's have as much and leave less than so
many times what those leave beyond the floor, it is that joint."""
FAINT, FAINTEST = 1.3, 0.02
"""Times the noise (mean squares) of what does not stand out of it by itself; and what a name must close of that."""


def told_stands(analysis: Analysis) -> list[Stand]:
    """All causes that were told to be there, the one that the data say most for first."""
    everything = analysis.everything
    causes = [
        Stand(analysis.problem.candidates[g].place, (g,), (s,), 1.0)
        for g, s in zip(everything.groups, everything.sizes, strict=True)
    ]
    return sorted(causes, key=lambda one: evidence_lost(analysis, one, causes), reverse=True)


def evidence_lost(analysis: Analysis, stand: Stand, named: Sequence[Stand]) -> float:
    """What the data say for one cause when all others are given: geometry can move much that placing takes back."""
    evidence, everything = analysis.evidence, joined(chosen_of(named), analysis.given)
    return evidence.given(everything) - evidence.given(without(everything, stand.groups))


@dataclass(frozen=True, eq=False)
class Said:
    """What a search found and a judge let stand, ordered and located."""

    analysis: Analysis
    judge: Judge

    def stands(self) -> list[Stand]:
        """Named causes, the one that the data say most for first, and unknown ones, each place once."""
        out: list[Stand] = []
        for one in self._ordered():
            sharp = replace(one, place=self._sharper(one.place)) if one.unknown else one
            if not any(sharp.unknown and other.place.same_as(sharp.place) for other in out):
                out.append(sharp)
        return self._wider(out)

    def _wider(self, told: list[Stand]) -> list[Stand]:
        """Time or the configuration in place of an unknown's joint, where an error of that joint leaves far more."""
        if not told or not all(one.unknown for one in told) or told[0].place.joint is None:
            return told
        joint, local = f"joint {told[0].place.joint}", self.judge.local
        wide = {v: self._beyond_m2(v) for v in ("time", "configuration") if v in local and local[v].groups}
        best = min(wide, key=wide.__getitem__, default=None)
        if best is None or not self._leaves_more(joint, best) or self._evidence(joint) > self._evidence(best):
            return told
        place = unknown_at(best)
        instead = Stand(place, local[best].groups, local[best].sizes, 0.0)
        return [instead, *(one for one in told[1:] if not one.place.same_as(place))]

    def _evidence(self, variable: str) -> float:
        return self.analysis.evidence.given(self.judge.local.get(variable, Chosen()))

    def _beyond_m2(self, variable: str) -> float:
        """What functions of one variable leave beyond the floor on kept-out points."""
        left_m2 = self.judge.open.square_m2(self.judge.local.get(variable, Chosen()))
        return max(left_m2 - self.judge.floor_m2, 0.0)

    def _leaves_more(self, joint: str, variable: str) -> bool:
        """Whether errors of one joint leave far more than functions of time or configuration do."""
        return self._beyond_m2(joint) > LEAVES * self._beyond_m2(variable) + 0.5 * self.judge.floor_m2

    def _sharper(self, place: Place) -> Place:
        """A joint instead of time or the whole configuration, where an error of that joint alone says nearly as much.

        Play that nothing holds on a flank wanders, and what wanders looks like something that depends on time.
        """
        if place.variable not in ("configuration", "time"):
            return place
        joints = [variable for variable in self.judge.local if variable.startswith("joint")]
        best = max(joints, key=self._evidence, default=None)
        if best is None or self._evidence(best) < ONE_JOINT * self._evidence(place.variable):
            return place
        return place if self._leaves_more(best, place.variable) else unknown_at(best)

    def _ordered(self) -> list[Stand]:
        judged = [*self._geometry_stands(), *stands(self.judge)]
        named = [one for one in judged if not one.unknown]
        order = sorted(named, key=lambda one: evidence_lost(self.analysis, one, named), reverse=True)
        order = [one for one in order if self._matters(one, order)]
        if self._faint(order):
            order = []
        located = [one for one in judged if one.unknown]
        unknown = self._unknown(located, order)
        one = None if self.analysis.given.groups else self._one_for_all([*order, *located])
        if one is not None:
            rest = [other for other in unknown if other not in located and not other.place.same_as(one.place)]
            return [one, *self._adding(order, [one, *rest]), *rest]
        if order and not self.analysis.given.groups and not self._enough(order):
            return [*self._stood_in_for(order, unknown), *(self._adding(order, unknown) if unknown else order)]
        return self._strongest_first(order, unknown)

    def _faint(self, named: list[Stand]) -> bool:
        """Whether names close little of what hardly stands out of the noise."""
        floor_m2, closed = self.judge.floor_m2, self.judge.base_m2 - self.judge.square(chosen_of(named))
        return self.judge.base_m2 < FAINT * floor_m2 and closed < max(0.5 * self.judge.closable_m2, FAINTEST * floor_m2)

    def _enough(self, named: list[Stand]) -> bool:
        """Whether names close what can be closed; many together may do so for anything, but not down to the noise."""
        chosen = chosen_of(named)
        left = self.judge.open.square_m2(joined(chosen, self.judge.found))
        if len(named) > MANY and left > MANY_LEAVE * self.judge.floor_m2:
            return False
        return sufficient(self.judge, chosen) >= 0.5

    def _one_for_all(self, several: list[Stand]) -> Stand | None:
        """One thing without a name that leaves less of kept-out points than what is at several places; None: none."""
        judge = self.judge
        if len({judge.variable(one.place) for one in several}) < 2 or not judge.local:
            return None
        if judge.open.square_m2(joined(chosen_of(several), judge.found)) < AT_FLOOR * judge.floor_m2:
            return None
        most = max(self._evidence(variable) for variable in judge.local)
        likely = [variable for variable in judge.local if self._evidence(variable) >= ONE_JOINT * most]
        left = {variable: judge.open.square_m2(judge.local[variable]) for variable in likely}
        best = min(left, key=left.__getitem__)
        if judge.open.square_m2(chosen_of(several)) < left[best]:
            return None
        return Stand(unknown_at(best), judge.local[best].groups, judge.local[best].sizes, 0.0)

    def _stood_in_for(self, named: list[Stand], unknown: list[Stand]) -> list[Stand]:
        """What names that leave too much most probably stand in for: something at their joint, or everywhere."""
        lost = self._lost_m2([*named, *unknown])[len(named) :]
        unknown = [unknown[k] for k in np.argsort(lost)[::-1]]
        if unknown and len(named) < MANY:
            return unknown
        place = self._foremost(named)
        same = [one for one in unknown if one.place.same_as(place)] or [Stand(place, (), (), 0.0)]
        return [*same, *(one for one in unknown if not one.place.same_as(place))]

    def _foremost(self, named: list[Stand]) -> Place:
        """Where names stand in for something: their common variable, or that of the best functions without a name."""
        variables = {self.judge.variable(one.place) for one in named}
        if len(variables) == 1:
            return unknown_at(variables.pop())
        best = [self.judge.problem.candidates[g].place for g in self.judge.lone.groups[:1]]
        return replace(best[0], effect=UNKNOWN) if best else unknown_at("configuration")

    def _strongest_first(self, named: list[Stand], unknown: list[Stand]) -> list[Stand]:
        """Names in their order; before them what has no name and closes more than any: names must add to it then."""
        lost = self._lost_m2([*named, *unknown])
        most = max(lost[: len(named)], default=np.inf) + SURE_OF_REST * self.judge.closable_m2
        first = [one for one, m2 in zip(unknown, lost[len(named) :], strict=True) if m2 > most]
        told = self._adding(named, unknown) if first else named
        return [*first, *told, *(one for one in unknown if one not in first)]

    def _adding(self, named: list[Stand], unknown: list[Stand]) -> list[Stand]:
        """Names that add to what has none, and without it predict better than no name."""
        least = TOLD_SHARE * self.judge.closable_m2
        lost = self._lost_m2([*named, *unknown])
        out = [one for one, m2 in zip(named, lost, strict=False) if m2 > least or self._is_given(one)]
        while out:
            without_m2 = [self._open_m2([other for other in out if other is not one]) for one in out]
            worst = int(np.argmin(without_m2))
            if without_m2[worst] > self._open_m2(out) or self._is_given(out[worst]):
                break
            out = out[:worst] + out[worst + 1 :]
        return out

    def _open_m2(self, some: list[Stand]) -> float:
        return self.judge.open.square_m2(joined(self.analysis.given, chosen_of(some)))

    def _lost_m2(self, told: list[Stand]) -> list[float]:
        """What each of several closes when all others are given, m^2."""
        whole = self.judge.square(chosen_of(told))
        return [self.judge.square(chosen_of([o for o in told if o is not one])) - whole for one in told]

    def _is_given(self, stand: Stand) -> bool:
        return bool(stand.groups) and stand.groups[0] in self.analysis.given.groups

    def _matters(self, stand: Stand, others: list[Stand]) -> bool:
        """Whether geometry that is fitted anyway is worth telling of."""
        if not self._is_given(stand):
            return True
        a = self.analysis
        known = without(joined(a.given, self.judge.worth), stand.groups)
        if not a.evidence.gains(np.array(stand.groups), known).evidence[0] > 0:
            return False
        rest = chosen_of([one for one in others if one is not stand])
        kept, closable = self.judge.kept_out, self.judge.closable_m2
        return kept.square_m2(rest) - kept.square_m2(joined(rest, chosen_of([stand]))) > TOLD_SHARE * closable

    def _geometry_stands(self) -> list[Stand]:
        given = self.analysis.given
        candidates = self.analysis.problem.candidates
        return [Stand(candidates[g].place, (g,), (s,), 1.0) for g, s in zip(given.groups, given.sizes, strict=True)]

    def _unknown(self, located: list[Stand], named: list[Stand]) -> list[Stand]:
        """What acts without a name: at places where names failed, and where all names leave something."""
        judge, out = self.judge, list(located)
        so_far = chosen_of([*named, *located])
        left = judge.square(so_far)
        rest = judge.rest if named or located else judge.lone
        if rest.groups and left - judge.square(joined(so_far, rest)) > SURE_OF_REST * judge.closable_m2:
            place = judge.problem.candidates[rest.groups[0]].place
            unknown = Place(UNKNOWN, joint=place.joint, variable=place.variable)
            if not any(one.place.same_as(unknown) for one in out):
                out.append(Stand(unknown, rest.groups, rest.sizes, 0.0))
        noise = self.analysis.noise
        known = [one.place for one in (*out, *named)]
        told = noise.scattering in {one.joint for one in known} or any(one.effect in EVERYWHERE for one in known)
        if noise.scattering is not None and not told and (noise.excess > 1 or noise.unlike_statement):
            out.append(Stand(Place(UNKNOWN, joint=noise.scattering), (), (), 0.0))
        return out
