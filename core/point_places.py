"""Where the last link was, by fewer than three targets on it: a place and no turn.

What is judged is the middle of the targets that were seen, those of known place if there are any; else each target sits
where the **other** standstills have it on the link, which hides errors that are the same in all of them.
"""

import numpy as np

from core.calibrated_arm import CalibratedArm
from core.geometry import Array
from core.link_poses import TARGETS, LinkPoses, as_the_arm_has_them, frames_of, known_places, names_of
from core.measurements import Campaign
from core.standstills import Standstills


def point_places(campaign: Campaign, arm: CalibratedArm, seen: Standstills, row: np.ndarray) -> LinkPoses:
    """Places of targets at some of the standstills, those of which it can be told where a target of theirs sits.

    Args:
        campaign: tells what is known of the targets.
        arm: the calibrated arm.
        seen: all standstills, also those that are judged by better evidence: they tell where targets sit.
        row: which of them are judged here, (r,).
    """
    on_link, spread, usable = _sites(campaign, arm, seen)
    held, _ = known_places(campaign, arm, seen)
    used = usable[row]
    best = used & held
    used = np.where(best.any(axis=1)[:, None], best, used)
    row, used = row[used.any(axis=1)], used[used.any(axis=1)]
    weight = used / used.sum(axis=1, keepdims=True)
    count = len(row)
    frame, pose = np.tile(np.eye(4), (count, 1, 1)), np.tile(np.eye(4), (count, 1, 1))
    frame[:, :3, 3] = np.einsum("rj,rja->ra", weight, np.where(used[..., None], on_link[row], 0.0))
    pose[:, :3, 3] = np.einsum("rj,rja->ra", weight, np.where(used[..., None], seen.points.point_m[row], 0.0))
    pose[:, :3, :3] = np.nan
    own = np.full((count, 6, 6), np.nan)
    covariance = np.where(used[..., None, None], seen.points.covariance_m2[row], 0.0)
    own[:, :3, :3] = np.einsum("rj,rjab->rab", weight**2, covariance)
    shared = np.zeros((count, 6, 3))
    shared[:, :3] = -frames_of(seen.some(row), arm)[:, :3, :3]
    sited = np.where(used[..., None, None], spread[None], 0.0)
    placement = np.einsum("rj,rjab->rab", weight**2, sited).mean(axis=0) if count else np.zeros((3, 3))
    return LinkPoses(
        row=row,
        reference=TARGETS,
        on_link=frame,
        pose=pose,
        own_covariance=own,
        shared=shared,
        placement_covariance=placement,
        anchors=names_of(campaign, seen, (used & held).any(axis=0)),
        free_turn=False,
    )


def _sites(campaign: Campaign, arm: CalibratedArm, seen: Standstills) -> tuple[Array, Array, np.ndarray]:
    """Where targets sit on the link.

    Returns:
        Place of each target for each standstill, (k, j, 3); its covariance, (j, 3, 3); where it can be told, (k, j).
    """
    there = np.where(seen.points.seen[..., None], as_the_arm_has_them(seen, arm), 0.0)
    count = seen.points.seen.sum(axis=0)
    held, known = known_places(campaign, arm, seen)
    others = (there.sum(axis=0) - there) / np.maximum(count - 1, 1)[:, None]
    place = np.where(held[:, None], known[:, :3], others)
    spread = np.zeros((len(count), 3, 3))
    for j in range(len(count)):
        if held[j]:
            spread[j] = np.diag(known[j, 3:] ** 2)
        elif count[j] > 1:
            spread[j] = np.cov(there[seen.points.seen[:, j], j].T) / count[j]
    return place, spread, seen.points.seen & (held | (count > 1))
