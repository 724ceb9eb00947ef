"""Sites to plan for: an arm that was calibrated once, or one of which only the drawing is known."""

from dataclasses import replace

import numpy as np

from core.arm_jacobian import ArmState
from core.calibrated_arm import calibrated_arm
from core.calibration import Calibration
from core.errors import InputError
from core.geometry import Array, apply
from core.kinematics import link_frames
from core.measurements import Target
from core.motion_forms import MotionForm, MotionFunction, coupling_form, transmission_form
from core.planning.information import fitted
from core.planning.sight import Sight
from core.planning.site import Repeats, Site, skeleton
from core.robot import Coupling, Joint, Robot


def nominal_site(
    robot: Robot,
    base: Array,
    targets: tuple[Target, ...],
    sight: Sight,
    home: Array | None = None,
    repeats: Repeats | None = None,
) -> Site:
    """An arm as drawn, with its base placed roughly: a plan needs no more.

    Args:
        base: from the robot's base to the instrument's frame, (4, 4).
        targets: each with its place on its link.
        home: commands at the arm's marks, (n,).

    Raises:
        InputError: a target's place is not given, or a joint has no motor, so that nothing shows its axis alone.
    """
    if not robot.commanded.all():
        passive = int(np.argmin(robot.commanded)) + 1
        raise InputError(f"joint {passive} of {robot.name} has no motor: its axis cannot be calibrated by moving it")
    lines = tuple(line.moved(base) for line in robot.axes_at_zero())
    state = ArmState(lines, *drawn_drives(robot), _places(robot, base, targets))
    return Site(robot, state, targets, sight, skeleton(robot, base), home, repeats=repeats or Repeats())


def calibrated_site(calibration: Calibration, sight: Sight | None = None) -> Site:
    """An arm as a calibration has it, with the noise that was found.

    Args:
        sight: the stations; None: not known, and points as exact as the campaign states.

    Raises:
        InputError: the geometry is not known, because a joint was not swept.
    """
    campaign, arm = calibration.campaign, calibrated_arm(calibration)
    drives, refinement = calibration.estimate.arm, calibration.refinement
    rest = _known_places(refinement.rest_points_m, arm.base, arm.robot, campaign.targets)
    state = ArmState(drives.axes, tuple(replace(f, offset=0.0) for f in drives.transmissions), drives.couplings, rest)
    return Site(
        robot=campaign.robot,
        state=state,
        targets=campaign.targets,
        sight=sight or Sight(sigma_m=_stated_sigma(calibration)),
        skeleton_m=skeleton(arm.robot, arm.base),
        home=campaign.home,
        repeats=Repeats(refinement.noise.added_m if refinement.noise.stated else 0.0, refinement.arc_excess),
    )


def narrowed(site: Site, ranges: dict[int, tuple[float, float]]) -> Site:
    """The same site with some joints (1..n) kept within ranges of their commands, rad or m.

    Raises:
        InputError: there is no such joint, or it does not go there.
    """
    joints = list(site.robot.joints)
    for joint, (low, high) in ranges.items():
        if not 1 <= joint <= len(joints) or not site.robot.commanded[joint - 1]:
            raise InputError(f"a range is given for joint {joint}, expected a joint 1..{len(joints)} with a motor")
        least, most = site.limits[joint - 1]
        if not (least - 1e-9 <= low < high <= most + 1e-9):
            unit, scale = ("mm", 1e3) if site.robot.sliding[joint - 1] else ("deg", 180 / np.pi)
            raise InputError(
                f"the range of joint {joint} is {low * scale:.6g} to {high * scale:.6g} {unit}, expected the lower "
                f"value first and both within {least * scale:.6g} to {most * scale:.6g} {unit}"
            )
        joints[joint - 1] = replace(joints[joint - 1], limits=(low, high))
    return replace(site, robot=replace(site.robot, joints=tuple(joints)))


def _stated_sigma(calibration: Calibration) -> float:
    """What the campaign says of one coordinate of a point, root mean square; what was found where it says nothing."""
    table = calibration.campaign.measurements
    stated = table.covariance_m2[fitted(table) & table.seen]
    variance = np.trace(stated, axis1=1, axis2=2) / 3
    if calibration.refinement.noise.stated and np.isfinite(variance).all():
        return float(np.sqrt(variance.mean()))
    return calibration.estimate.noise_m


def targets_on_links(robot: Robot, radius_m: float = 0.15) -> tuple[Target, ...]:
    """A target on every link, so far off the axis that moves the link and as far along as the link reaches."""
    ends = robot.link_transforms[:, :3, 3]
    out = []
    for link, end in enumerate(ends, 1):
        across = end[:2] / np.linalg.norm(end[:2]) if np.linalg.norm(end[:2]) > 1e-6 else np.array([1.0, 0.0])
        # A quarter turn from the link itself, so that it does not stand in the way.
        place = end + radius_m * np.array([-across[1], across[0], 0.0])
        out.append(Target(f"T{link}", link, tuple(float(v) for v in place)))
    return tuple(out)


def drawn_drives(robot: Robot) -> tuple[tuple[MotionFunction, ...], tuple[MotionFunction | None, ...]]:
    """Transmissions and couplings as drawn: families as the robot's description has them, without errors."""
    transmissions = tuple(_perfect(drawn_transmission(joint)) for joint in robot.joints)
    into = (robot.coupling_into(joint) for joint in range(1, robot.joint_count + 1))
    return transmissions, tuple(None if c is None else _perfect(drawn_coupling(c)) for c in into)


def drawn_transmission(joint: Joint) -> MotionForm:
    """The family of a joint's drive; where evidence is to choose it, one with a constant or two."""
    if joint.transmission == "auto":
        return transmission_form("ratio" if joint.slides else "first_harmonic")
    return transmission_form(joint.transmission, joint.drive_ratio)


def drawn_coupling(coupling: Coupling) -> MotionForm:
    """The family of a coupling; where evidence is to choose it, a plain gain."""
    return coupling_form("proportional" if coupling.form == "auto" else coupling.form, coupling.gain)


def _perfect(form: MotionForm) -> MotionFunction:
    return MotionFunction(form, form.start())


def _places(robot: Robot, base: Array, targets: tuple[Target, ...]) -> Array:
    unplaced = [target.name for target in targets if target.point_m is None]
    if unplaced:
        raise InputError(f"target {unplaced[0]!r} has no place on its link, expected xyz_mm in campaign.toml")
    return _known_places(np.full((len(targets), 3), np.nan), base, robot, targets)


def _known_places(rest: Array, base: Array, robot: Robot, targets: tuple[Target, ...]) -> Array:
    """Places at rest, those that are NaN filled with what the campaign says of the target."""
    at_rest = base @ link_frames(robot, np.zeros((1, robot.joint_count)))[0]
    out = rest.copy()
    for k, target in enumerate(targets):
        if np.isnan(out[k]).any() and target.point_m is not None:
            frame = at_rest[target.link - 1] if target.link else np.eye(4)
            out[k] = apply(frame, np.array(target.point_m))
    return out
