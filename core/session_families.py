"""Which family of functions each drive and coupling is given, where the operator chooses one instead of the robot's.

Choices are settings of the session: ``transmission_3`` for the drive of joint 3, ``coupling_3`` for the coupling into
it. Without one, the family of robot.toml is used, or evidence chooses where that says ``auto``.
"""

from collections.abc import Mapping
from dataclasses import replace

from core.errors import InputError
from core.input_files import shown
from core.motion_forms import coupling_form, transmission_form
from core.robot import Coupling, Joint, Robot

AUTO = "auto"
COUPLING_FAMILIES = (AUTO, "proportional", "gear", "arctangent")


def drive_key(joint: int) -> str:
    """The setting for the drive of a joint, 1..n."""
    return f"transmission_{joint}"


def coupling_key(joint: int) -> str:
    """The setting for the coupling into a joint, 2..n."""
    return f"coupling_{joint}"


def drive_families(joint: Joint) -> tuple[str, ...]:
    """The families that a joint's drive may be given."""
    if joint.slides:
        return AUTO, "direct", "ratio"
    geared = ("gear",) if joint.drive_ratio is not None else ()
    return AUTO, "direct", "ratio", "first_harmonic", *geared, "harmonics_2", "harmonics_3", "harmonics_4"


def with_families(robot: Robot, settings: Mapping[str, object]) -> Robot:
    """The robot with the families that a session's settings choose.

    Raises:
        InputError: a setting names a family that this joint cannot have.
    """
    joints = tuple(
        replace(joint, transmission=_chosen(settings, drive_key(number), joint.transmission))
        for number, joint in enumerate(robot.joints, 1)
    )
    couplings = tuple(replace(c, form=_chosen(settings, coupling_key(c.target), c.form)) for c in robot.couplings)
    for number, joint in enumerate(joints, 1):
        check_drive(number, joint)
    for coupling in couplings:
        check_coupling(coupling)
    return replace(robot, joints=joints, couplings=couplings)


def check_drive(number: int, joint: Joint) -> None:
    """Refuse a family that a joint's drive cannot have.

    Raises:
        InputError: one sentence says which.
    """
    if joint.transmission != AUTO:
        try:
            form = transmission_form(joint.transmission, joint.drive_ratio)
        except InputError as wrong:
            raise InputError(f"joint {number}: {wrong}") from None
        if joint.slides and form.name not in drive_families(joint):
            raise InputError(
                f"joint {number} slides, so that its drive cannot be a {form.name}; expected direct or ratio"
            )


def check_coupling(coupling: Coupling) -> None:
    """Refuse a family that no coupling has.

    Raises:
        InputError: one sentence says which.
    """
    if coupling.form != AUTO:
        try:
            coupling_form(coupling.form, coupling.gain)
        except InputError as wrong:
            raise InputError(f"coupling {coupling.source} -> {coupling.target}: {wrong}") from None


def _chosen(settings: Mapping[str, object], key: str, otherwise: str) -> str:
    value = settings.get(key, otherwise)
    if not isinstance(value, str):
        raise InputError(f"setting {key} = {shown(value)}, expected the name of a family")
    return value
