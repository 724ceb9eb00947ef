"""The paper's simulated cell as a planner knows it before anything is measured, and plans measured there.

The planner is given the drawing of the arm, where its base stands, where targets are drawn, the two theodolites, the
repeatability: nothing of the arm's faults. Bounds are taken at the truth, errors against the truth.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from core.arm_jacobian import ArmState
from core.calibrated_arm import CalibratedArm, calibrated_arm
from core.calibration import calibrate
from core.geometry import Array, apply, invert
from core.kinematics import forward, link_frames
from core.measurements import POSE, SWEEP, Campaign, Measurements, Target
from core.phi_convention import convention_of
from core.phi_model import from_axes
from core.planning.expected_error import ExpectedError
from core.planning.pose_calibration import calibrate_on_poses
from core.planning.proposal import expected_by, shown_by
from core.planning.sight import Sight
from core.planning.site import Repeats, Site
from core.planning.site_makers import nominal_site
from core.rotations import vectors_of_rotations
from core.twin import irb_l6
from core.twin.campaign import simulate_campaign
from core.twin.noise import MEAN_LENGTH, Noise


@cache
def table_1() -> Measurements:
    """The paper's own plan as the twin has it, 129 shots, with the twelve test poses as rows to be checked with."""
    return simulate_campaign(1).measurements


@cache
def kept_out_commands() -> Array:
    """Commands of the twelve test poses, kept out of every plan and fit, (12, 6)."""
    table = table_1()
    rows = np.flatnonzero(table.phase == POSE)
    return table.commanded[rows[np.unique(table.pose[rows], return_index=True)[1]]]


@cache
def drawn_site() -> Site:
    """The cell by its drawings."""
    cell = irb_l6.cell()
    robot, pair = cell.robot, cell.instrument
    lines = robot.axes_at_zero()
    convention = convention_of(robot)
    base = cell.truth.base @ invert(from_axes(lines, convention)[0])
    at_rest = link_frames(robot, np.zeros((1, robot.joint_count)))[0]
    targets = tuple(
        Target(name, link, tuple(apply(invert(at_rest[link - 1]), np.array(place))))
        for name, link, place in irb_l6.TARGETS
    )
    repeats = Repeats(cell.repeatability.mean_translation_m / MEAN_LENGTH)
    return nominal_site(robot, base, targets, Sight((pair.left, pair.right)), cell.home, repeats)


def true_site(drawn: Site | None = None) -> Site:
    """The same cell as it is; targets that only a plan has stay where the plan has them."""
    drawn, true = drawn_site() if drawn is None else drawn, irb_l6.cell().truth
    rest = drawn.state.rest_points_m.copy()
    rest[: len(true.rest_points_m)] = true.rest_points_m
    plain = tuple(replace(f, offset=0.0) for f in true.arm.transmissions)
    return replace(drawn, state=ArmState(true.arm.axes, plain, true.arm.couplings, rest))


def measured(site: Site, rows: Measurements, seed: int, noise: Noise | None = None) -> Campaign:
    """A plan measured on the twin: instrument noise and repeatability in every shot.

    Args:
        site: the plan's; its targets beyond the cell's are stuck on where it has them.
    """
    cell, true, rng = irb_l6.cell(), true_site(site), np.random.default_rng(seed)
    noise = Noise() if noise is None else noise
    shots = np.flatnonzero(rows.target >= 0)
    links = site.links[rows.target[shots]]
    points = cell.truth.arm.points(rows.commanded[shots], links, true.state.rest_points_m[rows.target[shots]])
    if noise.repeatability:
        points = cell.repeatability.displaced(points, _bodies(rows, shots, links), rng)
    covariance = cell.instrument.covariance(points)
    if noise.instrument:
        points, covariance = cell.instrument.measure(points, rng)
    every = rows.point_m.copy(), rows.covariance_m2.copy()
    every[0][shots], every[1][shots] = points, covariance
    table = replace(rows, point_m=every[0], covariance_m2=every[1])
    return Campaign(site.robot, site.targets, table, "planned", cell.instrument.statement, home=cell.home)


def calibrated(campaign: Campaign) -> CalibratedArm:
    """By the product: the independent-axis calibration of sweeps, or the fit of free poses."""
    if (campaign.measurements.phase == SWEEP).any():
        return calibrated_arm(calibrate(campaign))
    return calibrate_on_poses(campaign).arm


@dataclass(frozen=True)
class Errors:
    """Of a model of the arm over the test poses."""

    shift_m: Array
    """(12, 3), instrument's frame."""
    turn_rad: Array
    """(12, 3)."""

    @property
    def position_m(self) -> float:
        """Mean length."""
        return float(np.linalg.norm(self.shift_m, axis=1).mean())

    @property
    def orientation_rad(self) -> float:
        """Mean angle."""
        return float(np.linalg.norm(self.turn_rad, axis=1).mean())


def errors_of(arm: CalibratedArm) -> Errors:
    """Where the arm truly goes less where a model has it."""
    true = true_tools()
    has = arm.base @ forward(arm.robot, arm.drives.net(kept_out_commands()))
    turn = vectors_of_rotations(true[:, :3, :3] @ np.swapaxes(has[:, :3, :3], 1, 2))
    return Errors(true[:, :3, 3] - has[:, :3, 3], turn)


@cache
def true_tools() -> Array:
    """Where the tool truly goes in the test poses, instrument's frame, (12, 4, 4)."""
    truth = irb_l6.cell().truth
    return truth.base @ truth.tool_poses(kept_out_commands())


def bound(rows: Measurements, site: Site | None = None) -> ExpectedError:
    """The Cramer-Rao bound of shots at the truth, over the test poses."""
    return expected_by(shown_by(true_site(site), rows), rows, kept_out_commands())


def _bodies(rows: Measurements, shots: np.ndarray, links: np.ndarray) -> np.ndarray:
    """Which shots show the same link in the same standstill, (m,)."""
    standstill = [column[shots] for column in (rows.joint, rows.sweep, rows.step, rows.pose)]
    return np.unique(np.stack([*standstill, links]), axis=1, return_inverse=True)[1].ravel()
