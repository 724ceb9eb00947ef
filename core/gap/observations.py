"""What the diagnosis looks at: the measured points of a campaign with everything that could explain them."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from core.calibrated_arm import CalibratedArm
from core.errors import CampaignError
from core.geometry import Array
from core.kinematics import active_commands, nominal_net
from core.measurements import POSE, SWEEP, Campaign
from core.robot import Robot

FALLBACK_SIGMA_M = 1e-4
"""Of a point that states no noise, before the data have been asked."""
STILL = 1e-6
"""A joint that goes no farther stands still, rad or m."""


@dataclass(frozen=True, eq=False)
class Observations:
    """Points on links 1..n, in the order of measurement, and the sim that is held against them."""

    campaign: Campaign
    chain: Robot
    """The sim's geometry, in its own base frame."""
    rows: np.ndarray
    """Rows of the campaign's measurements, (m,)."""
    active: Array
    """What each motor is asked for, rad or m, (m, n)."""
    net: Array
    """Net displacements as the sim has them, rad or m, (m, n)."""
    sim: str
    """What the sim is, in words."""
    calibrated: CalibratedArm | None = None
    """The sim, where it is a calibrated arm."""

    @property
    def count(self) -> int:
        return len(self.rows)

    @property
    def joint_count(self) -> int:
        return self.chain.joint_count

    @cached_property
    def point_m(self) -> Array:
        """Measured points, instrument's frame, (m, 3)."""
        return self.campaign.measurements.point_m[self.rows]

    @property
    def commanded(self) -> Array:
        """What was commanded, rad or m, (m, n)."""
        return self.campaign.measurements.commanded[self.rows]

    @cached_property
    def simulated_m(self) -> Array | None:
        """The points as another simulator predicts them, (m, 3); None: the sim is the chain."""
        points = self.campaign.measurements.simulated_point_m
        return None if points is None else points[self.rows]

    @cached_property
    def fitted(self) -> np.ndarray:
        """Points that may be fitted, (m,): all but the owner's validation rows, unless there is nothing else."""
        return ~self.check if (~self.check).any() else np.ones(self.count, dtype=bool)

    @cached_property
    def target(self) -> np.ndarray:
        return self.campaign.measurements.target[self.rows]

    @cached_property
    def link(self) -> np.ndarray:
        """The link that each point rides on, 1..n, (m,)."""
        return np.array([target.link for target in self.campaign.targets])[self.target]

    @cached_property
    def record(self) -> np.ndarray:
        return self.campaign.measurements.record[self.rows]

    @cached_property
    def phase(self) -> np.ndarray:
        return self.campaign.measurements.phase[self.rows]

    @cached_property
    def joint(self) -> np.ndarray:
        """The joint that moves in a sweep, 1..n, else 0, (m,)."""
        return self.campaign.measurements.joint[self.rows]

    @cached_property
    def check(self) -> np.ndarray:
        """The owner's validation rows, never fitted, (m,)."""
        return self.campaign.measurements.check[self.rows]

    @cached_property
    def approach(self) -> np.ndarray:
        return self.campaign.measurements.approach[self.rows]

    @cached_property
    def stated_covariance_m2(self) -> Array:
        """Stated covariance of each point, (m, 3, 3); a stated or assumed isotropic one where a row has none."""
        covariance = self.campaign.measurements.covariance_m2[self.rows].copy()
        sigma_m = self.campaign.instrument.sigma_m or FALLBACK_SIGMA_M
        missing = ~np.isfinite(covariance).all(axis=(1, 2))
        covariance[missing] = sigma_m**2 * np.eye(3)
        return covariance

    @cached_property
    def payload_kg(self) -> Array:
        """(m,), 0 where nobody wrote it down."""
        return np.nan_to_num(_column(self.campaign.measurements.payload_kg, self.rows, 0.0))

    @cached_property
    def time(self) -> Array:
        """Time since the first point as a share of the whole, 0..1, (m,); without times the order of measurement."""
        logged = self.campaign.measurements.time_s
        time = self.record.astype(float) if logged is None else logged[self.rows]
        if not np.isfinite(time).all() or np.ptp(time) == 0:
            time = np.arange(self.count, dtype=float)
        return (time - time.min()) / max(np.ptp(time), 1e-300)

    @cached_property
    def standstill(self) -> np.ndarray:
        """Which points were taken without the arm moving in between, integer (m,)."""
        table, rows = self.campaign.measurements, self.rows
        keys = np.stack([self.joint, table.sweep[rows], table.step[rows], table.pose[rows]], axis=1)
        keys = np.column_stack([keys, np.round(self.active, 9), self.approach])
        changed = np.any(keys[1:] != keys[:-1], axis=1)
        return np.concatenate([[0], np.cumsum(changed)]) if len(rows) else np.zeros(0, dtype=int)

    @cached_property
    def swept(self) -> np.ndarray:
        return self.phase == SWEEP

    @cached_property
    def posed(self) -> np.ndarray:
        return self.phase == POSE

    @cached_property
    def span(self) -> Array:
        """How far each joint's motor goes over the points, rad or m, (n,)."""
        return np.ptp(self.active, axis=0)

    @cached_property
    def held(self) -> np.ndarray:
        """Joints that stood still at all points, whatever their motors did to hold them against others, (n,)."""
        return np.ptp(self.net, axis=0) < STILL

    @cached_property
    def still(self) -> np.ndarray:
        """Joints whose motors stood still at all points, (n,)."""
        return self.span < STILL

    @cached_property
    def uncoupled(self) -> "Observations":
        """The same points of an arm whose motors move one joint each: net displacements stand for those of motors."""
        chain = replace(self.chain, couplings=())
        return replace(self, chain=chain, active=self.net)

    def part(self, keep: np.ndarray) -> "Observations":
        """Some of the points; ``keep``: boolean (m,) or indices."""
        return replace(self, rows=self.rows[keep], active=self.active[keep], net=self.net[keep])


def observe(campaign: Campaign, arm: CalibratedArm | None = None) -> Observations:
    """The points of a campaign and the sim: its nominal robot, or a calibrated arm, or the simulated points in it.

    Raises:
        CampaignError: no point on a moving link was seen.
    """
    table = campaign.measurements
    links = np.array([target.link for target in campaign.targets] or [0])
    usable = table.seen & (table.target >= 0)
    usable &= links[np.maximum(table.target, 0)] > 0
    simulated = table.simulated_point_m
    if simulated is not None:
        usable &= np.isfinite(simulated).all(axis=1)
    else:
        usable &= ~np.isin(table.target, placeless(campaign))
    rows = np.flatnonzero(usable)
    rows = rows[np.argsort(table.record[rows], kind="stable")]
    if len(rows) == 0:
        raise CampaignError("the campaign has no measured point on a link that moves, so there is no gap to look at")
    commanded = table.commanded[rows]
    active = active_commands(campaign.robot, commanded)
    if arm is None:
        sim = "the nominal model" if simulated is None else "the points of another simulator"
        return Observations(campaign, campaign.robot, rows, active, nominal_net(campaign.robot, commanded), sim)
    if simulated is not None:
        raise CampaignError("the campaign has sim_* columns, so the sim is given twice: leave the calibration out")
    if arm.robot.joint_count != campaign.robot.joint_count:
        raise CampaignError(
            f"the calibration is of an arm with {arm.robot.joint_count} joints, the campaign's robot has "
            f"{campaign.robot.joint_count}"
        )
    source = f"the calibration from {arm.source!r}" if arm.source else "the calibration"
    return Observations(campaign, arm.robot, rows, active, arm.drives.net(commanded), source, arm)


def placeless(campaign: Campaign) -> list[int]:
    """Targets whose place is not known and that validation rows alone show: nothing may be fitted to them."""
    table = campaign.measurements
    links = np.array([target.link for target in campaign.targets] or [0])
    seen = table.seen & (table.target >= 0) & (links[table.target] > 0)
    fitted = set(table.target[seen & ~table.check])
    shown = set(table.target[seen]) if fitted else set()
    return sorted(int(t) for t in shown - fitted if campaign.targets[t].point_m is None)


def _column(values: Array | None, rows: np.ndarray, default: float) -> Array:
    return np.full(len(rows), default) if values is None else values[rows]
