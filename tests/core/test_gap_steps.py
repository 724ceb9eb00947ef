"""Steps of encoders are found with their size, to a tenth of a step from one end of a joint's range to the other."""

import numpy as np
import pytest
from gap_arms import ARMS, Day, day

from core.gap.doings import doings
from core.gap.effects.drives import quantisation, saw
from core.gap.encoder_steps import encoder_steps, settled_steps
from core.gap.placement import placement_slots
from core.gap.sim import Part, Slot
from core.gap.step_edges import JointErrors, settled

SIGMA_M = 2e-5


CASES = [(1, 7e-4, 0.2), (2, 7e-4, 0.2), (3, 7e-4, 0.7), (1, 1.9e-3, 0.7), (2, 1.3e-3, 0.7), (3, 1.3e-3, 0.7)]


@pytest.mark.parametrize(("joint", "step_rad", "phase"), CASES)
def test_the_last_of_thousands_of_steps_is_where_it_should_be(joint: int, step_rad: float, phase: float) -> None:
    sim = day(ARMS["phi"](1), 1, Day(arc=25, poses=120))
    told, rng = doings(sim.seen), np.random.default_rng(joint)
    x = told.active[:, joint - 1]
    moved = sim.fields([Slot(Part.DRIVE, joint - 1)])[:, :, 0] * saw(x, step_rad, phase)[:, None]
    aim = moved + rng.normal(0.0, SIGMA_M, moved.shape)
    placed = sim.fields(placement_slots(sim.seen)).reshape(aim.size, -1)
    aim -= (placed @ np.linalg.lstsq(placed, aim.ravel(), rcond=None)[0]).reshape(aim.shape)
    found = encoder_steps(sim, told, [aim], np.full(told.count, SIGMA_M**-2))
    mine = [one for one in found if one.place.joint == joint]
    assert mine
    sizes = np.array([dict(one.fixed)[f"step_of_joint_{joint}_rad"] for one in mine])
    steps_off = np.abs(1 / sizes - 1 / step_rad) * np.ptp(x)
    assert steps_off.min() < 0.1


class TestSettled:
    """Of all sizes and phases that leave every point on its side, the middle is taken."""

    STEP, PHASE = 1e-3, 0.3

    def errors(self, seed: int, points: int = 150, step: float = STEP, outliers: int = 0) -> JointErrors:
        rng = np.random.default_rng(seed)
        x = rng.uniform(-1.0, 1.3, points)
        error = saw(x, step, self.PHASE) + 1e-5 * rng.normal(size=points)
        error[:outliers] += 0.3
        strength = np.full(points, 1e10)
        return JointErrors(x, strength, strength * error)

    def misplaced(self, found: tuple[float, float], step: float = STEP) -> float:
        """Share of new places that lie on the wrong side of an edge."""
        x = np.linspace(-1.0, 1.3, 100_001)
        return float(np.mean(np.abs(saw(x, *found) - saw(x, step, self.PHASE)) > step / 2))

    def test_few_new_places_lie_on_the_wrong_side(self) -> None:
        off = []
        for seed in range(20):
            start = self.STEP * (1 + 1.5e-5), self.PHASE + 0.012
            size, phases = settled([self.errors(seed)], start[0], [start[1]])
            off.append(self.misplaced((size, phases[0])))
        # An edge lies between two of 150 places; two numbers are found by them.
        assert np.mean(off) < 0.01
        assert np.max(off) < 0.03

    def test_joints_of_one_size_tell_it_together(self) -> None:
        alone = [abs(settled([self.errors(s)], self.STEP, [self.PHASE])[0] / self.STEP - 1) for s in range(12)]
        several = [self.errors(seed) for seed in range(12)]
        size, phases = settled(several, self.STEP * (1 + 1e-5), [self.PHASE + 0.01] * 12)
        assert abs(size / self.STEP - 1) < np.mean(alone)
        assert np.mean([self.misplaced((size, phase)) for phase in phases]) < 0.008

    def test_outliers_count_for_a_step(self) -> None:
        found, phases = settled([self.errors(1, outliers=3).within(self.STEP)], self.STEP, [self.PHASE])
        assert self.misplaced((found, phases[0])) < 0.02

    def test_a_joint_that_stands_still_tells_nothing(self) -> None:
        still = JointErrors(np.full(9, 0.2), np.ones(9), np.zeros(9))
        assert settled([still], self.STEP, [0.25]) == (self.STEP, [0.25])


def test_steps_of_all_joints_do_not_blur_each_other() -> None:
    """One size for all; every joint has a phase of its own, which the steps of the others hide."""
    sim = day(ARMS["phi"](1), 1, Day(arc=25, poses=240))
    told, rng = doings(sim.seen), np.random.default_rng(3)
    step, phases = 8e-4, rng.uniform(0, 1, sim.seen.joint_count)
    moved = sum(
        sim.fields([Slot(Part.DRIVE, j)])[:, :, 0] * saw(told.active[:, j], step, phases[j])[:, None]
        for j in range(len(phases))
    )
    aim = moved + rng.normal(0.0, SIGMA_M, moved.shape)
    wrong = quantisation(told, {j: (step, float(phases[j] + 0.5)) for j in range(len(phases))})
    found = settled_steps(sim, told, wrong, aim, np.full(told.count, SIGMA_M**-2))
    for j, (size, phase) in found.steps.items():
        x = told.active[:, j]
        off = np.abs(saw(x, size, phase) - saw(x, step, phases[j])) > step / 2
        assert off.mean() < 0.02
