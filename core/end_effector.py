"""Where the end-effector really was: measured poses of its tool, by three or more targets on it.

What is seen is a body of targets; what is asked for is the tool. How the body sits on the last link has to come from
somewhere, and not from the poses that are to be judged: a body fitted to all of them would take every constant error of
the arm for a place of the body, and hide it. So, in this order:

1. The **shape** of the body (how its targets stand to each other) follows from the pose records alone, without any
   model of the arm (generalised Procrustes, ``core/rigid_pose.py``).
2. Targets of which it is known where they sit on the link are the body's **anchors** and held there: by the owner's
   statement (``xyz_mm``) or by the calibration's sweeps (at the paper's campaign: T1), whichever is more certain.
   Three of them place the body altogether.
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
from core.geometry import Array, apply, invert, skew, transform
from core.kinematics import link_frames
from core.measurements import Campaign
from core.rigid_pose import PointSets, RigidPoses, can_be_placed, fit_body, fit_poses
from core.rotations import vectors_of_rotations
from core.standstills import Standstills, standstills

FEWEST_FREEDOMS = 10
"""With fewer degrees of freedom the scatter of the targets says nothing about the stated covariance."""
UNLIKELY = 1e-3
"""A pose stands out where its points have less chance than this, times the number of poses."""
BEYOND_CHANCE = 0.01
"""Scatter that has less chance than this enlarges the stated covariance."""
ANCHORED = 1e-6
"""Weight of what the poses say against what the anchors say."""


@dataclass(frozen=True)
class EndEffector:
    """Measured poses of a reference frame on the last link."""

    seen: Standstills
    """The standstills that show it: three or more targets, not on one line."""
    skipped: tuple[int, ...]
    """Poses that show too little."""
    reference: str
    """Whose position it is: ``tool``, or ``targets`` for the middle of the targets."""
    on_link: Array
    """From the reference frame to the frame of the last link, (4, 4)."""
    pose: Array
    """From the reference frame to the instrument's frame, (k, 4, 4)."""
    own_covariance: Array
    """Of its shift and turn, by the noise of this pose's points, (k, 6, 6), m and rad, in the instrument's frame."""
    shared: Array
    """How shift and turn follow from an error in the body's placement, (k, 6, 6)."""
    placement_covariance: Array
    """Of that placement on the link, the same for all poses, (6, 6)."""
    anchors: tuple[str, ...]
    """Targets whose place on the link is known."""
    free_turn: bool
    """Whether anchors leave something free, which the other poses then tell."""
    noise_factor: float
    """By which the stated covariances were enlarged, because the targets scatter by more."""
    suspects: tuple[int, ...]
    """Poses whose points do not fit the body's shape: less than one chance in a thousand."""

    @property
    def covariance(self) -> Array:
        """Of shift and turn, everything together, (k, 6, 6)."""
        return self.own_covariance + self.shared @ self.placement_covariance @ np.swapaxes(self.shared, 1, 2)

    def some(self, keep: np.ndarray) -> "EndEffector":
        """Some of the poses, by index or flag; what is known of the body stays."""
        return replace(
            self,
            seen=self.seen.some(keep),
            pose=self.pose[keep],
            own_covariance=self.own_covariance[keep],
            shared=self.shared[keep],
        )


def measured_poses(campaign: Campaign, arm: CalibratedArm) -> EndEffector:
    """The measured poses of the tool (or, for a robot without one, of the middle of its targets).

    Raises:
        CampaignError: no pose shows three targets that are not on one line, or a single one does and it is not known
            how they sit.
    """
    records = standstills(campaign, arm.noise_m)
    on_link = _as_the_arm_has_them(records, arm)
    body = np.stack([np.median(on_link[records.points.seen[:, j], j], axis=0) for j in range(len(records.target))])
    placed = can_be_placed(body, records.points.seen)
    if not placed.any():
        raise CampaignError("no pose shows three or more targets on the last link that are not on one line")
    seen = _selected(records, placed)
    body = fit_body(body[np.isin(records.target, seen.target)], seen.points)
    factor, seen, suspects = _judged(body, seen)
    rigid = fit_poses(body, seen.points)
    anchors, known = _anchors(campaign, arm, seen)
    frames = arm.base @ link_frames(arm.robot, arm.drives.net(seen.commanded))[:, -2]
    each = invert(frames) @ rigid.transform
    placement, spread = _placements(body, each, anchors, known)
    tool, reference = _reference(arm, placement)
    to_reference = invert(placement) @ tool
    pose = rigid.transform @ to_reference
    own = _carried(rigid.covariance, pose[:, :3, 3] - rigid.transform[:, :3, 3])
    names = tuple(campaign.targets[t].name for t, held in zip(seen.target, anchors, strict=True) if held)
    return EndEffector(
        seen=seen,
        skipped=tuple(int(p) for p in records.pose[~placed]),
        reference=reference,
        on_link=tool,
        pose=pose,
        own_covariance=own,
        shared=_by_placement(pose, tool, _centre(body, placement, anchors)),
        placement_covariance=spread,
        anchors=names,
        free_turn=not can_be_placed(body, anchors[None])[0],
        noise_factor=factor,
        suspects=suspects,
    )


def _as_the_arm_has_them(records: Standstills, arm: CalibratedArm) -> Array:
    """The measured points carried into the frame of the last link by the calibrated arm, (k, j, 3)."""
    frames = arm.base @ link_frames(arm.robot, arm.drives.net(records.commanded))[:, -2]
    return apply(invert(frames)[:, None], records.points.point_m)


def _selected(records: Standstills, keep: np.ndarray) -> Standstills:
    """Some of the standstills, with the targets that these show."""
    kept = records.some(keep)
    points, shown = kept.points, kept.points.seen.any(axis=0)
    chosen = PointSets(points.point_m[:, shown], points.covariance_m2[:, shown], points.seen[:, shown])
    return replace(kept, target=kept.target[shown], points=chosen)


def _judged(body: Array, seen: Standstills) -> tuple[float, Standstills, tuple[int, ...]]:
    """Stated covariances enlarged where the targets scatter by more, and poses that stand out even then."""
    found = fit_poses(body, seen.points)
    # Finding the shape has cost as many freedoms as it has: three a target but for a rigid motion.
    freedoms = int(found.degrees_of_freedom.sum()) - (3 * len(body) - 6)
    worst = _gross(found)
    factor = 1.0
    total, extra = found.chi_square.sum() - found.chi_square[worst].sum(), found.degrees_of_freedom[worst].sum()
    if freedoms - extra >= FEWEST_FREEDOMS and chdtrc(freedoms - extra, total) < BEYOND_CHANCE:
        factor = float(np.sqrt(total / (freedoms - extra)))
    points = replace(seen.points, covariance_m2=seen.points.covariance_m2 * factor**2)
    chance = chdtrc(found.degrees_of_freedom, found.chi_square / factor**2) * len(seen.pose)
    return factor, replace(seen, points=points), tuple(int(p) for p in seen.pose[chance < UNLIKELY])


def _gross(found: RigidPoses) -> np.ndarray:
    """Rows of poses that stand out, a fifth of all at most, so that a few gross errors do not count as noise."""
    chance = chdtrc(found.degrees_of_freedom, found.chi_square)
    worst = np.argsort(chance)[: len(chance) // 5]
    return worst[chance[worst] * len(chance) < UNLIKELY]


def _anchors(campaign: Campaign, arm: CalibratedArm, seen: Standstills) -> tuple[np.ndarray, Array]:
    """Which targets have a known place, (j,), and what is known of each: place on the link and its std, (j, 6)."""
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
        return _carried(fitted.covariance, fitted.transform[:, :3, :3] @ middle)[0]
    turns = vectors_of_rotations(each[:, :3, :3] @ _mean_rotation(each).T)
    out = np.zeros((6, 6))
    out[3:, 3:] = np.cov(turns.T) / len(each)
    if anchors.any():
        out[:3, :3] = np.diag((known[anchors, 3:] ** 2).mean(axis=0) / anchors.sum())
    else:
        out[:3, :3] = np.cov((each[:, :3, 3] - mean[:3, 3]).T) / len(each)
    return out


def _mean_rotation(each: Array) -> Array:
    """The rotation nearest to the mean of some, (3, 3)."""
    u, _, vt = np.linalg.svd(each[:, :3, :3].mean(axis=0))
    return u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt


def _centre(body: Array, placement: Array, anchors: np.ndarray) -> Array:
    """The point on the link about which the placement is uncertain by a turn, for each pose, (k, 3)."""
    return apply(placement, body[anchors].mean(axis=0) if anchors.any() else np.zeros(3))


def _reference(arm: CalibratedArm, placement: Array) -> tuple[Array, str]:
    """The frame whose pose is judged, seen from the last link, and what it is."""
    tool = arm.nominal.link_transforms[-1]
    if not np.array_equal(tool, np.eye(4)):
        return tool, "tool"
    return transform(np.eye(3), placement[:, :3, 3].mean(axis=0)), "targets"


def _carried(covariance: Array, lever_m: Array) -> Array:
    """Covariance of the shift of a point a lever away, and of the turn, (k, 6, 6)."""
    carry = np.broadcast_to(np.eye(6), covariance.shape).copy()
    carry[:, :3, 3:] = -skew(lever_m)
    return carry @ covariance @ np.swapaxes(carry, 1, 2)


def _by_placement(pose: Array, tool: Array, centre: Array) -> Array:
    """Shift and turn of the reference frame for an error of the body's placement on the link, (k, 6, 6).

    If the body really sits shifted by t and turned by w about the centre, the tool is off by the opposite.
    """
    rotation = pose[:, :3, :3] @ tool[:3, :3].T
    out = np.zeros((len(pose), 6, 6))
    out[:, :3, :3] = out[:, 3:, 3:] = -rotation
    out[:, :3, 3:] = rotation @ skew(tool[:3, 3] - centre)
    return out
