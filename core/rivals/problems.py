"""A campaign made ready for an aggregate method: equations, and the nominal arm to start from."""

from dataclasses import dataclass, replace

import numpy as np

from core.arm_jacobian import ArmState, predict
from core.geometry import Array, invert, transform
from core.measurements import Campaign
from core.rivals.equations import Equations, PointEquations, PoseEquations
from core.rivals.markers import frames_of, markers
from core.rivals.measured_poses import measured_poses
from core.rivals.observed import Drives, layout_of, nominal_base, nominal_state, observed_points


@dataclass(frozen=True)
class Repeatability:
    """What a method is told of how the arm returns: standard deviations of one coordinate."""

    shift_m: float = 0.0
    turn_rad: float = 0.0


@dataclass(frozen=True, eq=False)
class Problem:
    """Equations and where their solution starts."""

    campaign: Campaign
    equations: Equations
    start: ArmState
    base: Array
    """From the robot's base frame to the instrument's, for the start, (4, 4)."""
    points: int
    """How many measured points there are."""


def point_problem(campaign: Campaign, drives: Drives, repeatability: Repeatability | None = None) -> Problem:
    """Positions of all targets that may be fitted.

    Raises:
        CampaignError: there are too few points.
    """
    told = Repeatability() if repeatability is None else repeatability
    points = observed_points(campaign, told.shift_m)
    base = nominal_base(points)
    start = nominal_state(points, base, drives)
    layout = layout_of(start, campaign.robot, drives)
    equations = PointEquations.of(layout, points.seen, points.covariance_m2)
    return Problem(campaign, equations, start, base, len(points.row))


def pose_problem(campaign: Campaign, drives: Drives, repeatability: Repeatability | None = None) -> Problem:
    """Full poses of the body that three or more targets on the last link form.

    Raises:
        CampaignError: there are too few points or poses.
    """
    told = Repeatability() if repeatability is None else repeatability
    points, poses = observed_points(campaign), measured_poses(campaign)
    base = nominal_base(points)
    start = replace(nominal_state(points, base, drives), rest_points_m=markers(np.eye(4)))
    layout = layout_of(start, campaign.robot, drives)
    own = np.diag([told.shift_m**2] * 3 + [told.turn_rad**2] * 3)
    equations = PoseEquations.of(layout, poses.asked, poses.pose, poses.covariance + own, campaign)
    start = replace(start, rest_points_m=markers(_body_at_rest(start, equations, poses.pose)))
    return Problem(campaign, equations, start, base, poses.points)


def _body_at_rest(start: ArmState, equations: PoseEquations, pose: Array) -> Array:
    """The body when every joint is at zero, by all measured poses carried back by the nominal arm, (4, 4)."""
    carried = frames_of(predict(start, equations.seen, equations.layout).point_m.reshape(-1, 3, 3))
    each = invert(carried) @ pose
    u, _, vt = np.linalg.svd(each[:, :3, :3].mean(axis=0))
    return transform(u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt, np.median(each[:, :3, 3], axis=0))
