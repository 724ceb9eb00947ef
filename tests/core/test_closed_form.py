"""Closed forms: every subproblem is solved as far as it can be, and every arm of a family gets all its answers."""

from dataclasses import replace

import numpy as np
import pytest

from core.closed_form import closed_form
from core.driven_robot import nominal_driven
from core.geometry import rotation_about, transform
from core.inverse_kinematics import (
    SINGULAR,
    Outcome,
    all_branches,
    inverse_kinematics,
    is_singular,
    smallest_singular,
)
from core.kinematics import forward
from core.robot import Joint, JointKind, Robot
from core.robot_builders import DhRow, robot_from_dh
from core.subproblems import bring, dot, level, meet, reach, turned
from core.twin.irb_l6_arm import nominal_robot
from core.twin.scara import cell as scara_cell

RNG = np.random.default_rng
QUARTER = np.pi / 2


def arm(rows: list[tuple[float, float, float]], limit: float = 3.1) -> Robot:
    dh = [DhRow(0.0, d, a, alpha) for d, a, alpha in rows]
    return robot_from_dh("arm", [Joint(JointKind.REVOLUTE, (-limit, limit))] * len(rows), dh)


ARMS = {
    "irb_l6": (nominal_robot(), "parallel"),
    "ur10": (
        arm(
            [
                (0.1273, 0, QUARTER),
                (0, -0.612, 0),
                (0, -0.5723, 0),
                (0.1639, 0, QUARTER),
                (0.1157, 0, -QUARTER),
                (0.0922, 0, 0),
            ]
        ),
        "parallel",
    ),
    "elbow with offsets": (
        arm(
            [
                (0.4, 0.1, QUARTER),
                (0.05, 0.45, 0),
                (0, 0.04, QUARTER),
                (0.45, 0, -QUARTER),
                (0, 0, QUARTER),
                (0.1, 0, 0),
            ]
        ),
        "elbow",
    ),
    "puma": (
        arm(
            [
                (0, 0, -QUARTER),
                (0.2, 0.43, 0),
                (0.15, 0.02, -QUARTER),
                (0.43, 0, QUARTER),
                (0, 0, -QUARTER),
                (0.05, 0, 0),
            ]
        ),
        "elbow",
    ),
    "shoulder": (
        arm(
            [(0.4, 0, QUARTER), (0, 0.3, 0.7), (0.05, 0.2, QUARTER), (0.45, 0, -QUARTER), (0, 0, QUARTER), (0.1, 0, 0)]
        ),
        "shoulder",
    ),
}


def unit(rng: np.random.Generator) -> np.ndarray:
    vector = rng.normal(size=3)
    return vector / np.linalg.norm(vector)


def apart(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Largest difference of any joint, whole turns left out."""
    return np.abs((first - second + np.pi) % (2 * np.pi) - np.pi).max(axis=-1)


def test_turning_columns_is_turning_by_a_matrix() -> None:
    rng = RNG(1)
    axis, vectors, angle = unit(rng), rng.normal(size=(3, 50)), rng.uniform(-3, 3, 50)
    each = np.einsum("mij,jm->im", rotation_about(axis, angle), vectors)
    np.testing.assert_allclose(turned(axis, angle, vectors), each, rtol=0, atol=1e-14)


def test_bring_turns_one_vector_onto_another_or_as_near_as_it_comes() -> None:
    rng = RNG(2)
    axis, start, angle = unit(rng), rng.normal(size=(3, 30)), rng.uniform(-3, 3, 30)
    np.testing.assert_allclose(bring(axis, start, turned(axis, angle, start)), angle, rtol=0, atol=1e-12)
    goal = rng.normal(size=(3, 30))
    best = np.linalg.norm(turned(axis, bring(axis, start, goal), start) - goal, axis=0)
    for other in np.linspace(-np.pi, np.pi, 73):
        assert (np.linalg.norm(turned(axis, np.full(30, other), start) - goal, axis=0) >= best - 1e-12).all()


def test_meet_brings_two_vectors_together_in_both_ways() -> None:
    rng = RNG(3)
    axes, common = (unit(rng), unit(rng)), rng.normal(size=(3, 40))
    true = rng.uniform(-3, 3, (2, 40))
    first, second = (turned(axis, -angle, common) for axis, angle in zip(axes, true, strict=True))
    one, two = meet(axes[0], first, axes[1], second)
    np.testing.assert_allclose(turned(axes[0], one, first), turned(axes[1], two, second), rtol=0, atol=1e-7)
    away = np.abs((np.stack([one, two]) - true[:, None] + np.pi) % (2 * np.pi) - np.pi).max(axis=0)
    assert away.min(axis=0).max() < 1e-6


def test_reach_gives_a_sum_of_vectors_its_length_in_both_ways_or_the_nearest_one() -> None:
    rng = RNG(4)
    axis, start, other = unit(rng), rng.normal(size=(3, 40)), rng.normal(size=(3, 40))
    length_2 = np.sum((other + turned(axis, rng.uniform(-3, 3, 40), start)) ** 2, axis=0)
    for angle in reach(axis, start, other, length_2):
        found = np.sum((other + turned(axis, angle, start)) ** 2, axis=0)
        np.testing.assert_allclose(found, length_2, rtol=0, atol=1e-9)
    far = reach(axis, start, other, np.full(40, 1e3))
    longest = np.sum((other + turned(axis, far[0], start)) ** 2, axis=0)
    for trial in np.linspace(-np.pi, np.pi, 73):
        assert (np.sum((other + turned(axis, np.full(40, trial), start)) ** 2, axis=0) <= longest + 1e-9).all()


def test_level_gives_a_vector_its_height_in_both_ways() -> None:
    rng = RNG(5)
    axis, normal, start = unit(rng), unit(rng), rng.normal(size=(3, 40))
    height = dot(normal, turned(axis, rng.uniform(-3, 3, 40), start))
    for angle in level(normal, axis, start, height):
        np.testing.assert_allclose(dot(normal, turned(axis, angle, start)), height, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", ARMS)
def test_every_answer_of_an_arm_of_a_family_is_found(name: str) -> None:
    robot, family = ARMS[name]
    form = closed_form(nominal_driven(robot))
    assert form.family == family
    assert form.slack_rad == 0
    net = RNG(6).uniform(-3, 3, (400, 6))
    poses = forward(robot, net)
    answers = form.answers(poses)
    back = forward(robot, answers.reshape(-1, 6)).reshape(400, 8, 4, 4)
    true = np.abs(back - poses[:, None]).max(axis=(2, 3)) < 1e-8
    regular = smallest_singular(nominal_driven(robot), net) > 0.02
    assert apart(answers, net[:, None]).min(axis=1)[regular].max() < 1e-6
    assert set(true[regular].sum(axis=1).tolist()) <= {2, 4, 6, 8}
    assert (true.sum(axis=1) == 8).mean() > 0.5
    # No true answer is missing: exhaustive search finds as many different ones.
    few = np.flatnonzero(regular)[:25]
    branches = all_branches(nominal_driven(robot), poses[few])
    for k, row in enumerate(few):
        different = np.unique(np.round(answers[row][true[row]] % (2 * np.pi), 4) % (2 * np.pi), axis=0)
        assert (branches.pose == k).sum() == len(different)


@pytest.mark.parametrize("name", ARMS)
def test_a_base_and_a_tool_of_its_own_change_nothing(name: str) -> None:
    robot = ARMS[name][0]
    rng = RNG(7)
    links = robot.link_transforms.copy()
    links[-1] = links[-1] @ transform(rotation_about(unit(rng), 0.8), [0.1, -0.2, 0.3])
    moved = replace(
        robot, base_transform=transform(rotation_about(unit(rng), 1.1), [1.0, 2.0, -1.0]), link_transforms=links
    )
    net = rng.uniform(-1.5, 1.5, (50, 6))
    answers = closed_form(nominal_driven(moved)).answers(forward(moved, net))
    regular = smallest_singular(nominal_driven(moved), net) > 0.02
    assert apart(answers, net[:, None]).min(axis=1)[regular].max() < 1e-6


@pytest.mark.parametrize("name", ARMS)
def test_an_arm_that_is_nearly_of_a_family_gets_starts_that_lead_there(name: str) -> None:
    """Axes off by half a degree and lengths by some millimetres, as calibration finds them."""
    robot, family = ARMS[name]
    rng = RNG(8)
    links = robot.link_transforms.copy()
    for i in range(6):
        links[i] = links[i] @ transform(rotation_about(unit(rng), 0.008 * rng.normal()), 0.003 * rng.normal(size=3))
    off = nominal_driven(replace(robot, link_transforms=links, phi_rad=None))
    form = closed_form(off)
    assert form.family == family
    assert 0 < form.slack_rad < 0.3
    net = rng.uniform(-2, 2, (500, 6)) * 0.9
    net = np.clip(net, *(0.95 * off.limits.T))
    found = inverse_kinematics(off, forward(off.chain, net), net * 0.5)
    assert found.solved.all()
    regular = smallest_singular(off, net) > 0.1
    nearest = apart(form.answers(forward(off.chain, net)), net[:, None]).min(axis=1)
    assert np.quantile(nearest[regular], 0.95) < 10 * form.slack_rad


def test_other_arms_have_no_closed_form() -> None:
    rng = RNG(9)
    odd = arm([(0.3, 0.2, 1.0), (0.1, 0.4, 0.5), (0.1, 0.1, 0.8), (0.3, 0.1, -0.9), (0.1, 0.1, 1.2), (0.1, 0.1, 0.3)])
    seven = arm([(0.3, 0, QUARTER)] * 7)
    for robot in (odd, seven, scara_cell().robot):
        assert closed_form(nominal_driven(robot)) is None
    net = rng.uniform(-1.5, 1.5, (30, 6))
    assert inverse_kinematics(nominal_driven(odd), forward(odd, net), net + 0.05).solved.all()


def test_what_exact_answers_do_not_solve_is_said_without_more_search() -> None:
    robot = nominal_driven(arm([(r[0], r[1], r[2]) for r in _elbow_rows()], limit=1.0))
    inside = RNG(10).uniform(-0.9, 0.9, (50, 6))
    poses = forward(robot.chain, inside)
    poses[::2, :3, 3] += [0.0, 0.0, 3.0]
    found = inverse_kinematics(robot, poses)
    assert set(found.outcome[::2]) == {Outcome.UNREACHABLE}
    assert set(found.outcome[1::2]) == {Outcome.SOLVED}
    beyond = forward(robot.chain, np.tile([1.4, 0.3, -0.2, 0.4, 0.8, 0.1], (5, 1)))
    assert set(inverse_kinematics(robot, beyond).outcome) == {Outcome.BEYOND_LIMITS}


def _elbow_rows() -> list[tuple[float, float, float]]:
    return [(0.4, 0.1, QUARTER), (0, 0.45, 0), (0, 0.04, QUARTER), (0.45, 0, -QUARTER), (0, 0, QUARTER), (0.1, 0, 0)]


def test_a_singular_wrist_may_turn_into_its_limits() -> None:
    """Joint 5 straight: only the sum of joints 4 and 6 is given, and some of its parts keep the limits."""
    robot = nominal_driven(arm(_elbow_rows(), limit=1.2))
    stretched = np.array([[0.2, 0.5, -0.3, 1.1, 0.0, 1.0]])
    found = inverse_kinematics(robot, forward(robot.chain, stretched))
    assert found.outcome[0] == Outcome.SINGULAR
    assert not found.excess.any()


def test_quick_singularity_test_agrees_with_singular_values() -> None:
    for robot in (nominal_driven(nominal_robot()), nominal_driven(scara_cell().robot)):
        n = robot.chain.joint_count
        net = RNG(11).uniform(-1, 1, (300, n))
        if n == 6:
            net[:100, 4] = QUARTER + np.geomspace(1e-9, 1e-2, 100)
        sizes = smallest_singular(robot, net)
        for bound in (SINGULAR, 1e-3, 0.05):
            np.testing.assert_array_equal(is_singular(robot, net, bound), sizes < bound)
    assert is_singular(nominal_driven(nominal_robot()), np.empty((0, 6))).shape == (0,)
