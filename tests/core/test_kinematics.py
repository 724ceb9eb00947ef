"""Chains of every origin against products written out by hand, and derivatives against finite differences."""

import numpy as np
import pytest
from hypothesis import given
from random_arms import SEEDS, random_model
from scipy.spatial.transform import Rotation

from core.errors import RobotError
from core.kinematics import active_commands, forward, joint_jacobian, joint_motions, link_frames, nominal_net
from core.phi_model import frames
from core.robot import Coupling, Joint, JointKind, Robot
from core.robot_builders import DhRow, PhiTool, phi_model_of, phi_tool_of, robot_from_dh, robot_from_phi
from core.robot_files import read_robot

TURNS, SLIDES = Joint(JointKind.REVOLUTE), Joint(JointKind.PRISMATIC)
KINDS = [(False,) * 6, (False, False, True, False), (False, True, True, False, False)]

URDF = """<robot name="arm">
<link name="base"/><link name="one"/><link name="two"/><link name="tip"/>
<joint name="a" type="revolute"><parent link="base"/><child link="one"/><origin xyz="0.1 -0.2 0.3" rpy="0.4 -0.5 0.6"/>
<axis xyz="1 2 -2"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="b" type="prismatic"><parent link="one"/><child link="two"/><origin xyz="0 0.4 -0.1" rpy="-1 0.2 2"/>
<axis xyz="0 0 -1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="c" type="fixed"><parent link="two"/><child link="tip"/><origin xyz="0.2 0.1 0.5" rpy="3 1.5 -0.3"/></joint>
</robot>"""
URDF_ROBOT = 'format = "trueaxis-robot/1"\nname = "arm"\nurdf = "arm.urdf"\nbase_link = "base"\ntip_link = "tip"\n'


def joints(sliding):
    return tuple(SLIDES if slides else TURNS for slides in sliding)


def random_robot(rng, sliding) -> Robot:
    tool = PhiTool(*rng.uniform(0.4, 1.2, 7))
    return robot_from_phi("random", joints(sliding), random_model(rng, sliding), tool)


def screw(axis, angle, way):
    """Turn about and slide along a coordinate axis, 0 = x, 2 = z."""
    out = np.eye(4)
    out[:3, :3] = Rotation.from_rotvec(angle * np.eye(3)[axis]).as_matrix()
    out[axis, 3] = way
    return out


class TestForward:
    @pytest.mark.parametrize("sliding", KINDS)
    @given(SEEDS)
    def test_phi_model_with_a_tool(self, sliding, seed):
        rng = np.random.default_rng(seed)
        robot, net = random_robot(rng, sliding), rng.normal(size=(3, len(sliding)))
        model, tool = phi_model_of(robot), phi_tool_of(robot.link_transforms[-1])
        for pose, g in zip(forward(robot, net), net, strict=True):
            u, d = (tool.phi_rad, g[-1]) if sliding[-1] else (tool.phi_rad + g[-1], 0.0)
            phi = np.array([[-np.sin(u), 0, np.cos(u), 0], [np.cos(u), 0, np.sin(u), 0], [0, 1, 0, d], [0, 0, 0, 1]])
            link = screw(2, tool.theta_rad, tool.a_m) @ screw(0, tool.alpha_rad, tool.b_m)
            expected = frames(model, g)[-1] @ phi @ link @ screw(2, tool.gamma_rad, tool.h_m)
            np.testing.assert_allclose(pose, expected, atol=1e-9)

    @pytest.mark.parametrize("sliding", KINDS)
    @given(SEEDS)
    def test_denavit_hartenberg(self, sliding, seed):
        rng = np.random.default_rng(seed)
        rows = [DhRow(*row) for row in rng.uniform(-2, 2, (len(sliding), 4))]
        g = rng.normal(size=len(sliding))
        expected = np.eye(4)
        for row, slides, value in zip(rows, sliding, g, strict=True):
            turn, way = (0.0, value) if slides else (value, 0.0)
            expected = expected @ screw(2, row.theta_rad + turn, row.d_m + way) @ screw(0, row.alpha_rad, row.a_m)
        np.testing.assert_allclose(forward(robot_from_dh("dh", joints(sliding), rows), g)[0], expected, atol=1e-12)

    def test_urdf(self, tmp_path):
        (tmp_path / "arm.urdf").write_text(URDF, encoding="utf-8")
        (tmp_path / "robot.toml").write_text(URDF_ROBOT, encoding="utf-8")
        robot = read_robot(tmp_path / "robot.toml")

        def origin(xyz, rpy):
            out = np.eye(4)
            out[:3, :3], out[:3, 3] = Rotation.from_euler("xyz", rpy).as_matrix(), xyz
            return out

        turn, slide = np.eye(4), np.eye(4)
        turn[:3, :3] = Rotation.from_rotvec(0.9 * np.array([1, 2, -2]) / 3).as_matrix()
        slide[2, 3] = 0.25
        first, second = origin((0.1, -0.2, 0.3), (0.4, -0.5, 0.6)), origin((0, 0.4, -0.1), (-1, 0.2, 2))
        expected = first @ turn @ second @ slide @ origin((0.2, 0.1, 0.5), (3, 1.5, -0.3))
        np.testing.assert_allclose(forward(robot, [0.9, -0.25])[0], expected, atol=1e-12)

    def test_link_frames_hold_what_rides_on_the_link(self):
        rng = np.random.default_rng(4)
        robot = random_robot(rng, (False, False, True, False))
        still, moved = link_frames(robot, [[0.3, -0.4, 0.1, 0.0], [0.3, -0.4, 0.1, 0.8]])
        np.testing.assert_allclose(still[:3], moved[:3])
        assert np.abs(still[3] - moved[3]).max() > 0.1

    def test_motions_turn_about_and_slide_along_z(self):
        robot = random_robot(np.random.default_rng(1), (False, True, False))
        motions = joint_motions(robot, [[0.5, 0.2, 0.0]])[0]
        np.testing.assert_allclose(motions[0], screw(2, 0.5, 0.0), atol=1e-15)
        np.testing.assert_allclose(motions[1], screw(2, 0.0, 0.2), atol=1e-15)

    def test_wrong_number_of_joint_values_is_refused(self):
        robot = random_robot(np.random.default_rng(1), (False, True, False))
        with pytest.raises(RobotError, match=r"random has 3 joints, .* shape \(m, 3\), got \(1, 4\)"):
            forward(robot, np.zeros((1, 4)))


class TestJacobian:
    @pytest.mark.parametrize("sliding", KINDS)
    @given(SEEDS)
    def test_against_central_differences(self, sliding, seed):
        rng = np.random.default_rng(seed)
        robot, net = random_robot(rng, sliding), rng.normal(size=(2, len(sliding)))
        found = joint_jacobian(robot, net)
        rotation = forward(robot, net)[:, :3, :3]
        for j in range(len(sliding)):
            step = np.zeros(len(sliding))
            step[j] = 1e-6
            slope = (forward(robot, net + step) - forward(robot, net - step)) / 2e-6
            spin = slope[:, :3, :3] @ rotation.swapaxes(1, 2)
            np.testing.assert_allclose(found[:, :3, j], slope[:, :3, 3], atol=2e-8)
            angular = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
            np.testing.assert_allclose(found[:, 3:, j], angular, atol=2e-8)


def coupled(compensated) -> Robot:
    model = random_model(np.random.default_rng(6), (False,) * 4)
    couplings = (Coupling(1, 2, -1.0, compensated[0]), Coupling(2, 3, 0.5, compensated[1]))
    return robot_from_phi("coupled", joints((False,) * 4), model, couplings=couplings)


class TestCouplings:
    def test_a_compensating_controller_makes_net_equal_to_command(self):
        q = np.random.default_rng(2).normal(size=(5, 4))
        np.testing.assert_allclose(nominal_net(coupled((True, True)), q), q, atol=1e-15)

    def test_active_commands_by_hand(self):
        active = active_commands(coupled((True, True)), [[0.3, 0.1, 0.7, 0.2]])[0]
        np.testing.assert_allclose(active, [0.3, 0.1 + 0.3, 0.7 - 0.5 * 0.4, 0.2], atol=1e-15)

    def test_without_compensation_the_command_is_the_motor_s(self):
        robot, q = coupled((False, True)), [[0.3, 0.1, 0.7, 0.2]]
        np.testing.assert_allclose(active_commands(robot, q)[0], [0.3, 0.1, 0.7 - 0.5 * 0.1, 0.2], atol=1e-15)
        np.testing.assert_allclose(nominal_net(robot, q)[0], [0.3, 0.1 - 0.3, 0.7, 0.2], atol=1e-15)

    def test_passive_motion_goes_up_one_step_only(self):
        robot = coupled((False, False))
        before, after = nominal_net(robot, [[0.0] * 4, [1.0, 0, 0, 0]])
        np.testing.assert_allclose(after - before, [1, -1, 0, 0], atol=1e-15)

    def test_a_passive_joint_has_no_command_and_follows(self):
        kinds = (TURNS, Joint(JointKind.PASSIVE), TURNS, TURNS)
        model = random_model(np.random.default_rng(6), (False,) * 4)
        robot = robot_from_phi("parallelogram", kinds, model, couplings=(Coupling(1, 2, -1.0),))
        np.testing.assert_allclose(nominal_net(robot, [[0.4, 0.9, 0.1, 0.2]])[0], [0.4, -0.4, 0.1, 0.2], atol=1e-15)
