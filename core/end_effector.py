"""Where the end-effector really was: measured poses of its tool, by whatever was seen of the last link.

    three or more targets, not on one line     the whole pose                      core/body_poses.py
    a 6-D target                               the whole pose                      core/framed_poses.py
    fewer targets                              a place only, that of the targets   core/point_places.py

A 6-D target is taken rather than a body of targets, unless the places of three of these are known: then nothing of the
body is left to be taken from other poses.
"""

from dataclasses import dataclass, replace

import numpy as np

from core.body_poses import Body, body_of, body_poses, enlarged
from core.calibrated_arm import CalibratedArm
from core.errors import CampaignError
from core.framed_poses import framed_poses, framed_target
from core.geometry import Array
from core.link_poses import TARGETS, TOOL, LinkPoses, as_the_arm_has_them, known_places
from core.measurements import Campaign
from core.point_places import point_places
from core.rigid_pose import PointSets, can_be_placed
from core.standstills import Standstills, standstills


@dataclass(frozen=True)
class EndEffector:
    """Measured poses of a reference frame on the last link."""

    seen: Standstills
    """The standstills that show it."""
    skipped: tuple[int, ...]
    """Poses that show too little."""
    reference: tuple[str, ...]
    """Whose position each is: ``tool``, or ``targets`` for the middle of the targets, (k,)."""
    on_link: Array
    """From the reference frame to the frame of the last link, (k, 4, 4)."""
    pose: Array
    """From the reference frame to the instrument's frame, (k, 4, 4); a rotation is NaN where only a place was seen."""
    own_covariance: Array
    """Of its shift and turn, by the noise of this pose, (k, 6, 6), m and rad, in the instrument's frame."""
    shared: Array
    """How shift and turn follow from an error in the targets' placement, (k, 6, q)."""
    placement_covariance: Array
    """Of that placement on the link, the same for all poses, (q, q)."""
    anchors: tuple[str, ...]
    """Targets whose place on the link is known."""
    free_turn: bool
    """Whether a turn of the link that is the same in all poses cannot show."""
    framed: str
    """The 6-D target by which turns were measured; empty: none."""
    framed_sigma_rad: float | None
    """Standard deviation of each component of its turn; None: not known, and taken from the scatter between poses."""
    noise_factor: float
    """By which the stated covariances were enlarged, because the targets scatter by more."""
    suspects: tuple[int, ...]
    """Poses whose points do not fit the body's shape: less than one chance in a thousand."""

    @property
    def turned(self) -> np.ndarray:
        """Of which poses the turn was measured, boolean, (k,)."""
        return np.isfinite(self.pose[:, 0, 0])

    @property
    def covariance(self) -> Array:
        """Of shift and turn, everything together, (k, 6, 6)."""
        return self.own_covariance + self.shared @ self.placement_covariance @ np.swapaxes(self.shared, 1, 2)

    def some(self, keep: np.ndarray) -> "EndEffector":
        """Some of the poses, by index or flag; what is known of the targets stays."""
        chosen = np.arange(len(self.pose))[keep]
        return replace(
            self,
            seen=self.seen.some(keep),
            reference=tuple(self.reference[k] for k in chosen),
            on_link=self.on_link[keep],
            pose=self.pose[keep],
            own_covariance=self.own_covariance[keep],
            shared=self.shared[keep],
        )


@dataclass(frozen=True)
class _Split:
    """Which standstills are judged by what, indices each."""

    body: np.ndarray
    framed: np.ndarray
    column: int
    """Of the 6-D target."""
    single: np.ndarray


def measured_poses(campaign: Campaign, arm: CalibratedArm) -> EndEffector:
    """The measured poses of the tool, or places of targets where no more was seen.

    Raises:
        CampaignError: nothing of the last link was seen of which it can be told where it sits, or a single pose shows
            three targets and it is not known how they sit.
    """
    records = standstills(campaign, arm.noise_m)
    carried = as_the_arm_has_them(records, arm)
    roughly = np.stack([np.median(carried[records.points.seen[:, j], j], axis=0) for j in range(len(records.target))])
    split = _split(campaign, arm, records, roughly)
    body = Body(roughly, 1.0, ())
    if len(split.body):
        own = _selected(records, split.body)
        body = body_of(roughly[np.isin(records.target, own.target)], own)
    records = enlarged(records, body.factor)
    sigma_rad = _framed_sigma(campaign, records)
    parts = []
    if len(split.body):
        parts.append(body_poses(campaign, arm, _selected(records, split.body), split.body, body))
    if len(split.framed):
        parts.append(framed_poses(campaign, arm, records.some(split.framed), split.framed, split.column, sigma_rad))
    parts.append(point_places(campaign, arm, records, split.single))
    framed = campaign.targets[records.target[split.column]].name if len(split.framed) else ""
    return _joined(records, [part for part in parts if len(part.row)], body, framed, sigma_rad)


def _split(campaign: Campaign, arm: CalibratedArm, records: Standstills, roughly: Array) -> _Split:
    seen = records.points.seen
    held, _ = known_places(campaign, arm, records)
    column, framed = framed_target(records)
    if framed.sum() < 2:
        framed = np.zeros(len(seen), dtype=bool)
    placed = can_be_placed(roughly, seen)
    framed = framed & ~can_be_placed(roughly, seen & held)
    placed = placed & ~framed
    return _Split(np.flatnonzero(placed), np.flatnonzero(framed), column, np.flatnonzero(~placed & ~framed))


def _framed_sigma(campaign: Campaign, records: Standstills) -> float | None:
    """Standard deviation of a component of a 6-D target's turn: as stated, or as repeated shots have it."""
    return (
        campaign.instrument.turn_sigma_rad if campaign.instrument.turn_sigma_rad is not None else records.turn_sigma_rad
    )


def _selected(records: Standstills, keep: np.ndarray) -> Standstills:
    """Some of the standstills, with the targets that these show."""
    kept = records.some(keep)
    points, shown = kept.points, kept.points.seen.any(axis=0)
    chosen = PointSets(points.point_m[:, shown], points.covariance_m2[:, shown], points.seen[:, shown])
    return replace(
        kept,
        target=kept.target[shown],
        points=chosen,
        rotation=kept.rotation[:, shown],
        turn_shots=kept.turn_shots[:, shown],
    )


def _joined(
    records: Standstills, parts: list[LinkPoses], body: Body, framed: str, sigma_rad: float | None
) -> EndEffector:
    """All kinds of evidence as one, in the order of the standstills; placements of different kinds are independent."""
    if not parts:
        raise CampaignError(
            "no pose shows three or more targets on the last link that are not on one line, a 6-D target, or a target "
            "of which it is known or seen elsewhere where it sits"
        )
    row = np.concatenate([part.row for part in parts])
    order = np.argsort(row)
    widths = [part.placement_covariance.shape[0] for part in parts]
    ends = np.cumsum(widths)
    shared, placement = np.zeros((len(row), 6, ends[-1])), np.zeros((ends[-1], ends[-1]))
    starts = np.cumsum([0, *(len(part.row) for part in parts)])
    for k, part in enumerate(parts):
        own = slice(ends[k] - widths[k], ends[k])
        shared[starts[k] : starts[k + 1], :, own] = part.shared
        placement[own, own] = part.placement_covariance
    reference = [part.reference for part in parts for _ in part.row]
    return EndEffector(
        seen=_selected(records, row[order]),
        skipped=tuple(int(p) for p in np.delete(records.pose, row)),
        reference=tuple(reference[k] for k in order),
        on_link=np.concatenate([part.on_link for part in parts])[order],
        pose=np.concatenate([part.pose for part in parts])[order],
        own_covariance=np.concatenate([part.own_covariance for part in parts])[order],
        shared=shared[order],
        placement_covariance=placement,
        anchors=tuple(dict.fromkeys(name for part in parts for name in part.anchors)),
        free_turn=any(part.free_turn for part in parts),
        framed=framed,
        framed_sigma_rad=sigma_rad,
        noise_factor=body.factor,
        suspects=body.suspects,
    )


def judged_points(measured: EndEffector) -> str:
    """Whose position was judged, in words."""
    kinds = set(measured.reference)
    words = {TOOL: "origin of the tool", TARGETS: "middle of the targets"}
    return " or ".join(words[kind] for kind in (TOOL, TARGETS) if kind in kinds)
