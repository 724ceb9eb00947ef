"""Inverse kinematics: what is reached is reached, every branch is found, and what cannot be is said."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from random_arms import SEEDS, random_model, random_motion

from core.driven_robot import DrivenRobot, nominal_driven
from core.errors import InputError
from core.geometry import invert, rotation_about, transform
from core.inverse_kinematics import (
    Outcome,
    Tolerance,
    all_branches,
    in_limits,
    inverse_kinematics,
    smallest_singular,
)
from core.kinematics import forward, joint_jacobian, nominal_net
from core.pose_iteration import approach, chain_state, misfits, rotation_vectors, scaled_jacobian
from core.robot import Coupling, Joint, JointKind, Robot
from core.robot_builders import DhRow, robot_from_dh, robot_from_phi
from core.twin.irb_l6_arm import nominal_robot, true_arm
from core.twin.scara import cell as scara_cell

TURN = 2 * np.pi
RNG = np.random.default_rng


def l6() -> DrivenRobot:
    return nominal_driven(nominal_robot())


def wrist_arm(limit_deg: float = 180.0) -> Robot:
    """A six-joint arm with a spherical wrist: its inverse kinematics has eight answers in the middle of its reach."""
    limits = (-np.deg2rad(limit_deg), np.deg2rad(limit_deg))
    quarter = np.pi / 2
    rows = [(0.4, 0.1, quarter), (0, 0.45, 0), (0, 0.04, quarter), (0.45, 0, -quarter), (0, 0, quarter), (0.1, 0, 0)]
    dh = [DhRow(0.0, d, a, alpha) for d, a, alpha in rows]
    return robot_from_dh("wrist", [Joint(JointKind.REVOLUTE, limits)] * 6, dh)


def random_net(robot: DrivenRobot, count: int, seed: int) -> np.ndarray:
    """Net displacements that commands within the limits lead to."""
    low, high = np.clip(robot.limits, -np.pi, np.pi).T
    commanded = RNG(seed).uniform(low, high, (count, len(low)))
    return robot.drives.net(np.where(robot.chain.commanded, commanded, 0.0))


def turned(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Largest difference of any joint, whole turns left out."""
    return np.abs((first - second + np.pi) % TURN - np.pi).max(axis=-1)


def test_every_reachable_pose_is_solved_without_a_start() -> None:
    robot = l6()
    poses = forward(robot.chain, random_net(robot, 5000, 11))
    found = inverse_kinematics(robot, poses)
    assert found.solved.all()
    back = forward(robot.chain, found.net)
    np.testing.assert_allclose(back[:, :3, 3], poses[:, :3, 3], rtol=0, atol=1e-8)
    np.testing.assert_allclose(back[:, :3, :3], poses[:, :3, :3], rtol=0, atol=1e-8)
    assert not found.excess.any()
    assert max(found.position_error_m.max(), found.rotation_error_rad.max()) < 1e-8


def test_a_start_for_each_pose_keeps_to_its_branch() -> None:
    robot = l6()
    wanted = random_net(robot, 2000, 3)
    regular = smallest_singular(robot, wanted) > 0.02
    start = wanted + RNG(4).normal(size=wanted.shape) * 0.02
    found = inverse_kinematics(robot, forward(robot.chain, wanted), start)
    assert found.solved.all()
    np.testing.assert_allclose(found.net[regular], wanted[regular], rtol=0, atol=1e-8)


def test_of_all_branches_the_nearest_to_one_configuration_is_taken() -> None:
    robot = nominal_driven(wrist_arm())
    near = np.array([0.2, 0.6, -0.4, 0.5, 0.8, -0.3])
    poses = forward(robot.chain, near + RNG(5).normal(size=(50, 6)) * 0.4)
    found = inverse_kinematics(robot, poses, near)
    branches = all_branches(robot, poses)
    assert found.solved.all()
    for k in range(len(poses)):
        own = in_limits(robot, branches.net[branches.pose == k], near)
        best = own[np.argmin(np.linalg.norm(own - near, axis=1))]
        np.testing.assert_allclose(found.net[k], best, rtol=0, atol=1e-6)


def test_a_spherical_wrist_has_its_eight_branches() -> None:
    robot = nominal_driven(wrist_arm())
    net = RNG(6).uniform(-np.pi, np.pi, (300, 6))
    poses = forward(robot.chain, net)
    branches = all_branches(robot, poses)
    back = forward(robot.chain, branches.net)
    np.testing.assert_allclose(back, poses[branches.pose], rtol=0, atol=1e-8)
    count = np.bincount(branches.pose, minlength=len(poses))
    # Four or eight: elbow up and down, and the shoulder's other side where the arm reaches over; each with a flip.
    regular = np.array([branches.smallest_singular[branches.pose == k].min() > 0.03 for k in range(len(poses))])
    assert regular.sum() > 100
    assert set(count[regular]) <= {4, 8}
    own = [turned(branches.net[branches.pose == k], net[k]).min() for k in range(len(poses))]
    assert np.max(np.array(own)[regular]) < 1e-6


def test_branches_are_kept_apart() -> None:
    robot = nominal_driven(wrist_arm())
    branches = all_branches(robot, forward(robot.chain, RNG(7).uniform(-3, 3, (40, 6))))
    for k in range(40):
        own = branches.net[branches.pose == k]
        apart = turned(own[:, None], own[None]) + 10 * np.eye(len(own))
        assert apart.min() > 1e-3


def test_a_pose_out_of_reach_is_said_to_be() -> None:
    robot = l6()
    poses = forward(robot.chain, random_net(robot, 3, 1))
    poses[0, :3, 3] += 50.0
    poses[1, :3, 3] *= 1.75 / np.linalg.norm(poses[1, :3, 3])
    found = inverse_kinematics(robot, poses)
    assert list(found.outcome) == [Outcome.UNREACHABLE, Outcome.UNREACHABLE, Outcome.SOLVED]
    assert found.position_error_m[1] > 0.01


def test_a_pose_beyond_the_limits_names_the_joints() -> None:
    free = nominal_driven(wrist_arm())
    narrow = nominal_driven(wrist_arm(limit_deg=60.0))
    net = np.array([[1.3, 0.3, 0.2, 0.2, 0.7, 0.1], [0.5, 0.3, 0.2, 0.2, 0.7, 0.1]])
    poses = forward(free.chain, net)
    found = inverse_kinematics(narrow, poses)
    assert list(found.outcome) == [Outcome.BEYOND_LIMITS, Outcome.SOLVED]
    np.testing.assert_allclose(found.net[0], net[0], rtol=0, atol=1e-6)
    assert np.flatnonzero(found.excess[0]).tolist() == [0]
    assert found.excess[0, 0] == pytest.approx(1.3 - np.deg2rad(60.0), abs=1e-6)


@pytest.mark.parametrize("shift", [0.0, 1e-8])
def test_a_singular_pose_is_said_to_be(shift: float) -> None:
    robot = nominal_driven(wrist_arm())
    stretched = np.array([[0.3, 0.4, -0.2, 0.5, shift, 0.9]])
    assert inverse_kinematics(robot, forward(robot.chain, stretched), stretched).outcome[0] == Outcome.SINGULAR
    bent = stretched + np.array([0, 0, 0, 0, 0.01, 0])
    assert inverse_kinematics(robot, forward(robot.chain, bent), stretched).outcome[0] == Outcome.SOLVED


def test_limits_are_those_of_the_commands() -> None:
    arm = true_arm()
    robot = DrivenRobot(nominal_robot(), arm)
    edge = robot.limits[:, 1] * np.array([1, 0, 0, 0, 0, 0])
    for step, outcome in ((-1e-4, Outcome.SOLVED), (1e-4, Outcome.BEYOND_LIMITS)):
        net = arm.net(edge + np.array([step, 0.1, 0.1, 0.1, 0.3, 0.1]))
        found = inverse_kinematics(robot, forward(robot.chain, net), net)
        assert found.outcome[0] == outcome
        np.testing.assert_allclose(found.commanded[0, 0], edge[0] + step, rtol=0, atol=1e-9)


def test_an_arm_with_a_slide_is_solved() -> None:
    robot = nominal_driven(scara_cell().robot)
    low, high = robot.limits.T
    net = RNG(8).uniform(low, high, (500, 4))
    found = inverse_kinematics(robot, forward(robot.chain, net))
    assert found.solved.all()
    np.testing.assert_allclose(forward(robot.chain, found.net), forward(robot.chain, net), rtol=0, atol=1e-8)


def test_an_arm_of_four_joints_does_not_pretend_to_tilt() -> None:
    robot = nominal_driven(scara_cell().robot)
    net = RNG(9).uniform(*(0.8 * robot.limits.T), (20, 4))
    tilted = forward(robot.chain, net) @ transform(rotation_about([1.0, 0, 0], 2e-3), np.zeros(3))
    strict = inverse_kinematics(robot, tilted)
    assert set(strict.outcome) == {Outcome.UNREACHABLE}
    np.testing.assert_allclose(strict.rotation_error_rad, 2e-3, rtol=0, atol=1e-5)
    loose = inverse_kinematics(robot, tilted, tolerance=Tolerance(1e-4, 3e-3))
    assert loose.solved.all()
    assert loose.position_error_m.max() < 1e-5


def test_a_joint_without_a_motor_follows_its_coupling() -> None:
    rows = [DhRow(0, 0.3, 0.1, np.pi / 2), DhRow(0, 0, 0.6, 0), DhRow(0, 0, 0.5, 0), DhRow(0, 0, 0.1, -np.pi / 2)]
    kinds = [JointKind.REVOLUTE, JointKind.REVOLUTE, JointKind.PASSIVE, JointKind.REVOLUTE]
    robot = robot_from_dh("palletiser", [Joint(kind) for kind in kinds], rows, (Coupling(2, 3, -1.0),))
    driven = nominal_driven(robot)
    commanded = RNG(2).uniform(-1, 1, (200, 4)) * [1, 1, 0, 1]
    found = inverse_kinematics(driven, forward(robot, nominal_net(robot, commanded)), np.zeros(4))
    assert found.solved.all()
    np.testing.assert_allclose(found.net[:, 2], -found.net[:, 1], rtol=0, atol=1e-12)
    np.testing.assert_allclose(nominal_net(robot, found.commanded), found.net, rtol=0, atol=1e-12)


def test_seven_joints_reach_what_six_numbers_ask_for() -> None:
    six = wrist_arm()
    rows = [DhRow(0, 0.3, 0.0, np.pi / 2)]
    links = np.concatenate([[rows[0].transform()], six.link_transforms])
    robot = nominal_driven(Robot("seven", (Joint(JointKind.REVOLUTE),) * 7, links))
    net = RNG(3).uniform(-2, 2, (100, 7))
    found = inverse_kinematics(robot, forward(robot.chain, net), net + 0.05)
    assert found.solved.all()
    np.testing.assert_allclose(forward(robot.chain, found.net), forward(robot.chain, net), rtol=0, atol=1e-8)


def panda() -> DrivenRobot:
    """An arm of seven joints whose limits leave little room."""
    quarter = np.pi / 2
    lengths = ((0.333, 0), (0, 0), (0.316, 0.0825), (0, -0.0825), (0.384, 0), (0, 0.088), (0.107, 0))
    twists = (-quarter, quarter, quarter, -quarter, quarter, quarter, 0)
    limits = ((-166, 166), (-101, 101), (-166, 166), (-176, -4), (-166, 166), (-1, 215), (-166, 166))
    joints = [Joint(JointKind.REVOLUTE, tuple(np.deg2rad(ends))) for ends in limits]
    rows = [DhRow(0.0, d, a, alpha) for (d, a), alpha in zip(lengths, twists, strict=True)]
    return nominal_driven(robot_from_dh("panda", joints, rows))


def test_a_joint_to_spare_is_used_to_keep_the_limits() -> None:
    """Poses of which nearly all configurations break a limit, and some at random."""
    robot = panda()
    narrow = np.deg2rad(
        [
            [-165.55, 98.52, 103.74, -161.14, -152.63, 213.85, -141.88],
            [69.43, -100.96, 88.28, -175.55, -155.58, 173.51, -55.35],
            [121.98, 98.07, -79.15, -169.91, 130.4, 191.91, -0.41],
            [114.88, -52.18, -85.75, -167.99, -161.29, 213.3, 138.95],
        ]
    )
    net = np.concatenate([narrow, RNG(14).uniform(*robot.limits.T, (300, 7))])
    found = inverse_kinematics(robot, forward(robot.chain, net))
    assert found.solved.all()
    assert not found.excess.any()
    np.testing.assert_allclose(forward(robot.chain, found.net), forward(robot.chain, net), rtol=0, atol=1e-8)


def test_a_joint_that_is_held_stays() -> None:
    robot = panda()
    net = RNG(15).uniform(*(0.7 * robot.limits.T), (40, 7))
    start = net + 0.05
    end = approach(robot, forward(robot.chain, net), start, 30, held=2)
    np.testing.assert_array_equal(end.free[:, 2], start[:, 2])
    assert end.reached.mean() > 0.8


def test_whole_turns_stay_near_and_within_the_limits() -> None:
    robot = nominal_driven(wrist_arm(limit_deg=400.0))
    near = np.array([6.1, 0.6, -0.4, -6.0, 0.8, 0.3])
    pose = forward(robot.chain, near[None] + 0.05)
    np.testing.assert_allclose(inverse_kinematics(robot, pose, near).net[0], near + 0.05, rtol=0, atol=1e-8)
    beyond = np.deg2rad([450.0, 0, 0, -450.0, 0, 0])
    kept = in_limits(robot, beyond[None].copy(), beyond[None])
    np.testing.assert_allclose(np.rad2deg(kept[0]), [90, 0, 0, -90, 0, 0], atol=1e-9)


@settings(max_examples=15, deadline=None)
@given(SEEDS)
def test_arms_of_any_shape_come_back_to_where_they_were(seed: int) -> None:
    rng = RNG(seed)
    sliding = tuple(bool(s) for s in rng.random(6) < 0.2)
    if all(sliding[:2]):
        sliding = (False, *sliding[1:])
    kinds = [JointKind.PRISMATIC if s else JointKind.REVOLUTE for s in sliding]
    arm = robot_from_phi("any", [Joint(kind) for kind in kinds], random_model(rng, sliding))
    robot = nominal_driven(replace(arm, base_transform=random_motion(rng)))
    net = rng.uniform(-1.5, 1.5, (20, 6))
    keep = smallest_singular(robot, net) > 0.01
    poses = forward(robot.chain, net)[keep]
    found = inverse_kinematics(robot, poses, net[keep] + rng.normal(size=(keep.sum(), 6)) * 1e-3)
    assert found.solved.all()
    np.testing.assert_allclose(forward(robot.chain, found.net), poses, rtol=0, atol=1e-7)


def test_the_fast_chain_agrees_with_the_plain_one() -> None:
    for robot in (l6(), nominal_driven(scara_cell().robot), nominal_driven(wrist_arm())):
        net = RNG(1).normal(size=(50, robot.chain.joint_count))
        state, poses = chain_state(robot, net), forward(robot.chain, net)
        np.testing.assert_allclose(state.position.T, poses[:, :3, 3], rtol=0, atol=1e-13)
        np.testing.assert_allclose(np.transpose(state.columns, (2, 1, 0)), poses[:, :3, :3], rtol=0, atol=1e-13)
        jacobian = joint_jacobian(robot.chain, net)
        jacobian[:, :3] /= robot.reach_m
        jacobian[:, 3:] *= robot.turn_weight
        np.testing.assert_allclose(np.moveaxis(scaled_jacobian(robot, state), 2, 0), jacobian, rtol=0, atol=1e-13)


def test_the_misfit_falls_as_the_jacobian_says() -> None:
    robot = l6()
    net, step = random_net(robot, 40, 2), RNG(3).normal(size=(40, 6)) * 1e-6
    wanted = np.moveaxis(forward(robot.chain, net + step), 0, 2)
    state = chain_state(robot, net)
    linear = np.einsum("inm,mn->im", scaled_jacobian(robot, state), step)
    np.testing.assert_allclose(misfits(robot, state, wanted), linear, rtol=0, atol=1e-11)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.3, 3.0, np.pi - 1e-9, np.pi])
def test_rotation_vectors_are_exact_at_every_angle(angle: float) -> None:
    for seed in range(5):
        axis = RNG(seed).normal(size=3)
        axis /= np.linalg.norm(axis)
        vector = rotation_vectors(rotation_about(axis, angle)[:, :, None])[:, 0]
        sign = np.sign(vector @ axis) if angle > 3.1 else 1.0
        np.testing.assert_allclose(vector * sign, axis * angle, rtol=0, atol=3e-8)


def test_a_bent_step_ends_where_straight_ones_take_long() -> None:
    robot = l6()
    net = random_net(robot, 20_000, 0)
    hard = net[np.argsort(smallest_singular(robot, net))[:20]]
    poses, start = forward(robot.chain, hard), hard + RNG(1).normal(size=hard.shape) * 0.1
    straight = approach(robot, poses, start, 40).misfit
    bent = approach(robot, poses, start, 40, bent=True).misfit
    assert np.count_nonzero(bent < 1e-9) > np.count_nonzero(straight < 1e-9)


def test_what_is_no_pose_is_refused() -> None:
    robot = l6()
    with pytest.raises(InputError, match="not a rotation"):
        inverse_kinematics(robot, np.diag([2.0, 1, 1, 1])[None])
    with pytest.raises(InputError, match="not a rotation"):
        inverse_kinematics(robot, np.diag([-1.0, 1, 1, 1])[None])
    with pytest.raises(InputError, match="shape"):
        inverse_kinematics(robot, np.eye(4))
    with pytest.raises(InputError, match="6 finite numbers"):
        inverse_kinematics(robot, np.eye(4)[None], np.zeros(5))


def test_no_pose_gives_no_solution() -> None:
    robot = l6()
    assert inverse_kinematics(robot, np.empty((0, 4, 4))).net.shape == (0, 6)
    assert all_branches(robot, np.empty((0, 4, 4))).net.shape == (0, 6)


def test_the_tool_frame_is_what_is_brought_there() -> None:
    robot = l6()
    net = random_net(robot, 5, 12)
    found = inverse_kinematics(robot, forward(robot.chain, net))
    tool = invert(forward(robot.chain, found.net)) @ forward(robot.chain, net)
    np.testing.assert_allclose(tool, np.broadcast_to(np.eye(4), tool.shape), rtol=0, atol=1e-8)
