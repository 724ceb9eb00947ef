"""calibration.json read back: the same arm, for every arm; and what is wrong with a file is said in one sentence."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from arms_in_use import arm, calibration
from random_arms import random_motion

from core.calibration_file import read_calibration
from core.calibration_json import calibration_to_json
from core.errors import InputError
from core.json_records import JsonRecord
from core.kinematics import forward
from core.robot import Coupling, Joint, JointKind, LinkMass, Robot
from core.robot_json import robot_of_record, robot_record
from core.twin.noise import Noise

Document = dict[str, Any]


def written(folder: Path, which: str = "l6", edit: Callable[[Document], object] | None = None) -> Path:
    document = json.loads(calibration_to_json(calibration(which, Noise())))
    if edit is not None:
        edit(document)
    path = folder / "calibration.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


@pytest.mark.parametrize("which", ["l6", "scara"])
def test_the_arm_that_is_read_is_the_one_that_was_written(which: str, tmp_path: Path) -> None:
    found, expected = read_calibration(written(tmp_path, which)), arm(which, Noise())
    n = expected.nominal.joint_count
    commanded = np.random.default_rng(1).uniform(-0.6, 0.6, (50, n))
    net = expected.drives.net(commanded)
    np.testing.assert_allclose(found.drives.net(commanded), net, rtol=0, atol=1e-10)
    np.testing.assert_allclose(found.drives.commanded_for(net), commanded, rtol=0, atol=1e-10)
    np.testing.assert_allclose(forward(found.robot, net), forward(expected.robot, net), rtol=0, atol=1e-10)
    np.testing.assert_allclose(forward(found.nominal, net), forward(expected.nominal, net), rtol=0, atol=1e-14)
    np.testing.assert_allclose(found.base, expected.base, rtol=0, atol=1e-10)
    assert found.digest == expected.digest
    assert found.noise_m == pytest.approx(expected.noise_m, rel=1e-10)
    assert found.last_axis_std_rad == pytest.approx(expected.last_axis_std_rad, rel=1e-10)
    assert [t.name for t in found.targets] == [t.name for t in expected.targets]
    for one, other in zip(found.targets, expected.targets, strict=True):
        np.testing.assert_allclose(one.point_m, other.point_m, rtol=0, atol=1e-11)
        np.testing.assert_allclose(one.std_m, other.std_m, rtol=1e-9)
    assert found.covariance.parameters == expected.covariance.parameters
    std = np.sqrt(np.diag(expected.covariance.matrix))
    np.testing.assert_allclose(
        found.covariance.matrix, expected.covariance.matrix, rtol=0, atol=1e-10 * np.outer(std, std).max()
    )
    assert (found.home is None) == (expected.home is None)
    if expected.home is not None:
        np.testing.assert_allclose(found.home, expected.home, rtol=0, atol=1e-11)


@pytest.mark.parametrize("which", ["l6", "scara"])
def test_the_calibrated_chain_predicts_the_points_of_the_calibration(which: str) -> None:
    """The chain in the robot's base, carried by ``base``, agrees with the axes in the instrument's frame."""
    found = calibration(which, Noise())
    ready = arm(which, Noise())
    n = ready.nominal.joint_count
    commanded = np.random.default_rng(2).uniform(-0.5, 0.5, (20, n))
    rest = found.refinement.rest_points_m[next(k for k, t in enumerate(found.campaign.targets) if t.link == n)]
    link = np.full(len(commanded), n)
    by_axes = found.estimate.arm.points(commanded, link, np.broadcast_to(rest, (len(commanded), 3)))
    at_rest = ready.base @ forward(ready.robot, np.zeros((1, n)))[0]
    on_tool = np.linalg.inv(at_rest) @ [*rest, 1.0]
    by_chain = ready.base @ forward(ready.robot, ready.drives.net(commanded)) @ on_tool
    np.testing.assert_allclose(by_chain[:, :3], by_axes, rtol=0, atol=1e-9)


def test_a_robot_of_every_kind_survives_as_json(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    joints = (
        Joint(JointKind.REVOLUTE, (-1.0, 2.0), 32 / 19, "gear"),
        Joint(JointKind.PASSIVE),
        Joint(JointKind.PRISMATIC, (-np.inf, 0.4)),
    )
    motions = [np.stack([random_motion(rng) for _ in range(3)]) for _ in range(2)]
    robot = Robot(
        'odd " one',
        joints,
        motions[0],
        random_motion(rng),
        motions[1],
        (Coupling(1, 2, -0.7, compensated=False, form="gear"),),
        tuple(LinkMass(k + 0.1, (0.1, -0.2, k)) for k in range(3)),
        (0.0, 0.6, -0.8),
        np.array([np.pi / 2, 0.1]),
    )
    text = json.dumps(robot_record(robot))
    found = robot_of_record(JsonRecord(json.loads(text), tmp_path))
    assert (found.name, found.joints, found.couplings, found.links) == (
        robot.name,
        joints,
        robot.couplings,
        robot.links,
    )
    assert found.gravity_direction == robot.gravity_direction
    for name in ("link_transforms", "base_transform", "moving_frames", "phi_rad"):
        np.testing.assert_allclose(getattr(found, name), getattr(robot, name), rtol=1e-15, atol=0)


def drop(key: str) -> Callable[[Document], object]:
    return lambda document: document.pop(key)


def put(*path_and_value: Any) -> Callable[[Document], object]:
    *path, last, value = path_and_value

    def edit(document: Document) -> None:
        place: Any = document
        for key in path:
            place = place[key]
        place[last] = value

    return edit


def correlate_by_three(document: Document) -> None:
    """Two parameters that would err together by more than each alone."""
    matrix = document["covariance"]["matrix"]
    matrix[-1][-2] = matrix[-2][-1] = 3 * np.sqrt(matrix[-1][-1] * matrix[-2][-2])


WRONG = [
    (drop("nominal_robot"), ["nominal robot"]),
    (put("format", "trueaxis-gap/1"), ["format", "trueaxis-gap/1", "trueaxis-calibration/1"]),
    (put("frames", []), ["sweep of every joint"]),
    (put("base_to_instrument", None), ["sweep of every joint"]),
    (put("frames", 2, "actual", "a_mm", "wide"), ["frames[2].actual.a_mm", "'wide'", "a number"]),
    (put("frames", 2, "actual", "a_mm", None), ["frames[2].actual.a_mm", "None"]),
    (put("frames", 2, "phi_deg", 45.0), ["frames[2].phi_deg", "45.0", "expected 0"]),
    (lambda document: document["frames"].pop(), ["4 frames", "6 joints"]),
    (put("transmissions", 0, "form", "spring"), ["transmissions[0]", "spring"]),
    (put("transmissions", 1, "joint", 9), ["transmissions[1].joint", "9", "1..6"]),
    (put("transmissions", 1, "coefficients", {}), ["transmissions[1].coefficients", "missing"]),
    (put("couplings", 0, "to", 2), ["couplings[0].to", "2"]),
    (put("targets", 0, "point_mm", [1, 2]), ["targets[0].point_mm", "3 numbers"]),
    (put("targets", 0, "link", 7), ["targets[0].link", "0..6"]),
    (put("noise_mm", True), ["noise_mm", "True"]),
    (put("nominal_robot", "link_transforms", 1, 0, 0, 5.0), ["nominal_robot.link_transforms", "rigid"]),
    (put("nominal_robot", "joints", 0, "kind", "ball"), ["nominal_robot.joints[0].kind", "ball"]),
    (put("nominal_robot", "joints", 0, "limits_deg", [5, -5]), ["nominal_robot.joints[0]", "lower first"]),
    (put("nominal_robot", "couplings", 0, "to", 5), ["nominal_robot.couplings[0]"]),
    (put("base_to_instrument", 3, [1, 0, 0, 1]), ["base_to_instrument", "rigid"]),
    (put("home_deg", 2, None), ["home_deg"]),
    (put("covariance", "parameters", 0, "frame 9 a_m"), ["covariance.parameters", "of this calibration"]),
    (put("covariance", "parameters", 0, "frame 1 b_m"), ["covariance.parameters", "each once"]),
    (put("covariance", "matrix", 0, 1, 7.0), ["covariance", "symmetric"]),
    (put("covariance", "matrix", 5, 5, -1.0), ["covariance", "variances"]),
    (correlate_by_three, ["covariance", "negative variance"]),
    (put("covariance", "matrix", 3, [1.0]), ["covariance.matrix", "numbers"]),
]


@pytest.mark.parametrize(("edit", "words"), WRONG, ids=[words[0] for _, words in WRONG])
def test_what_is_wrong_is_said(edit: Callable[[Document], object], words: list[str], tmp_path: Path) -> None:
    path = written(tmp_path, edit=edit)
    with pytest.raises(InputError) as refused:
        read_calibration(path)
    for word in (str(path), *words):
        assert word in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("{", "not valid JSON"),
        ("[1, 2]", "a list"),
        ('{"format": NaN}', "not valid JSON"),
        ("[" * 100_000, "nested too deep"),
        ("", "empty"),
        ('{"format": 1e999}', "format"),
    ],
)
def test_what_is_no_calibration_is_refused(text: str, word: str, tmp_path: Path) -> None:
    path = tmp_path / "calibration.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=word):
        read_calibration(path)


def test_a_calibration_that_says_nothing_of_how_it_errs_is_read(tmp_path: Path) -> None:
    assert read_calibration(written(tmp_path, edit=drop("covariance"))).covariance is None


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nowhere\.json is missing"):
        read_calibration(tmp_path / "nowhere.json")
