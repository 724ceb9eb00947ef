"""The extended Kalman filter: it agrees with the batch solution, and its covariance tells how wrong it is."""

from dataclasses import replace

import numpy as np
import pytest
from rival_cells import EXACT, HAND, axis_errors, cell, deviations, free_poses, true_state
from scipy.stats import chi2

from core.arm_jacobian import ArmState
from core.rivals.aggregate import linear_least_squares
from core.rivals.equations import Equations
from core.rivals.kalman import Prior, kalman_filter
from core.rivals.observed import Drives
from core.rivals.problems import Problem, Repeatability, point_problem, pose_problem
from core.twin import irb_l6
from core.twin.noise import MEAN_LENGTH, Noise

BUILD = {"points": point_problem, "poses": pose_problem}
TOLD = Repeatability(
    irb_l6.REPEATABILITY.mean_translation_m / MEAN_LENGTH, irb_l6.REPEATABILITY.mean_rotation_rad / MEAN_LENGTH
)
VAGUE = 100.0
"""A prior standard deviation that says nothing, rad or m."""


def problem(kind: str, drives: Drives, noise: Noise = EXACT, seed: int = 2, count: int = 60) -> Problem:
    targets = HAND["irb_l6"] if kind == "poses" else HAND["irb_l6"][:1]
    measured = free_poses("irb_l6", drives is Drives.AS_COMMANDED, targets, count, seed, noise)
    return BUILD[kind](measured, drives, TOLD)


def vague(equations: Equations) -> np.ndarray:
    return VAGUE**2 * np.eye(equations.size)


@pytest.mark.parametrize("drives", Drives)
@pytest.mark.parametrize("kind", BUILD)
def test_a_noiseless_arm_is_found_again(kind, drives):
    own, found = cell("irb_l6", drives is Drives.AS_COMMANDED), problem(kind, drives)
    filtered = kalman_filter(found.equations, found.start, vague(found.equations))
    assert filtered.warm_up < found.equations.count
    angle, distance = axis_errors(filtered.state.axes, own.truth.arm.axes, own.robot.sliding)
    assert angle < 1e-9
    assert distance < 1e-9


@pytest.mark.parametrize("kind", BUILD)
def test_pose_by_pose_comes_to_the_batch_solution(kind):
    found = problem(kind, Drives.AS_COMMANDED, Noise(), count=129)
    batch = linear_least_squares(found.equations, found.start)
    filtered = kalman_filter(found.equations, found.start, vague(found.equations))
    away = deviations(batch.state, filtered.state, found.equations) / np.sqrt(np.diag(batch.covariance))
    assert np.abs(away[found.equations.axes]).max() < 0.01
    np.testing.assert_allclose(np.sqrt(np.diag(filtered.covariance)), np.sqrt(np.diag(batch.covariance)), rtol=2e-3)


def test_the_difference_to_the_batch_goes_with_the_square_of_the_noise():
    """The filter leaves out what is of second order; with ten times less noise that is a hundred times less."""
    sizes = []
    for noise in (1.0, 0.1):
        found = problem("points", Drives.FUNCTIONS, Noise())
        seen = found.equations.seen
        exact = problem("points", Drives.FUNCTIONS).equations.seen.point_m
        seen = replace(seen, point_m=exact + noise * (seen.point_m - exact))
        equations = replace(found.equations, seen=seen, whitener=found.equations.whitener / noise)
        batch = linear_least_squares(equations, found.start)
        filtered = kalman_filter(equations, found.start, vague(equations))
        sizes.append(np.abs(deviations(batch.state, filtered.state, equations)).max())
    assert sizes[1] < sizes[0] / 30


def test_uncertainty_shrinks_with_every_pose():
    found = problem("points", Drives.AS_COMMANDED, Noise())
    filtered = kalman_filter(found.equations, found.start)
    volume = np.log(filtered.std[:, found.equations.axes]).sum(axis=1)
    assert (np.diff(volume) < 0).all()
    assert len(filtered.std) == len(filtered.innovation) == found.equations.count - filtered.warm_up


def drawn(true: ArmState, equations: Equations, spread: np.ndarray, rng: np.random.Generator) -> ArmState:
    return equations.moved(true, spread * rng.normal(size=equations.size))


@pytest.mark.parametrize("warm_up", [0, None])
def test_the_covariance_is_consistent(warm_up):
    """Arms drawn from the prior: normalised squared errors and innovations within their 99.9 % chi-square limits.

    The test of Bar-Shalom, Li and Kirubarajan, Estimation with Applications to Tracking and Navigation (Wiley 2001),
    section 5.4. The prior is that of an arm that was calibrated before, so that the model is linear within it.
    """
    own, runs = cell("irb_l6", True), 60
    squares, innovations, freedom = [], [], 0
    for seed in range(runs):
        found = problem("points", Drives.AS_COMMANDED, Noise(), seed, 30)
        equations, rng = found.equations, np.random.default_rng((seed, 5))
        spread = Prior(5e-4, 5e-4, 5e-4).std(equations, found.start)
        true = true_state(own, np.array([0]))
        filtered = kalman_filter(equations, drawn(true, equations, spread, rng), np.diag(spread**2), warm_up)
        error = deviations(filtered.state, true, equations)
        squares.append(error @ np.linalg.solve(filtered.covariance, error))
        innovations.append(filtered.innovation.sum())
        freedom = 3 * len(filtered.innovation)
    for total, each in ((sum(squares), equations.size), (sum(innovations), freedom)):
        low, high = chi2.ppf([0.0005, 0.9995], runs * each)
        assert low < total < high


def test_from_a_nominal_arm_the_filter_alone_is_over_confident():
    """Why the first standstills are solved together: without that the innovations are many times too large."""
    found = problem("poses", Drives.AS_COMMANDED, Noise(), count=60)
    alone = kalman_filter(found.equations, found.start, Prior(), warm_up=0)
    warmed = kalman_filter(found.equations, found.start, Prior())
    low, high = chi2.ppf([0.005, 0.995], 6 * len(warmed.innovation))
    assert low < warmed.innovation.sum() < high
    assert alone.innovation[warmed.warm_up :].sum() > 2 * high
