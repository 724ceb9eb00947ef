"""A base that swings to and fro is found with its period; noise and what the arm does itself are no swing."""

from functools import cache

import numpy as np
import pytest
from gap_arms import ARMS, Day, day

from core.gap.sim import Part, Sim, Slot
from core.gap.swings import swings
from core.geometry import Array

SIGMA_M = 3e-5


@cache
def cell() -> Sim:
    return day(ARMS["phi"](1), 1, Day(arc=25, poses=60, visits=3))


def noise_m(seed: int) -> Array:
    return np.random.default_rng(seed).normal(0.0, SIGMA_M, (cell().seen.count, 3))


def swing_m(times: float) -> Array:
    """The base turns and shifts to and fro, every way with a phase of its own."""
    sim, rng = cell(), np.random.default_rng(3)
    phase, size = rng.uniform(0, 2 * np.pi, 6), np.repeat([1e-4, 1.5e-4], 3)
    motion = size * np.sin(2 * np.pi * times * sim.seen.time[:, None] + phase)
    return sim.moved_m({Slot(Part.BASE, 0, k): motion[:, k] for k in range(6)}) - sim.points_m()


def even() -> Array:
    return np.full(cell().seen.count, SIGMA_M**-2)


@pytest.mark.parametrize("times", [6.3, 14.0, 27.7])
def test_a_swing_is_found_with_its_period(times: float) -> None:
    (found,) = swings(cell(), swing_m(times) + noise_m(1), even())
    assert not found.named
    assert found.place.variable == "time"
    # A swing is known to a fraction of the inverse of the time that it is looked at.
    assert float(found.atom.split()[0]) == pytest.approx(times, abs=0.2)


def test_noise_is_no_swing() -> None:
    assert all(not swings(cell(), noise_m(seed), even()) for seed in range(20))


def test_a_joint_that_errs_is_no_swing() -> None:
    sim = cell()
    for joint in range(sim.seen.joint_count):
        moved = sim.fields([Slot(Part.DRIVE, joint)])[:, :, 0] * 1e-3 * np.sin(2 * sim.seen.active[:, joint])[:, None]
        assert not swings(sim, moved + noise_m(joint), even())


def test_points_that_are_left_out_are_not_asked() -> None:
    weight, aim = even(), noise_m(4)
    weight[:20] = 0.0
    aim[:20] += 1.0
    assert not swings(cell(), aim, weight)


def test_few_points_show_no_swing() -> None:
    sim = cell().part(np.arange(10))
    assert swings(sim, swing_m(6.3)[:10], even()[:10]) == []
