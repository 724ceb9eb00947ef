"""Where the last link was at some standstills, by one kind of evidence; and what all kinds have in common."""

from dataclasses import dataclass

import numpy as np

from core.calibrated_arm import CalibratedArm
from core.geometry import Array, apply, invert, skew, transform
from core.kinematics import link_frames
from core.measurements import Campaign
from core.rotations import nearest_rotations
from core.standstills import Standstills

TOOL, TARGETS = "tool", "targets"
"""Whose place is judged: the tool's, or that of targets where the robot has no tool or its turn is not seen."""


@dataclass(frozen=True)
class LinkPoses:
    """Measured poses of a reference on the last link, a row a standstill."""

    row: np.ndarray
    """Of the standstills, (r,)."""
    reference: str
    """``tool`` or ``targets``."""
    on_link: Array
    """From the reference frame to the frame of the last link, (r, 4, 4)."""
    pose: Array
    """From the reference frame to the instrument's frame, (r, 4, 4); its rotation is NaN where none was measured."""
    own_covariance: Array
    """Of its shift and turn, by the noise of this standstill, (r, 6, 6), m and rad, in the instrument's frame."""
    shared: Array
    """How shift and turn follow from an error of the placement on the link, (r, 6, q)."""
    placement_covariance: Array
    """Of that placement, the same for all rows, (q, q)."""
    anchors: tuple[str, ...]
    """Targets that were used and whose place on the link is known."""
    free_turn: bool
    """Whether a turn of the link that is the same in all poses cannot show."""


def frames_of(records: Standstills, arm: CalibratedArm) -> Array:
    """Where the calibrated arm has the last link, from its frame to the instrument's, (k, 4, 4)."""
    return arm.base @ link_frames(arm.robot, arm.drives.net(records.commanded))[:, -2]


def as_the_arm_has_them(records: Standstills, arm: CalibratedArm) -> Array:
    """The measured points carried into the frame of the last link by the calibrated arm, (k, j, 3)."""
    return apply(invert(frames_of(records, arm))[:, None], records.points.point_m)


def known_places(campaign: Campaign, arm: CalibratedArm, seen: Standstills) -> tuple[np.ndarray, Array]:
    """Which targets have a known place, (j,), and what is known of each: place on the link and its std, (j, 6).

    The owner's statement (``xyz_mm``) or what the calibration's sweeps found, whichever is more certain.
    """
    at_rest = arm.base @ link_frames(arm.robot, np.zeros((1, arm.robot.joint_count)))[0, -2]
    swept = {target.name: target for target in arm.targets if target.link == arm.robot.joint_count}
    known = np.full((len(seen.target), 6), np.nan)
    for row, index in enumerate(seen.target):
        target = campaign.targets[index]
        found, std = swept.get(target.name), np.full(3, np.inf)
        if found is not None:
            std = np.nan_to_num(found.std_m)
            known[row] = [*apply(invert(at_rest), found.point_m), *std]
        if target.point_m is not None and target.sigma_m < np.sqrt(np.mean(std**2)):
            known[row] = [*target.point_m, *[target.sigma_m] * 3]
    return np.isfinite(known[:, 0]), known


def tool_on_link(arm: CalibratedArm, placement: Array) -> tuple[Array, str]:
    """The frame whose pose is judged, seen from the last link, (4, 4), and what it is.

    Args:
        arm: tells whether the robot has a tool.
        placement: of the targets on the link, (r, 4, 4): without a tool their middle is judged.
    """
    tool = arm.nominal.link_transforms[-1]
    if not np.array_equal(tool, np.eye(4)):
        return tool, TOOL
    return transform(np.eye(3), placement[:, :3, 3].mean(axis=0)), TARGETS


def names_of(campaign: Campaign, seen: Standstills, chosen: np.ndarray) -> tuple[str, ...]:
    """Names of some of the targets, boolean (j,)."""
    return tuple(campaign.targets[t].name for t, held in zip(seen.target, chosen, strict=True) if held)


def carried(covariance: Array, lever_m: Array) -> Array:
    """Covariance of the shift of a point a lever away, and of the turn, (r, 6, 6)."""
    carry = np.broadcast_to(np.eye(6), covariance.shape).copy()
    carry[:, :3, 3:] = -skew(lever_m)
    return carry @ covariance @ np.swapaxes(carry, 1, 2)


def by_placement(pose: Array, on_link: Array, centre: Array) -> Array:
    """Shift and turn of the reference frame for an error of the placement on the link, (r, 6, 6).

    If the targets really sit shifted by t and turned by w about the centre, (r, 3), the reference is off by the
    opposite.
    """
    rotation = pose[:, :3, :3] @ np.swapaxes(on_link[:, :3, :3], 1, 2)
    out = np.zeros((len(pose), 6, 6))
    out[:, :3, :3] = out[:, 3:, 3:] = -rotation
    out[:, :3, 3:] = rotation @ skew(on_link[:, :3, 3] - centre)
    return out


def mean_rotation(rotations: Array) -> Array:
    """The rotation nearest to the mean of some (r, 3, 3), (3, 3)."""
    return nearest_rotations(rotations.mean(axis=0)[None])[0]
