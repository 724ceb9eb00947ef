"""robot.toml: the three ways to say the geometry, what is refused, and the way back."""

from pathlib import Path

import numpy as np
import pytest
from campaign_texts import ROBOT_TOML
from hypothesis import given, settings
from hypothesis import strategies as st

from core.errors import RobotError
from core.geometry import Array
from core.kinematics import forward
from core.phi_model import PhiModel
from core.robot import Joint, JointKind, Robot
from core.robot_builders import DhRow, PhiTool, phi_model_of, phi_tool_of, robot_from_dh, robot_from_phi
from core.robot_files import read_robot
from core.robot_writer import dh_robot_toml, phi_robot_toml, write_robot

MM = 1e-3


def read_text(folder: Path, text: str) -> Robot:
    path = folder / "robot.toml"
    path.write_text(text, encoding="utf-8")
    return read_robot(path)


def turn(axis: str, degrees: float) -> Array:
    """A turn about x or z, written out by hand."""
    c, s = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
    if axis == "x":
        return np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1.0]])
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])


def shift(x: float, y: float, z: float) -> Array:
    out = np.eye(4)
    out[:3, 3] = x, y, z
    return out


def phi_frame(degrees: float) -> Array:
    """x = -sin, y along Z_i, z = cos: equation A2 in another way, as turns."""
    return turn("z", degrees) @ np.array([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]])


def test_a_phi_model_is_the_product_of_its_elementary_motions(tmp_path: Path) -> None:
    robot = read_text(tmp_path, ROBOT_TOML)
    first = shift(0, 0, 10 * MM) @ turn("z", -90) @ turn("x", 90)
    second = turn("z", -170) @ turn("x", 80)
    tool = (
        shift(0, 0, 3 * MM) @ turn("z", 60) @ shift(4 * MM, 0, 0) @ turn("x", 50) @ turn("z", 70) @ shift(0, 0, 8 * MM)
    )
    expected = (
        turn("z", 12) @ phi_frame(90) @ first @ turn("z", -34) @ phi_frame(0) @ second @ shift(0, 0, 0.25)
    ) @ phi_frame(20)
    net = [np.deg2rad(12), np.deg2rad(-34), 0.25]
    np.testing.assert_allclose(forward(robot, net)[0], expected @ tool, atol=1e-15)
    np.testing.assert_allclose(robot.phi_rad, [np.pi / 2, 0])


def test_without_a_tool_the_last_frame_is_frame_n(tmp_path: Path) -> None:
    head, _, tail = ROBOT_TOML.partition("[tool]")
    robot = read_text(tmp_path, head + tail[tail.index("[[coupling]]") :])
    np.testing.assert_array_equal(robot.link_transforms[-1], np.eye(4))


def test_joints_couplings_links_and_gravity(tmp_path: Path) -> None:
    robot = read_text(tmp_path, ROBOT_TOML)
    assert [joint.kind for joint in robot.joints] == ["revolute", "revolute", "prismatic"]
    np.testing.assert_allclose(robot.joints[0].limits, np.deg2rad([-170, 170]))
    np.testing.assert_allclose(robot.joints[2].limits, [-0.01, 0.5])
    assert robot.joints[1].limits == (-np.inf, np.inf)
    assert robot.joints[1].drive_ratio == 32 / 19
    assert robot.joints[1].transmission == "gear"
    (coupling,) = robot.couplings
    assert (coupling.source, coupling.target, coupling.gain) == (1, 2, -1.0)
    assert (coupling.compensated, coupling.form) == (False, "proportional")
    assert robot.links[1].centre_m == pytest.approx((1 * MM, 2 * MM, 3 * MM))
    assert robot.gravity_direction == (0, 0, -1)


def test_gravity_that_nobody_stated_is_unknown(tmp_path: Path) -> None:
    assert read_text(tmp_path, ROBOT_TOML[: ROBOT_TOML.index("[gravity]")]).gravity_direction is None


DH = [(30.0, 100.0, 200.0, 90.0), (-45.0, 0.0, 300.0, 0.0), (0.0, 50.0, 0.0, -90.0)]


def dh_text(rows: list[tuple[float, ...]] = DH) -> str:
    names = ("theta_deg", "d_mm", "a_mm", "alpha_deg")
    head, _, _ = ROBOT_TOML.partition("[[frame]]")
    blocks = ["[[dh]]\n" + "\n".join(f"{k} = {v}" for k, v in zip(names, row, strict=True)) for row in rows]
    return head + "\n".join(blocks) + "\n"


def test_denavit_and_hartenberg_is_the_product_of_its_elementary_motions(tmp_path: Path) -> None:
    robot = read_text(tmp_path, dh_text())
    expected = np.eye(4)
    for (theta, d, a, alpha), (angle, slide) in zip(DH, [(12, 0), (-34, 0), (0, 250)], strict=True):
        expected = expected @ turn("z", theta + angle) @ shift(0, 0, (d + slide) * MM)
        expected = expected @ shift(a * MM, 0, 0) @ turn("x", alpha)
    net = [np.deg2rad(12), np.deg2rad(-34), 0.25]
    np.testing.assert_allclose(forward(robot, net)[0], expected, atol=1e-15)
    assert robot.phi_rad is None


def test_a_link_of_denavit_and_hartenberg_has_its_frame_at_the_far_end(tmp_path: Path) -> None:
    """A centre of mass at the origin of DH frame i lies where the constant transform puts that origin."""
    links = "".join("[[link]]\nmass_kg = 1.0\ncom_mm = [0.0, 0.0, 0.0]\n" for _ in DH)
    robot = read_text(tmp_path, dh_text() + links)
    for link, transform in zip(robot.links, robot.link_transforms, strict=True):
        assert link.centre_m == pytest.approx(transform[:3, 3])


def test_a_robot_is_written_and_read_back(tmp_path: Path) -> None:
    robot = read_text(tmp_path, ROBOT_TOML)
    write_robot(tmp_path / "again.toml", robot)
    assert_same(read_robot(tmp_path / "again.toml"), robot)


def test_denavit_and_hartenberg_rows_are_written_and_read_back(tmp_path: Path) -> None:
    rows = [DhRow(np.deg2rad(t), d * MM, a * MM, np.deg2rad(u)) for t, d, a, u in DH]
    joints = [Joint(JointKind.REVOLUTE, (-3.0, 3.0)), Joint(JointKind.REVOLUTE), Joint(JointKind.PRISMATIC)]
    robot = robot_from_dh("written", joints, rows)
    assert_same(read_text(tmp_path, dh_robot_toml(robot, rows)), robot)


angles = st.floats(-7, 7)
lengths = st.floats(-2, 2)


@given(
    rows=st.lists(st.tuples(angles, lengths, lengths, angles, angles), max_size=5),
    tool=st.none() | st.builds(PhiTool, angles, lengths, lengths, angles, angles, angles, lengths),
)
@settings(max_examples=60, deadline=None, derandomize=True)
def test_any_phi_model_survives_the_file(
    tmp_path_factory: pytest.TempPathFactory, rows: list[tuple[float, ...]], tool: PhiTool | None
) -> None:
    model = PhiModel(*np.array(rows).reshape(-1, 5).T, sliding=np.zeros(len(rows) + 1, dtype=bool))
    robot = robot_from_phi("any", [Joint(JointKind.REVOLUTE)] * (len(rows) + 1), model, tool)
    path = tmp_path_factory.getbasetemp() / "any.toml"
    write_robot(path, robot, model)
    assert_same(read_robot(path), robot)
    np.testing.assert_allclose(phi_model_of(robot).link_transforms(), model.link_transforms(), atol=1e-12)


def test_a_tool_along_any_axis_is_found() -> None:
    quarter_turns = [np.eye(3), turn("x", 90)[:3, :3], turn("z", 90)[:3, :3] @ turn("x", 90)[:3, :3]]
    for rotation in quarter_turns:
        transform = shift(0.1, 0.2, 0.3)
        transform[:3, :3] = rotation
        tool = phi_tool_of(transform)
        assert tool is not None
        np.testing.assert_allclose(tool.transform(), transform, atol=1e-15)


WRONG = [
    ('format = "trueaxis-robot/1"', "", "format is missing"),
    ('kind = "prismatic"', 'kind = "sliding"', "[[joint]] number 3 kind = 'sliding'"),
    ("limits = [-170, 170]", "limits = [170, -170]", "limits = [170, -170], expected two numbers in deg"),
    ("limits = [-10, 500]", "limits = [500, -10]", "expected two numbers in mm"),
    ("limits = [-170, 170]", "limit = [-170, 170]", "no key 'limit'; it knows kind, limits"),
    ("drive_ratio = [32, 19]", "drive_ratio = [32, 0]", "drive_ratio = [32, 0]"),
    ("drive_ratio = [32, 19]", 'drive_ratio = "2:1"', "drive_ratio = '2:1'"),
    ("phi_deg = 90.0", "phi = 90.0", "[[frame]] number 1 has no key 'phi'"),
    ("a_mm = 10.0\n", "", "[[frame]] number 1 a_mm is missing"),
    ("a_mm = 10.0", "a_mm = nan", "a_mm = nan, expected a number"),
    ("a_mm = 10.0", "a_mm = true", "a_mm = True, expected a number"),
    ("gamma_deg", "gama_deg", "[tool] has no key 'gama_deg'"),
    ("to = 2", "to = 3", "from a joint to the next one up"),
    ("from = 1\nto = 2", "from = 3\nto = 4", "joint that is not there"),
    ("gain = -1.0", "gain = -1.0\nratio = 2", "[[coupling]] number 1 has no key 'ratio'"),
    ("mass_kg = 12.0", "mass_kg = -12.0", "at least 0"),
    ("mass_kg = 12.0", "mass = 12.0", "expected mass_kg"),
    ("[[link]]\nmass_kg = 1.0\ncom_mm = [0.0, 0.0, 0.0]", "", "2 [[link]] tables and 3 joints"),
    ("[0.0, 0.0, -2.0]", "[0.0, 0.0, 0.0]", "not zero"),
    ("[tool]", "[[dh]]\na_mm = 1\n[tool]", "given 2 times, by frame and dh"),
    ('name = "small arm"', 'name = "small\\narm"', "on one line"),
]


@pytest.mark.parametrize(("old", "new", "words"), WRONG)
def test_a_wrong_robot_is_named(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in ROBOT_TOML
    with pytest.raises(RobotError) as told:
        read_text(tmp_path, ROBOT_TOML.replace(old, new, 1))
    assert str(tmp_path / "robot.toml") in str(told.value)
    assert words in str(told.value)


def test_a_passive_joint_needs_its_coupling(tmp_path: Path) -> None:
    text = ROBOT_TOML.replace('kind = "revolute"', 'kind = "passive"', 1)
    with pytest.raises(RobotError, match="joint 1 is passive and no coupling drives it"):
        read_text(tmp_path, text)


def test_the_number_of_rows_must_fit(tmp_path: Path) -> None:
    with pytest.raises(RobotError, match=r"3 \[\[joint\]\] tables and 2 \[\[dh\]\] tables"):
        read_text(tmp_path, dh_text(DH[:2]))
    with pytest.raises(RobotError, match=r"3 \[\[joint\]\] tables and 0 \[\[frame\]\] tables"):
        read_text(tmp_path, ROBOT_TOML.partition("[[frame]]")[0])
    with pytest.raises(RobotError, match="phi-model's"):
        read_text(tmp_path, dh_text() + "[tool]\nh_mm = 3.0\n")


def test_additions_of_others_are_left_alone(tmp_path: Path) -> None:
    read_text(tmp_path, 'maker = "ASEA"\n' + ROBOT_TOML + "[controller]\nname = 'S2'\n")


BOMBS = ["a = " + "[" * 9_999, "a" + ".a" * 9_999 + " = 1", "a" + ' . "b \\" c"' * 9_999 + " = 1", "a = " + "9" * 9_999]


@pytest.mark.parametrize("text", BOMBS)
def test_a_toml_bomb_is_refused_at_once(tmp_path: Path, text: str) -> None:
    with pytest.raises(RobotError, match="TOML"):
        read_text(tmp_path, text)


def test_a_robot_not_on_its_base_frame_cannot_be_said() -> None:
    model = PhiModel(*np.zeros((5, 1)), sliding=np.zeros(2, dtype=bool))
    robot = robot_from_phi("moved", [Joint(JointKind.REVOLUTE)] * 2, model)
    object.__setattr__(robot, "base_transform", shift(1, 0, 0))
    with pytest.raises(RobotError, match="base frame"):
        phi_robot_toml(robot)


def assert_same(one: Robot, other: Robot) -> None:
    """Two robots agree, numbers to 1e-12."""
    assert one.name == other.name
    np.testing.assert_allclose(one.link_transforms, other.link_transforms, rtol=0, atol=1e-12)
    assert (one.phi_rad is None) == (other.phi_rad is None)
    if one.phi_rad is not None:
        np.testing.assert_allclose(one.phi_rad, other.phi_rad, rtol=0, atol=1e-12)
    for a, b in zip(one.joints, other.joints, strict=True):
        assert (a.kind, a.transmission, a.drive_ratio) == (b.kind, b.transmission, b.drive_ratio)
        np.testing.assert_allclose(a.limits, b.limits, rtol=1e-12)
    assert one.couplings == other.couplings
    for a, b in zip(one.links, other.links, strict=True):
        assert a.mass_kg == b.mass_kg
        assert a.centre_m == pytest.approx(b.centre_m, abs=1e-12)
    assert one.gravity_direction == other.gravity_direction
