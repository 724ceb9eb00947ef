"""Before measuring: the smallest effect that planned points would show, and which effects they could not tell apart.

The isolability matrix of fault diagnosis (Gertler 1998, Fault Detection and Diagnosis in Engineering Systems) for the
library of effects, in the terms in which a diagnosis decides: expected log evidence. Each effect acts alone, drawn at
random in all its numbers, at a stated size; its rivals are the places for which a diagnosis would then gather nearly
as much.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.gap.analysis import AS_CALIBRATED, drawn_geometry, null_threshold
from core.gap.detection import SURE
from core.gap.evidence import Chosen, without
from core.gap.expected_evidence import size_for
from core.gap.isolability_field import Field, Limit, noise_rms_m, place_of
from core.gap.planned import planned_problem
from core.gap.problem import Problem
from core.gap.result import Place
from core.geometry import Array
from core.measurements import Campaign

AT_LEAST = 2.0
"""Times its detection limit that an effect has at least when its rivals are named."""
APART = 4.0
"""Standard deviations between an effect and a rival that is told from it in nine campaigns of ten."""


@dataclass(frozen=True)
class Rival:
    """A place that an effect could be taken for."""

    place: Place
    separation: float
    """Expected, in standard deviations; 0: nothing speaks for the right one."""
    group: int
    """The candidate of the problem that would do it."""


@dataclass(frozen=True, eq=False)
class Isolated:
    """What planned points can say of one effect at one place."""

    place: Place
    limit: Limit
    rms_m: float
    """The size at which rivals are named, as ``Limit.rms_m``."""
    rivals: tuple[Rival, ...]
    """Less than ``APART`` standard deviations away, nearest first."""
    group: int
    """The candidate of the problem that stands for the effect."""
    size: float
    """The size at which rivals are named, in the units of the problem; where nothing is seen, the stated one."""
    granted: Chosen
    """What is fitted anyway when the effect is judged."""

    @property
    def named(self) -> bool:
        """Whether it would be seen and told from everything else."""
        return self.limit.shown and not self.rivals


@dataclass(frozen=True, eq=False)
class Isolability:
    """What planned points can tell of every effect of the library."""

    problem: Problem
    drawn: bool
    """Whether the geometry is as drawn; else it is known as a calibration leaves it."""
    noise_m: float
    """Of one coordinate, rms over the shots."""
    needed: Array
    """Log evidence from which each candidate of the problem is hardly missed, (candidates,)."""
    effects: tuple[Isolated, ...]


def isolability(campaign: Campaign, drawn: bool = False) -> Isolability:
    """What the points of a plan will be able to show and to tell apart.

    Args:
        campaign: planned rows with points where they are expected (``with_expected_points``) and the expected noise as
            covariances; of measured points only their places count.
        drawn: the sim's geometry is as drawn (1 mm, 1 mrad), so that all of it is fitted as well; False: it is known as
            a calibration leaves it (0.1 mm, 0.1 mrad).

    Raises:
        CampaignError: no target on a moving link is sighted.
    """
    problem = planned_problem(campaign)
    needed = null_threshold(problem, problem.evidence(AS_CALIBRATED)) + SURE + problem.cost
    given = drawn_geometry(problem) if drawn else Chosen()
    fitted = {problem.candidates[g].place for g in given.groups}
    rest = [int(g) for g in problem.named if g not in given.groups]
    effects = _isolated(problem, given, rest, [g for g in rest if place_of(problem, g) not in fitted], needed)
    for g in given.groups:
        effects += _isolated(problem, without(given, (g,)), [*rest, g], [g], needed)
    return Isolability(problem, drawn, noise_rms_m(problem), needed, tuple(effects))


def _isolated(
    problem: Problem, granted: Chosen, groups: Sequence[int], asked: Sequence[int], needed: Array
) -> list[Isolated]:
    """Every place of the asked candidates among the groups that compete."""
    field = Field(problem, granted, tuple(groups))
    limit = size_for(field.evidence, needed[list(groups)])
    acting = field.standing_for(np.flatnonzero(np.isin(groups, asked)), limit)
    size = np.maximum(field.stated, np.where(np.isfinite(limit), AT_LEAST * limit, 0.0))[acting]
    found = field.separations(acting, size)
    out = []
    for k, own in enumerate(acting):
        shown = field.limit(int(own), float(limit[own]))
        near = found.nearer_than(APART, k) if shown.shown else []
        behind = [int(groups[found.rival[k, p]]) for p in near]
        rivals = (Rival(place_of(problem, g), float(found.apart[k, p]), g) for g, p in zip(behind, near, strict=True))
        group, rms_m = int(groups[own]), float(size[k] * field.moved_m[own])
        out.append(Isolated(place_of(problem, group), shown, rms_m, tuple(rivals), group, float(size[k]), granted))
    return out
