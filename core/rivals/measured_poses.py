"""Measured poses of the end-effector for methods that fit full poses: three or more targets seen in one standstill."""

from dataclasses import dataclass, replace

import numpy as np

from core.errors import CampaignError
from core.geometry import Array
from core.measurements import Campaign
from core.rigid_pose import PointSets, can_be_placed, fit_body, fit_poses
from core.rivals.observed import UNSTATED_M
from core.standstills import standstills
from core.sweep_fits import active_from_zero


@dataclass(frozen=True)
class MeasuredPoses:
    """Poses of the body that the targets on the last link form; its origin is their middle."""

    pose: Array
    """From the body to the instrument's frame, (k, 4, 4)."""
    covariance: Array
    """Of shift and turn, by the noise of the points alone, (k, 6, 6)."""
    asked: Array
    """See ``Observations``, (k, n)."""
    points: int
    """How many points they rest on."""


def measured_poses(campaign: Campaign) -> MeasuredPoses:
    """The poses of all standstills that may be fitted and show three or more targets on the last link.

    The shape of the body follows from the poses themselves.

    Raises:
        CampaignError: there are fewer than three of them.
    """
    table = campaign.measurements
    fitted = np.where(table.check[:, None], np.nan, table.point_m)
    seen = standstills(replace(campaign, measurements=replace(table, point_m=fitted)), UNSTATED_M)
    there = seen.points.seen
    body = seen.points.point_m[int(np.argmax(there.sum(axis=1)))]
    keep = can_be_placed(np.nan_to_num(body), there)
    if keep.sum() < 3 or not there[keep].any(axis=0).all() or not np.isfinite(body).all():
        raise CampaignError(
            f"{int(keep.sum())} standstills show three or more targets on link {campaign.robot.joint_count} that are "
            "not on one line, expected at least 3, one of them with all targets, to fit full poses"
        )
    sets = PointSets(seen.points.point_m[keep], seen.points.covariance_m2[keep], there[keep])
    found = fit_poses(fit_body(body, sets), sets)
    asked = active_from_zero(campaign, seen.commanded[keep])
    return MeasuredPoses(found.transform, found.covariance, asked, int(there[keep].sum()))
