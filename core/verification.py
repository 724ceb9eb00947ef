"""How far the nominal and the calibrated arm miss poses that no fit has seen (figures 9 and 10).

For every pose record that shows three or more targets on the end-effector, or a 6-D target, the measured pose of the
tool (``core/end_effector.py``) is compared with the pose that each model predicts for the same commands:

    position error     the distance between measured and predicted origin of the tool
    orientation error  the angle of the rotation from the predicted to the measured tool

A record that shows fewer targets has a position error alone, that of the middle of its targets.

Both models stand on the same base: the robot's base frame as the calibration has it in the instrument's frame, by the
rule of section 4 about the first axes. Errors contain what the arm does differently on every visit (its repeatability)
and what the instrument adds; the standard uncertainties are those of the measured poses alone.
"""

from dataclasses import dataclass

import numpy as np

from core.calibrated_arm import CalibratedArm
from core.end_effector import EndEffector, measured_poses
from core.errors import CampaignError
from core.geometry import Array
from core.kinematics import link_frames, nominal_net
from core.measurements import Campaign
from core.robot import Robot
from core.rotations import vectors_of_rotations
from core.wording import is_simulated

COVERAGE = 2.0
"""Standard uncertainties that a verdict leaves on either side of a limit (ISO 14253-1 with k = 2)."""


@dataclass(frozen=True)
class Errors:
    """Sizes of errors, a number a pose, and what is uncertain about them; statistics of none are NaN."""

    value: Array
    """(k,), m or rad; NaN where it was not measured."""
    std: Array
    """Standard uncertainty of each, (k,)."""
    mean_std: float
    """Standard uncertainty of their mean; what poses share does not average out."""

    @property
    def known(self) -> Array:
        """Those that were measured, (count,)."""
        return self.value[np.isfinite(self.value)]

    @property
    def count(self) -> int:
        return len(self.known)

    @property
    def mean(self) -> float:
        return float(np.mean(self.known)) if self.count else np.nan

    @property
    def rms(self) -> float:
        return float(np.sqrt(np.mean(self.known**2))) if self.count else np.nan

    @property
    def p95(self) -> float:
        """The size that 95 of 100 errors do not exceed, by linear interpolation between them."""
        return float(np.percentile(self.known, 95)) if self.count else np.nan

    @property
    def max(self) -> float:
        return float(np.max(self.known)) if self.count else np.nan


@dataclass(frozen=True)
class ModelErrors:
    """What one model of the arm gets wrong: measured less predicted."""

    predicted: Array
    """From the reference frame to the instrument's frame, (k, 4, 4)."""
    shift_m: Array
    """In the instrument's frame, (k, 3)."""
    turn_rad: Array
    """Rotation vectors from predicted to measured, in the instrument's frame, (k, 3)."""
    position: Errors
    orientation: Errors


@dataclass(frozen=True)
class Limits:
    """What the operator allows."""

    position_m: float | None = None
    orientation_rad: float | None = None


@dataclass(frozen=True)
class Verification:
    """Errors of both models over the pose records of a campaign."""

    campaign: Campaign
    arm: CalibratedArm
    measured: EndEffector
    nominal: ModelErrors
    calibrated: ModelErrors
    limits: Limits
    notes: tuple[str, ...]

    @property
    def improvement_position(self) -> float:
        """Ratio of the mean position errors, nominal to calibrated; NaN where there is none left."""
        return _ratio(self.nominal.position.mean, self.calibrated.position.mean)

    @property
    def improvement_orientation(self) -> float:
        """The same for orientations."""
        return _ratio(self.nominal.orientation.mean, self.calibrated.orientation.mean)


def verify(campaign: Campaign, arm: CalibratedArm, limits: Limits | None = None) -> Verification:
    """Judge the nominal and the calibrated arm by a campaign's pose records.

    Args:
        campaign: measured in the same instrument's frame and with the same targets as the calibration's campaign.
        arm: the calibrated arm.
        limits: what errors the operator allows.

    Raises:
        CampaignError: the campaign is about another robot, or has no usable pose records.
    """
    _require_same_robot(campaign.robot, arm.nominal)
    measured = measured_poses(campaign, arm)
    commanded = measured.seen.commanded
    nominal = compared(measured, arm.base @ predicted(arm.nominal, nominal_net(arm.nominal, commanded), measured))
    calibrated = compared(measured, arm.base @ predicted(arm.robot, arm.drives.net(commanded), measured))
    limits = Limits() if limits is None else limits
    return Verification(campaign, arm, measured, nominal, calibrated, limits, _notes(campaign, arm, measured))


def verdicts(errors: Errors, limit: float | None) -> tuple[str, ...]:
    """``pass``, ``fail`` or ``undecided`` for each error, its uncertainty considered; empty without a limit.

    An error passes where it would even with two standard uncertainties more, and fails where it would even with two
    less (the decision rule of ISO 14253-1 with k = 2).
    """
    if limit is None:
        return ()
    passes, fails = errors.value + COVERAGE * errors.std <= limit, errors.value - COVERAGE * errors.std > limit
    return tuple("pass" if p else "fail" if f else "undecided" for p, f in zip(passes, fails, strict=True))


def pose_verdicts(errors: ModelErrors, limits: Limits) -> tuple[str, ...]:
    """One verdict a pose, over its position and its orientation; empty without limits."""
    said = (verdicts(errors.position, limits.position_m), verdicts(errors.orientation, limits.orientation_rad))
    given = [each for each in said if each]
    return tuple(overall(pair) for pair in zip(*given, strict=True)) if given else ()


def overall(each: tuple[str, ...]) -> str:
    """One verdict out of many: all pass, any fails, or it is not decided."""
    return "fail" if "fail" in each else "undecided" if "undecided" in each else "pass"


def calibrated_verdict(found: Verification) -> str:
    """Whether the calibrated arm keeps the operator's limits: pass, fail or undecided; empty without limits."""
    each = pose_verdicts(found.calibrated, found.limits)
    return overall(each) if each else ""


def predicted(robot: Robot, net: Array, measured: EndEffector) -> Array:
    """Where a model has the reference frame for net displacements (k, n), in the robot's base, (k, 4, 4)."""
    return link_frames(robot, net)[:, -2] @ measured.on_link


def compared(measured: EndEffector, predicted: Array) -> ModelErrors:
    """Measured poses less others in the instrument's frame, (k, 4, 4)."""
    shift = measured.pose[:, :3, 3] - predicted[:, :3, 3]
    turn, seen = np.full(shift.shape, np.nan), measured.turned
    turn[seen] = vectors_of_rotations(measured.pose[seen, :3, :3] @ np.swapaxes(predicted[seen, :3, :3], 1, 2))
    return ModelErrors(predicted, shift, turn, _errors(measured, shift, 0), _errors(measured, turn, 3))


def _errors(measured: EndEffector, vectors: Array, first: int) -> Errors:
    """Lengths of errors; their uncertainty is that along the error, and across it where the error is smaller."""
    rows, known = slice(first, first + 3), np.isfinite(vectors).all(axis=1)
    value, std = np.full(len(vectors), np.nan), np.full(len(vectors), np.nan)
    own, shared = measured.own_covariance[known, rows, rows], measured.shared[known, rows]
    size = np.linalg.norm(vectors[known], axis=1)
    along = vectors[known] / np.maximum(size, 1e-300)[:, None]
    value[known] = size
    std[known] = np.sqrt(np.einsum("ki,kij,kj->k", along, measured.covariance[known, rows, rows], along))
    count = max(len(size), 1)
    pulled = np.einsum("ki,kij->j", along, shared) / count
    mean_variance = (
        np.einsum("ki,kij,kj->", along, own, along) / count**2 + pulled @ measured.placement_covariance @ pulled
    )
    return Errors(value, std, float(np.sqrt(mean_variance)))


def _ratio(before: float, after: float) -> float:
    return before / after if after > 0 else np.nan


def _require_same_robot(robot: Robot, nominal: Robot) -> None:
    """Errors of the nominal arm need the nominal arm that was calibrated."""
    if robot.joint_count != nominal.joint_count:
        raise CampaignError(
            f"the campaign's robot {robot.name} has {robot.joint_count} joints, but the calibration is of "
            f"{nominal.name} with {nominal.joint_count}"
        )
    same = [joint.kind for joint in robot.joints] == [joint.kind for joint in nominal.joints]
    chains = [np.concatenate([r.base_transform[None], r.link_transforms]) for r in (robot, nominal)]
    if not same or not np.allclose(*chains, rtol=0, atol=1e-6):
        raise CampaignError(
            f"the campaign's robot {robot.name} is described otherwise than the nominal robot that was calibrated, "
            "expected the same robot.toml"
        )


def _notes(campaign: Campaign, arm: CalibratedArm, measured: EndEffector) -> tuple[str, ...]:
    """What has to be known to read the numbers, in sentences."""
    notes = []
    if is_simulated(campaign):
        notes.append("the campaign is simulated: no robot was measured")
    if arm.digest and campaign.digest and arm.digest != campaign.digest:
        notes.append(
            f"the calibration was made from another campaign ({arm.source or 'without a title'}): instrument and "
            "targets are taken to stand where they stood then"
        )
    if measured.skipped:
        poses = ", ".join(map(str, measured.skipped))
        notes.append(f"too few targets to give a pose, left out: {poses}")
    notes += _reference_notes(arm, measured)
    if measured.suspects:
        notes.append(f"targets do not fit their common shape in pose {', '.join(map(str, measured.suspects))}")
    if measured.noise_factor > 1.2:
        notes.append(f"the targets scatter {measured.noise_factor:.2g} times as much as their stated uncertainty")
    return tuple(notes)


def _reference_notes(arm: CalibratedArm, measured: EndEffector) -> list[str]:
    """Whose place was judged, and what of it cannot show."""
    notes = []
    few = measured.seen.pose[~measured.turned]
    if len(few):
        which = "every pose" if len(few) == len(measured.pose) else f"pose {', '.join(map(str, few))}"
        notes.append(
            f"{which} shows fewer than three targets or such on one line: position only, that of the middle of its "
            "targets and not of the tool"
        )
    if not measured.anchors:
        notes.append(
            "of no target it is known where it sits on the last link: that is taken from the other poses, which hides "
            "constant errors"
        )
    elif measured.free_turn:
        held = " and ".join(measured.anchors)
        notes.append(
            f"the place of {held} on the last link is known, how the other targets sit about it is taken from the "
            "other poses: a turn of the last axis that is the same in all poses cannot show (the direction of that "
            f"axis has a standard uncertainty of {arm.last_axis_std_rad * 1e3:.2g} mrad)"
        )
    if measured.framed and measured.framed_sigma_rad is None:
        notes.append(
            f"how well the instrument measures the turn of {measured.framed} is not stated and was not repeated: its "
            "scatter between poses is taken, which holds the arm's errors as well, so that stated uncertainties of "
            "orientations are too large"
        )
    return notes
