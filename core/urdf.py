"""A chain of joints out of a URDF file (Unified Robot Description Format, wiki.ros.org/urdf/XML).

A URDF joint places its child link's frame in the parent's, ``T_origin = Trans(xyz) Rz(yaw) Ry(pitch) Rx(roll)``, and
turns it about, or slides it along, any axis given in the child's frame. The core wants that axis on z: with A_i a
rotation that carries z onto the axis of joint i, frame i = (child link's frame) . A_i, and

    T_tip_to_base = T_1 . M_1 . (A_1^-1 T_2) . M_2 ... M_n . (A_n^-1 T_tip),     T_i = fixed joints . T_origin_i . A_i

Fixed joints are folded into what follows them. ``Robot.moving_frames`` is A_i^-1: from the URDF's link frame, which
moves with joint i, to frame i.
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np

from core.errors import RobotError
from core.file_records import HUGE
from core.geometry import Array, apply, perpendicular_basis, rotation_about, transform
from core.input_files import InputText, one_line, shown
from core.robot import Coupling, Joint, JointKind, LinkMass, Robot
from core.urdf_masses import LinkInertia, UrdfJoint, lumped_masses

URDF_LIMIT_BYTES = 20_000_000
MOST_ELEMENTS = 400_000
KINDS = {"revolute": JointKind.REVOLUTE, "continuous": JointKind.REVOLUTE, "prismatic": JointKind.PRISMATIC}


@dataclass(frozen=True)
class UrdfChain:
    """The moving joints between two links of a URDF file, with the fixed ones folded in."""

    name: str
    joints: tuple[Joint, ...]
    base_transform: Array
    """From frame 1 at rest to the base link, (4, 4), m."""
    link_transforms: Array
    """From frame i+1 (after the last joint: the tip link) to frame i, (n, 4, 4), m."""
    moving_frames: Array
    """From the child link of joint i to frame i, (n, 4, 4)."""
    links: tuple[LinkMass, ...]
    """Masses with centres in frame i; empty unless every moving link has an inertial element."""

    def robot(
        self,
        name: str,
        joints: Sequence[Joint],
        couplings: Sequence[Coupling],
        gravity_direction: tuple[float, float, float] | None,
    ) -> Robot:
        """The robot of this chain; what a URDF file does not know is added."""
        return Robot(
            name=name,
            joints=tuple(joints),
            link_transforms=self.link_transforms,
            base_transform=self.base_transform,
            moving_frames=self.moving_frames,
            couplings=tuple(couplings),
            links=self.links,
            gravity_direction=gravity_direction,
        )


def parse_urdf(source: InputText, base_link: str, tip_link: str) -> UrdfChain:
    """The chain of moving joints from one link of a URDF file to another.

    Raises:
        RobotError: the file is not a URDF, has entities, lacks a link, or the chain has a joint that is not supported.
    """
    root = _root(source)
    by_child = _joints_by_child(root, source)
    path = _path(by_child, base_link, tip_link, source)
    moving = [joint for joint in path if joint.kind != "fixed"]
    if not moving:
        raise RobotError(f"{source.path}: no joint moves between {shown(base_link)} and {shown(tip_link)}")
    segments = _segments(path)
    rotations = np.array([_z_onto(joint.axis) for joint in moving])
    back = np.swapaxes(rotations, -1, -2)
    ends = np.concatenate([rotations[1:], np.eye(4)[None]])
    name = root.get("name") or "robot"
    return UrdfChain(
        name=name if one_line(name) else "robot",
        joints=tuple(_core_joint(joint, source) for joint in moving),
        base_transform=segments[0] @ rotations[0],
        link_transforms=back @ segments[1:] @ ends,
        moving_frames=back,
        links=_masses(root, by_child, moving, back, source),
    )


def chain_ends(source: InputText) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Links where a chain may begin (no joint leads to them) and end (none leads on), and then all that lie between.

    Raises:
        RobotError: the file is not a URDF, or no joint in it moves.
    """
    joints = _joints_by_child(_root(source), source)
    if not any(joint.kind in KINDS for joint in joints.values()):
        raise RobotError(f"{source.path}: no joint moves, expected a robot")
    parents = dict.fromkeys(joint.parent for joint in joints.values())
    starts = tuple(link for link in parents if link not in joints)
    ends = tuple(link for link in joints if link not in parents)
    between = tuple(link for link in joints if link in parents)
    # The deepest end first: that of the arm, not of a gripper's finger or a cable.
    deepest = sorted(ends, key=lambda link: -_moving_above(joints, link))
    return (*starts, *between), (*deepest, *between)


def _moving_above(joints: dict[str, UrdfJoint], link: str) -> int:
    """How many joints move between a link and where its chain begins."""
    count = steps = 0
    while link in joints and steps <= len(joints):
        count += joints[link].kind in KINDS and not joints[link].mimics
        link, steps = joints[link].parent, steps + 1
    return count


def _root(source: InputText) -> ElementTree.Element:
    """The robot element; entities are refused before anything expands them."""
    if "<!DOCTYPE" in source.text or "<!ENTITY" in source.text:
        raise RobotError(f"{source.path}: has a DOCTYPE or entities, expected a plain URDF file")
    if source.text.count("<") > MOST_ELEMENTS:
        raise RobotError(f"{source.path}: has more than {MOST_ELEMENTS} tags, expected the URDF file of one robot")
    try:
        root = ElementTree.fromstring(source.text)
    except (ElementTree.ParseError, ValueError) as wrong:
        raise RobotError(f"{source.path} is not valid XML: {' '.join(str(wrong).split())}") from None
    if root.tag != "robot":
        raise RobotError(f"{source.path}: the outermost element is <{shown(root.tag)}>, expected <robot>")
    return root


def _joints_by_child(root: ElementTree.Element, source: InputText) -> dict[str, UrdfJoint]:
    joints: dict[str, UrdfJoint] = {}
    for element in root.findall("joint"):
        joint = _joint(element, source)
        if joint.child in joints:
            raise RobotError(
                f"{source.path}: link {shown(joint.child)} is the child of two joints,"
                f" {shown(joints[joint.child].name)} and {shown(joint.name)}, expected one"
            )
        joints[joint.child] = joint
    return joints


def _joint(element: ElementTree.Element, source: InputText) -> UrdfJoint:
    place = f"{source.path}: joint {shown(element.get('name', ''))}"
    parent, child, limit = element.find("parent"), element.find("child"), element.find("limit")
    if parent is None or child is None or not parent.get("link") or not child.get("link"):
        raise RobotError(f"{place} names no parent or no child link")
    axis = np.array(_three(element.find("axis"), "xyz", (1.0, 0.0, 0.0), place))
    length = float(np.linalg.norm(axis))
    if length < 1e-9:
        raise RobotError(f"{place}: the axis is zero, expected a direction")
    return UrdfJoint(
        name=element.get("name", ""),
        kind=element.get("type", ""),
        parent=parent.get("link", ""),
        child=child.get("link", ""),
        origin=_origin(element, place),
        axis=axis / length,
        limits=_limits(limit, place),
        mimics=element.find("mimic") is not None,
    )


def _limits(limit: ElementTree.Element | None, place: str) -> tuple[float, float]:
    if limit is None or ("lower" not in limit.attrib and "upper" not in limit.attrib):
        return -np.inf, np.inf
    return tuple(_number(limit.get(side, "0"), f"{place}: limit {side}") for side in ("lower", "upper"))


def _path(joints: dict[str, UrdfJoint], base_link: str, tip_link: str, source: InputText) -> list[UrdfJoint]:
    """The joints from the base link up to the tip link, found from the tip down."""
    path: list[UrdfJoint] = []
    link = tip_link
    while link != base_link:
        if link not in joints or len(path) > len(joints):
            raise RobotError(
                f"{source.path}: no chain of joints leads from base_link {shown(base_link)}"
                f" to tip_link {shown(tip_link)}"
            )
        path.append(joints[link])
        link = joints[link].parent
    for joint in path:
        if joint.mimics:
            raise RobotError(
                f"{source.path}: joint {shown(joint.name)} mimics another one, expected a plain joint;"
                " say it as a [[coupling]] in robot.toml"
            )
        if joint.kind not in (*KINDS, "fixed"):
            raise RobotError(
                f"{source.path}: joint {shown(joint.name)} is of type {shown(joint.kind)}, expected one of"
                f" {', '.join(KINDS)}, fixed"
            )
    return path[::-1]


def _segments(path: list[UrdfJoint]) -> Array:
    """The constant transforms before, between and behind the moving joints, link frame to link frame."""
    segments = [np.eye(4)]
    for joint in path:
        segments[-1] = segments[-1] @ joint.origin
        if joint.kind != "fixed":
            segments.append(np.eye(4))
    return np.array(segments)


def _z_onto(axis: Array) -> Array:
    """A rotation (4, 4) that carries z onto a unit vector; the identity for z itself."""
    across, beside = perpendicular_basis(axis)
    return transform(np.stack([across, beside, axis], axis=1), np.zeros(3))


def _core_joint(joint: UrdfJoint, source: InputText) -> Joint:
    limits = (-np.inf, np.inf) if joint.kind == "continuous" else joint.limits
    if not limits[0] < limits[1]:
        raise RobotError(
            f"{source.path}: joint {shown(joint.name)} has the limits {limits[0]:g} and {limits[1]:g},"
            " expected the lower first"
        )
    return Joint(KINDS[joint.kind], limits)


def _masses(
    root: ElementTree.Element, joints: dict[str, UrdfJoint], moving: list[UrdfJoint], back: Array, source: InputText
) -> tuple[LinkMass, ...]:
    inertias = {
        link.get("name", ""): _inertia(element, source, link.get("name", ""))
        for link in root.findall("link")
        if (element := link.find("inertial")) is not None
    }
    lumps = lumped_masses(joints, moving, inertias)
    return tuple(
        LinkMass(lump.mass_kg, tuple(float(v) for v in apply(turn, lump.centre_m)))
        for lump, turn in zip(lumps, back[: len(lumps)], strict=True)
    )


def _inertia(element: ElementTree.Element, source: InputText, link: str) -> LinkInertia:
    place = f"{source.path}: link {shown(link)}, inertial"
    mass = element.find("mass")
    value = _number("" if mass is None else mass.get("value", ""), f"{place} mass")
    if value < 0:
        raise RobotError(f"{place}: mass {value:g} kg, expected a number >= 0")
    return LinkInertia(value, _origin(element, place)[:3, 3])


def _origin(element: ElementTree.Element, place: str) -> Array:
    """An origin element's transform, (4, 4): xyz in m, then roll, pitch, yaw about fixed axes in rad."""
    origin = element.find("origin")
    xyz = _three(origin, "xyz", (0.0, 0.0, 0.0), place)
    roll, pitch, yaw = _three(origin, "rpy", (0.0, 0.0, 0.0), place)
    about_x, about_y = rotation_about([1, 0, 0], roll), rotation_about([0, 1, 0], pitch)
    return transform(rotation_about([0, 0, 1], yaw) @ about_y @ about_x, xyz)


def _three(
    element: ElementTree.Element | None, name: str, default: tuple[float, float, float], place: str
) -> tuple[float, ...]:
    text = None if element is None else element.get(name)
    if text is None:
        return default
    words = text.split()
    if len(words) != 3:
        raise RobotError(f"{place}: {name} = {shown(text)}, expected three numbers")
    return tuple(_number(word, f"{place}: {name}") for word in words)


def _number(text: str, place: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not isfinite(value) or abs(value) > HUGE:
        raise RobotError(f"{place} = {shown(text)}, expected a number")
    return value
