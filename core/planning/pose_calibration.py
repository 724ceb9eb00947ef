"""An arm from free poses: what a plan of free poses is evaluated with.

The method of the paper needs single-joint sweeps; a plan of free poses has none. All unknowns are then fitted at once
to all points that may be fitted, poses and sweeps alike, as ``core/refinement.py`` does it from its joint-by-joint
estimate, but from the drawn arm, placed where the points are. No function is chosen by evidence: where the robot's
description leaves that to evidence, a first harmonic (a ratio where a joint slides, a gain for a coupling) is fitted.
"""

from dataclasses import dataclass, replace

import numpy as np

from core.arm import Arm
from core.arm_jacobian import ArmState, Layout, Observations, predict
from core.calibrated_arm import CalibratedArm, assembled_arm
from core.drives import offset_std, offsets
from core.errors import CampaignError
from core.estimate import ArmEstimate
from core.function_fit import FunctionFit
from core.geometry import Array, apply, invert, rigid_fit
from core.kinematics import active_commands, link_frames, nominal_net
from core.measurements import Campaign
from core.motion_forms import MotionFunction
from core.noise import Noise, is_stated
from core.phi_convention import convention_of
from core.phi_model import from_axes
from core.phi_uncertainty import geometry_from_axes
from core.planning.information import fitted
from core.planning.site_makers import drawn_drives
from core.refinement import MOST_ROUNDS, SETTLED, axis_covariance, worst_outlier
from core.refinement_problem import RefinementProblem, Solved

PLACING_ROUNDS = 50
NO_STATEMENT_M = 1e-3
"""Noise to begin with where none is stated."""


@dataclass(frozen=True)
class PoseCalibration:
    """An arm fitted to all points at once."""

    arm: CalibratedArm
    estimate: ArmEstimate
    noise: Noise
    residual_m: Array
    """Measured minus predicted, (m, 3)."""
    used: np.ndarray
    """Points that do not stand out, boolean, (m,)."""
    degrees_of_freedom: int
    unobservable: int
    """Combinations of unknowns that the points say nothing about."""


def calibrate_on_poses(campaign: Campaign, reject: bool = True) -> PoseCalibration:
    """Fit all unknowns of an arm to all of a campaign's points that may be fitted.

    Args:
        reject: leave out points that stand out.

    Raises:
        CampaignError: there are fewer coordinates than unknowns.
        NotConverged: the fit did not settle.
    """
    problem, state = _problem(campaign)
    noise = Noise(True) if is_stated(problem.stated_m2) else Noise(False, added_m=NO_STATEMENT_M)
    used, nothing = np.ones(len(problem.row), dtype=bool), np.zeros(campaign.robot.joint_count)
    prediction = predict(state, problem.seen, problem.layout)
    for _ in range(MOST_ROUNDS):
        state, solved = problem.solve(state, prediction, problem.covariance(noise, nothing, prediction), used)
        prediction = solved.prediction
        better = problem.noise(solved, used)
        settled = abs(better.rms_m(problem.stated_m2[used]) / noise.rms_m(problem.stated_m2[used]) - 1) < SETTLED
        noise = better
        worst = worst_outlier(problem, solved, used) if reject else None
        if settled and worst is None:
            break
        if worst is not None:
            used = used & (np.arange(len(used)) != worst)
    solved = replace(solved, covariance=solved.covariance * solved.chi_square / solved.degrees_of_freedom)
    arm, estimate = _assembled(campaign, problem, state, solved, noise)
    residual = problem.seen.point_m - prediction.point_m
    return PoseCalibration(arm, estimate, noise, residual, used, solved.degrees_of_freedom, solved.unobservable)


def _problem(campaign: Campaign) -> tuple[RefinementProblem, ArmState]:
    """All points that may be fitted, and the drawn arm placed where they are."""
    table, robot = campaign.measurements, campaign.robot
    links = np.array([target.link for target in campaign.targets])
    rows = np.flatnonzero(fitted(table) & table.seen)
    rows = rows[links[table.target[rows]] > 0]
    targets, local = np.unique(table.target[rows], return_inverse=True)
    home = np.zeros(robot.joint_count) if campaign.home is None else campaign.home
    seen = Observations(
        point_m=table.point_m[rows],
        target=local,
        link=links[table.target[rows]],
        asked=active_commands(robot, table.commanded[rows] - home),
        sliding=robot.sliding,
        home=campaign.home is not None,
    )
    base, places = _placed(campaign, seen, targets, nominal_net(robot, table.commanded[rows] - home))
    state = ArmState(tuple(line.moved(base) for line in robot.axes_at_zero()), *drawn_drives(robot), places)
    coupled = np.array([c is not None for c in state.couplings])
    layout = Layout.of(state, robot.sliding, robot.commanded, coupled)
    if 3 * len(rows) <= layout.size:
        raise CampaignError(
            f"{len(rows)} points that may be fitted do not show {layout.size} unknowns, expected more than "
            f"{layout.size // 3}"
        )
    nobody = np.zeros(len(rows), dtype=int)
    everything = np.ones(len(rows), dtype=bool)
    problem = RefinementProblem(seen, table.covariance_m2[rows], rows, nobody, layout, targets, everything)
    return problem, state


def _placed(campaign: Campaign, seen: Observations, targets: np.ndarray, net: Array) -> tuple[Array, Array]:
    """Where the drawn arm's base stands, (4, 4), and its targets at rest, (t, 3), so that its points are near.

    In turn: a rigid fit of the base, and the mean of each target whose place is not known, carried back.
    """
    robot = campaign.robot
    frames = link_frames(robot, net)[np.arange(len(seen.link)), seen.link - 1]
    known = [campaign.targets[t].point_m for t in targets]
    places = np.array([(0.0, 0.0, 0.0) if place is None else place for place in known])
    unknown = [k for k, place in enumerate(known) if place is None]
    base = rigid_fit(apply(frames, places[seen.target]), seen.point_m)
    for _ in range(PLACING_ROUNDS if unknown else 0):
        local = apply(invert(base @ frames), seen.point_m)
        for k in unknown:
            places[k] = local[seen.target == k].mean(axis=0)
        base = rigid_fit(apply(frames, places[seen.target]), seen.point_m)
    at_rest = base @ link_frames(robot, np.zeros((1, robot.joint_count)))[0]
    links = np.array([campaign.targets[t].link for t in targets])
    return base, apply(at_rest[links - 1], places)


def _assembled(
    campaign: Campaign, problem: RefinementProblem, state: ArmState, solved: Solved, noise: Noise
) -> tuple[CalibratedArm, ArmEstimate]:
    robot = campaign.robot
    lines = robot.axes_at_zero()
    convention = convention_of(robot)
    nominal = from_axes(lines, convention)[1]
    drives = _function_fits(state.transmissions, problem.layout.transmissions, solved)
    covariance = axis_covariance(problem, solved.covariance, robot.joint_count)
    with_offsets = tuple(
        replace(f, offset=float(o)) for f, o in zip(state.transmissions, _offsets(campaign, state), strict=True)
    )
    estimate = ArmEstimate(
        method="free poses",
        arm=Arm(robot, state.axes, with_offsets, state.couplings),
        axis_covariance=covariance,
        transmissions=drives,
        offset_std=offset_std(campaign, list(drives)),
        couplings=_function_fits(state.couplings, problem.layout.couplings, solved),
        geometry=geometry_from_axes(state.axes, convention, covariance, nominal),
        noise_m=noise.rms_m(problem.stated_m2),
    )
    return assembled_arm(campaign, convention, nominal, estimate, _targets(campaign, problem, state, solved)), estimate


def _offsets(campaign: Campaign, state: ArmState) -> Array:
    return offsets(campaign, list(state.transmissions))


def _function_fits(
    functions: tuple[MotionFunction | None, ...], places: tuple[slice | None, ...], solved: Solved
) -> tuple[FunctionFit | None, ...]:
    """Functions with the covariance of their constants; there are no curves to show residuals of."""
    return tuple(
        None
        if function is None
        else FunctionFit(
            form=function.form,
            coefficients=function.coefficients,
            covariance=np.zeros((0, 0)) if place is None else solved.covariance[place, place],
            start=np.zeros(0),
            residual=(),
            rms_before=np.nan,
            rms_after=np.nan,
            chi_square=np.nan,
            reason="set in the robot's description",
        )
        for function, place in zip(functions, places, strict=True)
    )


def _targets(campaign: Campaign, problem: RefinementProblem, state: ArmState, solved: Solved) -> tuple[Array, Array]:
    """Places at rest of all targets of the campaign and their covariances; NaN: not seen."""
    count = len(campaign.targets)
    rest, spread = np.full((count, 3), np.nan), np.full((count, 3, 3), np.nan)
    first = problem.layout.targets.start
    for k, target in enumerate(problem.targets):
        own = slice(first + 3 * k, first + 3 * k + 3)
        rest[target], spread[target] = state.rest_points_m[k], solved.covariance[own, own]
    return rest, spread
