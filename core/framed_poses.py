"""Poses of the last link by a 6-D target on it: an instrument that measures where a target is and how it is turned.

How the target sits on the link comes from elsewhere than the pose that is judged: its place from the owner's statement
or the calibration's sweeps, if known, else, as always its turn, from the **other** poses as the calibrated arm has
them. A turn that is the same in all poses cannot show, as with a body of targets of which one place is known
(``core/body_poses.py``).
"""

import numpy as np

from core.calibrated_arm import CalibratedArm
from core.geometry import Array, invert
from core.link_poses import (
    LinkPoses,
    by_placement,
    carried,
    frames_of,
    known_places,
    mean_rotation,
    names_of,
    tool_on_link,
)
from core.measurements import Campaign
from core.rotations import nearest_rotations, vectors_of_rotations
from core.standstills import Standstills


def framed_target(seen: Standstills) -> tuple[int, np.ndarray]:
    """The 6-D target that most standstills show, by its column, and which show it, boolean (k,)."""
    framed = seen.framed
    column = int(np.argmax(framed.sum(axis=0))) if framed.size else 0
    return column, framed[:, column] if framed.size else np.zeros(len(seen.pose), dtype=bool)


def framed_poses(
    campaign: Campaign, arm: CalibratedArm, seen: Standstills, row: np.ndarray, column: int, sigma_rad: float | None
) -> LinkPoses:
    """The poses of the tool by one 6-D target.

    Args:
        campaign: tells what is known of the targets.
        arm: the calibrated arm.
        seen: standstills that show the target with its turn, two or more.
        row: what these standstills are called, (r,).
        column: of the target.
        sigma_rad: standard deviation of each component of its turn in one shot; None: the scatter between poses, which
            holds the arm's errors as well.
    """
    target = np.zeros((len(row), 4, 4))
    target[:, :3, :3], target[:, :3, 3] = seen.rotation[:, column], seen.points.point_m[:, column]
    target[:, 3, 3] = 1.0
    each = invert(frames_of(seen, arm)) @ target
    held, known = known_places(campaign, arm, seen)
    anchors = held & (np.arange(len(held)) == column)
    turns = vectors_of_rotations(each[:, :3, :3] @ mean_rotation(each[:, :3, :3]).T)
    spread = np.zeros((6, 6))
    spread[3:, 3:] = np.cov(turns.T) / len(row)
    placement = _of_the_others(each)
    if anchors.any():
        placement[:, :3, 3] = known[column, :3]
        spread[:3, :3] = np.diag(known[column, 3:] ** 2)
    else:
        spread[:3, :3] = np.cov(each[:, :3, 3].T) / len(row)
    tool, reference = tool_on_link(arm, placement)
    on_link = np.broadcast_to(tool, each.shape)
    pose = target @ invert(placement) @ tool
    variance = np.full(len(row), np.mean(turns**2))
    if sigma_rad is not None:
        variance = sigma_rad**2 / seen.turn_shots[:, column]
    own = np.zeros((len(row), 6, 6))
    own[:, :3, :3], own[:, 3:, 3:] = seen.points.covariance_m2[:, column], variance[:, None, None] * np.eye(3)
    return LinkPoses(
        row=row,
        reference=reference,
        on_link=on_link,
        pose=pose,
        own_covariance=carried(own, pose[:, :3, 3] - target[:, :3, 3]),
        shared=by_placement(pose, on_link, placement[:, :3, 3]),
        placement_covariance=spread,
        anchors=names_of(campaign, seen, anchors),
        free_turn=True,
    )


def _of_the_others(each: Array) -> Array:
    """For each of some poses the mean of all the others, (r, 4, 4)."""
    out = (each.sum(axis=0) - each) / (len(each) - 1)
    out[:, :3, :3] = nearest_rotations(out[:, :3, :3])
    out[:, 3] = [0.0, 0.0, 0.0, 1.0]
    return out
