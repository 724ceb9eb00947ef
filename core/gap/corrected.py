"""The sim with the causes added: where it has the points of this campaign, or of another one of the same arm."""

from dataclasses import dataclass

import numpy as np

from core.calibrated_arm import CalibratedArm
from core.gap.calibration_doubt import doubt_columns
from core.gap.design import motions_of
from core.gap.doings import doings
from core.gap.effects.candidate import Candidate, Column
from core.gap.kept_out import mean_square
from core.gap.observations import Observations, observe
from core.gap.placement import place, placement_slots, with_placement
from core.gap.result import GapReport
from core.gap.sim import Sim, Slot
from core.geometry import Array
from core.measurements import Campaign

SESSION_BOUND = frozenset({"base_shift", "target_slip", "drift"})
"""Effects that belong to one session: nothing of them is taken to another."""
ROUNDS = 6


@dataclass(frozen=True, eq=False)
class CorrectedSim:
    """Causes with their estimated numbers, and the small changes of geometry that were fitted along."""

    arm: CalibratedArm | None
    """The sim that is corrected; None: the nominal robot."""
    causes: tuple[Candidate, ...]
    numbers: tuple[Array, ...]
    """Unknown numbers of each cause, in the units of their names."""
    geometry: tuple[tuple[Slot, float], ...]
    doubt: Array
    """How far the errors that the calibration knew it may have went, in their standard deviations, (d,)."""
    digest: str
    """Of the campaign it was found on."""

    def motions(self, seen: Observations) -> dict[Slot, Array]:
        """The small motions at the points of a campaign, (m,) each."""
        told, same = doings(seen), seen.campaign.digest == self.digest
        ones = np.ones(seen.count)
        columns: list[Column] = [*([(slot, ones)] for slot, _ in self.geometry), *doubt_columns(seen)]
        numbers = [np.array([value for _, value in self.geometry]), self.doubt]
        for cause, values in zip(self.causes, self.numbers, strict=True):
            if same or cause.place.effect not in SESSION_BOUND:
                columns += cause.columns(told)
                numbers.append(values)
        return motions_of(columns, np.concatenate(numbers))

    def points_m(self, campaign: Campaign) -> tuple[Observations, Array]:
        """The points that a campaign would have measured, placed by what it did measure, (m, 3)."""
        seen = observe(campaign, self.arm)
        sim, motions = self._placed(seen)
        return seen, sim.moved_m(motions)

    def _placed(self, seen: Observations) -> tuple[Sim, dict[Slot, Array]]:
        weight = _weights(seen)
        sim, motions = place(seen, weight), self.motions(seen)
        slots = placement_slots(seen)
        for _ in range(ROUNDS if slots else 0):
            fields = sim.placed_fields(slots, motions)
            square = np.einsum("mck,m,mcl->kl", fields, weight, fields, optimize=True)
            pull = np.einsum("mck,m,mc->k", fields, weight, seen.point_m - sim.moved_m(motions), optimize=True)
            square += 1e-9 * np.trace(square) / len(square) * np.eye(len(square))
            sim = with_placement(sim, slots, np.linalg.solve(square, pull))
        return sim, motions


@dataclass(frozen=True, eq=False)
class Diagnosis(GapReport):
    """A report and the sim that comes of it."""

    corrected: CorrectedSim | None = None


def realised_closure(report: Diagnosis, fresh: Campaign) -> float:
    """Share of gap^2 - floor^2 that the corrected sim closes on another session, base and targets placed anew."""
    assert report.corrected is not None
    seen = observe(fresh, report.corrected.arm)
    before = mean_square(seen.point_m - place(seen, _weights(seen)).points_m())
    _, points = report.corrected.points_m(fresh)
    after = mean_square(seen.point_m - points)
    return float((before - after) / max(before - report.noise.floor_rms_m**2, 1e-300))


def _weights(seen: Observations) -> Array:
    return seen.fitted / np.trace(seen.stated_covariance_m2, axis1=1, axis2=2)
