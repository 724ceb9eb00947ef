"""Scatter of one joint: found with its size where it is, and not found where noise is even."""

from functools import cache

import numpy as np
import pytest
from gap_arms import ARMS, Day, day

from core.gap.doings import Doings, doings
from core.gap.scatter import joint_scatter
from core.gap.sim import Part, Sim, Slot
from core.gap.whitening import whitening
from core.geometry import Array

SIGMA_M, SIZE_RAD = 3e-5, 1e-4


@cache
def cell() -> tuple[Doings, Sim, Array]:
    sim = day(ARMS["phi"](1), 1, Day(arc=25, poses=40, visits=3))
    told = doings(sim.seen)
    return told, sim, np.tile(SIGMA_M**2 * np.eye(3), (told.count, 1, 1))


def moved_m(joint: int) -> Array:
    _, sim, _ = cell()
    return sim.fields([Slot(Part.DRIVE, joint - 1)])[:, :, 0]


def noise_m(seed: int, joint: int | None) -> Array:
    rng = np.random.default_rng(seed)
    even = rng.normal(0.0, SIGMA_M, (cell()[0].count, 3))
    return even if joint is None else even + rng.normal(0.0, SIZE_RAD, len(even))[:, None] * moved_m(joint)


@pytest.mark.parametrize("joint", [1, 2, 3])
def test_a_joint_that_scatters_is_found_with_its_size(joint: int) -> None:
    told, sim, covariance = cell()
    found = joint_scatter(sim, told, noise_m(joint, joint), whitening(covariance, np.ones(told.count)))
    assert found is not None
    assert found.joint == joint
    # The grid of sizes is a factor of 1.47 wide.
    assert found.size * np.sqrt(found.scale) == pytest.approx(SIZE_RAD, rel=0.3)
    given = covariance + SIZE_RAD**2 * np.einsum("mi,mj->mij", moved_m(joint), moved_m(joint))
    shaped = found.over(covariance)
    assert np.trace(shaped, axis1=1, axis2=2).mean() == pytest.approx(np.trace(given, axis1=1, axis2=2).mean(), rel=0.2)


@pytest.mark.parametrize("part", [Part.DRIVE, Part.JOINT])
def test_a_joint_that_drives_the_next_one_scatters_with_it_or_alone(part: Part) -> None:
    sim = day(ARMS["coupled"](1), 1, Day(arc=25, poses=40, visits=3))
    told, rng = doings(sim.seen), np.random.default_rng(8)
    moved = sim.fields([Slot(part, 1)])[:, :, 0] * rng.normal(0.0, SIZE_RAD, told.count)[:, None]
    covariance = np.tile(SIGMA_M**2 * np.eye(3), (told.count, 1, 1))
    noise = rng.normal(0.0, SIGMA_M, (told.count, 3))
    found = joint_scatter(sim, told, moved + noise, whitening(covariance, np.ones(told.count)))
    assert found is not None
    assert found.joint == 2


def test_an_even_scatter_is_no_joints() -> None:
    """The likelihood must gain ten: one even campaign in thousands does."""
    told, sim, covariance = cell()
    white = whitening(covariance, np.ones(told.count))
    assert all(joint_scatter(sim, told, noise_m(seed, None), white) is None for seed in range(50))


def test_a_wrong_scale_of_the_noise_makes_no_joint() -> None:
    told, sim, covariance = cell()
    white = whitening(4 * covariance, np.ones(told.count))
    assert joint_scatter(sim, told, noise_m(9, None), white) is None
