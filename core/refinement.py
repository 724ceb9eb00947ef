"""All points at once: the joint-by-joint estimate refined by maximum likelihood.

Joint by joint, displacements are free: nothing is asked of the drives until the axes are known. That is robust, and it
leaves something on the table. Once every drive has a function, a point's place along its arc also says where the axis
is, one target serves several joints, and errors of one step no longer pass as truth into the next. So all parameters
(axes, constants of all functions, targets) are fitted to all points of all sweeps, weighted by their noise:

    minimise  sum_j e_j' C_j^-1 e_j,       e_j = measured - predicted point            (core/arm_jacobian.py)

by Gauss-Newton from the joint-by-joint start. The inverse of the information matrix is the covariance of everything,
and goes through to the phi-model. Two guards:

- The noise is estimated anew from these residuals, so uncertainties do not rest on a data sheet.
- Where points scatter along their arcs beyond the noise, the family of a drive's function is not the whole truth. The
  excess is added to the noise along the arcs of that joint, so that it is not forced into the geometry.
"""

from dataclasses import dataclass, replace

import numpy as np

from core.arm import Arm, carry
from core.arm_jacobian import ArmState, Layout, Observations, Prediction, moved, net_displacements, predict
from core.axes.result import outlier_probabilities
from core.errors import NotConverged
from core.estimate import ArmEstimate
from core.function_fit import FunctionFit
from core.geometry import Array, cross
from core.joint_by_joint import SweepMotion, drive_functions, offset_std
from core.measurements import Campaign
from core.motion_forms import MotionFunction
from core.noise import Noise, noise_from_scatter
from core.phi_convention import Convention
from core.phi_model import PhiModel
from core.phi_uncertainty import geometry_from_axes
from core.refined_curves import Seen, refined_motions, with_curves
from core.sweep_fits import SweepFits, active_from_zero

SETTLED = 0.03
"""The noise is estimated anew until it changes by less than this share; its own uncertainty is no smaller."""
EXCESS_SHARE = 1.5
"""Variance along the arcs over what the noise explains, beyond which a joint gets an excess of its own."""


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
    problem = _Problem.of(campaign, found, start)
    used = np.concatenate([f.used for f in found.fits]) & problem.knowable
    state, noise, excess = problem.start_state(start), found.noise, np.zeros(campaign.robot.joint_count)
    prediction = predict(state, problem.seen, problem.layout)
    for _ in range(12):
        state, solved = problem.solve(state, prediction, problem.covariance(noise, excess, prediction), used)
        prediction = solved.prediction
        better = problem.noise(solved, used)
        more = problem.arc_excess(prediction, better, used)
        worst = _worst_outlier(solved, used) if reject else None
        growth = better.rms_m(problem.stated_m2[used]) / noise.rms_m(problem.stated_m2[used])
        noise, settled = better, np.allclose(more, excess, rtol=0.05, atol=1e-9) and abs(growth - 1) < SETTLED
        excess = more
        if settled and worst is None:
            break
        if worst is not None:
            used = used.copy()
            used[worst] = False
    solved = replace(solved, covariance=solved.covariance * solved.chi_square / solved.degrees_of_freedom)
    return problem.result(campaign, state, solved, noise, excess, used, start, motions, convention, nominal)


@dataclass(frozen=True)
class _Solved:
    prediction: Prediction
    covariance: Array
    """Of the unknowns, (p, p)."""
    chi_square: float
    degrees_of_freedom: int
    unobservable: int
    probability: Array
    """Outlier probability of each row, (m,)."""


@dataclass(frozen=True)
class _Problem:
    """The data and the layout of the unknowns."""

    seen: Observations
    stated_m2: Array
    """Stated covariances, (m, 3, 3)."""
    row: np.ndarray
    joint: np.ndarray
    layout: Layout
    targets: np.ndarray
    """Indices of the campaign's targets that are seen, (t,)."""
    knowable: np.ndarray
    """False for points that also moved with a joint of which there is no sweep, boolean, (m,)."""

    @staticmethod
    def of(campaign: Campaign, found: SweepFits, start: ArmEstimate) -> "_Problem":
        sweeps = [f.sweep for f in found.fits]
        target = np.concatenate([s.target for s in sweeps])
        targets, local = np.unique(target, return_inverse=True)
        asked = np.concatenate([active_from_zero(campaign, s.commanded)[s.stop] for s in sweeps])
        swept = np.isin(np.arange(1, campaign.robot.joint_count + 1), found.swept)
        asked[:, ~swept] = 0.0
        seen = Observations(
            point_m=np.concatenate([s.point_m for s in sweeps]),
            target=local,
            link=np.array([t.link for t in campaign.targets])[target],
            asked=asked,
            sliding=campaign.robot.sliding,
            home=campaign.home is not None,
        )
        joint = np.concatenate([np.full(len(s.rows), s.joint) for s in sweeps])
        coupled_on = np.array(
            [c is not None and c.target not in found.swept for c in map(campaign.robot.coupling_from, joint)]
        )
        state = _state(start, np.zeros((len(targets), 3)))
        coupled = np.array([fit is not None for fit in start.couplings])
        return _Problem(
            seen,
            np.concatenate([s.covariance_m2 for s in sweeps]),
            np.concatenate([s.rows for s in sweeps]),
            joint,
            Layout.of(state, campaign.robot.sliding, swept, coupled),
            targets,
            ~(coupled_on & (seen.link > joint)),
        )

    def start_state(self, start: ArmEstimate) -> ArmState:
        """Targets at rest by carrying every point back, and averaging."""
        state = _state(start, np.zeros((len(self.targets), 3)))
        # Two passes of one linear fit: predicted points are affine in the targets at rest.
        prediction = predict(state, self.seen, self.layout)
        rest = np.zeros((len(self.targets), 3))
        turns = prediction.jacobian[:, :, self.layout.targets]
        residual = self.seen.point_m - prediction.point_m
        for k in range(len(self.targets)):
            mine = self.seen.target == k
            back = turns[mine][:, :, 3 * k : 3 * k + 3].swapaxes(1, 2) @ residual[mine][:, :, None]
            rest[k] = np.median(back[:, :, 0], axis=0)
        return _state(start, rest)

    def covariance(self, noise: Noise, excess: Array, prediction: Prediction) -> Array:
        """Covariance of every point, the excess along the arcs included, (m, 3, 3)."""
        out = noise.covariance(self.stated_m2)
        if excess.any():
            along = prediction.by_net[np.arange(len(self.joint)), :, self.joint - 1] * excess[self.joint - 1][:, None]
            out = out + along[:, :, None] * along[:, None, :]
        return out

    def noise(self, solved: _Solved, used: np.ndarray) -> Noise:
        """The noise by the scatter of the points about the arm."""
        residual = (self.seen.point_m - solved.prediction.point_m)[used]
        components = 3 * len(residual)
        observed = float(np.sum(residual**2)) * components / solved.degrees_of_freedom
        stated = float(np.sum(np.trace(self.stated_m2[used], axis1=1, axis2=2)))
        return noise_from_scatter(observed, stated, components, solved.degrees_of_freedom)

    def solve(
        self, state: ArmState, prediction: Prediction, covariance: Array, used: np.ndarray
    ) -> tuple[ArmState, _Solved]:
        """Gauss-Newton with step halving under fixed weights, from a state and its prediction."""
        whitener = np.linalg.inv(np.linalg.cholesky(covariance)) * used[:, None, None]
        residual, cost = self._whitened(whitener, prediction)
        freedom = max(3 * int(used.sum()) - self.layout.size, 1)
        reach = float(np.abs(self.seen.point_m).max())
        rounding = float(np.sum((1e-14 * reach * np.diagonal(whitener, axis1=1, axis2=2)) ** 2))
        for _ in range(50):
            matrix = (whitener @ prediction.jacobian).reshape(-1, self.layout.size)
            inverse, lost = _inverse(matrix.T @ matrix)
            gradient = matrix.T @ residual
            step = inverse @ gradient
            if gradient @ step <= 1e-6 * cost / freedom + rounding:
                probability = self._probability(matrix, inverse, residual, cost, used)
                return state, _Solved(prediction, inverse, cost, freedom + lost, lost, probability)
            for _ in range(30):
                candidate = moved(state, self.layout, step)
                prediction = predict(candidate, self.seen, self.layout)
                residual, new_cost = self._whitened(whitener, prediction)
                if new_cost <= cost * (1 + 1e-12):
                    break
                step = step / 2
            state, cost = candidate, new_cost
        raise NotConverged("the fit of all points at once did not converge in 50 steps")

    def _whitened(self, whitener: Array, prediction: Prediction) -> tuple[Array, float]:
        residual = (whitener @ (self.seen.point_m - prediction.point_m)[:, :, None]).ravel()
        return residual, float(residual @ residual)

    def _probability(self, matrix: Array, inverse: Array, residual: Array, cost: float, used: np.ndarray) -> Array:
        rows = matrix.reshape(-1, 3, self.layout.size)
        pull = np.einsum("mij,jk,mik->m", rows, inverse, rows, optimize=True)
        square = np.einsum("mi,mi->m", residual.reshape(-1, 3), residual.reshape(-1, 3))
        freedom = np.maximum(3.0 - pull, 0.3)
        count = max(3 * int(used.sum()) - self.layout.size, 1)
        return np.where(used, outlier_probabilities(square, freedom, cost, count), 1.0)

    def arc_excess(self, prediction: Prediction, noise: Noise, used: np.ndarray) -> Array:
        """How far each drive departs from its function beyond what the noise explains, rad or m, (n,)."""
        covariance = noise.covariance(self.stated_m2)
        residual = self.seen.point_m - prediction.point_m
        excess = np.zeros(prediction.by_net.shape[2])
        for joint in np.unique(self.joint):
            mine = (self.joint == joint) & used & (self.seen.link >= joint)
            arm = prediction.by_net[mine][:, :, joint - 1]
            square = np.einsum("mi,mi->m", arm, arm)
            along = np.einsum("mi,mi->m", arm, residual[mine]) ** 2 / square**2
            expected = np.einsum("mi,mij,mj->m", arm, covariance[mine], arm) / square**2
            if along.mean() > (EXCESS_SHARE + 4 * np.sqrt(2 / len(along))) * expected.mean():
                excess[joint - 1] = np.sqrt(along.mean() - expected.mean())
        return excess

    def result(
        self,
        campaign: Campaign,
        state: ArmState,
        solved: _Solved,
        noise: Noise,
        excess: Array,
        used: np.ndarray,
        start: ArmEstimate,
        motions: tuple[SweepMotion, ...],
        convention: Convention | None,
        nominal: PhiModel | None,
    ) -> Refinement:
        seen = Seen(self.seen, solved.prediction, noise.covariance(self.stated_m2), used)
        motions = refined_motions(motions, state, seen)
        drives = self._function_fits(start.transmissions, state.transmissions, self.layout.transmissions, solved)
        couplings = self._function_fits(start.couplings, state.couplings, self.layout.couplings, solved)
        n, home = len(state.axes), self.seen.home
        own = tuple(tuple(m.curve for m in motions if m.found.sweep.joint == j) for j in range(1, n + 1))
        passive = tuple(tuple(m.passive for m in motions if m.passive and m.found.sweep.joint == j) for j in range(n))
        drives = with_curves(drives, own, home, np.ones(n))
        couplings = with_curves(couplings, passive, False, campaign.robot.coupling_gains)
        covariance = self._axis_covariance(solved.covariance, n)
        geometry = None
        if convention is not None and nominal is not None:
            geometry = geometry_from_axes(state.axes, convention, covariance, nominal)
        functions = drive_functions(campaign, list(drives))
        estimate = ArmEstimate(
            method="all points at once",
            arm=Arm(campaign.robot, state.axes, functions, state.couplings),
            axis_covariance=covariance,
            transmissions=drives,
            offset_std=offset_std(campaign, list(drives)),
            couplings=couplings,
            geometry=geometry,
            noise_m=noise.rms_m(self.stated_m2[used]),
        )
        rest, rest_covariance = self._targets(campaign, state, solved.covariance)
        return Refinement(
            estimate,
            rest,
            rest_covariance,
            motions,
            self._residuals(state, solved, used),
            noise,
            solved.degrees_of_freedom,
            excess,
            solved.unobservable,
        )

    def _function_fits(
        self,
        fits: tuple[FunctionFit | None, ...],
        functions: tuple[MotionFunction | None, ...],
        places: tuple[slice | None, ...],
        solved: _Solved,
    ) -> tuple[FunctionFit | None, ...]:
        out = []
        for fit, function, place in zip(fits, functions, places, strict=True):
            if fit is None or place is None:
                out.append(fit)
                continue
            out.append(replace(fit, coefficients=function.coefficients, covariance=solved.covariance[place, place]))
        return tuple(out)

    def _axis_covariance(self, covariance: Array, n: int) -> Array:
        out = np.full((4 * n, 4 * n), np.nan)
        places = [
            (4 * i + k, place.start + k)
            for i, place in enumerate(self.layout.axes)
            if place is not None
            for k in range(place.stop - place.start)
        ]
        for i, place in enumerate(self.layout.axes):
            if place is not None:
                out[4 * i : 4 * i + 4, :] = 0.0
        out[:, [4 * i + k for i, p in enumerate(self.layout.axes) if p is None for k in range(4)]] = np.nan
        outer, inner = np.array(places).T
        out[np.ix_(outer, outer)] = covariance[np.ix_(inner, inner)]
        return out

    def _targets(self, campaign: Campaign, state: ArmState, covariance: Array) -> tuple[Array, Array]:
        count = len(campaign.targets)
        rest, spread = np.full((count, 3), np.nan), np.full((count, 3, 3), np.nan)
        own = covariance[self.layout.targets, self.layout.targets]
        for k, target in enumerate(self.targets):
            rest[target] = state.rest_points_m[k]
            spread[target] = own[3 * k : 3 * k + 3, 3 * k : 3 * k + 3]
        return rest, spread

    def _residuals(self, state: ArmState, solved: _Solved, used: np.ndarray) -> PointResiduals:
        """Residuals in the swept joint's own directions: along its axis, away from it, along the arc."""
        residual = self.seen.point_m - solved.prediction.point_m
        arm = solved.prediction.by_net[np.arange(len(self.joint)), :, self.joint - 1]
        along = arm / np.maximum(np.linalg.norm(arm, axis=1), 1e-300)[:, None]
        axes = self._axes_in_place(state)
        slides = self.seen.sliding[self.joint - 1]
        outward = cross(along, axes)
        tangential = np.einsum("mi,mi->m", along, residual)
        axial = np.einsum("mi,mi->m", axes, residual)
        radial = np.einsum("mi,mi->m", outward, residual)
        across = np.linalg.norm(residual - axial[:, None] * axes, axis=1)
        return PointResiduals(
            self.row,
            self.joint,
            residual,
            axial,
            np.where(slides, across, radial),
            np.where(slides, 0.0, tangential),
            used,
            self.knowable,
            solved.probability,
        )

    def _axes_in_place(self, state: ArmState) -> Array:
        """Direction of the swept joint's axis where the joints below it stand, for every point, (m, 3)."""
        net = net_displacements(state, self.seen)
        ends = np.stack([line.point_m for line in state.axes])[self.joint - 1]
        directions = np.stack([line.direction for line in state.axes])[self.joint - 1]
        near = carry(state.axes, self.seen.sliding, net, self.joint - 1, ends)
        return carry(state.axes, self.seen.sliding, net, self.joint - 1, ends + directions) - near


def _state(start: ArmEstimate, rest_points_m: Array) -> ArmState:
    plain = tuple(replace(f, offset=0.0) for f in start.arm.transmissions)
    return ArmState(start.arm.axes, plain, start.arm.couplings, rest_points_m)


def _inverse(normal: Array) -> tuple[Array, int]:
    """Inverse of the information matrix, and how many combinations of unknowns carry no information."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
    values, vectors = np.linalg.eigh(normal * scale[:, None] * scale)
    known = values > 1e-12 * values[-1]
    inverse = (vectors[:, known] / values[known]) @ vectors[:, known].T
    return inverse * scale[:, None] * scale, int((~known).sum())


def _worst_outlier(solved: _Solved, used: np.ndarray) -> int | None:
    """The row that stands out most, if any does: less than one chance in a thousand that any row would."""
    worst = int(np.argmin(np.where(used, solved.probability, 1.0)))
    return worst if solved.probability[worst] * used.sum() < 1e-3 else None
