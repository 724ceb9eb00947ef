"""A calibrated chain for other tools: URDF, MJCF and plain transforms, every number to the last digit.

All three place frame i+1 in frame i by a constant rigid motion, and turn frame i about (slide it along) its own z-axis
by the joint's net displacement. They hold the geometry alone: what drives and couplings make of commands is in
calibration.json.
"""

from xml.sax.saxutils import quoteattr

import numpy as np

from core.calibrated_arm import CalibratedArm
from core.geometry import Array
from core.json_values import json_text
from core.robot import Joint, JointKind, Robot
from core.robot_json import exact_mm, robot_record
from core.rotations import quaternions, turns_of_rotations
from core.version import VERSION

CHAIN_FORMAT = "trueaxis-chain/1"
NO_LIMIT = 1e6
"""Stands for a limit that a joint has not, where a format wants a number; rad or m."""
GEOMETRY_ONLY = (
    "Joint values are net displacements (rad, m), not commands: drives and couplings are in calibration.json."
)


def chain_json(arm: CalibratedArm) -> str:
    """The chain as transforms: from the base frame to frame 1, frame i+1 to frame i, at last the tool to frame n."""
    return json_text(
        {
            "format": CHAIN_FORMAT,
            "trueaxis": VERSION,
            "units": "translations in mm, limits in deg or mm; rows first",
            "chain": "base_transform . M_1 . link_transforms[0] . M_2 . link_transforms[1] ... M_n ."
            " link_transforms[n-1]; M_i turns about, or slides along, z by the net displacement of joint i",
            "note": GEOMETRY_ONLY,
            "calibrated_with": arm.source,
            "digest_sha256": arm.digest or None,
            "base_to_instrument": exact_mm(arm.base),
            "robot": robot_record(arm.robot),
        }
    )


def urdf_text(robot: Robot) -> str:
    """The chain as URDF: base_link, link_1 .. link_n with joint_1 .. joint_n, and tool behind a fixed joint."""
    lines = [
        '<?xml version="1.0"?>',
        f"<!-- {GEOMETRY_ONLY} Effort and velocity are not known and 0. -->",
        f"<robot name={quoteattr(robot.name)}>",
        '  <link name="base_link"/>',
    ]
    parents = [robot.base_transform, *robot.link_transforms[:-1]]
    for number, (joint, origin) in enumerate(zip(robot.joints, parents, strict=True), 1):
        parent = "base_link" if number == 1 else f"link_{number - 1}"
        lines += [f'  <link name="link_{number}"/>', *_urdf_joint(number, joint, parent, origin)]
    lines += [
        '  <link name="tool"/>',
        '  <joint name="tool_joint" type="fixed">',
        f'    <parent link="link_{robot.joint_count}"/>',
        '    <child link="tool"/>',
        f"    {_urdf_origin(robot.link_transforms[-1])}",
        "  </joint>",
        "</robot>",
    ]
    return "\n".join(lines) + "\n"


def mjcf_text(robot: Robot) -> str:
    """The chain as MJCF: nested bodies link_1 .. link_n with joints joint_1 .. joint_n, the tool as a site."""
    lines = [
        f"<!-- {GEOMETRY_ONLY} Masses are not known: the compiler's bounds stand for them. -->",
        f"<mujoco model={quoteattr(robot.name)}>",
        '  <compiler angle="radian" boundmass="1" boundinertia="0.01"/>',
        "  <worldbody>",
        '    <body name="base_link">',
    ]
    parents = [robot.base_transform, *robot.link_transforms[:-1]]
    for number, (joint, place) in enumerate(zip(robot.joints, parents, strict=True), 1):
        pad = "  " * (number + 2)
        lines += [f'{pad}<body name="link_{number}" {_mjcf_place(place)}>', f"{pad}  {_mjcf_joint(number, joint)}"]
    lines.append("  " * (robot.joint_count + 3) + f'<site name="tool" {_mjcf_place(robot.link_transforms[-1])}/>')
    lines += ["  " * (depth + 2) + "</body>" for depth in range(robot.joint_count, -1, -1)]
    lines += ["  </worldbody>", "</mujoco>"]
    return "\n".join(lines) + "\n"


def _urdf_joint(number: int, joint: Joint, parent: str, origin: Array) -> list[str]:
    unlimited = not np.isfinite(joint.limits).any()
    kind = "prismatic" if joint.slides else "continuous" if unlimited else "revolute"
    lines = [f'  <joint name="joint_{number}" type="{kind}">']
    if joint.kind is JointKind.PASSIVE:
        lines.append(f"    <!-- without a motor: driven through a coupling by joint {number - 1} -->")
    lines += [f'    <parent link="{parent}"/>', f'    <child link="link_{number}"/>', f"    {_urdf_origin(origin)}"]
    lines.append('    <axis xyz="0 0 1"/>')
    if kind != "continuous":
        low, high = _finite_limits(joint)
        lines.append(f'    <limit lower="{_exact(low)}" upper="{_exact(high)}" effort="0" velocity="0"/>')
    return [*lines, "  </joint>"]


def _urdf_origin(transform: Array) -> str:
    turns = turns_of_rotations(transform[None, :3, :3])[0]
    return f'<origin xyz="{_words(transform[:3, 3])}" rpy="{_words(turns)}"/>'


def _mjcf_joint(number: int, joint: Joint) -> str:
    kind = "slide" if joint.slides else "hinge"
    head = f'<joint name="joint_{number}" type="{kind}" axis="0 0 1"'
    if not np.isfinite(joint.limits).any():
        return f'{head} limited="false"/>'
    return f'{head} limited="true" range="{_words(_finite_limits(joint))}"/>'


def _mjcf_place(transform: Array) -> str:
    turn = quaternions(transform[None, :3, :3])[0]
    return f'pos="{_words(transform[:3, 3])}" quat="{_words(turn)}"'


def _finite_limits(joint: Joint) -> tuple[float, float]:
    low, high = joint.limits
    return max(low, -NO_LIMIT), min(high, NO_LIMIT)


def _words(values: Array | tuple[float, ...]) -> str:
    return " ".join(_exact(float(v)) for v in values)


def _exact(value: float) -> str:
    return f"{value + 0.0:.17g}"
