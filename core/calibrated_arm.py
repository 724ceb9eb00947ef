"""What a calibration leaves for use: the nominal robot, the chain and the drives as they are, where things stand.

Two frames. The **instrument's**, in which points are measured. The **robot's base**, in which poses are commanded: the
nominal robot's own base frame, tied to the real arm by its first axes. The phi-model's rule puts frame 1 onto the first
two axes (Z_1 on axis 1, Y_1 along the common normal to axis 2, section 4); the nominal axes tell how the robot's
base stands to that frame, and it stands so to frame 1 of the real axes as well.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from core.arm import Arm
from core.calibration import Calibration, calibrated_robot
from core.driven_robot import DrivenRobot, nominal_driven
from core.errors import InputError
from core.estimate import ArmEstimate
from core.geometry import Array, invert
from core.measurements import Campaign
from core.parameter_covariance import ParameterCovariance
from core.phi_convention import Convention
from core.phi_model import PhiModel, from_axes
from core.robot import Robot


@dataclass(frozen=True)
class KnownTarget:
    """A target whose place on its link a calibration found."""

    name: str
    link: int
    point_m: Array
    """When every joint is at zero, in the instrument's frame, (3,)."""
    std_m: Array
    """Standard uncertainty of its coordinates, (3,)."""


@dataclass(frozen=True, eq=False)
class CalibratedArm:
    """A calibrated arm, ready for use."""

    nominal: Robot
    """As its maker drew it, in the robot's base frame."""
    robot: Robot
    """The same chain with calibrated geometry, in the robot's base frame; moved by net displacements."""
    drives: Arm
    """Commands to net displacements and back; its axes are in the instrument's frame."""
    base: Array
    """From the robot's base to the instrument's frame, (4, 4)."""
    targets: tuple[KnownTarget, ...]
    noise_m: float
    """Standard deviation of one coordinate of a point, as the calibration found it."""
    last_axis_std_rad: float = np.nan
    """Standard uncertainty of the direction of the last axis."""
    home: Array | None = None
    """Commands at the arm's marks, (n,)."""
    source: str = ""
    """Title of the campaign that it was calibrated with."""
    digest: str = ""
    """SHA-256 of that campaign's files."""
    covariance: ParameterCovariance | None = None
    """Of geometry and drives together; None: not known."""

    def driven(self) -> DrivenRobot:
        """Calibrated chain and drives, for inverse kinematics in the robot's base frame; the same one every time."""
        return self._driven

    def nominal_driven(self) -> DrivenRobot:
        """The same of the nominal robot."""
        return self._nominal_driven

    @cached_property
    def _driven(self) -> DrivenRobot:
        return DrivenRobot(self.robot, self.drives)

    @cached_property
    def _nominal_driven(self) -> DrivenRobot:
        return nominal_driven(self.nominal)


def calibrated_arm(calibration: Calibration) -> CalibratedArm:
    """What is left for use of a calibration.

    Raises:
        InputError: the geometry is not known, because a joint was not swept.
    """
    refinement = calibration.refinement
    if calibration.estimate.geometry is None or calibration.convention is None or calibration.nominal is None:
        raise InputError("the calibration has no geometry: every joint has to be swept")
    return assembled_arm(
        calibration.campaign,
        calibration.convention,
        calibration.nominal,
        calibration.estimate,
        (refinement.rest_points_m, refinement.rest_covariance_m2),
    )


def assembled_arm(
    campaign: Campaign,
    convention: Convention,
    nominal: PhiModel,
    estimate: ArmEstimate,
    targets: tuple[Array, Array],
) -> CalibratedArm:
    """An estimate of every joint, put together for use.

    Args:
        convention, nominal: frames of the phi-model and nominal parameters in them.
        estimate: with its geometry.
        targets: places at rest in the instrument's frame, (t, 3), NaN where not known, and covariances, (t, 3, 3).
    """
    chain = calibrated_robot(campaign.robot, convention, nominal, estimate)
    base, robot = in_robot_base(campaign.robot, convention, chain, estimate.geometry.base)
    places, std = targets[0], np.sqrt(np.diagonal(targets[1], axis1=1, axis2=2))
    known = np.isfinite(places).all(axis=1)
    return CalibratedArm(
        nominal=campaign.robot,
        robot=robot,
        drives=estimate.arm,
        base=base,
        targets=tuple(
            KnownTarget(target.name, target.link, places[k], std[k])
            for k, target in enumerate(campaign.targets)
            if known[k]
        ),
        noise_m=estimate.noise_m,
        last_axis_std_rad=estimate.axis_std(campaign.robot.joint_count)[0],
        home=campaign.home,
        source=campaign.title,
        digest=campaign.digest,
        covariance=estimate.covariance,
    )


def in_robot_base(nominal: Robot, convention: Convention, robot: Robot, frame_1: Array) -> tuple[Array, Robot]:
    """A calibrated chain carried from frame 1 of the phi-model into the robot's base frame.

    Args:
        robot: the chain in frame 1.
        frame_1: from frame 1 to the instrument's frame, (4, 4).

    Returns:
        From the robot's base to the instrument's frame, and the chain in the robot's base.
    """
    in_base, _ = from_axes(nominal.axes_at_zero(), convention)
    return frame_1 @ invert(in_base), replace(robot, base_transform=in_base @ robot.base_transform)
