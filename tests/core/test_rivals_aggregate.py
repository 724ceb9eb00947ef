"""Least squares on the aggregate model: known arms found again, with the spread that is promised."""

import numpy as np
import pytest
from rival_cells import EXACT, HAND, axis_errors, cell, deviations, free_poses, true_state

from core.compensation import reached
from core.errors import CampaignError
from core.geometry import apply, invert
from core.measurements import Campaign
from core.phi_convention import convention_of
from core.rivals.aggregate import (
    Solution,
    condition_of,
    covariance_of,
    linear_least_squares,
    nonlinear_least_squares,
)
from core.rivals.chain_parameters import ChainParameters, PhiParameters
from core.rivals.equations import PointEquations
from core.rivals.identified import arm_of, calibrated_arm_of, phi_model_of
from core.rivals.measured_poses import measured_poses
from core.rivals.observed import Drives, observed_points
from core.rivals.problems import Problem, Repeatability, point_problem, pose_problem
from core.twin.campaign import simulate_campaign
from core.twin.noise import MEAN_LENGTH, Noise

BUILD = {"points": point_problem, "poses": pose_problem}
NORMAL_99 = 2.576
RUNS = 200


def campaign(name: str, kind: str, perfect: bool, noise: Noise = EXACT, seed: int = 1, count: int = 60) -> Campaign:
    return free_poses(name, perfect, HAND[name] if kind == "poses" else HAND[name][:1], count, seed, noise)


def chain(found: Problem) -> ChainParameters:
    return PhiParameters(found.start.axes, convention_of(found.campaign.robot))


def solve(found: Problem, method: str) -> Solution:
    if method == "linear":
        return linear_least_squares(found.equations, found.start)
    return nonlinear_least_squares(found.equations, found.start, chain(found))


@pytest.mark.parametrize("method", ["linear", "nonlinear"])
@pytest.mark.parametrize("perfect", [True, False])
@pytest.mark.parametrize("kind", BUILD)
@pytest.mark.parametrize("name", ["irb_l6", "scara"])
def test_a_noiseless_arm_is_found_again(name, kind, perfect, method):
    own = cell(name, perfect)
    drives = Drives.AS_COMMANDED if perfect else Drives.FUNCTIONS
    solution = solve(BUILD[kind](campaign(name, kind, perfect), drives), method)
    assert solution.converged
    angle, distance = axis_errors(solution.state.axes, own.truth.arm.axes, own.robot.sliding)
    assert angle < 1e-9
    assert distance < 1e-9
    for found, true in zip(
        (*solution.state.transmissions, *solution.state.couplings),
        (*own.truth.arm.transmissions, *own.truth.arm.couplings),
        strict=True,
    ):
        if true is not None:
            np.testing.assert_allclose(found.coefficients, true.coefficients, rtol=0, atol=1e-9)


@pytest.mark.parametrize("kind", BUILD)
def test_the_arm_that_was_found_goes_where_the_true_arm_goes(kind):
    own, measured = cell("irb_l6", False), campaign("irb_l6", kind, False)
    arm = arm_of(solve(BUILD[kind](measured, Drives.FUNCTIONS), "linear").state, measured)
    usable = calibrated_arm_of(arm, measured)
    commanded = own.truth.home + np.random.default_rng(8).uniform(-0.5, 0.5, (20, 6))
    there = usable.base @ reached(usable, commanded)
    np.testing.assert_allclose(there, own.truth.base @ own.truth.tool_poses(commanded), atol=1e-8)
    np.testing.assert_allclose(phi_model_of(arm).parameters, own.truth.phi.parameters, atol=1e-9)


def test_both_ways_of_solving_meet_at_the_same_place():
    found = point_problem(campaign("irb_l6", "points", False, Noise()), Drives.FUNCTIONS, Repeatability(2e-4))
    one, other = solve(found, "linear"), solve(found, "nonlinear")
    step = deviations(one.state, other.state, found.equations)
    assert np.abs(step / np.sqrt(np.diag(one.covariance))).max() < 1e-4
    np.testing.assert_allclose(one.covariance, other.covariance, rtol=1e-3, atol=1e-3 * np.abs(one.covariance).max())


def test_a_geometry_without_drives_leaves_what_the_drives_do():
    """The aggregate model as it is published cannot fit an arm whose gears are eccentric, and its residuals say so."""
    found = point_problem(campaign("irb_l6", "points", False), Drives.AS_COMMANDED, Repeatability(2e-4))
    solution = solve(found, "linear")
    residual = found.equations.evaluate(solution.state).residual
    assert np.sqrt(np.mean(residual**2)) > 5


@pytest.mark.parametrize("kind", BUILD)
def test_the_covariance_is_right(kind):
    """e' C^-1 e over many campaigns has the mean that a chi-square of so many freedoms has, within 99 %."""
    own, squares = cell("irb_l6", True), []
    shift, turn = (own.repeatability.mean_translation_m, own.repeatability.mean_rotation_rad)
    told = Repeatability(shift / MEAN_LENGTH, turn / MEAN_LENGTH)
    for seed in range(RUNS):
        measured = campaign("irb_l6", kind, True, Noise(), seed, 40)
        found = BUILD[kind](measured, Drives.AS_COMMANDED, told)
        solution = solve(found, "linear")
        targets = observed_points(measured).target
        error = deviations(solution.state, true_state(own, targets), found.equations)
        # Where the body sits on the link is the method's own: what is known of the truth are the axes.
        known = slice(0, 24 if kind == "poses" else 27)
        squares.append(error[known] @ np.linalg.solve(solution.covariance[known, known], error[known]))
    freedom = known.stop
    assert abs(np.mean(squares) - freedom) < NORMAL_99 * np.sqrt(2 * freedom / RUNS)


def test_measured_poses_are_those_of_the_last_link():
    measured = campaign("irb_l6", "poses", False)
    found, own = measured_poses(measured), cell("irb_l6", False)
    commanded = measured.measurements.commanded[::3]
    link = own.truth.base @ own.truth.tool_poses(commanded)
    on_link = invert(link) @ found.pose
    np.testing.assert_allclose(on_link, np.broadcast_to(on_link[0], on_link.shape), atol=1e-9)
    assert found.points == measured.measurements.count
    middle = apply(link, apply(invert(link[0]), measured.measurements.point_m[:3].mean(axis=0)))
    np.testing.assert_allclose(found.pose[:, :3, 3], middle, atol=1e-9)


def test_validation_rows_are_never_fitted():
    own = simulate_campaign(1)
    points = observed_points(own)
    assert len(points.row) == 129
    assert not own.measurements.check[points.row].any()
    with pytest.raises(CampaignError, match="no pose records"):
        measured_poses(own)


def test_too_few_points_are_refused():
    few = campaign("irb_l6", "points", True, count=3)
    with pytest.raises(CampaignError, match="3 points that may be fitted, expected 4 or more"):
        observed_points(few)


def test_condition_and_covariance_of_a_known_matrix():
    q, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(20, 3)))
    matrix = q * [1.0, 1e3, 1e-3]
    assert condition_of(matrix) == pytest.approx(1.0)
    np.testing.assert_allclose(covariance_of(matrix), np.diag([1.0, 1e-6, 1e6]), rtol=1e-9, atol=1e-9)
    assert condition_of(np.column_stack([matrix, matrix[:, 0]])) == np.inf
    assert isinstance(point_problem(campaign("irb_l6", "points", True), Drives.AS_COMMANDED).equations, PointEquations)
