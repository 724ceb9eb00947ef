"""URDF chains against a forward kinematics written independently, joint by joint, in the URDF's own link frames."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.campaign_files import read_campaign
from core.errors import RobotError
from core.geometry import Array, apply
from core.kinematics import forward, link_frames
from core.robot import Robot
from core.robot_files import read_robot

ROBOT_TOML = """format = "trueaxis-robot/1"
name = "from urdf"
urdf = "arm.urdf"
base_link = "base"
tip_link = "tip"
"""

MOVING = [
    # name, type, xyz, rpy, axis
    ("j1", "revolute", (0.1, -0.2, 0.3), (0.4, -0.5, 0.6), (1.0, 2.0, -3.0)),
    ("j2", "prismatic", (0.0, 0.4, -0.1), (-1.0, 0.2, 2.0), (0.0, 0.0, -1.0)),
    ("j3", "continuous", (0.2, 0.1, 0.5), (3.0, 1.5, -0.3), None),
    ("j4", "revolute", (-0.3, 0.0, 0.2), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
]
FIXED = {
    "before": ((0.01, 0.02, 0.03), (0.1, 0.2, 0.3)),
    "between": ((-0.04, 0.05, 0.06), (-0.4, 0.5, 0.6)),
    "behind": ((0.07, 0.08, -0.09), (0.7, -0.8, 0.9)),
}


def joint_xml(
    name: str, kind: str, parent: str, child: str, xyz: tuple, rpy: tuple, axis: tuple | None = None, more: str = ""
) -> str:
    numbers = {key: " ".join(map(repr, value)) for key, value in (("xyz", xyz), ("rpy", rpy), ("axis", axis or ()))}
    stated = f'<axis xyz="{numbers["axis"]}"/>' if axis else ""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{numbers["xyz"]}" rpy="{numbers["rpy"]}"/>{stated}{more}</joint>'
    )


def links_xml(masses: bool) -> str:
    inertial = '<inertial><origin xyz="0.1 0.2 0.3" rpy="1 2 3"/><mass value="2.5"/></inertial>' if masses else ""
    names = ("base", "world", "l1", "l2", "mid", "l3", "l4", "tip", "cover")
    return "".join(f'<link name="{name}">{inertial}</link>' for name in names)


def urdf(more: str = "", masses: bool = True, last: str = "revolute") -> str:
    chain = [("world", "l1"), ("l1", "l2"), ("mid", "l3"), ("l3", "l4")]
    limit = '<limit lower="-1.5" upper="2" effort="1" velocity="1"/>'
    joints = [
        joint_xml(name, last if name == "j4" else kind, *ends, xyz, rpy, axis, limit + (more if name == "j4" else ""))
        for (name, kind, xyz, rpy, axis), ends in zip(MOVING, chain, strict=True)
    ]
    for name, ends in (("before", ("base", "world")), ("between", ("l2", "mid")), ("behind", ("l4", "tip"))):
        joints.insert(0, joint_xml(name, "fixed", *ends, *FIXED[name]))
    joints.append(joint_xml("lid", "fixed", "l4", "cover", (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    return f'<?xml version="1.0" encoding="utf-8"?><robot name="odd">{links_xml(masses)}{"".join(joints)}</robot>'


def read(folder: Path, text: str, toml: str = ROBOT_TOML) -> Robot:
    (folder / "arm.urdf").write_text(text, encoding="utf-8")
    (folder / "robot.toml").write_text(toml, encoding="utf-8")
    return read_robot(folder / "robot.toml")


def placed(xyz: tuple, rpy: tuple) -> Array:
    out = np.eye(4)
    out[:3, :3] = Rotation.from_euler("xyz", rpy).as_matrix()
    out[:3, 3] = xyz
    return out


def link_poses(q: Array) -> list[Array]:
    """The pose of links l1, l2, l3, l4 and tip in the base link, by the definition of the format."""
    pose, poses = placed(*FIXED["before"]), []
    for (_, kind, xyz, rpy, axis), value in zip(MOVING, q, strict=True):
        direction = np.array(axis or (1.0, 0.0, 0.0))
        direction = direction / np.linalg.norm(direction)
        motion = np.eye(4)
        if kind == "prismatic":
            motion[:3, 3] = direction * value
        else:
            motion[:3, :3] = Rotation.from_rotvec(direction * value).as_matrix()
        pose = pose @ placed(xyz, rpy) @ motion
        poses.append(pose)
        pose = pose @ (placed(*FIXED["between"]) if len(poses) == 2 else np.eye(4))
    return [*poses, pose @ placed(*FIXED["behind"])]


@pytest.fixture
def configurations() -> Array:
    return np.random.default_rng(3).uniform(-1.4, 1.4, (20, 4))


def test_the_tip_goes_where_the_format_says(tmp_path: Path, configurations: Array) -> None:
    robot = read(tmp_path, urdf())
    for q in configurations:
        np.testing.assert_allclose(forward(robot, q)[0], link_poses(q)[-1], atol=1e-14)


def test_moving_frames_carry_points_of_urdf_links(tmp_path: Path, configurations: Array) -> None:
    robot = read(tmp_path, urdf())
    point = np.array([0.3, -0.7, 0.2])
    assert robot.moving_frames is not None
    for q in configurations:
        ours = apply(link_frames(robot, q)[0, :4] @ robot.moving_frames, point)
        theirs = [apply(pose, point) for pose in link_poses(q)[:4]]
        np.testing.assert_allclose(ours, theirs, atol=1e-14)


def test_kinds_and_limits(tmp_path: Path) -> None:
    robot = read(tmp_path, urdf())
    assert [joint.kind for joint in robot.joints] == ["revolute", "prismatic", "revolute", "revolute"]
    assert robot.joints[1].limits == (-1.5, 2.0)
    assert robot.joints[2].limits == (-np.inf, np.inf)


def test_joint_tables_add_what_a_urdf_cannot_say(tmp_path: Path) -> None:
    tables = [
        '[[joint]]\nkind = "revolute"\nlimits = [-10, 20]\n',
        '[[joint]]\nkind = "prismatic"\n',
        '[[joint]]\nkind = "passive"\n',
        '[[joint]]\nkind = "revolute"\ndrive_ratio = 1.5\n',
    ]
    coupling = "[[coupling]]\nfrom = 2\nto = 3\ngain = -1.0\n"
    robot = read(tmp_path, urdf(), ROBOT_TOML + "".join(tables) + coupling)
    assert robot.joints[0].limits == pytest.approx(np.deg2rad([-10, 20]))
    assert robot.joints[1].limits == (-1.5, 2.0)
    assert robot.commanded.tolist() == [True, True, False, True]
    assert robot.joints[3].drive_ratio == 1.5
    with pytest.raises(RobotError, match="joint 1 is prismatic, but revolute in the URDF"):
        read(tmp_path, urdf(), ROBOT_TOML + tables[1] * 4)
    with pytest.raises(RobotError, match=r"3 \[\[joint\]\] tables, but .* 4 moving joints"):
        read(tmp_path, urdf(), ROBOT_TOML + tables[0] * 3)


def test_masses_move_with_their_joint(tmp_path: Path, configurations: Array) -> None:
    """The common centre of each moving group, placed by both kinematics; links fixed to it, the lid too, count."""
    robot = read(tmp_path, urdf())
    assert [link.mass_kg for link in robot.links] == [2.5, 5.0, 2.5, 7.5]
    com = np.array([0.1, 0.2, 0.3])
    own = apply(np.eye(4), com)
    behind, between = apply(placed(*FIXED["behind"]), com), apply(placed(*FIXED["between"]), com)
    groups = [own, (own + between) / 2, own, (own + behind + own + [1.0, 0, 0]) / 3]
    for q in configurations:
        frames = link_frames(robot, q)[0]
        for frame, link, pose, group in zip(frames[:4], robot.links, link_poses(q)[:4], groups, strict=True):
            np.testing.assert_allclose(apply(frame, link.centre_m), apply(pose, group), atol=1e-14)


def test_masses_are_all_there_or_not_at_all(tmp_path: Path) -> None:
    assert read(tmp_path, urdf(masses=False)).links == ()


def test_targets_are_told_in_the_urdfs_link_frame(tmp_path: Path) -> None:
    robot = read(tmp_path, urdf())
    (tmp_path / "campaign.toml").write_text(
        'format = "trueaxis-campaign/1"\n[[target]]\nname = "T"\nlink = 3\nxyz_mm = [300, -700, 200]\n'
    )
    header = "record,phase,pose,target,q1_deg,q2_mm,q3_deg,q4_deg,x_mm,y_mm,z_mm"
    (tmp_path / "measurements.csv").write_text(f"{header}\n1,pose,0,T,0,0,0,0,1,2,3\n")
    target = read_campaign(tmp_path).targets[0]
    placed_by_us = apply(link_frames(robot, np.zeros(4))[0, 2], target.point_m)
    np.testing.assert_allclose(placed_by_us, apply(link_poses(np.zeros(4))[2], [0.3, -0.7, 0.2]), atol=1e-14)


def test_the_digest_covers_the_urdf_file(tmp_path: Path) -> None:
    read(tmp_path, urdf())
    (tmp_path / "campaign.toml").write_text('format = "trueaxis-campaign/1"\n[[target]]\nname = "T"\nlink = 3\n')
    header = "record,phase,pose,target,q1_deg,q2_mm,q3_deg,q4_deg,x_mm,y_mm,z_mm"
    (tmp_path / "measurements.csv").write_text(f"{header}\n1,pose,0,T,0,0,0,0,1,2,3\n")
    before = read_campaign(tmp_path).digest
    (tmp_path / "arm.urdf").write_text(urdf() + "\n", encoding="utf-8")
    assert read_campaign(tmp_path).digest != before


WRONG = [
    (urdf(more='<mimic joint="j1"/>'), "joint 'j4' mimics another one"),
    (urdf(last="floating"), "joint 'j4' is of type 'floating'"),
    (urdf().replace('child link="tip"', 'child link="tap"'), "no chain of joints leads"),
    (urdf().replace('child link="cover"', 'child link="tip"'), "link 'tip' is the child of two joints"),
    (urdf().replace('parent link="base"', 'parent link="tip"'), "no chain of joints leads"),
    (urdf().replace('xyz="1.0 2.0 -3.0"', 'xyz="0 0 0"'), "joint 'j1': the axis is zero"),
    (urdf().replace('xyz="1.0 2.0 -3.0"', 'xyz="1 2"'), "expected three numbers"),
    (urdf().replace('xyz="1.0 2.0 -3.0"', 'xyz="1 2 x"'), "'x', expected a number"),
    (urdf().replace('xyz="1.0 2.0 -3.0"', 'xyz="1 2 nan"'), "'nan', expected a number"),
    (urdf().replace('upper="2"', 'upper="-2"'), "the limits -1.5 and -2"),
    (urdf().replace('<parent link="l3"/>', ""), "joint 'j4' names no parent or no child link"),
    (urdf().replace('mass value="2.5"', 'mass value="-2.5"'), "mass -2.5 kg"),
    (urdf().replace("</robot>", ""), "not valid XML"),
    (urdf().replace("robot", "model"), "expected <robot>"),
    ('<!DOCTYPE robot [<!ENTITY a "b">]>' + urdf().partition("?>")[2], "DOCTYPE"),
    ("<robot>" + "<a/>" * 400_001 + "</robot>", "400000 tags"),
]


@pytest.mark.parametrize(("text", "words"), WRONG)
def test_a_wrong_urdf_is_named(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(RobotError) as told:
        read(tmp_path, text)
    assert words in str(told.value)
    assert "arm.urdf" in str(told.value)


def test_nothing_moves_between_neighbours(tmp_path: Path) -> None:
    with pytest.raises(RobotError, match="no joint moves between 'base' and 'world'"):
        read(tmp_path, urdf(), ROBOT_TOML.replace('"tip"', '"world"'))


def test_a_urdf_outside_the_folder_is_refused(tmp_path: Path) -> None:
    for name in ("../arm.urdf", "/tmp/arm.urdf"):
        with pytest.raises(RobotError, match="leads out of the folder"):
            read(tmp_path, urdf(), ROBOT_TOML.replace("arm.urdf", name))
