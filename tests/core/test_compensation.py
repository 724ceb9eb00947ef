"""Compensation: the real arm, given the commands, takes the poses that were wanted."""

from dataclasses import replace

import numpy as np
import pytest
from arms_in_use import EXACT, arm, calibration

from core.calibrated_arm import CalibratedArm, calibrated_arm
from core.compensation import OK, compensate, reached
from core.driven_robot import nominal_driven
from core.errors import InputError
from core.geometry import Array, invert, joint_motion, rotation_about, transform
from core.inverse_kinematics import Tolerance, inverse_kinematics
from core.kinematics import forward, nominal_net
from core.phi_convention import convention_for
from core.phi_model import from_axes
from core.robot import Robot
from core.twin.campaign import truth
from core.twin.noise import Noise
from core.twin.scara import cell as scara_cell


def wanted(count: int, seed: int = 1, spread: float = 0.4) -> tuple[Array, Array]:
    """Poses of the nominal arm within the swept ranges, and its joint values there."""
    q = np.random.default_rng(seed).uniform(-spread, spread, (count, 6))
    return forward(arm().nominal, q), q


def test_the_true_arm_takes_the_wanted_poses() -> None:
    """An exact calibration makes the twin itself go where it is asked, to the micrometre; uncompensated it misses."""
    poses, q = wanted(200)
    found = compensate(arm(), poses)
    assert found.status == (OK,) * 200
    there = truth().tool_poses(found.commanded)
    assert np.linalg.norm(there[:, :3, 3] - poses[:, :3, 3], axis=1).max() < 1e-6
    assert np.abs(there[:, :3, :3] - poses[:, :3, :3]).max() < 1e-6
    assert np.linalg.norm(truth().tool_poses(q)[:, :3, 3] - poses[:, :3, 3], axis=1).mean() > 0.04


def test_the_pose_to_command_is_what_the_controller_turns_into_the_commands() -> None:
    poses, _ = wanted(50)
    found = compensate(arm(), poses)
    nominal = arm().nominal
    np.testing.assert_allclose(found.pose, forward(nominal, nominal_net(nominal, found.commanded)), rtol=0, atol=1e-12)
    by_controller = inverse_kinematics(nominal_driven(nominal), found.pose, nominal_net(nominal, found.commanded))
    np.testing.assert_allclose(by_controller.commanded, found.commanded, rtol=0, atol=1e-7)


def test_forth_and_back_without_loss() -> None:
    poses, q = wanted(300)
    found = compensate(arm(noise=Noise()), poses, q)
    back = reached(arm(noise=Noise()), found.commanded)
    assert np.linalg.norm(back[:, :3, 3] - poses[:, :3, 3], axis=1).max() < 1e-8
    assert np.abs(back[:, :3, :3] - poses[:, :3, :3]).max() < 1e-8


def test_the_branch_is_the_one_that_was_asked_for() -> None:
    poses, q = wanted(100)
    found = compensate(arm(), poses, q)
    assert np.abs(found.commanded - q).max() < 0.5
    flipped = compensate(arm(), poses[:1], np.array([[q[0, 0], -q[0, 1], -q[0, 2] + 1.0, 1.0, q[0, 4], q[0, 5]]]))
    assert flipped.status[0] == OK or "beyond limits" in flipped.status[0]


def test_a_wanted_pose_in_the_instruments_frame_is_the_same_pose() -> None:
    poses, q = wanted(20)
    in_base = compensate(arm(), poses, q)
    in_instrument = compensate(arm(), arm().base @ poses, q, frame="instrument")
    np.testing.assert_allclose(in_instrument.commanded, in_base.commanded, rtol=0, atol=1e-8)
    with pytest.raises(InputError, match="'floor'"):
        compensate(arm(), poses, frame="floor")


def test_what_cannot_be_had_is_named_row_by_row() -> None:
    poses, near = wanted(6)
    poses[1, :3, 3] += 9.0
    poses[2, :3, 3] *= 1.6 / np.linalg.norm(poses[2, :3, 3])
    beyond = np.array([[0.1, 0.1, 0.2, 0.1, 0.3, 0.0]]) + np.array([[0, 0.87, 0, 0, 0, 0]])
    poses[3], near[3] = reached(arm(), beyond)[0], beyond[0]
    found = compensate(arm(), poses, near)
    assert [s.split(":")[0] for s in found.status] == [OK, "unreachable", "unreachable", "beyond limits", OK, OK]
    assert "joint 2 by " in found.status[3]
    assert " deg" in found.status[3]
    assert "mm" in found.status[2]
    bad = ~found.ok
    assert np.isnan(found.pose[bad]).all()
    assert np.isnan(found.commanded[bad]).all()
    assert np.isfinite(found.commanded[~bad]).all()


def test_limits_count_for_the_commands_and_not_for_the_nominal_solution() -> None:
    """Within a degree of a limit the corrected command may break it though the nominal one does not."""
    edge = arm().nominal.joints[0].limits[1]
    q = np.tile([edge - np.deg2rad(0.05), 0.1, 0.1, 0.1, 0.3, 0.1], (1, 1))
    nominal = compensate(arm(), forward(arm().nominal, q), q)
    offset = truth().home[0]
    assert offset > np.deg2rad(1)
    assert nominal.status[0].startswith("beyond limits: joint 1 by 1.")


def test_an_arm_of_four_joints_is_compensated_as_far_as_it_goes() -> None:
    """A real arm of four joints cannot stand exactly upright: strictly unreachable, loosely a matter of tolerance."""
    ready = arm("scara", Noise())
    low, high = nominal_driven(ready.nominal).limits.T
    q = np.random.default_rng(3).uniform(0.7 * low, 0.7 * high, (30, 4))
    poses = forward(ready.nominal, q)
    strict = compensate(ready, poses, q)
    assert all(s.startswith("unreachable: the nearest that was found is ") for s in strict.status)
    loose = compensate(ready, poses, q, tolerance=Tolerance(1e-5, 5e-3))
    assert loose.status == (OK,) * 30
    there = scara_cell().truth.tool_poses(loose.commanded)
    before = scara_cell().truth.tool_poses(q)
    missed = [np.linalg.norm(p[:, :3, 3] - poses[:, :3, 3], axis=1) for p in (before, there)]
    assert np.mean(missed[1]) < 0.15 * np.mean(missed[0])


def test_a_base_frame_of_its_own_changes_nothing_for_the_arm() -> None:
    """Poses are in the base frame of the nominal robot, wherever that is to its first axis."""
    shift = transform(rotation_about([0.0, 0.6, 0.8], 0.7), [0.3, -0.2, 0.9])
    moved = based(shift)
    poses, q = wanted(20)
    here, there = compensate(arm(), poses, q), compensate(moved, shift @ poses, q)
    np.testing.assert_allclose(there.commanded, here.commanded, rtol=0, atol=1e-8)
    np.testing.assert_allclose(there.pose, shift @ here.pose, rtol=0, atol=1e-8)
    np.testing.assert_allclose(moved.base @ shift, arm().base, rtol=0, atol=1e-9)


def based(shift: Array) -> CalibratedArm:
    """The same arm, its nominal robot described in another base frame."""
    found = calibration("l6", EXACT)
    robot: Robot = replace(found.campaign.robot, base_transform=shift)
    lines = robot.axes_at_zero()
    convention = convention_for(lines, robot.sliding, robot.phi_rad, y_reference=shift[:3, 1])
    campaign = replace(found.campaign, robot=robot)
    return calibrated_arm(
        replace(found, campaign=campaign, convention=convention, nominal=from_axes(lines, convention)[1])
    )


def test_the_base_frame_hangs_on_the_first_axes() -> None:
    """Where axis 1 of the calibrated chain is, there the instrument saw it; Y_1 points to axis 2."""
    ready = arm(noise=Noise())
    first = ready.drives.axes[0]
    seen = ready.base @ joint_motion(first, 0.0, False)
    assert seen.shape == (4, 4)
    axis = ready.base[:3, :3] @ ready.robot.base_transform[:3, 2]
    np.testing.assert_allclose(axis, first.direction, rtol=0, atol=1e-12)
    origin = ready.base @ [0, 0, 0, 1]
    np.testing.assert_allclose(first.foot_of(origin[:3]), origin[:3], rtol=0, atol=1e-12)
    second = ready.drives.axes[1]
    in_base = invert(ready.base)[:3, :3] @ second.direction
    assert abs(in_base @ [0, 1, 0]) < 1e-12


def test_no_poses_give_no_commands() -> None:
    found = compensate(arm(), np.empty((0, 4, 4)))
    assert found.status == ()
    assert found.commanded.shape == (0, 6)
