"""Poses of the last link by three or more targets on it, which are a rigid body.

How the body sits on the link has to come from somewhere, and not from the poses that are to be judged: a body fitted to
all of them would take every constant error of the arm for a place of the body, and hide it. So, in this order:

1. The **shape** of the body (how its targets stand to each other) follows from the pose records alone, without any
   model of the arm (generalised Procrustes, ``core/rigid_pose.py``).
2. Targets of which it is known where they sit on the link are the body's **anchors** and held there. Three of them
   place the body altogether.
3. What anchors leave free (with one: a turn about it) is taken for each pose from the **other** poses, as the
   calibrated arm has them: leave-one-out, so that no pose is judged by a body that was fitted to it.

The same body, so placed, judges both the nominal and the calibrated arm. Where step 3 is needed, the tool is fixed to
its targets rather than to the last axis: an error of that axis's direction turns the tool by the same in every pose,
and no target can show it. Such a constant turn is left out of the errors and of their uncertainty; ``free_turn`` tells.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from core.calibrated_arm import CalibratedArm
from core.errors import CampaignError
from core.geometry import Array, apply, invert
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
from core.rigid_pose import PointSets, RigidPoses, can_be_placed, fit_body, fit_poses
from core.rotations import vectors_of_rotations
from core.standstills import Standstills

FEWEST_FREEDOMS = 10
"""With fewer degrees of freedom the scatter of the targets says nothing about the stated covariance."""
UNLIKELY = 1e-3
"""A pose stands out where its points have less chance than this, times the number of poses."""
BEYOND_CHANCE = 0.01
"""Scatter that has less chance than this enlarges the stated covariance."""
ANCHORED = 1e-6
"""Weight of what the poses say against what the anchors say."""


@dataclass(frozen=True)
class Body:
    """Targets on the last link as one rigid body."""

    shape_m: Array
    """Places of its targets about their middle, (j, 3)."""
    factor: float
    """By which stated covariances have to be enlarged, because the targets scatter by more."""
    suspects: tuple[int, ...]
    """Poses whose points do not fit the shape: less than one chance in a thousand."""


def body_of(roughly_m: Array, seen: Standstills) -> Body:
    """The body that standstills show, each of which fixes its pose; roughly the places of its targets are (j, 3)."""
    shape = fit_body(roughly_m, seen.points)
    return Body(shape, *_scatter(shape, seen))


def body_poses(campaign: Campaign, arm: CalibratedArm, seen: Standstills, row: np.ndarray, body: Body) -> LinkPoses:
    """The poses of the tool by the body.

    Args:
        campaign: tells what is known of the targets.
        arm: the calibrated arm.
        seen: standstills with their covariances enlarged as the body says, and no other targets than its own.
        row: what these standstills are called, (r,).
        body: of the targets.

    Raises:
        CampaignError: there is a single one, and it is not known how the targets sit.
    """
    rigid = fit_poses(body.shape_m, seen.points)
    anchors, known = known_places(campaign, arm, seen)
    each = invert(frames_of(seen, arm)) @ rigid.transform
    placement, spread = _placements(body.shape_m, each, anchors, known)
    tool, reference = tool_on_link(arm, placement)
    on_link = np.broadcast_to(tool, each.shape)
    pose = rigid.transform @ invert(placement) @ tool
    return LinkPoses(
        row=row,
        reference=reference,
        on_link=on_link,
        pose=pose,
        own_covariance=carried(rigid.covariance, pose[:, :3, 3] - rigid.transform[:, :3, 3]),
        shared=by_placement(pose, on_link, _centre(body.shape_m, placement, anchors)),
        placement_covariance=spread,
        anchors=names_of(campaign, seen, anchors),
        free_turn=not can_be_placed(body.shape_m, anchors[None])[0],
    )


def _scatter(shape: Array, seen: Standstills) -> tuple[float, tuple[int, ...]]:
    """By how much stated covariances are too small, and poses that stand out even then."""
    found = fit_poses(shape, seen.points)
    # Finding the shape has cost as many freedoms as it has: three a target but for a rigid motion.
    freedoms = int(found.degrees_of_freedom.sum()) - (3 * len(shape) - 6)
    worst = _gross(found)
    factor = 1.0
    total, extra = found.chi_square.sum() - found.chi_square[worst].sum(), found.degrees_of_freedom[worst].sum()
    if freedoms - extra >= FEWEST_FREEDOMS and chdtrc(freedoms - extra, total) < BEYOND_CHANCE:
        factor = float(np.sqrt(total / (freedoms - extra)))
    chance = chdtrc(found.degrees_of_freedom, found.chi_square / factor**2) * len(seen.pose)
    return factor, tuple(int(p) for p in seen.pose[chance < UNLIKELY])


def enlarged(seen: Standstills, factor: float) -> Standstills:
    """The same with standard deviations that many times as large."""
    points = replace(seen.points, covariance_m2=seen.points.covariance_m2 * factor**2)
    return replace(seen, points=points)


def _gross(found: RigidPoses) -> np.ndarray:
    """Rows of poses that stand out, a fifth of all at most, so that a few gross errors do not count as noise."""
    chance = chdtrc(found.degrees_of_freedom, found.chi_square)
    worst = np.argsort(chance)[: len(chance) // 5]
    return worst[chance[worst] * len(chance) < UNLIKELY]


def _placements(body: Array, each: Array, anchors: np.ndarray, known: Array) -> tuple[Array, Array]:
    """Where the body sits on the link, and how uncertain that is.

    Returns:
        From the body to the link, for each pose by what the anchors and the other poses say, (k, 4, 4); covariance of a
        shift of the anchors' middle (the body's, without any) and of a turn about it, (6, 6).
    """
    count = len(each)
    held = np.flatnonzero(anchors)
    whole = bool(can_be_placed(body, anchors[None])[0])
    if count == 1 and not whole:
        raise CampaignError(
            "one pose alone shows three targets, and the calibration does not know the places of three of them: "
            "how they sit cannot be told from how the arm stands"
        )
    places = apply(each[:, None], body[None])
    others = places if whole else (places.sum(axis=0) - places) / (count - 1)
    goal = np.where(anchors[:, None], known[:, :3], others)
    weight = np.where(anchors, 1.0, 0.0 if whole else ANCHORED) if len(held) else np.ones(len(body))
    # One covariance stands for a weight; an anchor is held, the others turn the body about it.
    spread = np.eye(3) / np.maximum(weight, 1e-12)[:, None, None] * 1e-6
    seen = np.broadcast_to(weight > 0, (count, len(body)))
    placement = fit_poses(body, PointSets(goal, np.broadcast_to(spread, (*goal.shape, 3)), seen)).transform
    return placement, _placement_covariance(body, each, anchors, known, whole)


def _placement_covariance(body: Array, each: Array, anchors: np.ndarray, known: Array, whole: bool) -> Array:
    mean = each.mean(axis=0)
    if whole:
        spread = known[anchors, 3:, None] ** 2 * np.eye(3)
        fitted = fit_poses(
            body[anchors],
            PointSets(
                known[None, anchors, :3], spread[None] + 1e-18 * np.eye(3), np.ones((1, anchors.sum()), dtype=bool)
            ),
        )
        middle = body[anchors].mean(axis=0)
        return carried(fitted.covariance, fitted.transform[:, :3, :3] @ middle)[0]
    turns = vectors_of_rotations(each[:, :3, :3] @ mean_rotation(each[:, :3, :3]).T)
    out = np.zeros((6, 6))
    out[3:, 3:] = np.cov(turns.T) / len(each)
    if anchors.any():
        out[:3, :3] = np.diag((known[anchors, 3:] ** 2).mean(axis=0) / anchors.sum())
    else:
        out[:3, :3] = np.cov((each[:, :3, 3] - mean[:3, 3]).T) / len(each)
    return out


def _centre(body: Array, placement: Array, anchors: np.ndarray) -> Array:
    """The point on the link about which the placement is uncertain by a turn, for each pose, (k, 3)."""
    return apply(placement, body[anchors].mean(axis=0) if anchors.any() else np.zeros(3))
