"""Columns and their sums: asked for in pieces as in one go, scaled alike; the noise drawn beside them is white."""

from dataclasses import replace

import numpy as np
import pytest
from gap_arms import ARMS, Day, day

from core.gap.design import Design, candidate_columns
from core.gap.doings import doings
from core.gap.gram import gram, whitened
from core.gap.library import candidates
from core.gap.problem import Problem, pose_problem
from core.gap.sim import Part, Sim, Slot
from core.gap.whitening import Whitening, whitening
from core.geometry import Array

PLAN = Day(arc=5, poses=12)


def noise_of(sim: Sim, seed: int, correlation: float) -> Whitening:
    rng = np.random.default_rng(seed)
    m = sim.seen.count
    root = np.diag(rng.uniform(1e-5, 5e-5, 3)) + 1e-5 * np.tril(rng.normal(size=(m, 3, 3)))
    weight = np.where(rng.random(m) < 0.1, 0.0, rng.uniform(0.3, 1.0, m))
    return whitening(root @ np.swapaxes(root, 1, 2), weight, correlation)


def posed(name: str, seed: int, correlation: float = 0.0) -> tuple[Problem, Array]:
    """A problem with the whole library, and residuals that nothing explains."""
    sim = day(ARMS[name](seed), seed, PLAN)
    told = doings(sim.seen)
    residual = 1e-4 * np.random.default_rng(seed).normal(size=(sim.seen.count, 3))
    return pose_problem(sim, told, candidates(told), residual, noise_of(sim, seed, correlation)), residual


@pytest.mark.parametrize("name", ["coupled", "dh with slides"])
@pytest.mark.parametrize("correlation", [0.0, 0.6])
def test_sums_are_the_direct_products(name: str, correlation: float) -> None:
    problem, residual = posed(name, 1, correlation)
    p = problem.design.count
    x = problem.white.rows(problem.design.whole()).reshape(-1, p)
    y = problem.white.rows(residual).ravel()
    square, most = x.T @ x, np.abs(x.T @ x).max()
    rng = np.random.default_rng(9)
    some = [rng.choice(p, 7), np.arange(5), rng.choice(p, 30)]
    for index in some:
        np.testing.assert_allclose(problem.sums.square.rows(index), square[index], atol=1e-9 * most)
    np.testing.assert_allclose(problem.sums.square.whole, square, atol=1e-9 * most)
    np.testing.assert_allclose(problem.sums.pull, x.T @ y, atol=1e-9 * np.abs(x.T @ y).max())
    assert problem.sums.total == pytest.approx(y @ y)
    assert problem.sums.count == 3 * np.count_nonzero(problem.white.weight)


def test_columns_are_fields_times_features() -> None:
    problem, _ = posed("coupled", 2)
    sim, design = problem.sim, problem.design
    whole = design.whole()
    rng = np.random.default_rng(2)
    for c in rng.choice(design.count, 60, replace=False):
        expected = sum(sim.fields([slot])[:, :, 0] * feature[:, None] for slot, feature in design.columns[c])
        np.testing.assert_allclose(whole[:, :, c], expected * design.scale[c], rtol=1e-9, atol=1e-15)
    some = rng.choice(design.count, 9, replace=False)
    np.testing.assert_array_equal(design.some(some).whole(), whole[:, :, some])


def test_motions_are_what_columns_are_the_derivative_of() -> None:
    """moved_m(motions(x)) leaves the sim along the columns, for all groups together that any point shows."""
    problem, _ = posed("dh with slides", 3)
    numbers = np.random.default_rng(3).normal(size=problem.design.count)
    numbers *= (1e-4 / np.abs(numbers).max()) * (np.diag(problem.sums.square.whole) > 0)
    moved = problem.sim.moved_m(problem.design.motions(numbers)) - problem.sim.points_m()
    expected = problem.design.whole() @ numbers
    np.testing.assert_allclose(moved, expected, atol=1e-4 * np.abs(expected).max())


def test_every_group_is_one_noise_standard_deviation_rms() -> None:
    """Mean square over coordinates and columns of a group; 0 where no point that counts moves."""
    problem, _ = posed("coupled", 4)
    diagonal = np.diag(problem.sums.square.whole) / problem.sums.count
    unit = np.array([diagonal[group].mean() for group in problem.slices])
    moving = unit != 0
    assert np.count_nonzero(~moving) < 0.01 * len(unit)
    np.testing.assert_allclose(unit[moving], 1.0, rtol=1e-9)


def test_slices_follow_the_candidates() -> None:
    problem, _ = posed("phi", 5)
    start = problem.nuisance
    for candidate, group in zip(problem.candidates, problem.slices, strict=True):
        assert group == slice(start, start + len(candidate.names))
        assert len(candidate.references) == len(candidate.names)
        start = group.stop
    assert start == problem.design.count
    columns, sizes, slices = candidate_columns(problem.candidates, problem.doings)
    assert len(columns) == len(sizes) == slices[-1].stop


def test_drawn_noise_has_the_sums_that_white_noise_has() -> None:
    """The pulls of many draws have the covariance X'X over points that are taken."""
    sim = day(ARMS["phi"](6), 6, PLAN)
    slots = [Slot(Part.JOINT, j) for j in range(4)]
    ones = np.ones(sim.seen.count)
    design = Design(sim, tuple([(slot, ones)] for slot in slots), np.ones(4))
    white = replace(noise_of(sim, 6, 0.0), weight=np.where(np.arange(sim.seen.count) % 5, 1.0, 0.0))
    columns = whitened(design, white)
    sums = gram(columns, (), np.zeros((sim.seen.count, 3)), white, draws=4000, seed=1)
    square = sums.square.whole
    size = np.sqrt(np.diag(square))
    found = np.cov(sums.null_pulls) / size[:, None] / size
    np.testing.assert_allclose(found, square / size[:, None] / size, atol=5 / np.sqrt(4000))
    again = gram(columns, (), np.zeros((sim.seen.count, 3)), white, draws=4000, seed=1)
    np.testing.assert_array_equal(sums.null_pulls, again.null_pulls)
