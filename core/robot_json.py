"""A robot as JSON, whatever it was described by, and back: the chain as transforms, to the last digit.

Keys carry their units; a limit that a joint has not is null. Transforms are 4x4, rows first, translations in mm.
"""

from collections.abc import Sequence

import numpy as np

from core.errors import RobotError
from core.geometry import Array
from core.json_records import JsonRecord
from core.json_values import Json
from core.robot import Coupling, Joint, JointKind, LinkMass, Robot
from core.units import displacement_units, from_si, to_si


def robot_record(robot: Robot) -> Json:
    """Everything that a ``Robot`` holds."""
    record: Json = {
        "name": robot.name,
        "joints": [_joint_record(joint) for joint in robot.joints],
        "base_transform": exact_mm(robot.base_transform),
        "link_transforms": [exact_mm(link) for link in robot.link_transforms],
        "couplings": [_coupling_record(coupling) for coupling in robot.couplings],
    }
    if robot.moving_frames is not None:
        record["moving_frames"] = [exact_mm(frame) for frame in robot.moving_frames]
    if robot.phi_rad is not None:
        record["phi_deg"] = np.rad2deg(robot.phi_rad).tolist()
    if robot.links:
        record["links"] = [
            {"mass_kg": float(link.mass_kg), "com_mm": [from_si(float(v), "mm") for v in link.centre_m]}
            for link in robot.links
        ]
    if robot.gravity_direction is not None:
        record["gravity_direction"] = [float(v) for v in robot.gravity_direction]
    return record


def robot_of_record(record: JsonRecord) -> Robot:
    """The robot of such a record.

    Raises:
        InputError: a key is missing or holds something that cannot be; the message names file and key.
    """
    joints = tuple(_joint(one) for one in record.records("joints"))
    n = len(joints)
    try:
        return Robot(
            name=record.text("name"),
            joints=joints,
            link_transforms=_transforms(record, "link_transforms", n),
            base_transform=transform_of(record, "base_transform"),
            moving_frames=_transforms(record, "moving_frames", n) if "moving_frames" in record else None,
            couplings=tuple(_coupling(one) for one in record.records("couplings")),
            links=tuple(_link(one) for one in record.records("links")) if "links" in record else (),
            gravity_direction=_gravity(record),
            phi_rad=np.deg2rad(record.numbers("phi_deg", (n - 1,))) if "phi_deg" in record else None,
        )
    except RobotError as wrong:
        raise record.failed(str(wrong)) from None


def exact_mm(transform: Array) -> list[list[float]]:
    """A rigid motion (4, 4) as nested lists, translation in mm, every digit kept."""
    out = np.array(transform, dtype=float)
    out[:3, 3] *= 1e3
    return out.tolist()


def transform_of(record: JsonRecord, key: str) -> Array:
    """The rigid motion under a key, (4, 4), m.

    Raises:
        InputError: it is not a rigid motion.
    """
    return _rigid(record, key, record.numbers(key, (4, 4))[None])[0]


def _transforms(record: JsonRecord, key: str, count: int) -> Array:
    return _rigid(record, key, record.numbers(key, (count, 4, 4)))


def _rigid(record: JsonRecord, key: str, transforms: Array) -> Array:
    rotation = transforms[:, :3, :3]
    whole = np.abs(np.swapaxes(rotation, 1, 2) @ rotation - np.eye(3)).max(initial=0.0) < 1e-9
    last = np.abs(transforms[:, 3] - [0, 0, 0, 1]).max(initial=0.0) < 1e-9
    if not whole or not last or (np.linalg.det(rotation) < 0).any():
        raise record.wrong(key, "4x4 rigid motions: a rotation, a translation in mm, the last row 0 0 0 1")
    out = transforms.copy()
    out[:, :3, 3] *= 1e-3
    return out


def _joint_record(joint: Joint) -> Json:
    unit = displacement_units(joint.slides)[0]
    record: Json = {"kind": str(joint.kind), f"limits_{unit}": [_limit(value, unit) for value in joint.limits]}
    if joint.drive_ratio is not None:
        record["drive_ratio"] = float(joint.drive_ratio)
    if joint.transmission != "auto":
        record["transmission"] = joint.transmission
    return record


def _limit(value: float, unit: str) -> float | None:
    return from_si(float(value), unit) if np.isfinite(value) else None


def _joint(record: JsonRecord) -> Joint:
    kind = JointKind(record.choice("kind", tuple(JointKind)))
    unit = displacement_units(kind is JointKind.PRISMATIC)[0]
    low, high = record.optional_numbers(f"limits_{unit}", 2)
    limits = (-np.inf if low is None else to_si(low, unit), np.inf if high is None else to_si(high, unit))
    ratio = record.number("drive_ratio") if "drive_ratio" in record else None
    form = record.text("transmission") if "transmission" in record else "auto"
    try:
        return Joint(kind, limits, ratio, form)
    except RobotError as wrong:
        raise record.failed(str(wrong)) from None


def _coupling_record(coupling: Coupling) -> Json:
    return {
        "from": coupling.source,
        "to": coupling.target,
        "gain": float(coupling.gain),
        "compensated": coupling.compensated,
        "form": coupling.form,
    }


def _coupling(record: JsonRecord) -> Coupling:
    try:
        return Coupling(
            record.integer("from"),
            record.integer("to"),
            record.number("gain"),
            record.flag("compensated"),
            record.text("form"),
        )
    except RobotError as wrong:
        raise record.failed(str(wrong)) from None


def _link(record: JsonRecord) -> LinkMass:
    centre: Sequence[float] = record.numbers("com_mm", (3,)) * 1e-3
    return LinkMass(record.number("mass_kg"), tuple(float(v) for v in centre))


def _gravity(record: JsonRecord) -> tuple[float, float, float] | None:
    if "gravity_direction" not in record:
        return None
    x, y, z = record.numbers("gravity_direction", (3,))
    return float(x), float(y), float(z)
