"""How fast a whole campaign is calibrated, against the same problem written the obvious way.

The obvious way: one vector of all parameters (axes, constants of transmissions and couplings, targets), residuals of
all points from the forward model, ``scipy.optimize.least_squares`` with its own numerical Jacobian. It is given the
joint-by-joint estimate as its start and is not charged for it.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from core.arm import Arm
from core.calibration import Calibration, calibrate
from core.drives import offsets
from core.geometry import Array, Line, joint_motion, perpendicular_basis
from core.measurements import Campaign
from core.twin import irb_l6
from core.twin.campaign import simulate_campaign
from core.twin.cell import Cell
from tests.benchmarks.clock import median_s, once_s
from tests.benchmarks.tables import markdown

STEPS = 116
SEED = 3
KEPT_OUT = 400
REACH_RAD = np.deg2rad([22.0, 20.0, 20.0, 40.0, 28.0, 22.0])
"""Kept-out configurations lie within the ranges of the sweeps about home."""


def long_cell(steps: int = STEPS) -> Cell:
    """The paper's arm with sweeps of so many points."""
    cell = irb_l6.cell()
    sweeps = tuple(replace(plan, points=steps) for plan in cell.protocol.sweeps)
    return replace(cell, protocol=replace(cell.protocol, sweeps=sweeps))


@dataclass(frozen=True)
class AllAtOnce:
    """The whole calibration as one least-squares problem."""

    campaign: Campaign
    start: Arm
    observed: tuple[bool, ...]
    """Which couplings the sweeps show; the others stay as they are, (n,)."""
    targets: np.ndarray
    """Indices of the targets that the sweeps show, (t,)."""
    rows: np.ndarray
    """Rows of the campaign that are fitted, (m,)."""
    local: np.ndarray
    """Which of ``targets`` each row shows, (m,)."""
    whitener: Array
    """(m, 3, 3)."""

    @staticmethod
    def of(calibration: Calibration) -> "AllAtOnce":
        """The problem of a campaign, from its joint-by-joint estimate."""
        campaign = calibration.campaign
        rows = np.concatenate([sweep.rows for sweep in campaign.sweeps])
        targets, local = np.unique(campaign.measurements.target[rows], return_inverse=True)
        covariance = calibration.found.noise.covariance(campaign.measurements.covariance_m2[rows])
        whitener = np.linalg.inv(np.linalg.cholesky(covariance))
        start = calibration.joint_by_joint
        observed = tuple(fit is not None for fit in start.couplings)
        return AllAtOnce(campaign, start.arm, observed, targets, rows, local, whitener)

    def arm(self, unknown: Array) -> tuple[Arm, Array]:
        """The arm and the targets at rest that a vector of unknowns stands for."""
        at = 0

        def take(count: int) -> Array:
            nonlocal at
            at += count
            return unknown[at - count : at]

        axes = tuple(_shifted(line, take(4)) for line in self.start.axes)
        drives = [replace(f, coefficients=take(len(f.coefficients))) for f in self.start.transmissions]
        couplings = tuple(
            replace(f, coefficients=take(len(f.coefficients))) if seen else f
            for f, seen in zip(self.start.couplings, self.observed, strict=True)
        )
        own = offsets(self.campaign, [replace(f, offset=0.0) for f in drives])
        with_offsets = tuple(replace(f, offset=float(o)) for f, o in zip(drives, own, strict=True))
        return Arm(self.start.robot, axes, with_offsets, couplings), take(3 * len(self.targets)).reshape(-1, 3)

    def start_vector(self) -> Array:
        """The joint-by-joint estimate as a vector; targets are carried back to rest, and averaged."""
        couplings = [f for f, seen in zip(self.start.couplings, self.observed, strict=True) if seen]
        constants = np.concatenate([f.coefficients for f in (*self.start.transmissions, *couplings)])
        zero = np.zeros((len(self.rows), 3))
        origin = self._points(self.start, zero)
        turns = np.stack([self._points(self.start, zero + unit) - origin for unit in np.eye(3)], axis=1)
        measured = self.campaign.measurements.point_m[self.rows]
        back = (turns @ (measured - origin)[:, :, None])[:, :, 0]
        rest = [back[self.local == k].mean(axis=0) for k in range(len(self.targets))]
        return np.concatenate([np.zeros(4 * len(self.start.axes)), constants, *rest])

    def residual(self, unknown: Array) -> Array:
        """Whitened measured less predicted coordinates, (3m,)."""
        arm, rest = self.arm(unknown)
        miss = self.campaign.measurements.point_m[self.rows] - self._points(arm, rest[self.local])
        return (self.whitener @ miss[:, :, None]).ravel()

    def solve(self) -> tuple[OptimizeResult, Array]:
        """The optimum and the covariance of all unknowns."""
        found = least_squares(self.residual, self.start_vector(), x_scale="jac")
        return found, np.linalg.pinv(found.jac.T @ found.jac)

    def point_by_point(self) -> "PointByPoint":
        """The same problem with a forward model that goes point by point."""
        return PointByPoint(*(getattr(self, name) for name in self.__dataclass_fields__))

    def _points(self, arm: Arm, rest_points_m: Array) -> Array:
        table = self.campaign.measurements
        links = np.array([t.link for t in self.campaign.targets])[table.target[self.rows]]
        return arm.points(table.commanded[self.rows], links, rest_points_m)


class PointByPoint(AllAtOnce):
    """The forward model as it stands in textbooks: for each point the product of 4x4 matrices up to its link."""

    def _points(self, arm: Arm, rest_points_m: Array) -> Array:
        table = self.campaign.measurements
        out = np.empty((len(self.rows), 3))
        nets = arm.net(table.commanded[self.rows])
        for k, row in enumerate(self.rows):
            motion = np.eye(4)
            for i in range(self.campaign.targets[table.target[row]].link):
                motion = motion @ joint_motion(arm.axes[i], nets[k, i], bool(arm.robot.sliding[i]))
            out[k] = motion[:3, :3] @ rest_points_m[k] + motion[:3, 3]
        return out


def _shifted(line: Line, step: Array) -> Line:
    e1, e2 = perpendicular_basis(line.direction)
    return Line(line.point_m + step[2] * e1 + step[3] * e2, line.direction + step[0] * e1 + step[1] * e2)


def kept_out_rms_m(cell: Cell, arm: Arm, targets: np.ndarray, rest_points_m: Array) -> float:
    """Root mean square distance of predicted from true points in configurations that nobody measured."""
    rng = np.random.default_rng(11)
    commanded = cell.centre + rng.uniform(-1, 1, (KEPT_OUT, len(REACH_RAD))) * REACH_RAD
    square = []
    for k, target in enumerate(targets):
        link = np.full(KEPT_OUT, cell.target_links[target])
        true = cell.truth.arm.points(commanded, link, np.tile(cell.truth.rest_points_m[target], (KEPT_OUT, 1)))
        found = arm.points(commanded, link, np.tile(rest_points_m[k], (KEPT_OUT, 1)))
        square.append(np.sum((true - found) ** 2, axis=1))
    return float(np.sqrt(np.mean(square)))


def campaign_table() -> str:
    """Time and accuracy of ``calibrate`` and of the obvious way."""
    cell = long_cell()
    campaign = simulate_campaign(SEED, cell)
    calibration = calibrate(campaign)
    problem = AllAtOnce.of(calibration)
    own_s = median_s(lambda: calibrate(campaign), 7)
    quick_s, slow_s = median_s(problem.solve, 3), once_s(problem.point_by_point().solve)
    found, _ = problem.solve()
    arm, rest = problem.arm(found.x)
    start_arm, start_rest = problem.arm(problem.start_vector())
    start = kept_out_rms_m(cell, start_arm, problem.targets, start_rest)
    rival = kept_out_rms_m(cell, arm, problem.targets, rest)
    refined = calibration.refinement
    own = kept_out_rms_m(cell, calibration.estimate.arm, problem.targets, refined.rest_points_m[problem.targets])
    rows = [
        ("joint by joint: where least_squares starts, not charged to it", "-", "-", start),
        ("least_squares, forward model point by point", f"{slow_s * 1e3:.0f}", f"{slow_s / own_s:.0f}", rival),
        ("least_squares, forward model vectorised (core.arm)", f"{quick_s * 1e3:.0f}", f"{quick_s / own_s:.1f}", rival),
        ("core.calibration.calibrate, from the points", f"{own_s * 1e3:.0f}", "1", own),
    ]
    title = f"{len(cell.protocol.sweeps)} sweeps of {STEPS} stops, {len(problem.rows)} points, {len(found.x)} unknowns"
    header = (title, "ms", "times calibrate", "kept-out points, mm rms")
    return markdown(header, [(name, ms, ratio, f"{rms * 1e3:.4f}") for name, ms, ratio, rms in rows])
