"""Poses as CSV files: every way of writing them, and every mistake said with its row and column."""

import csv
from pathlib import Path

import numpy as np
import pytest
from random_arms import random_rotation

from core.errors import CampaignError
from core.geometry import rotation_about
from core.pose_files import poses_csv, poses_of_bytes, read_poses
from core.rotations import quaternions, turns_of_rotations
from core.twin.irb_l6_arm import nominal_robot
from core.twin.scara import cell as scara_cell

HEAD = "pose,x_mm,y_mm,z_mm,qw,qx,qy,qz\n"


def write(folder: Path, text: str) -> Path:
    path = folder / "poses.csv"
    path.write_text(text, encoding="utf-8")
    return path


def random_poses(count: int) -> np.ndarray:
    rng = np.random.default_rng(2)
    out = np.tile(np.eye(4), (count, 1, 1))
    out[:, :3, :3] = [random_rotation(rng) for _ in range(count)]
    out[:, :3, 3] = rng.uniform(-2, 2, (count, 3))
    return out


def test_quaternions_and_turns_and_units_say_the_same(tmp_path: Path) -> None:
    poses, robot = random_poses(20), nominal_robot()
    four, three = quaternions(poses[:, :3, :3]), turns_of_rotations(poses[:, :3, :3])
    ways = {
        "x_mm,y_mm,z_mm,qw,qx,qy,qz": np.hstack([poses[:, :3, 3] * 1e3, four]),
        "x_m,y_m,z_m,rx_deg,ry_deg,rz_deg": np.hstack([poses[:, :3, 3], np.rad2deg(three)]),
        "rz_rad,rx_rad,ry_rad,z_mm,y_m,x_mm": np.hstack(
            [three[:, [2, 0, 1]], poses[:, 2:3, 3] * 1e3, poses[:, 1:2, 3], poses[:, :1, 3] * 1e3]
        ),
    }
    for header, values in ways.items():
        rows = "\n".join(",".join(repr(float(v)) for v in row) for row in values)
        found = read_poses(write(tmp_path, f"{header}\n{rows}\n"), robot)
        np.testing.assert_allclose(found.poses, poses, rtol=0, atol=1e-12)
        assert found.names == tuple(str(k) for k in range(1, 21))
        assert found.near is None


def test_turns_are_about_fixed_axes_x_then_y_then_z(tmp_path: Path) -> None:
    path = write(tmp_path, "x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg\n1,2,3,90,0,90\n")
    rotation = read_poses(path, nominal_robot()).poses[0, :3, :3]
    expected = rotation_about([0, 0, 1], np.pi / 2) @ rotation_about([1, 0, 0], np.pi / 2)
    np.testing.assert_allclose(rotation, expected, rtol=0, atol=1e-15)


@pytest.mark.parametrize("angles", ["qw,qx,qy,qz", "rx_deg,ry_deg,rz_deg", "rx_rad,ry_rad,rz_rad"])
def test_what_is_written_is_read_back(angles: str, tmp_path: Path) -> None:
    robot, poses = nominal_robot(), random_poses(12)
    values = quaternions(poses[:, :3, :3])
    if angles.startswith("r"):
        values = turns_of_rotations(poses[:, :3, :3]) * (180 / np.pi if "deg" in angles else 1)
    rows = "\n".join(
        ",".join([f'"p, {k}"', *(repr(float(v)) for v in [*poses[k, :3, 3], *values[k]])]) for k in range(12)
    )
    asked = read_poses(write(tmp_path, f"pose,x_m,y_m,z_m,{angles}\n{rows}\n"), robot)
    commanded = np.random.default_rng(1).normal(size=(12, 6))
    poses[4], commanded[4] = np.nan, np.nan
    text = poses_csv(asked, robot, poses, commanded, ["ok"] * 4 + ["unreachable"] + ["ok"] * 7)
    header = text.splitlines()[0]
    assert header == f"pose,x_m,y_m,z_m,{angles},q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,status"
    rows = list(csv.reader(text.splitlines()))
    assert rows[5] == ["p, 4", *[""] * (len(rows[0]) - 2), "unreachable"]
    kept = [row for row in text.splitlines() if "unreachable" not in row]
    again = read_poses(write(tmp_path, "\n".join(kept) + "\n"), robot)
    here = np.arange(12) != 4
    np.testing.assert_allclose(again.poses, poses[here], rtol=0, atol=1e-12)
    np.testing.assert_allclose(again.near, commanded[here], rtol=0, atol=1e-12)
    assert again.names[3] == "p, 3"


def test_of_two_quaternions_the_nearer_one_is_written(tmp_path: Path) -> None:
    asked = read_poses(write(tmp_path, HEAD + "a,0,0,0,-1,0,0,0\nb,0,0,0,1,0,0,0\n"), nominal_robot())
    text = poses_csv(asked, nominal_robot(), asked.poses, np.zeros((2, 6)), ["ok", "ok"])
    rows = list(csv.DictReader(text.splitlines()))
    assert [row["qw"] for row in rows] == ["-1", "1"]


def test_joints_that_slide_have_their_own_unit(tmp_path: Path) -> None:
    robot = scara_cell().robot
    slide = int(np.flatnonzero(robot.sliding)[0]) + 1
    joints = ",".join(f"q{j}_{'mm' if j == slide else 'deg'}" for j in range(1, 5))
    path = write(tmp_path, f"x_mm,y_mm,z_mm,qw,qx,qy,qz,{joints}\n1,2,3,1,0,0,0,1,1,1,1\n")
    near = read_poses(path, robot).near[0]
    expected = np.where(robot.sliding, 1e-3, np.deg2rad(1.0))
    np.testing.assert_allclose(near, expected)


ROW = "a,1,2,3,1,0,0,0\n"
WRONG = [
    ("pose,x_mm,y_mm,qw,qx,qy,qz\na,1,2,1,0,0,0\n", ["row 1", "z_mm"]),
    ("pose,x,y_mm,z_mm,qw,qx,qy,qz\n" + ROW, ["row 1", "column x", "no unit"]),
    ("pose,x_cm,y_mm,z_mm,qw,qx,qy,qz\n" + ROW, ["row 1", "x_cm"]),
    ("pose,x_mm,y_mm,z_mm\na,1,2,3\n", ["row 1", "no orientation", "rx_deg"]),
    ("pose,x_mm,y_mm,z_mm,qw,qx,qy\na,1,2,3,1,0,0\n", ["row 1", "qz", "missing"]),
    ("pose,x_mm,y_mm,z_mm,rx_deg,ry_deg\na,1,2,3,1,0\n", ["row 1", "rz_deg"]),
    ("pose,x_mm,y_mm,z_mm,qw,qx,qy,qz,rx_deg\na,1,2,3,1,0,0,0,4\n", ["row 1", "twice"]),
    (HEAD + ROW + "b,1,two,3,1,0,0,0\n", ["row 3", "y_mm", "'two'", "a number"]),
    (HEAD + ROW + "b,1,,3,1,0,0,0\n", ["row 3", "y_mm", "empty", "a number"]),
    (HEAD + ROW + "b,1,2,3,1,0.5,0,0\n", ["row 3", "qw, qx, qy, qz", "1.118", "expected 1"]),
    (HEAD + ROW + "b,1,2,3,0,0,0,0\n", ["row 3", "length 0"]),
    (HEAD + ROW + "b,1,2,3,nan,0,0,1\n", ["row 3", "qw"]),
    (HEAD + ",1,2,3,1,0,0,0\n", ["row 2", "pose", "empty"]),
    (HEAD, ["no rows", "one row for a pose"]),
    (HEAD.replace("qz", "qz,q7_deg") + "a,1,2,3,1,0,0,0,5\n", ["row 1", "q7_deg", "q6"]),
    (HEAD.replace("qz", "qz,q1_mm") + "a,1,2,3,1,0,0,0,5\n", ["row 1", "q1_mm"]),
    (HEAD.replace("qz", "qz,q1_deg") + "a,1,2,3,1,0,0,0,5\n", ["row 1", "q2_deg"]),
]


@pytest.mark.parametrize(("text", "words"), WRONG, ids=[str(k) for k in range(len(WRONG))])
def test_what_is_wrong_is_said(text: str, words: list[str], tmp_path: Path) -> None:
    path = write(tmp_path, text)
    with pytest.raises(CampaignError) as refused:
        read_poses(path, nominal_robot())
    for word in (str(path), *words):
        assert word in str(refused.value)


def test_poses_may_be_pasted_with_tabs_as_spreadsheets_copy_them() -> None:
    poses = random_poses(4)
    four = quaternions(poses[:, :3, :3])
    header = "x_mm,y_mm,z_mm,qw,qx,qy,qz"
    values = np.hstack([poses[:, :3, 3] * 1e3, four])
    text = "\n".join([header, *(",".join(repr(float(v)) for v in row) for row in values)])
    for pasted in (text, text.replace(",", "\t"), text.replace("\n", "\r\n") + "\r\n"):
        found = poses_of_bytes(pasted.encode(), "pasted poses", nominal_robot())
        np.testing.assert_allclose(found.poses, poses, rtol=0, atol=1e-12)
    with pytest.raises(CampaignError, match=r"^pasted poses, row 3, column y_mm: 'here', expected a number"):
        poses_of_bytes(f"{header}\n1,2,3,1,0,0,0\n1,here,3,1,0,0,0\n".encode(), "pasted poses", nominal_robot())
    for data, words in ((b"", "is empty"), (b"\xff", "is not UTF-8"), (b"x" * 9_000_000, "9.0 MB, expected at most 8")):
        with pytest.raises(CampaignError, match=words):
            poses_of_bytes(data, "pasted poses", nominal_robot())
