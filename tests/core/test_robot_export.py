"""The calibrated chain in other tools' files: read back, it is the same chain to the last digits."""

import json
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from arms_in_use import arm
from random_arms import random_line, random_motion

from core.dh_export import dh_chain, dh_forward, dh_json, dh_warnings
from core.geometry import Array, Line, invert, rotation_about, transform
from core.input_files import InputText
from core.json_records import JsonRecord
from core.kinematics import forward
from core.robot import Joint, JointKind, Robot
from core.robot_builders import DhRow, robot_from_dh
from core.robot_export import chain_json, mjcf_text, urdf_text
from core.robot_json import robot_of_record
from core.rotations import rotations_of_quaternions
from core.twin.irb_l6_arm import nominal_robot
from core.twin.noise import Noise
from core.urdf import parse_urdf


def robots() -> dict[str, Robot]:
    rng = np.random.default_rng(8)
    kinds = [JointKind.REVOLUTE, JointKind.PRISMATIC, JointKind.REVOLUTE]
    odd = Robot(
        'a "quoted" <name> & more',
        tuple(Joint(kind) for kind in kinds),
        np.stack([random_motion(rng) for _ in kinds]),
        random_motion(rng),
    )
    right = [
        transform(rotation_about([0, 1.0, 0], np.pi / 2), [0.1, 0, 0]),
        transform(np.diag([1.0, -1, -1]), np.zeros(3)),
    ]
    return {
        "l6": arm("l6", Noise()).robot,
        "scara": arm("scara", Noise()).robot,
        "odd": odd,
        "right angles": Robot(
            "right", (Joint(JointKind.REVOLUTE, (-1.0, 2.0)), Joint(JointKind.REVOLUTE)), np.array(right)
        ),
    }


def random_net(robot: Robot) -> Array:
    return np.random.default_rng(3).uniform(-2, 2, (40, robot.joint_count))


def by_bodies(text: str, net: Array) -> Array:
    """Forward kinematics of an MJCF file as its makers describe it: nested bodies, then the site."""
    body = ElementTree.fromstring(text).find("worldbody/body")
    pose = np.tile(np.eye(4), (len(net), 1, 1))
    column = 0
    while True:
        site, inner = body.find("site"), body.find("body")
        if inner is None:
            return pose @ place(site)
        body = inner
        pose = pose @ place(body)
        joint = body.find("joint")
        assert joint.get("axis") == "0 0 1"
        slides = joint.get("type") == "slide"
        moved = np.tile(np.eye(4), (len(net), 1, 1))
        if slides:
            moved[:, 2, 3] = net[:, column]
        else:
            moved[:, :3, :3] = rotation_about([0, 0, 1.0], net[:, column])
        pose, column = pose @ moved, column + 1


def place(element: ElementTree.Element) -> Array:
    position, turn = (np.array(element.get(key).split(), dtype=float) for key in ("pos", "quat"))
    return transform(rotations_of_quaternions(turn[None])[0], position)


@pytest.mark.parametrize("which", list(robots()))
def test_urdf_is_read_back_as_the_same_chain(which: str) -> None:
    robot = robots()[which]
    text = urdf_text(robot)
    chain = parse_urdf(InputText(Path("out.urdf"), text.encode(), text), "base_link", "tool")
    back = chain.robot(robot.name, chain.joints, (), None)
    assert chain.name == robot.name
    assert [j.kind for j in back.joints] == [j.kind for j in robot.joints]
    for found, own in zip(back.joints, robot.joints, strict=True):
        if np.isfinite(own.limits).all():
            assert found.limits == own.limits
    net = random_net(robot)
    np.testing.assert_allclose(forward(back, net), forward(robot, net), rtol=0, atol=1e-13)


@pytest.mark.parametrize("which", list(robots()))
def test_mjcf_is_the_same_chain(which: str) -> None:
    robot = robots()[which]
    text = mjcf_text(robot)
    net = random_net(robot)
    np.testing.assert_allclose(by_bodies(text, net), forward(robot, net), rtol=0, atol=1e-13)
    root = ElementTree.fromstring(text)
    assert root.get("model") == robot.name
    assert root.find("compiler").get("angle") == "radian"
    joints = list(root.iter("joint"))
    assert [joint.get("name") for joint in joints] == [f"joint_{k}" for k in range(1, robot.joint_count + 1)]
    for joint, own in zip(joints, robot.joints, strict=True):
        if np.isfinite(own.limits).all():
            assert tuple(map(float, joint.get("range").split())) == own.limits
        else:
            assert joint.get("limited") == "false"


def test_json_is_the_same_chain() -> None:
    ready = arm("l6", Noise())
    record = JsonRecord(json.loads(chain_json(ready)), Path("out.json"))
    back = robot_of_record(record.record("robot"))
    net = random_net(ready.robot)
    np.testing.assert_allclose(forward(back, net), forward(ready.robot, net), rtol=0, atol=1e-14)
    assert record.numbers("base_to_instrument", (4, 4))[:3, 3] == pytest.approx(ready.base[:3, 3] * 1e3, rel=1e-15)


@pytest.mark.parametrize("which", list(robots()))
def test_denavit_hartenberg_rows_reproduce_the_chain(which: str) -> None:
    robot = robots()[which]
    found = dh_chain(robot)
    net = random_net(robot)
    again = dh_forward(found.base, found.rows, found.tool, robot.sliding, net)
    np.testing.assert_allclose(again, forward(robot, net), rtol=0, atol=1e-9)
    assert max(found.position_error_m, found.rotation_error) < 1e-9
    assert not any("miss" in sentence for sentence in dh_warnings(found))


def test_rows_are_in_the_standard_notation() -> None:
    """A robot that was made from such rows gives rows of the same lengths and twists, and the same chain."""
    rows = [DhRow(0.3, 0.4, 0.1, 1.2), DhRow(-0.2, 0.05, 0.5, -0.8), DhRow(0.7, -0.1, 0.2, 0.9)]
    robot = robot_from_dh("three", [Joint(JointKind.REVOLUTE)] * 3, rows)
    found = dh_chain(robot).rows
    for own, row in zip(rows[:2], found[:2], strict=True):
        sign = np.sign(row.a_m * own.a_m)
        np.testing.assert_allclose(
            [row.d_m, sign * row.a_m, sign * row.alpha_rad], [own.d_m, own.a_m, own.alpha_rad], atol=1e-12
        )
        np.testing.assert_allclose(np.sin(row.theta_rad - own.theta_rad), 0.0, atol=1e-12)


def test_nearly_parallel_axes_are_warned_of_with_their_condition() -> None:
    found = dh_chain(arm("l6", Noise()).robot)
    warned = dh_warnings(found)
    assert len(warned) == 2
    for row, sentence in zip((1, 2), warned, strict=True):
        first, second = arm("l6", Noise()).drives.axes[row : row + 2]
        sine = np.linalg.norm(np.cross(first.direction, second.direction))
        assert found.conditions[row] == pytest.approx(1 / sine, rel=1e-6)
        assert f"joints {row + 1} and {row + 2}" in sentence
        assert f"condition {1 / sine:.4g}" in sentence
    document = json.loads(dh_json(arm("l6", Noise()).robot))
    assert document["warnings"] == list(warned)
    assert document["largest_position_error_mm"] < 1e-6
    assert [row["joint"] for row in document["rows"]] == [1, 2, 3, 4, 5, 6]


def test_exactly_parallel_axes_are_a_choice_and_no_failure() -> None:
    robot = nominal_robot()
    found = dh_chain(robot)
    assert found.position_error_m < 1e-12
    assert np.isinf(found.conditions[[1, 2]]).all()
    assert sum("parallel" in sentence for sentence in dh_warnings(found)) == 2
    assert json.loads(dh_json(robot))["rows"][1]["condition"] is None


def test_the_condition_is_what_an_error_across_the_axes_makes_of_d() -> None:
    """Moving the second of two nearly parallel axes sideways moves d by the condition times as much."""
    tilt, shift = np.deg2rad(0.5), 1e-6
    rows = []
    for sideways in (0.0, shift):
        link = transform(rotation_about([0.6, 0.8, 0], tilt), [0.5, 0, 0])
        # Across the axes and across their normal.
        link[:3, 3] += sideways * np.array([-0.8, 0.6, 0.0])
        robot = Robot("two", (Joint(JointKind.REVOLUTE),) * 2, np.stack([link, np.eye(4)]))
        rows.append(dh_chain(robot))
    moved = abs(rows[1].rows[0].d_m - rows[0].rows[0].d_m)
    assert moved == pytest.approx(shift * rows[0].conditions[0], rel=1e-3)


def test_where_the_base_is_and_where_frames_sit_on_their_axes_is_free() -> None:
    rng = np.random.default_rng(1)
    lines = [random_line(rng) for _ in range(4)]
    frames = np.stack([on(line, rng) for line in lines] + [random_motion(rng)])
    links = invert(frames[:-1]) @ frames[1:]
    robot = Robot("free", (Joint(JointKind.REVOLUTE),) * 4, links, frames[0])
    other = np.stack([on(line, rng) for line in lines] + [frames[-1]])
    same = replace(robot, link_transforms=invert(other[:-1]) @ other[1:], base_transform=other[0])
    first, second = dh_chain(robot), dh_chain(same)
    for one, two in zip(first.rows[1:3], second.rows[1:3], strict=True):
        assert abs(one.a_m) == pytest.approx(abs(two.a_m), abs=1e-12)
        assert one.d_m == pytest.approx(two.d_m, abs=1e-12)


def on(line: Line, rng: np.random.Generator) -> Array:
    """A frame with its z-axis on a line, anywhere along and about it."""
    across = np.cross(line.direction, rng.normal(size=3))
    across /= np.linalg.norm(across)
    rotation = np.stack([across, np.cross(line.direction, across), line.direction], axis=1)
    return transform(rotation, line.point_m + rng.normal() * line.direction)
