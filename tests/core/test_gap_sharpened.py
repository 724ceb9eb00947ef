"""What a grid finds roughly is found sharply: time constants of warming up."""

import numpy as np
import pytest
from gap_arms import ARMS, Day, day

from core.gap.design import Design
from core.gap.doings import Doings, doings
from core.gap.effects.candidate import Candidate
from core.gap.effects.thermal import Thermal, WarmUp, thermals, warmed
from core.gap.sharpened import sharpened
from core.gap.sim import Sim
from core.geometry import Array

SIGMA_M = 2e-5


@pytest.fixture(scope="module")
def told() -> Doings:
    return doings(day(ARMS["phi"](1), 1, Day(arc=25, poses=60)).seen)


def moved(sim: Sim, told: Doings, candidate: Candidate, number: int, size: float) -> Array:
    columns = tuple(candidate.columns(told))[number : number + 1]
    return Design(sim, columns, np.ones(1)).whole()[:, :, 0] * size


@pytest.mark.parametrize("share", [0.05, 0.2, 0.6])
@pytest.mark.parametrize("link", [2, 3, None])
def test_the_time_constant_of_warming_up_is_found(told: Doings, share: float, link: int | None) -> None:
    sim = day(ARMS["phi"](1), 1, Day(arc=25, poses=60))
    constant_s = share * float(np.ptp(told.elapsed_s))
    truth = next(one for one in warmed(told, WarmUp(constant_s, False)) if one.place.joint == link)
    # As the grid has it: the neighbour of the true constant that was chosen, and what it leaves.
    near = [one for one in thermals(told) if one.place.joint == link and isinstance(one, Thermal) and one.warm_up]
    chosen = min(near, key=lambda one: abs(np.log(one.warm_up.constant_s / constant_s)))
    true_m = moved(sim, told, truth, 0, 2e-3)
    own_m = moved(sim, told, chosen, 0, 2e-3)
    noise_m = SIGMA_M * np.random.default_rng(1).normal(size=true_m.shape)
    left_m = true_m - own_m + noise_m
    found = sharpened(sim, told, [chosen], left_m, [own_m], np.full(told.count, SIGMA_M**-2))
    found = [one for one in found if one.place.effect == "thermal"]
    assert {one.place.joint for one in found} == {one.place.joint for one in thermals(told)}
    constants = {dict(one.fixed)["time_constant_s"] for one in found}
    assert len(constants) == 1
    # The next constants that are tried lie 23 % off.
    assert constants.pop() == pytest.approx(constant_s, rel=0.25)


def test_a_time_constant_is_more_than_nothing() -> None:
    with pytest.raises(ValueError, match="more than 0 s"):
        WarmUp(0.0, True)
