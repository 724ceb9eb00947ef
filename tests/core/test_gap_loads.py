"""What gravity asks of drives and links, against virtual work: torque = -dU/dq, moment = -dU/d(turn)."""

import numpy as np
import pytest
from gap_arms import ARMS, TURNS, campaign, net_of_motors, table

from core.gap.doings import Doings, doings
from core.gap.loads import STANDARD_GRAVITY, loads
from core.gap.observations import observe
from core.gap.sim import Part, Sim, Slot
from core.geometry import Array, apply
from core.kinematics import link_frames
from core.measurements import Target
from core.robot import LinkMass, Robot
from core.robot_builders import DhRow, robot_from_dh

STEP = 1e-5


def seen_at(robot: Robot, seed: int, count: int = 6, payload: bool = True) -> Doings:
    """An arm in random configurations with random payloads."""
    rng = np.random.default_rng(seed)
    kg = rng.uniform(0.5, 8.0, count) if payload else None
    rows = table(rng.uniform(-1.5, 1.5, (count, robot.joint_count)), payload_kg=kg)
    return doings(observe(campaign(robot, (Target("T", robot.joint_count),), rows)))


def potential(robot: Robot, net: Array, payload_kg: Array, offset_m: Array) -> Array:
    """Potential energy of links and payload, J, (m,); the payload sits beside the tool's point in the last frame."""
    frames = link_frames(robot, net)
    down = STANDARD_GRAVITY * np.array(robot.gravity_direction)
    energy = np.zeros(len(net))
    for k, link in enumerate(robot.links):
        energy -= link.mass_kg * apply(frames[:, k], link.centre_m) @ down
    load = frames[:, -1, :3, 3] + frames[:, -2, :3, :3] @ offset_m
    return energy - payload_kg * (load @ down)


def motor_loads(told: Doings, payload_kg: Array, offset_m: Array) -> Array:
    """-dU/d(motor), (m, n), by central differences through the couplings."""
    seen = told.seen
    sim = Sim(seen, np.eye(4), np.zeros((1, 3)), np.zeros(3))
    out = np.empty_like(seen.active)
    for j in range(seen.joint_count):
        step = STEP * np.eye(seen.joint_count)[j]
        above, below = (
            potential(seen.chain, net_of_motors(sim, seen.active + way * step), payload_kg, offset_m) for way in (1, -1)
        )
        out[:, j] = -(above - below) / (2 * STEP)
    return out


@pytest.mark.parametrize("name", ARMS)
def test_drive_loads_are_virtual_work(name: str) -> None:
    told = seen_at(ARMS[name](1), 1)
    kg = told.seen.payload_kg
    np.testing.assert_allclose(told.drive_load, motor_loads(told, kg, np.zeros(3)), atol=2e-6)
    np.testing.assert_allclose(told.own_load, motor_loads(told, 0 * kg, np.zeros(3)), atol=2e-6)
    np.testing.assert_allclose(told.kilogram_load, (told.drive_load - told.own_load) / kg[:, None], atol=1e-9)


@pytest.mark.parametrize("name", ARMS)
def test_a_payload_beside_the_tool_loads_the_drives_by_its_offset(name: str) -> None:
    """Also a motor that slides its own joint and turns the next one by a coupling."""
    told = seen_at(ARMS[name](2), 2)
    one = np.ones(told.count)
    centred = motor_loads(told, one, np.zeros(3))
    for k in range(3):
        beside = motor_loads(told, one, np.eye(3)[k])
        np.testing.assert_allclose(told.offset_load[:, :, k], beside - centred, atol=2e-6)


@pytest.mark.parametrize("name", ["phi with a slide", "dh", "coupled"])
def test_moments_in_the_middle_of_links_are_virtual_work(name: str) -> None:
    """A small turn of a link about its middle lifts and lowers what hangs beyond it: links above and payload."""
    robot = ARMS[name](3)
    told = seen_at(robot, 3, count=2)
    n = robot.joint_count
    down = STANDARD_GRAVITY * np.array(robot.gravity_direction)
    weights = [(link.mass_kg, k + 1, link.centre_m) for k, link in enumerate(robot.links)]
    for i in range(n):
        expected = np.zeros((told.count, 3))
        for axis in range(3):
            for kg, link, place in weights:
                if link > i + 1:
                    expected[:, axis] += kg * lowered(told, i, axis, link, np.array(place)) @ down
            tool = lowered(told, i, axis, n, robot.link_transforms[-1][:3, 3])
            expected[:, axis] += told.seen.payload_kg * (tool @ down)
        np.testing.assert_allclose(told.middle_moment[:, i], expected, atol=1e-7, err_msg=f"link {i + 1}")


def lowered(told: Doings, link: int, axis: int, rides: int, place: Array) -> Array:
    """Derivative of a point on a link with respect to a turn about the middle of another one, base frame, (m, 3)."""
    seen = told.seen
    campaign_of_it = campaign(seen.chain, (Target("it", rides),), seen.campaign.measurements)
    sim = Sim(observe(campaign_of_it), np.eye(4), place[None], np.zeros(3))
    middle = seen.chain.link_transforms[link][:3, 3] / 2
    turn = Slot(Part.LINK, link, axis)
    away = -np.cross(np.eye(3)[axis], middle)
    slots = [turn, *(Slot(Part.LINK, link, 3 + k) for k in range(3))]
    return sim.fields(slots) @ np.array([1.0, *away])


def test_moment_of_a_payload_s_offset_in_the_middle_of_links() -> None:
    """One kilogram moved by a metre along each axis of the last frame, against the cross product written out."""
    robot = ARMS["dh"](4)
    told = seen_at(robot, 4)
    frames = link_frames(robot, told.seen.net)
    down = STANDARD_GRAVITY * np.array(robot.gravity_direction)
    for i in range(robot.joint_count):
        for axis in range(3):
            moment = np.cross(frames[:, -2, :3, axis], down)
            expected = np.einsum("mji,mj->mi", frames[:, i, :3, :3], moment)
            np.testing.assert_allclose(told.loads.middle_offset[:, i, :, axis], expected, atol=1e-12)


def test_a_level_arm_by_hand() -> None:
    """Two links of 1 m and 0.5 m turned about horizontal axes, 10 kg in the middle of the first, 4 kg on the end."""
    rows = [DhRow(0, 0, 1.0, 0), DhRow(0, 0, 0.5, 0)]
    robot = robot_from_dh(
        "level", (TURNS,) * 2, rows, (), (LinkMass(10.0, (0.5, 0, 0)), LinkMass(4.0, (0.5, 0, 0))), (0.0, -1.0, 0.0)
    )
    q = np.array([[0.0, 0.0], [np.pi / 2, 0.0], [0.0, np.pi / 2]])
    told = doings(observe(campaign(robot, (Target("T", 2),), table(q, payload_kg=np.array([0.0, 0.0, 2.0])))))
    g = STANDARD_GRAVITY
    expected = -g * np.array([[10 * 0.5 + 4 * 1.5, 4 * 0.5], [0, 0], [10 * 0.5 + 4 * 1.0 + 2 * 1.0, 0]])
    np.testing.assert_allclose(told.drive_load, expected, atol=1e-12)


def test_without_a_direction_of_gravity_nothing_is_assumed() -> None:
    robot = robot_from_dh("floating", ARMS["dh"](1).joints, [DhRow(0, 0, 1.0, 0)] * 4)
    told = seen_at(robot, 5)
    assert loads(robot, told.seen.net) is None
    assert (told.drive_load, told.offset_load, told.middle_moment) == (None, None, None)


def test_without_masses_only_the_payload_pulls() -> None:
    robot = robot_from_dh("light", ARMS["dh"](1).joints, [DhRow(0.1, 0.2, 1.0, 0.3)] * 4, (), (), (0.0, 0.6, -0.8))
    told = seen_at(robot, 6)
    assert np.abs(told.own_load).max() == 0
    np.testing.assert_allclose(told.drive_load, motor_loads(told, told.seen.payload_kg, np.zeros(3)), atol=2e-6)
