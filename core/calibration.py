"""The whole way, from measured points to a calibrated arm.

    campaign --> axes of all sweeps --> drives and couplings, joint by joint --> phi-model
                                             \\--> all points at once -----------> phi-model --> findings

The joint-by-joint estimate is what the paper does and claims; the refinement of all points at once is what the data
allow. Both are kept side by side.
"""

from dataclasses import dataclass, replace

import numpy as np

from core.errors import NotConverged
from core.estimate import ArmEstimate
from core.findings import Finding, findings
from core.geometry import Array, invert
from core.joint_by_joint import joint_by_joint
from core.measurements import Campaign
from core.phi_convention import Convention, convention_of
from core.phi_model import PhiModel, frames, from_axes
from core.refinement import Refinement, refine
from core.robot import Robot
from core.sweep_fits import SweepFits, fit_sweeps
from core.walk_from_base import SweepMotion

APART = (
    "targets were not at the same place on their links in all sweeps, as an arm with lost motion leaves them; "
    "each sweep was given places of its own, so that this does not bend the geometry"
)
"""What is to be said where a refinement is not tied."""


@dataclass(frozen=True)
class Rejection:
    """A point that was left out, and why."""

    record: int
    joint: int
    target: str
    residual_m: float
    """Distance from where the calibrated arm has it."""
    reason: str


@dataclass(frozen=True)
class Calibration:
    """Everything that a calibration found."""

    campaign: Campaign
    estimator: str
    convention: Convention | None
    nominal: PhiModel | None
    """The nominal phi-model; None where not every joint was swept."""
    found: SweepFits
    """The axis of every sweep."""
    motions: tuple[SweepMotion, ...]
    """What every sweep shows of its drive, from the refined axes."""
    joint_by_joint: ArmEstimate
    refinement: Refinement
    findings: tuple[Finding, ...]
    rejected: tuple[Rejection, ...]

    @property
    def estimate(self) -> ArmEstimate:
        """The best estimate: all points at once."""
        return self.refinement.estimate

    @property
    def not_swept(self) -> tuple[int, ...]:
        """Joints without a sweep, 1..n: nothing is known of their axes and drives."""
        n = self.campaign.robot.joint_count
        return tuple(j for j in range(1, n + 1) if j not in self.found.swept and j not in self.found.not_moved)

    @property
    def not_moved(self) -> tuple[int, ...]:
        """Joints whose sweeps never changed their command."""
        return tuple(j for j in self.found.not_moved if j not in self.found.swept)

    def robot(self) -> Robot:
        """The calibrated arm as a chain, each nominal link hung on the phi-frame that it belongs to."""
        return calibrated_robot(self.campaign.robot, self.convention, self.nominal, self.estimate)


def calibrate(campaign: Campaign, estimator: str = "likelihood", reject: bool = True) -> Calibration:
    """Calibrate an arm from single-axis sweeps.

    Args:
        campaign: what was measured, on which nominal robot.
        estimator: of the axes: ``likelihood`` or ``paper``.
        reject: leave out points that stand out.

    Raises:
        CampaignError: there are no usable sweeps, or other joints move in one.
        AxisUndefined: the points of a sweep cannot define its axis.
        NotConverged: an iteration did not end.
    """
    found = fit_sweeps(campaign, estimator, reject)
    convention, nominal = nominal_frames(campaign.robot, found)
    start, motions = joint_by_joint(campaign, found, convention, nominal, reject)
    refinement = refine(campaign, found, motions, start, convention, nominal, reject)
    return Calibration(
        campaign=campaign,
        estimator=estimator,
        convention=convention,
        nominal=nominal,
        found=found,
        motions=refinement.motions,
        joint_by_joint=start,
        refinement=refinement,
        findings=findings(campaign.robot, nominal, refinement.estimate),
        rejected=_rejections(campaign, refinement),
    )


def nominal_frames(robot: Robot, found: SweepFits) -> tuple[Convention | None, PhiModel | None]:
    """The frames of the phi-model and the nominal parameters in them; None unless every joint was swept."""
    if len(found.swept) < robot.joint_count or robot.joint_count < 2:
        return None, None
    lines = robot.axes_at_zero()
    convention = convention_of(robot)
    return convention, from_axes(lines, convention)[1]


def calibrated_robot(
    robot: Robot, convention: Convention | None, nominal: PhiModel | None, estimate: ArmEstimate
) -> Robot:
    """The nominal robot with calibrated geometry; its base frame is the phi-model's frame 1.

    Each link frame of the nominal chain, the tool's included, keeps its place in the phi-frame of its joint.

    Raises:
        NotConverged: the geometry is not known, because a joint was not swept.
    """
    if convention is None or nominal is None or estimate.geometry is None:
        raise NotConverged("the calibrated geometry needs a sweep of every joint")
    n = robot.joint_count
    base, _ = from_axes(robot.axes_at_zero(), convention)
    ideal = frames(nominal, np.zeros(n), base)
    actual = frames(estimate.geometry.model, np.zeros(n))
    own = _link_frames_at_rest(robot)
    # Frame i of the nominal chain, seen from phi-frame i: both turn with joint i about the same axis.
    hung = actual @ invert(ideal) @ own[:-1]
    tool = actual[-1] @ invert(ideal[-1]) @ own[-1]
    following = np.concatenate([hung[1:], tool[None]])
    return replace(robot, link_transforms=invert(hung) @ following, base_transform=hung[0], phi_rad=None)


def _link_frames_at_rest(robot: Robot) -> Array:
    """Frames 1..n and the tool at zero displacement in the base frame, (n + 1, 4, 4)."""
    frame, out = robot.base_transform, []
    for link in robot.link_transforms:
        out.append(frame)
        frame = frame @ link
    return np.stack([*out, frame])


def _rejections(campaign: Campaign, refinement: Refinement) -> tuple[Rejection, ...]:
    residuals, table = refinement.residuals, campaign.measurements
    return tuple(
        Rejection(
            record=int(table.record[residuals.row[k]]),
            joint=int(residuals.joint[k]),
            target=campaign.targets[table.target[residuals.row[k]]].name,
            residual_m=float(np.linalg.norm(residuals.residual_m[k])),
            reason="stands out of the scatter of its sweep: less than one chance in a thousand that noise does this",
        )
        for k in np.flatnonzero(~residuals.used & residuals.knowable)
    )
