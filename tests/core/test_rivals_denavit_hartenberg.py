"""Denavit-Hartenberg parameters: as good as any where axes cross well, lost where they are nearly parallel."""

from dataclasses import replace

import numpy as np
import pytest
from random_arms import convention_of, random_model
from rival_cells import EXACT, axis_errors, free_poses

from core.arm_jacobian import ArmState, Observations, predict
from core.driven_robot import nominal_couplings
from core.geometry import Line
from core.motion_forms import Direct, MotionFunction
from core.phi_convention import convention_of as convention_of_robot
from core.phi_model import PhiModel, axes
from core.rivals.aggregate import ParameterProblem, condition_of, nonlinear_least_squares
from core.rivals.chain_parameters import PhiParameters
from core.rivals.denavit_hartenberg import DhParameters
from core.rivals.equations import PointEquations
from core.rivals.observed import Drives, layout_of
from core.rivals.problems import Problem, Repeatability, point_problem
from core.robot import Joint, JointKind, Robot
from core.robot_builders import robot_from_phi
from core.twin.noise import Noise

DIRECT = MotionFunction(Direct(), np.zeros(0))
TARGET = np.array([0.1, 0.05, 0.2])


def arm_with_errors(seed: int) -> tuple[Robot, tuple[Line, ...]]:
    """A random arm whose axes cross at large angles, and the same with deviations of 3 mm and 3 mrad."""
    rng = np.random.default_rng(seed)
    sliding = (False,) * 6
    model = random_model(rng, sliding)
    robot = robot_from_phi("random", [Joint(JointKind.REVOLUTE)] * 6, model)
    free = convention_of(model).free
    values = model.parameters + 0.003 * rng.normal(size=(5, 4)) * free
    return robot, axes(PhiModel(model.phi_rad, *values.T, sliding=np.array(sliding)))


def equations_of(robot: Robot, true: tuple[Line, ...], seed: int) -> tuple[PointEquations, ArmState]:
    """Noiseless points of one target in random poses, and the nominal arm to start from."""
    asked = np.random.default_rng((seed, 1)).uniform(-2, 2, (60, 6))
    seen = Observations(np.zeros((60, 3)), np.zeros(60, dtype=int), np.full(60, 6), asked, robot.sliding, home=False)
    couplings = nominal_couplings(robot)
    state = ArmState(true, (DIRECT,) * 6, couplings, TARGET[None])
    start = replace(state, axes=robot.axes_at_zero(), rest_points_m=TARGET[None] + 0.003)
    layout = layout_of(start, robot, Drives.AS_COMMANDED)
    seen = replace(seen, point_m=predict(state, seen, layout).point_m)
    return PointEquations.of(layout, seen, np.tile(1e-8 * np.eye(3), (60, 1, 1))), start


@pytest.mark.parametrize("seed", range(4))
def test_a_noiseless_arm_without_parallel_axes_is_found_again(seed):
    robot, true = arm_with_errors(seed)
    equations, start = equations_of(robot, true, seed)
    chain = DhParameters(robot, np.eye(4))
    found = nonlinear_least_squares(equations, start, chain)
    angle, distance = axis_errors(found.state.axes, true, robot.sliding)
    assert found.converged
    assert angle < 1e-9
    assert distance < 1e-9


def l6_problem(noise: Noise = EXACT) -> Problem:
    measured = free_poses("irb_l6", True, ("T1",), 129, 4, noise)
    return point_problem(measured, Drives.AS_COMMANDED, Repeatability(2e-4))


def conditions() -> tuple[float, float]:
    """Of the Jacobian by Denavit-Hartenberg and by phi-model parameters, at the nominal arm."""
    found = l6_problem()
    robot = found.campaign.robot
    chains = DhParameters(robot, found.base), PhiParameters(found.start.axes, convention_of_robot(robot))
    problems = [ParameterProblem(found.equations, found.start, chain) for chain in chains]
    return tuple(condition_of(p.jacobian(np.zeros(p.size))) for p in problems)


def test_parallel_axes_take_rank_from_the_jacobian():
    """The nominal arm has joints 2, 3 and 4 parallel: two pairs, and each loses parameters that the phi-model keeps."""
    by_dh, by_phi = conditions()
    assert by_dh == np.inf
    assert by_phi < 100


@pytest.fixture(scope="module")
def fits():
    found = l6_problem(Noise())
    robot = found.campaign.robot
    dh = DhParameters(robot, found.base)
    return (
        dh,
        nonlinear_least_squares(found.equations, found.start, dh),
        nonlinear_least_squares(
            found.equations, found.start, PhiParameters(found.start.axes, convention_of_robot(robot))
        ),
    )


def test_nearly_parallel_axes_make_parameters_explode(fits):
    """The arm deviates by millimetres; d of the rows between its parallel axes goes to metres."""
    chain, by_dh, by_phi = fits
    nominal, found = chain.rows(np.zeros(chain.size)), chain.rows(by_dh.parameters)
    assert np.abs(found - nominal)[1:3, 1].max() > 10.0
    assert np.abs(by_phi.parameters[6:]).max() < 0.02


def test_nearly_parallel_axes_ruin_the_condition_and_the_speed(fits):
    _, by_dh, by_phi = fits
    assert by_dh.condition > 1e3 * by_phi.condition
    assert by_dh.iterations > 5 * by_phi.iterations
