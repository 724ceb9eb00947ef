"""What was found on some of very many points, fitted and judged on all of them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from core.gap.analysis import Analysis, NoiseFound, numbers
from core.gap.design import Design
from core.gap.doings import doings
from core.gap.evidence import Chosen
from core.gap.observations import Observations
from core.gap.problem import Problem, pose_problem
from core.gap.whitening import whitening
from core.geometry import Array

SEARCHED_POINTS = 4000
"""More are searched in part only: the search needs no more, and the fit takes them all."""


@dataclass(frozen=True, eq=False)
class Wide:
    """A problem over all points with the candidates that matter."""

    problem: Problem
    number: dict[int, int]
    """Of each candidate of the search among those here."""
    noise: NoiseFound
    residual_m: Array
    """Real minus placed sim, (m, 3)."""

    def chosen(self, chosen: Chosen) -> Chosen:
        """A choice in the numbers of this problem; sizes keep their meaning in the units of the columns."""
        return Chosen(tuple(self.number[g] for g in chosen.groups), chosen.sizes)


def thinned(seen: Observations) -> Observations:
    """Every so many standstills of very many."""
    every = -(-seen.count // SEARCHED_POINTS)
    return seen if every == 1 else seen.part(seen.standstill % every == 0)


def widened(analysis: Analysis, seen: Observations, groups: Sequence[int], state: Chosen) -> Wide:
    """All points with some candidates of a search; few points again where what the search was bent about is dropped.

    Args:
        state: what sets the state about which the model is linear.
    """
    strongest = analysis.found.chosen.groups[:1]
    straight = analysis.sim is analysis.placed or set(strongest) <= set(state.groups)
    if seen is analysis.sim.seen and straight:
        same = {g: g for g in range(len(analysis.problem.candidates))}
        return Wide(analysis.problem, same, analysis.noise, analysis.residual_m)
    told = doings(seen)
    sim, placed = replace(analysis.sim, seen=seen), replace(analysis.placed, seen=seen)
    candidates = [analysis.problem.candidates[g] for g in groups]
    old = analysis.problem
    index, estimate = numbers(old, analysis.evidence, analysis.geometry_prior, state)
    columns = old.nuisance_columns(seen)
    columns += [column for g in state.groups for column in old.candidates[g].columns(told)]
    design = Design(sim, tuple(columns), old.design.scale[index])
    linear = design.whole() @ estimate
    residual_m = seen.point_m - sim.points_m()
    if seen.simulated_m is None:
        residual_m = residual_m - (sim.moved_m(design.motions(estimate)) - sim.points_m() - linear)
    noise = analysis.noise.over(seen, residual_m - linear)
    white = whitening(noise.covariance_m2, noise.weight, noise.memory)
    problem = pose_problem(sim, told, candidates, residual_m, white)
    return Wide(problem, {int(g): k for k, g in enumerate(groups)}, noise, seen.point_m - placed.points_m())
