"""The methods of the comparison: this project's own, and those of the literature, each with its source."""

from collections.abc import Callable
from functools import partial

import numpy as np

from core.arm_jacobian import ArmState
from core.calibrated_arm import CalibratedArm, calibrated_arm
from core.calibration import calibrate, nominal_frames
from core.driven_robot import nominal_driven
from core.joint_by_joint import joint_by_joint
from core.measurements import Campaign
from core.phi_convention import convention_of
from core.rivals.aggregate import linear_least_squares, nonlinear_least_squares
from core.rivals.chain_parameters import PhiParameters
from core.rivals.circle_point import commanded_rotations, plane_and_circle
from core.rivals.comparison import Data, Found, Method, Trial
from core.rivals.denavit_hartenberg import DhParameters
from core.rivals.identified import arm_of, calibrated_arm_of
from core.rivals.kalman import kalman_filter
from core.rivals.observed import Drives
from core.rivals.problems import Problem, point_problem, pose_problem
from core.sweep_fits import fit_sweeps

PAPER, OWN = "Sultan and Wager", "this project"
LINEAR = "Mooring, Roth and Driels 1991; Hollerbach and Wampler 1996"
NONLINEAR = "Driels and Pathre 1991"
FILTER = "Whitney 1986; Bay 1993; Trevelyan 1996; Du and Zhang 2013"
STONE = "Stone 1987; Stone and Sanderson 1987"
BRODERICK = "Broderick and Cipra 1988; Kim 1990"
DENAVIT = "Denavit and Hartenberg 1955; Hayati and Mirmirani 1985"

Solver = Callable[[Problem], tuple[ArmState, str]]
WATCHED = {Data.POINTS: "positions", Data.POSES: "full poses"}


def all_methods() -> tuple[Method, ...]:
    """Every method, this project's first."""
    return (*own_methods(), *circle_point_methods(), *aggregate_methods(), *on_the_sweeps(), *denavit_methods())


def own_methods() -> tuple[Method, ...]:
    """No calibration at all, the paper's estimator, and what this project makes of the same sweeps."""
    told, sweeps, functions = Drives.AS_COMMANDED, Data.SWEEPS, Drives.FUNCTIONS
    by_paper, by_likelihood = (partial(_joint_by_joint, estimator=name) for name in ("paper", "likelihood"))
    return (
        Method("no calibration", "the nominal arm on its true base", Data.NONE, told, _nominal),
        Method("joint by joint, paper's estimator", PAPER, sweeps, functions, by_paper, own=True),
        Method("joint by joint, likelihood", OWN, sweeps, functions, by_likelihood, own=True),
        Method("all points at once, likelihood", OWN, sweeps, functions, _all_at_once, own=True),
    )


def circle_point_methods() -> tuple[Method, ...]:
    """Axes one by one, drives at their word."""
    return tuple(
        Method(f"circle-point, {name}", source, Data.SWEEPS, Drives.AS_COMMANDED, _by_arcs(method))
        for name, source, method in (
            ("plane and circle", STONE, plane_and_circle),
            ("commanded rotations", BRODERICK, commanded_rotations),
        )
    )


def aggregate_methods() -> tuple[Method, ...]:
    """Linear and non-linear least squares and the filter, by positions and by poses, without and with functions."""
    solvers: tuple[tuple[str, str, Solver], ...] = (
        ("linear least squares", LINEAR, _linear),
        ("non-linear least squares", NONLINEAR, _nonlinear),
        ("Kalman filter", FILTER, _filtered),
    )
    return tuple(
        Method(f"{name}, {watched}", source, data, drives, _by_model(solver, data, drives))
        for drives in Drives
        for name, source, solver in solvers
        for data, watched in WATCHED.items()
    )


def on_the_sweeps() -> tuple[Method, ...]:
    """The aggregate model on the points of the sweeps themselves."""
    name = "non-linear least squares, the sweeps' points"
    return tuple(
        Method(name, NONLINEAR, Data.SWEEPS, drives, _by_model(_nonlinear, Data.SWEEPS, drives)) for drives in Drives
    )


def denavit_methods() -> tuple[Method, ...]:
    """Other parameters for the same arm, data and cost."""
    name = "Denavit-Hartenberg parameters, positions"
    return tuple(
        Method(name, DENAVIT, Data.POINTS, drives, _by_model(_denavit, Data.POINTS, drives)) for drives in Drives
    )


def _nominal(trial: Trial) -> Found:
    robot = trial.sweeps.robot
    driven = nominal_driven(robot)
    return Found(
        CalibratedArm(nominal=robot, robot=robot, drives=driven.drives, base=trial.base, targets=(), noise_m=np.nan)
    )


def _joint_by_joint(trial: Trial, estimator: str) -> Found:
    campaign = trial.sweeps
    found = fit_sweeps(campaign, estimator)
    estimate, _ = joint_by_joint(campaign, found, *nominal_frames(campaign.robot, found))
    return Found(calibrated_arm_of(estimate.arm, campaign))


def _all_at_once(trial: Trial) -> Found:
    return Found(calibrated_arm(calibrate(trial.sweeps)))


def _by_arcs(method: Callable[[Campaign], ArmState]) -> Callable[[Trial], Found]:
    def calibrated(trial: Trial) -> Found:
        campaign = trial.sweeps
        return Found(calibrated_arm_of(arm_of(method(campaign), campaign), campaign))

    return calibrated


def _by_model(solver: Solver, data: Data, drives: Drives) -> Callable[[Trial], Found]:
    build = pose_problem if data is Data.POSES else point_problem

    def calibrated(trial: Trial) -> Found:
        campaign = trial.campaign(data)
        state, remark = solver(build(campaign, drives, trial.told))
        return Found(calibrated_arm_of(arm_of(state, campaign), campaign), remark)

    return calibrated


def _linear(problem: Problem) -> tuple[ArmState, str]:
    return linear_least_squares(problem.equations, problem.start).state, ""


def _nonlinear(problem: Problem) -> tuple[ArmState, str]:
    chain = PhiParameters(problem.start.axes, convention_of(problem.campaign.robot))
    found = nonlinear_least_squares(problem.equations, problem.start, chain)
    return found.state, f"Condition number {found.condition:.0f}." if np.isfinite(found.condition) else ""


def _filtered(problem: Problem) -> tuple[ArmState, str]:
    found = kalman_filter(problem.equations, problem.start)
    return found.state, f"The first {found.warm_up} of {problem.equations.count} standstills solved together."


def _denavit(problem: Problem) -> tuple[ArmState, str]:
    chain = DhParameters(problem.campaign.robot, problem.base)
    found = nonlinear_least_squares(problem.equations, problem.start, chain)
    farthest = np.abs(chain.rows(found.parameters)[:, 1]).max()
    settled = f"after {found.iterations} evaluations" + ("" if found.converged else ", not settled")
    return found.state, f"Condition number {found.condition:.1e}, largest d {farthest:.0f} m {settled}."
