"""Steps of encoders are found with their size, to a tenth of a step from one end of a joint's range to the other."""

import numpy as np
import pytest
from gap_arms import ARMS, Day, day

from core.gap.doings import doings
from core.gap.effects.drives import saw
from core.gap.encoder_steps import encoder_steps
from core.gap.placement import placement_slots
from core.gap.sim import Part, Slot

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
