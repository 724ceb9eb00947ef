"""All points at once: the joint-by-joint estimate refined by maximum likelihood.

Joint by joint, displacements are free: nothing is asked of the drives until the axes are known. That is robust, and it
leaves something on the table. Once every drive has a function, a point's place along its arc also says where the axis
is, one target serves several joints, and errors of one step no longer pass as truth into the next. So all parameters
(axes, constants of all functions, targets) are fitted to all points of all sweeps, weighted by their noise:

    minimise  sum_j e_j' C_j^-1 e_j,       e_j = measured - predicted point            (core/arm_jacobian.py)

by Gauss-Newton from the joint-by-joint start. The inverse of the information matrix is the covariance of everything,
and goes through to the phi-model. Guards:

- The noise is estimated anew from these residuals, so uncertainties do not rest on a data sheet.
- Where points scatter along their arcs beyond the noise, the family of a drive's function is not the whole truth. The
  excess is added to the noise along the arcs of that joint, so that it is not forced into the geometry.
- A target has one place on its link in all sweeps, unless the points contradict it: then each sweep has its own.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import fdtrc

from core.arm import Arm, carry
from core.arm_jacobian import ArmState, Prediction, net_displacements, predict
from core.axes.result import ROUNDING_M
from core.drives import drive_functions, offset_std
from core.estimate import ArmEstimate, Geometry
from core.function_fit import FunctionFit
from core.geometry import Array, cross
from core.measurements import Campaign
from core.motion_forms import MotionFunction
from core.noise import Noise
from core.parameter_covariance import COUPLING, TRANSMISSION, ParameterCovariance, constants_of, frame_parameters
from core.phi_convention import Convention
from core.phi_model import PhiModel
from core.phi_uncertainty import geometry_from_axes, parameters_by_axes
from core.refined_curves import Seen, refined_motions, with_curves
from core.refinement_problem import RefinementProblem, Solved
from core.sweep_fits import SweepFits
from core.walk_from_base import SweepMotion

MOST_ROUNDS = 12
"""Rounds of fitting, estimating the noise and leaving out what stands out."""
SUSPICIOUS = 3.0
"""Standard deviations of chi-square above its mean from which the places of targets are looked into."""
CONTRADICTED = 1e-4
"""Chance below which targets are not held to be at one place in all sweeps."""
SETTLED = 0.03
"""The noise is estimated anew until it changes by less than this share; its own uncertainty is no smaller."""


@dataclass(frozen=True)
class PointResiduals:
    """Measured minus predicted, for every row of every sweep, in the order of ``SweepFits.fits``."""

    row: np.ndarray
    """Row in the campaign's measurements, (m,)."""
    joint: np.ndarray
    """The joint that was swept, (m,)."""
    residual_m: Array
    """In the instrument's frame, (m, 3)."""
    axial_m: Array
    """Along the axis of the swept joint, (m,)."""
    radial_m: Array
    """Away from it, (m,)."""
    tangential_m: Array
    """Along the arc, (m,); for a sliding joint the way along is ``axial_m``."""
    used: np.ndarray
    """Fitted, boolean, (m,)."""
    knowable: np.ndarray
    """False for points that also moved with a joint of which there is no sweep; they are not fitted, (m,)."""
    outlier_probability: Array
    """(m,)."""


@dataclass(frozen=True)
class Refinement:
    """The refined estimate with what it rests on."""

    estimate: ArmEstimate
    rest_points_m: Array
    """Targets when every joint is at zero, in the instrument's frame, (t, 3); NaN: never seen in a sweep."""
    rest_covariance_m2: Array
    """(t, 3, 3)."""
    motions: tuple[SweepMotion, ...]
    """What every sweep shows of its drive, from the refined axes; displacement counts from zero."""
    residuals: PointResiduals
    noise: Noise
    degrees_of_freedom: int
    arc_excess: Array
    """Standard deviation of what each drive does beyond its function, rad or m, (n,)."""
    unobservable: int
    """Combinations of parameters that the points say nothing about."""
    tied: bool
    """False: targets were not at the same place in all sweeps, as by lost motion, and each sweep has its own."""


def refine(
    campaign: Campaign,
    found: SweepFits,
    motions: tuple[SweepMotion, ...],
    start: ArmEstimate,
    convention: Convention | None,
    nominal: PhiModel | None,
    reject: bool = True,
) -> Refinement:
    """Refine a joint-by-joint estimate on all points of all sweeps; ``reject``: leave out points that stand out.

    Raises:
        NotConverged: Gauss-Newton did not settle; the joint-by-joint estimate stands.
    """
    problem, state, prediction, tied = _tied_or_not(campaign, found, motions, start)
    used = np.concatenate([_used(m) for m in motions]) & problem.knowable
    noise, excess = found.noise, np.zeros(campaign.robot.joint_count)
    for _ in range(MOST_ROUNDS):
        state, solved = problem.solve(state, prediction, problem.covariance(noise, excess, prediction), used)
        prediction = solved.prediction
        better, more = problem.noise(solved, used), problem.arc_excess(prediction, noise, used)
        growth = better.rms_m(problem.stated_m2[used]) / noise.rms_m(problem.stated_m2[used])
        settled = abs(growth - 1) < SETTLED and np.allclose(more, excess, rtol=0.05, atol=1e-9)
        noise, excess = better, more
        worst = worst_outlier(problem, solved, used) if reject else None
        if settled and worst is None:
            break
        if worst is not None:
            used = used & (np.arange(len(used)) != worst)
    solved = replace(solved, covariance=solved.covariance * solved.chi_square / solved.degrees_of_freedom)
    seen = Seen(problem.seen, solved.prediction, noise.covariance(problem.stated_m2), used)
    motions = refined_motions(motions, state, seen)
    rest, rest_covariance = _targets(problem, len(campaign.targets), state, solved.covariance, used)
    return Refinement(
        estimate=_estimate(campaign, problem, state, solved, start, motions, convention, nominal, noise),
        rest_points_m=rest,
        rest_covariance_m2=rest_covariance,
        motions=motions,
        residuals=_residuals(problem, state, solved, used),
        noise=noise,
        degrees_of_freedom=solved.degrees_of_freedom,
        arc_excess=excess,
        unobservable=solved.unobservable,
        tied=tied,
    )


def _tied_or_not(
    campaign: Campaign, found: SweepFits, motions: tuple[SweepMotion, ...], start: ArmEstimate
) -> tuple[RefinementProblem, ArmState, Prediction, bool]:
    """Let a target have one place in all sweeps, unless the points contradict that (F-test).

    An arm with lost motion does not come back to the same place between sweeps. Tied together, its sweeps would bend
    the geometry; apart, each still shows its axis and its drive.
    """
    solutions = []
    for tied in (True, False):
        problem = RefinementProblem.of(campaign, found, start, tied)
        used = np.concatenate([_used(m) for m in motions]) & problem.knowable
        nothing = np.zeros(campaign.robot.joint_count)
        state = problem.start_state(start)
        prediction = predict(state, problem.seen, problem.layout)
        state, solved = problem.solve(state, prediction, problem.covariance(found.noise, nothing, prediction), used)
        solutions.append((problem, state, solved.prediction, tied, solved))
        freedom = solved.degrees_of_freedom
        if tied and solved.chi_square < freedom * (1 + SUSPICIOUS * np.sqrt(2 / freedom)):
            break
    if len(solutions) == 2:
        one, other = solutions[0][4], solutions[1][4]
        more = one.degrees_of_freedom - other.degrees_of_freedom
        per_place = (one.chi_square - other.chi_square) / max(more, 1)
        scatter = other.chi_square / other.degrees_of_freedom
        if more > 0 and fdtrc(more, other.degrees_of_freedom, max(per_place, 0.0) / scatter) < CONTRADICTED:
            return solutions[1][:4]
    return solutions[0][:4]


def _estimate(
    campaign: Campaign,
    problem: RefinementProblem,
    state: ArmState,
    solved: Solved,
    start: ArmEstimate,
    motions: tuple[SweepMotion, ...],
    convention: Convention | None,
    nominal: PhiModel | None,
    noise: Noise,
) -> ArmEstimate:
    drives, couplings = _function_fits(campaign, problem, state, solved, start, motions)
    covariance = axis_covariance(problem, solved.covariance, len(state.axes))
    geometry = whole = None
    if convention is not None and nominal is not None:
        geometry = geometry_from_axes(state.axes, convention, covariance, nominal)
        whole = _parameter_covariance(problem, state, solved.covariance, convention, geometry)
    return ArmEstimate(
        method="all points at once",
        arm=Arm(campaign.robot, state.axes, drive_functions(campaign, list(drives)), state.couplings),
        axis_covariance=covariance,
        transmissions=drives,
        offset_std=offset_std(campaign, list(drives)),
        couplings=couplings,
        geometry=geometry,
        noise_m=noise.rms_m(problem.stated_m2),
        covariance=whole,
    )


def _parameter_covariance(
    problem: RefinementProblem, state: ArmState, covariance: Array, convention: Convention, geometry: Geometry
) -> ParameterCovariance:
    """Axes carried over to the parameters of the phi-model, beside the constants of all functions."""
    layout = problem.layout
    by_axes = parameters_by_axes(state.axes, geometry.base, geometry.model, convention)
    parameters = frame_parameters(len(state.axes))
    rows = np.zeros((len(parameters), layout.size))
    for i, place in enumerate(layout.axes):
        if place is not None:
            rows[:, place] = by_axes[:, 4 * i : 4 * i + place.stop - place.start]
    constants: list[int] = []
    for part, functions, places in (
        (TRANSMISSION, state.transmissions, layout.transmissions),
        (COUPLING, state.couplings, layout.couplings),
    ):
        for joint, (function, place) in enumerate(zip(functions, places, strict=True), 1):
            if function is not None and place is not None:
                parameters += constants_of(part, joint, function.form)
                constants += range(place.start, place.stop)
    rows = np.concatenate([rows, np.eye(layout.size)[constants]])
    matrix = rows @ covariance @ rows.T
    return ParameterCovariance(tuple(parameters), (matrix + matrix.T) / 2)


def _function_fits(
    campaign: Campaign,
    problem: RefinementProblem,
    state: ArmState,
    solved: Solved,
    start: ArmEstimate,
    motions: tuple[SweepMotion, ...],
) -> tuple[tuple[FunctionFit | None, ...], tuple[FunctionFit | None, ...]]:
    """Transmissions and couplings with refined constants and the residuals of the refined curves."""
    n, layout = len(state.axes), problem.layout
    own = tuple(tuple(m.curve for m in motions if m.found.sweep.joint == j) for j in range(1, n + 1))
    passive = tuple(tuple(m.passive for m in motions if m.passive and m.found.sweep.joint == j) for j in range(n))
    drives = _with_constants(start.transmissions, state.transmissions, layout.transmissions, solved)
    couplings = _with_constants(start.couplings, state.couplings, layout.couplings, solved)
    return (
        with_curves(drives, own, problem.seen.home, np.ones(n)),
        with_curves(couplings, passive, False, campaign.robot.coupling_gains),
    )


def _with_constants(
    fits: tuple[FunctionFit | None, ...],
    functions: tuple[MotionFunction | None, ...],
    places: tuple[slice | None, ...],
    solved: Solved,
) -> tuple[FunctionFit | None, ...]:
    out = []
    for fit, function, place in zip(fits, functions, places, strict=True):
        if fit is None or place is None:
            out.append(fit)
            continue
        out.append(replace(fit, coefficients=function.coefficients, covariance=solved.covariance[place, place]))
    return tuple(out)


def axis_covariance(problem: RefinementProblem, covariance: Array, n: int) -> Array:
    """Of tilts and shifts of all axes, as ``ArmEstimate`` has it, (4n, 4n); NaN: held."""
    out = np.full((4 * n, 4 * n), np.nan)
    places = [
        (4 * i + k, place.start + k)
        for i, place in enumerate(problem.layout.axes)
        if place is not None
        for k in range(place.stop - place.start)
    ]
    for i, place in enumerate(problem.layout.axes):
        if place is not None:
            out[4 * i : 4 * i + 4, :] = 0.0
    out[:, [4 * i + k for i, p in enumerate(problem.layout.axes) if p is None for k in range(4)]] = np.nan
    outer, inner = np.array(places).T
    out[np.ix_(outer, outer)] = covariance[np.ix_(inner, inner)]
    return out


def _targets(
    problem: RefinementProblem, count: int, state: ArmState, covariance: Array, used: np.ndarray
) -> tuple[Array, Array]:
    rest, spread = np.full((count, 3), np.nan), np.full((count, 3, 3), np.nan)
    own = covariance[problem.layout.targets, problem.layout.targets]
    for k, target in enumerate(problem.targets):
        if not np.any(used & (problem.seen.target == k)) or np.isfinite(rest[target]).all():
            continue
        rest[target] = state.rest_points_m[k]
        spread[target] = own[3 * k : 3 * k + 3, 3 * k : 3 * k + 3]
    return rest, spread


def _residuals(problem: RefinementProblem, state: ArmState, solved: Solved, used: np.ndarray) -> PointResiduals:
    """Residuals in the swept joint's own directions: along its axis, away from it, along the arc."""
    residual = problem.seen.point_m - solved.prediction.point_m
    arm = solved.prediction.by_net[np.arange(len(problem.joint)), :, problem.joint - 1]
    along = arm / np.maximum(np.linalg.norm(arm, axis=1), 1e-300)[:, None]
    axes = _axes_in_place(problem, state)
    slides = problem.seen.sliding[problem.joint - 1]
    outward = cross(along, axes)
    tangential = np.einsum("mi,mi->m", along, residual)
    axial = np.einsum("mi,mi->m", axes, residual)
    radial = np.einsum("mi,mi->m", outward, residual)
    across = np.linalg.norm(residual - axial[:, None] * axes, axis=1)
    return PointResiduals(
        problem.row,
        problem.joint,
        residual,
        axial,
        np.where(slides, across, radial),
        np.where(slides, 0.0, tangential),
        used,
        problem.knowable,
        solved.probability,
    )


def _axes_in_place(problem: RefinementProblem, state: ArmState) -> Array:
    """Direction of the swept joint's axis where the joints below it stand, for every point, (m, 3)."""
    net = net_displacements(state, problem.seen)
    ends = np.stack([line.point_m for line in state.axes])[problem.joint - 1]
    directions = np.stack([line.direction for line in state.axes])[problem.joint - 1]
    near = carry(state.axes, problem.seen.sliding, net, problem.joint - 1, ends)
    return carry(state.axes, problem.seen.sliding, net, problem.joint - 1, ends + directions) - near


def _used(motion: SweepMotion) -> np.ndarray:
    """Rows of a sweep that did not stand out in the joint-by-joint fits, boolean, (k,)."""
    used = motion.found.used.copy()
    used[list(motion.passive_outliers)] = False
    return used


def worst_outlier(problem: RefinementProblem, solved: Solved, used: np.ndarray) -> int | None:
    """The row that stands out most, if any does: less than one chance in a thousand that any row would."""
    worst = int(np.argmin(np.where(used, solved.probability, 1.0)))
    stands_out = solved.probability[worst] * used.sum() < 1e-3
    length = np.linalg.norm(problem.seen.point_m[worst] - solved.prediction.point_m[worst])
    return worst if stands_out and length > ROUNDING_M else None
