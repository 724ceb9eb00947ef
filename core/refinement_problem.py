"""The least-squares problem of a refinement: all points, all unknowns, solved by Gauss-Newton under given weights."""

from dataclasses import dataclass, replace

import numpy as np

from core.arm import slide, turn
from core.arm_jacobian import ArmState, Layout, Observations, Prediction, moved, net_displacements, predict
from core.axes.result import outlier_probabilities
from core.errors import NotConverged
from core.estimate import ArmEstimate
from core.geometry import Array
from core.measurements import Campaign
from core.noise import Noise, noise_from_scatter
from core.sweep_fits import SweepFits, active_from_zero

EXCESS_SHARE = 1.5
"""Variance along the arcs over what the noise explains, beyond which a joint gets an excess of its own."""


@dataclass(frozen=True)
class Solved:
    """A solution of the problem with its uncertainty."""

    prediction: Prediction
    covariance: Array
    """Of the unknowns by the given weights, (p, p)."""
    chi_square: float
    degrees_of_freedom: int
    unobservable: int
    """Combinations of unknowns that the points say nothing about."""
    probability: Array
    """Outlier probability of each row, (m,)."""


@dataclass(frozen=True)
class RefinementProblem:
    """The data and the layout of the unknowns."""

    seen: Observations
    stated_m2: Array
    """Stated covariances, (m, 3, 3)."""
    row: np.ndarray
    """Row in the campaign's measurements, (m,)."""
    joint: np.ndarray
    """The joint that was swept, (m,)."""
    layout: Layout
    targets: np.ndarray
    """Index of the campaign's target behind each place that is estimated, (t,)."""
    knowable: np.ndarray
    """False for points that also moved with a joint of which there is no sweep, boolean, (m,)."""

    @staticmethod
    def of(campaign: Campaign, found: SweepFits, start: ArmEstimate, tied: bool = True) -> "RefinementProblem":
        """Gather all sweeps of a campaign.

        Args:
            tied: whether a target has one place on its link in all sweeps, or one of its own in each.
        """
        sweeps = [f.sweep for f in found.fits]
        target = np.concatenate([s.target for s in sweeps])
        sweep = np.concatenate([np.full(len(s.rows), 0 if tied else k) for k, s in enumerate(sweeps)])
        places, local = np.unique(np.stack([sweep, target]), axis=1, return_inverse=True)
        targets, local = places[1], local.ravel()
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
        state = state_of(start, np.zeros((len(targets), 3)))
        coupled = np.array([fit is not None for fit in start.couplings])
        return RefinementProblem(
            seen,
            np.concatenate([s.covariance_m2 for s in sweeps]),
            np.concatenate([s.rows for s in sweeps]),
            joint,
            Layout.of(state, campaign.robot.sliding, swept, coupled),
            targets,
            ~(coupled_on & (seen.link > joint)),
        )

    def start_state(self, start: ArmEstimate) -> ArmState:
        """Targets at rest: every point carried back to zero, and the median of each target."""
        state = state_of(start, np.zeros((len(self.targets), 3)))
        points, net = self.seen.point_m, net_displacements(state, self.seen)
        for i, axis in enumerate(state.axes):
            undo = slide if self.seen.sliding[i] else turn
            points = np.where((self.seen.link > i)[:, None], undo(axis, -net[:, i], points), points)
        rest = [np.median(points[self.seen.target == k], axis=0) for k in range(len(self.targets))]
        return state_of(start, np.array(rest))

    def covariance(self, noise: Noise, excess: Array, prediction: Prediction) -> Array:
        """Covariance of every point, the excess along the arcs included, (m, 3, 3)."""
        out = noise.covariance(self.stated_m2)
        if excess.any():
            along = prediction.by_net[np.arange(len(self.joint)), :, self.joint - 1] * excess[self.joint - 1][:, None]
            out = out + along[:, :, None] * along[:, None, :]
        return out

    def noise(self, solved: Solved, used: np.ndarray) -> Noise:
        """The noise by the scatter of the points about the arm."""
        residual = (self.seen.point_m - solved.prediction.point_m)[used]
        components = 3 * len(residual)
        observed = float(np.sum(residual**2)) * components / solved.degrees_of_freedom
        stated = float(np.sum(np.trace(self.stated_m2[used], axis1=1, axis2=2)))
        return noise_from_scatter(observed, stated, components, solved.degrees_of_freedom)

    def solve(
        self, state: ArmState, prediction: Prediction, covariance: Array, used: np.ndarray
    ) -> tuple[ArmState, Solved]:
        """Gauss-Newton with step halving under fixed weights, from a state and its prediction."""
        whitener = np.linalg.inv(np.linalg.cholesky(covariance)) * used[:, None, None]
        residual, cost = self._whitened(whitener, prediction)
        freedom = max(3 * int(used.sum()) - self.layout.size, 1)
        reach = float(np.abs(self.seen.point_m).max())
        rounding = float(np.sum((1e-14 * reach * np.diagonal(whitener, axis1=1, axis2=2)) ** 2))
        for _ in range(50):
            matrix = (whitener @ prediction.jacobian).reshape(-1, self.layout.size)
            inverse, covariance, lost = inverses(matrix.T @ matrix)
            gradient = matrix.T @ residual
            step = inverse @ gradient
            if gradient @ step <= 1e-6 * cost / freedom + rounding:
                probability = self._probability(matrix, inverse, residual, cost, used)
                return state, Solved(prediction, covariance, cost, freedom + lost, lost, probability)
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
        pull = np.einsum("ij,ij->i", matrix @ inverse, matrix).reshape(-1, 3).sum(axis=1)
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


def state_of(start: ArmEstimate, rest_points_m: Array) -> ArmState:
    plain = tuple(replace(f, offset=0.0) for f in start.arm.transmissions)
    return ArmState(start.arm.axes, plain, start.arm.couplings, rest_points_m)


def inverses(normal: Array) -> tuple[Array, Array, int]:
    """Pseudo-inverse of the information matrix for the step, its inverse as covariance, and what is not observable.

    A combination of unknowns without information is left alone by the step and gets an enormous variance.
    """
    diagonal = np.diag(normal)
    scale = np.where(diagonal > 0, 1.0 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0)), 1.0)
    values, vectors = np.linalg.eigh(normal * scale[:, None] * scale)
    least = 1e-12 * values[-1]
    known = values > least
    scaled = vectors * scale[:, None]
    inverse = (scaled[:, known] / values[known]) @ scaled[:, known].T
    return inverse, inverse + (scaled[:, ~known] / least) @ scaled[:, ~known].T, int((~known).sum())
