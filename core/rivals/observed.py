"""The points of a campaign as the aggregate methods take them: each with its commands, however the arm came there.

Also what such a method starts from: the nominal arm, placed in the instrument's frame by a rigid fit of the points
where it expects them.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from core.arm_jacobian import ArmState, Layout, Observations, net_displacements
from core.driven_robot import nominal_driven
from core.errors import CampaignError
from core.geometry import Array, apply, invert, rigid_fit
from core.kinematics import link_frames
from core.measurements import Campaign
from core.motion_forms import MotionFunction
from core.planning.site_makers import drawn_drives
from core.robot import Robot
from core.sweep_fits import active_from_zero

UNSTATED_M = 1e-3
"""Standard deviation of a coordinate where none is stated: then only the ratio of weights counts."""
FEWEST_POINTS = 4


class Drives(StrEnum):
    """What a method takes the drives for."""

    AS_COMMANDED = "as commanded"
    """Every motor does what it is told, couplings have their nominal gains: geometry and zeros are all that is fitted,
    as in most of the literature."""
    FUNCTIONS = "with functions"
    """With the robot's transmission and coupling functions, whose constants are fitted too."""


@dataclass(frozen=True, eq=False)
class ObservedPoints:
    """Points that may be fitted."""

    campaign: Campaign
    row: np.ndarray
    """Rows of the campaign's measurements, (m,)."""
    target: np.ndarray
    """Indices of the campaign's targets that were seen, (t,)."""
    seen: Observations
    """Its ``target`` counts within ``target``."""
    covariance_m2: Array
    """Of each point: what is stated, and the repeatability that the method is told, (m, 3, 3)."""

    @property
    def robot(self) -> Robot:
        return self.campaign.robot


def observed_points(campaign: Campaign, repeatability_m: float = 0.0) -> ObservedPoints:
    """All points of a campaign on the arm that may be fitted, sweeps and poses alike.

    Args:
        repeatability_m: standard deviation of one coordinate that the arm adds on every visit.

    Raises:
        CampaignError: there are fewer than four.
    """
    table = campaign.measurements
    links = np.array([target.link for target in campaign.targets])
    usable = table.seen & ~table.check & (table.target >= 0)
    row = np.flatnonzero(usable & (links[table.target] > 0))
    if len(row) < FEWEST_POINTS:
        raise CampaignError(f"the campaign has {len(row)} points that may be fitted, expected {FEWEST_POINTS} or more")
    target, local = np.unique(table.target[row], return_inverse=True)
    seen = Observations(
        point_m=table.point_m[row],
        target=local,
        link=links[target][local],
        asked=active_from_zero(campaign, table.commanded[row]),
        sliding=campaign.robot.sliding,
        home=campaign.home is not None,
    )
    return ObservedPoints(campaign, row, target, seen, _covariance(campaign, row, repeatability_m))


def nominal_base(points: ObservedPoints) -> Array:
    """Where the nominal arm's base stands if its points are to lie where they were seen, (4, 4): a rigid fit.

    Targets whose place is stated decide; if there are none, all do, as if they sat in the origins of their links.
    """
    stated = _stated_places(points)[points.seen.target]
    known = np.isfinite(stated).all(axis=1)
    if known.sum() < FEWEST_POINTS:
        stated, known = np.nan_to_num(stated), np.ones(len(known), dtype=bool)
    return rigid_fit(apply(_nominal_links(points)[known], stated[known]), points.seen.point_m[known])


def nominal_state(points: ObservedPoints, base: Array, drives: Drives) -> ArmState:
    """The nominal arm on a base (4, 4), functions without errors.

    Targets sit where it is stated, else where their points are on average, carried back to their link.
    """
    robot, seen = points.robot, points.seen
    on_link = apply(invert(base @ _nominal_links(points)), seen.point_m)
    middles = np.array([np.median(on_link[seen.target == k], axis=0) for k in range(len(points.target))])
    stated = _stated_places(points)
    at_rest = link_frames(robot, np.zeros((1, robot.joint_count)))[0]
    links = np.array([points.campaign.targets[t].link for t in points.target])
    return ArmState(
        tuple(line.moved(base) for line in robot.axes_at_zero()),
        *_functions(robot, drives),
        apply(base @ at_rest[links - 1], np.where(np.isfinite(stated), stated, middles)),
    )


def layout_of(state: ArmState, robot: Robot, drives: Drives) -> Layout:
    """All axes, all targets, and with ``Drives.FUNCTIONS`` the constants of all functions."""
    coupled = np.array([c is not None and drives is Drives.FUNCTIONS for c in state.couplings])
    return Layout.of(state, robot.sliding, np.ones(robot.joint_count, dtype=bool), coupled)


def _stated_places(points: ObservedPoints) -> Array:
    """Targets in the frames of their links, NaN where it is not stated, (t, 3)."""
    unknown = (np.nan, np.nan, np.nan)
    return np.array([points.campaign.targets[t].point_m or unknown for t in points.target])


def _nominal_links(points: ObservedPoints) -> Array:
    """From the link of each point to the robot's base, by the nominal arm under its commands, (m, 4, 4)."""
    robot, seen = points.robot, points.seen
    direct = ArmState(robot.axes_at_zero(), *_functions(robot, Drives.AS_COMMANDED), np.zeros((len(points.target), 3)))
    return link_frames(robot, net_displacements(direct, seen))[np.arange(len(seen.link)), seen.link - 1]


def _functions(robot: Robot, drives: Drives) -> tuple[tuple[MotionFunction, ...], tuple[MotionFunction | None, ...]]:
    """Transmissions and couplings of perfect drives."""
    if drives is Drives.FUNCTIONS:
        return drawn_drives(robot)
    direct = nominal_driven(robot).drives
    return direct.transmissions, direct.couplings


def _covariance(campaign: Campaign, row: np.ndarray, repeatability_m: float) -> Array:
    stated = campaign.measurements.covariance_m2[row]
    sigma = UNSTATED_M if campaign.instrument.sigma_m is None else campaign.instrument.sigma_m
    known = np.isfinite(stated).all(axis=(1, 2))
    return np.where(known[:, None, None], stated, sigma**2 * np.eye(3)) + repeatability_m**2 * np.eye(3)
