"""Suggestions for any robot: every joint is seen, nothing is beyond a limit, and passive motion is watched."""

from dataclasses import replace

import numpy as np
import pytest

from core.robot import Coupling, Joint, JointKind, Robot
from core.session_plan import Plan, check_plan, steps_of
from core.suggested_plan import held_place, suggested_sweeps, suggested_targets, targets_for, unseen_joints
from core.twin import irb_l6, scara

ROBOTS = [irb_l6.cell().robot, scara.cell().robot]


def links_of(robot: Robot) -> dict[str, int]:
    return {target.name: target.link for target in suggested_targets(robot)}


def limited(*limits: tuple[float, float]) -> Robot:
    joints = tuple(Joint(JointKind.REVOLUTE, pair) for pair in limits)
    return Robot("limited", joints, np.tile(np.eye(4), (len(joints), 1, 1)))


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_every_joint_is_seen_and_the_plan_can_be_made(robot: Robot) -> None:
    links = links_of(robot)
    assert unseen_joints(robot, links) == ()
    sweeps = suggested_sweeps(robot, links)
    assert [row.joint for row in sweeps] == list(range(robot.joint_count, 0, -1))
    check_plan(robot, links, Plan(sweeps))


def test_the_arm_of_the_paper_gets_two_targets_where_joints_are_coupled() -> None:
    robot = ROBOTS[0]
    seen = {row.joint: len(row.targets) for row in suggested_sweeps(robot, links_of(robot))}
    assert seen == {6: 1, 5: 1, 4: 2, 3: 2, 2: 2, 1: 1}


def test_a_joint_that_no_target_shows_is_named_with_what_would_show_it() -> None:
    robot = ROBOTS[0]
    sentences = unseen_joints(robot, {"A": 5})
    assert sentences[0] == "joint 6 is seen by no target, expected one on link 6"
    assert "on link 4 itself, because its motor moves joint 5 too" in sentences[1]
    assert targets_for(robot, 4, {"A": 5}) == ()
    assert [row.joint for row in suggested_sweeps(robot, {"A": 5})] == [5, 1]


def test_joints_that_cannot_reach_zero_wait_in_the_middle() -> None:
    robot = limited((-2.9, 2.9), (-3.0, -0.1), (-0.02, 3.7), (0.0, 0.3))
    assert held_place(robot) == (0.0, np.deg2rad(-89.0), 0.0, 0.0)
    sweeps = suggested_sweeps(robot, {"T": 4})
    check_plan(robot, {"T": 4}, Plan(sweeps))
    for step in steps_of(robot, Plan(sweeps)):
        for command in (step.commanded, step.start or step.commanded):
            assert all(
                low <= q <= high for q, (low, high) in zip(command, [j.limits for j in robot.joints], strict=True)
            )
    assert np.ptp([step.commanded[3] for step in steps_of(robot, Plan(sweeps)) if step.joint == 4]) > 0.2


def test_passive_joints_are_not_swept() -> None:
    robot = limited(*[(-1.0, 1.0)] * 3)
    passive = replace(robot.joints[2], kind=JointKind.PASSIVE)
    robot = replace(robot, joints=(*robot.joints[:2], passive), couplings=(Coupling(2, 3, -1.0),))
    links = links_of(robot)
    assert [row.joint for row in suggested_sweeps(robot, links)] == [2, 1]
    check_plan(robot, links, Plan(suggested_sweeps(robot, links)))
