"""What a method found, as an arm that can be used: the same way from axes and drives to a calibrated arm for all."""

from dataclasses import replace

import numpy as np

from core.arm import Arm
from core.arm_jacobian import ArmState
from core.calibrated_arm import CalibratedArm, assembled_arm
from core.drives import offsets
from core.estimate import ArmEstimate, Geometry
from core.measurements import Campaign
from core.phi_convention import convention_of
from core.phi_model import PhiModel, from_axes, near


def arm_of(state: ArmState, campaign: Campaign) -> Arm:
    """An arm with the offsets of its transducers."""
    drives = list(state.transmissions)
    counted = zip(drives, offsets(campaign, drives), strict=True)
    return Arm(campaign.robot, state.axes, tuple(replace(f, offset=float(o)) for f, o in counted), state.couplings)


def phi_model_of(arm: Arm) -> PhiModel:
    """The parameters of the phi-model that follow from an arm's axes, angles near the nominal ones.

    Raises:
        RobotError: a Z_phi is parallel to the axis that follows it.
    """
    convention = convention_of(arm.robot)
    return near(from_axes(arm.axes, convention)[1], from_axes(arm.robot.axes_at_zero(), convention)[1])


def calibrated_arm_of(arm: Arm, campaign: Campaign) -> CalibratedArm:
    """An arm whose axes and drives were identified, ready for use; its tool hangs on frame n of the phi-model.

    Raises:
        RobotError: a Z_phi is parallel to the axis that follows it.
    """
    robot, convention = campaign.robot, convention_of(campaign.robot)
    n = robot.joint_count
    base, model = from_axes(arm.axes, convention)
    parameters = 4 * (n - 1)
    estimate = ArmEstimate(
        method="",
        arm=arm,
        axis_covariance=np.full((4 * n, 4 * n), np.nan),
        transmissions=(None,) * n,
        offset_std=np.full(n, np.nan),
        couplings=(None,) * n,
        geometry=Geometry(base, model, np.full((n - 1, 4), np.nan), np.full((parameters, parameters), np.nan)),
        noise_m=np.nan,
    )
    nominal = from_axes(robot.axes_at_zero(), convention)[1]
    unknown = np.full((len(campaign.targets), 3), np.nan), np.full((len(campaign.targets), 3, 3), np.nan)
    return assembled_arm(campaign, convention, nominal, estimate, unknown)
