"""Arms put together from the unknowns of a site, and how far an estimate is from the truth in these unknowns."""

import numpy as np

from core.arm import Arm
from core.arm_jacobian import ArmState
from core.calibrated_arm import CalibratedArm, assembled_arm
from core.estimate import ArmEstimate, Geometry, axis_basis
from core.geometry import Array
from core.measurements import Campaign, Measurements
from core.phi_model import from_axes
from core.planning.shots import pose_rows
from core.planning.site import Site


def arm_of(site: Site, state: ArmState) -> CalibratedArm:
    """The arm that a state of the unknowns stands for; commands count from zero, as with marks there."""
    n = site.robot.joint_count
    base, model = from_axes(state.axes, site.convention)
    nominal = from_axes(site.robot.axes_at_zero(), site.convention)[1]
    nothing = np.zeros((4 * n, 4 * n))
    estimate = ArmEstimate(
        method="put together",
        arm=Arm(site.robot, state.axes, state.transmissions, state.couplings),
        axis_covariance=nothing,
        transmissions=(None,) * n,
        offset_std=np.zeros(n),
        couplings=(None,) * n,
        geometry=Geometry(base, model, np.zeros((n - 1, 4)), np.zeros((4 * (n - 1), 4 * (n - 1)))),
        noise_m=0.0,
    )
    campaign = Campaign(site.robot, site.targets, empty(n), home=site.home)
    targets = np.full((len(site.targets), 3), np.nan), np.full((len(site.targets), 3, 3), np.nan)
    return assembled_arm(campaign, site.convention, nominal, estimate, targets)


def empty(n: int) -> Measurements:
    """No rows at all."""
    return pose_rows(np.zeros((0, n)), np.zeros(0, dtype=int))


def deviations(site: Site, arm: CalibratedArm) -> Array:
    """Estimate less truth in the unknowns of the true site, (p,); NaN: a target that was not seen."""
    state, layout = site.state, site.layout
    out = np.full(layout.size, np.nan)
    for place, true, found in zip(layout.axes, state.axes, arm.drives.axes, strict=True):
        basis = axis_basis(true.direction)
        both = np.concatenate([basis @ found.direction, basis @ (found.foot_of(true.point_m) - true.point_m)])
        out[place] = both[: place.stop - place.start]
    pairs = (
        *zip(layout.transmissions, state.transmissions, arm.drives.transmissions, strict=True),
        *zip(layout.couplings, state.couplings, arm.drives.couplings, strict=True),
    )
    for place, true, found in pairs:
        if place is not None:
            out[place] = found.coefficients - true.coefficients
    names = [target.name for target in site.targets]
    for target in arm.targets:
        k = names.index(target.name)
        first = layout.targets.start + 3 * k
        out[first : first + 3] = target.point_m - state.rest_points_m[k]
    return out
