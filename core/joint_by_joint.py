"""The paper's way: each joint on its own, one step at a time (sections 2 and 3).

1. Displacements about each axis, and the transmission function of each joint (equations 6 to 8, 12 and 13).
2. The axes carried back to the zero pose, from the base up, and the passive motion of joint i+1 while joint i moved
   (14 and 15): what lies below joint i+1 is known by the time that it is needed.
3. The phi-model (appendix), with the covariance of the axes carried through.

Joints that were never swept stay as they stood: their nominal geometry is not mixed in.
"""

import numpy as np

from core.displacement import displacements
from core.drives import offset_std
from core.errors import CampaignError, TrueaxisError
from core.estimate import ArmEstimate
from core.function_fit import FunctionFit, SweepCurve
from core.measurements import Campaign
from core.phi_convention import Convention
from core.phi_model import PhiModel
from core.phi_uncertainty import geometry_from_axes
from core.sweep_fits import SAME_COMMAND, SweepFit, SweepFits, active_from_zero
from core.transmission import fit_transmission
from core.walk_from_base import SweepMotion, WalkFromBase


def joint_by_joint(
    campaign: Campaign,
    found: SweepFits,
    convention: Convention | None,
    nominal: PhiModel | None,
    reject: bool = True,
) -> tuple[ArmEstimate, tuple[SweepMotion, ...]]:
    """Estimate the arm one joint at a time from the axes of its sweeps.

    Args:
        campaign: what was measured.
        found: the axes of all sweeps.
        convention, nominal: the frames of the phi-model; None: not every joint was swept.
        reject: leave out stops that stand out of the curve of a passive motion.

    Raises:
        CampaignError: a joint without a sweep stands differently in two sweeps.
    """
    _require_still(campaign, found)
    motions = [_motion(campaign, fit) for fit in found.fits]
    drives = _transmissions(campaign, motions)
    walk = WalkFromBase(campaign, found, motions, drives, reject)
    walk.run()
    arm = walk.arm()
    covariance = walk.axis_covariance()
    geometry = None
    if convention is not None and nominal is not None:
        geometry = geometry_from_axes(arm.axes, convention, covariance, nominal)
    stated = np.concatenate([f.sweep.covariance_m2[f.axis_rows] for f in found.fits])
    estimate = ArmEstimate(
        method="joint by joint",
        arm=arm,
        axis_covariance=covariance,
        transmissions=tuple(drives),
        offset_std=offset_std(campaign, drives),
        couplings=tuple(walk.couplings),
        geometry=geometry,
        noise_m=found.noise.rms_m(stated),
    )
    return estimate, tuple(walk.motions)


def _require_still(campaign: Campaign, found: SweepFits) -> None:
    """A joint without a sweep has no axis to be carried about, so it must stand the same throughout."""
    for k in range(campaign.robot.joint_count):
        if k + 1 in found.swept:
            continue
        held = np.concatenate([active_from_zero(campaign, f.sweep.commanded)[:, k] for f in found.fits])
        if np.ptp(held) > SAME_COMMAND and any(f.sweep.joint > k + 1 for f in found.fits):
            raise CampaignError(
                f"measurements.csv: joint {k + 1} has no sweep of its own but is commanded to different places; "
                f"expected a sweep of joint {k + 1}, or the same command throughout"
            )


def _motion(campaign: Campaign, found: SweepFit) -> SweepMotion:
    sweep, rows = found.sweep, found.axis_rows
    moved = displacements(
        found.fit,
        sweep.point_m[rows],
        stop=sweep.stop[rows],
        target=sweep.target[rows],
        commanded=sweep.commanded[:, sweep.joint - 1],
    )
    seen = np.isfinite(moved.value)
    asked = active_from_zero(campaign, sweep.commanded)[:, sweep.joint - 1]
    # What is seen of f is the displacement; an error of the axis enters with slope f' = 1 to first order.
    curve = SweepCurve(moved.value[seen], asked[seen], moved.std[seen], moved.axis_effect[seen], found.fit.covariance)
    return SweepMotion(found, moved, curve)


def _transmissions(campaign: Campaign, motions: list[SweepMotion]) -> list[FunctionFit | None]:
    drives: list[FunctionFit | None] = []
    for number, joint in enumerate(campaign.robot.joints, 1):
        curves = tuple(m.curve for m in motions if m.found.sweep.joint == number)
        try:
            drives.append(fit_transmission(joint, curves, campaign.home is not None) if curves else None)
        except TrueaxisError as error:
            raise type(error)(f"joint {number}: {error}") from None
    return drives
