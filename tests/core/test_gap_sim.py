"""The sim with small motions in every part: derivatives against differences, large motions against plain 4x4 chains."""

from dataclasses import replace

import numpy as np
import pytest
from gap_arms import ARMS, chain_points, net_of_motors, random_sim
from random_arms import random_motion
from scipy.spatial.transform import Rotation

from core.gap.placement import placement_slots, with_placement
from core.gap.sim import PRODUCTS, Part, Sim, Slot
from core.geometry import Array, apply

STEP = 1e-5


def all_slots(sim: Sim) -> list[Slot]:
    n, targets = sim.seen.joint_count, len(sim.target_m)
    slots = [Slot(part, j) for part in (Part.JOINT, Part.DRIVE) for j in range(n)]
    slots += [Slot(part, j, k) for part in (Part.AXIS, Part.LINK, Part.BEYOND) for j in range(n) for k in range(6)]
    slots += [Slot(Part.TARGET, t, k) for t in range(targets) for k in range(3)]
    slots += [Slot(Part.ROOM, p, k) for p in range(len(PRODUCTS)) for k in range(3)]
    return [*slots, *(Slot(Part.BASE, 0, k) for k in range(6)), Slot(Part.SCALE), Slot(Part.DEPTH)]


def large_motions(sim: Sim, seed: int) -> dict[Slot, Array]:
    """Every slot moves every point by a number of its own, far beyond anything small."""
    rng = np.random.default_rng(seed)
    return {slot: rng.uniform(-0.8, 0.8, sim.seen.count) for slot in all_slots(sim)}


def rigid(motions: dict[Slot, Array], part: Part, index: int, k: int) -> Array:
    """Turn, then shift, of one point's small motion as a 4x4 matrix."""
    value = [motions[Slot(part, index, axis)][k] for axis in range(6)]
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = Rotation.from_rotvec(value[:3]).as_matrix(), value[3:]
    return out


def by_hand(sim: Sim, motions: dict[Slot, Array], k: int) -> Array:
    """One point by multiplying matrices from the base outwards."""
    seen, robot = sim.seen, sim.seen.chain
    motors = seen.active[k] + [motions[Slot(Part.DRIVE, j)][k] for j in range(robot.joint_count)]
    net = motors + [motions[Slot(Part.JOINT, j)][k] for j in range(robot.joint_count)]
    for coupling in robot.couplings:
        net[coupling.target - 1] += coupling.gain * motors[coupling.source - 1]
    frame = np.eye(4)
    before = robot.base_transform
    for i in range(seen.link[k]):
        move = np.eye(4)
        if robot.joints[i].slides:
            move[2, 3] = net[i]
        else:
            move[:3, :3] = Rotation.from_rotvec([0, 0, net[i]]).as_matrix()
        frame = frame @ before @ rigid(motions, Part.AXIS, i, k) @ move @ rigid(motions, Part.LINK, i, k)
        if seen.link[k] > i + 1 or i + 1 == robot.joint_count:
            frame = frame @ rigid(motions, Part.BEYOND, i, k)
        before = robot.link_transforms[i]
    t = seen.target[k]
    place = sim.target_m[t] + [motions[Slot(Part.TARGET, t, axis)][k] for axis in range(3)]
    point = apply(sim.base @ frame, place) - sim.middle_m
    placed = apply(rigid(motions, Part.BASE, 0, k), point)
    bent = [
        sum(motions[Slot(Part.ROOM, p, axis)][k] * placed[a] * placed[b] for p, (a, b) in enumerate(PRODUCTS))
        for axis in range(3)
    ]
    sight = sim.middle_m / np.linalg.norm(sim.middle_m)
    deeper = motions[Slot(Part.DEPTH)][k] * (placed @ sight) * sight
    return placed * (1 + motions[Slot(Part.SCALE)][k]) + deeper + bent + sim.middle_m


@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("seed", [1, 2])
def test_fields_against_central_differences(name: str, seed: int) -> None:
    sim = random_sim(ARMS[name](seed), seed)
    slots = all_slots(sim)
    fields = sim.fields(slots)
    ones = np.full(sim.seen.count, STEP)
    for k, slot in enumerate(slots):
        slope = (sim.moved_m({slot: ones}) - sim.moved_m({slot: -ones})) / (2 * STEP)
        np.testing.assert_allclose(fields[:, :, k], slope, atol=1e-8, err_msg=str(slot))


@pytest.mark.parametrize("name", ARMS)
def test_no_motion_leaves_the_points_where_kinematics_has_them(name: str) -> None:
    sim = random_sim(ARMS[name](3), 3)
    np.testing.assert_allclose(sim.moved_m({}), sim.points_m(), atol=1e-13)
    np.testing.assert_allclose(sim.points_m(), chain_points(sim, net_of_motors(sim, sim.seen.active)), atol=1e-13)


@pytest.mark.parametrize("name", ARMS)
def test_large_motions_are_composed_exactly(name: str) -> None:
    sim = random_sim(ARMS[name](4), 4)
    motions = large_motions(sim, 4)
    expected = np.array([by_hand(sim, motions, k) for k in range(sim.seen.count)])
    assert np.linalg.norm(expected - sim.points_m(), axis=1).min() > 0.05
    np.testing.assert_allclose(sim.moved_m(motions), expected, atol=1e-12)


def test_what_moves_a_link_leaves_the_links_below_alone() -> None:
    sim = random_sim(ARMS["coupled"](5), 5)
    for part in (Part.JOINT, Part.AXIS, Part.LINK):
        moved = np.abs(sim.fields([Slot(part, 2, 0)])).max(axis=(1, 2))
        below = sim.seen.link < 3
        assert below.any()
        assert moved[below].max() == 0
        assert moved[~below].min() > 0


def test_what_a_link_carries_does_not_move_its_own_targets() -> None:
    """But on the last link, which carries nothing else."""
    sim = random_sim(ARMS["coupled"](5), 5)
    for index, still in ((1, sim.seen.link <= 2), (3, sim.seen.link <= 3)):
        moved = np.abs(sim.fields([Slot(Part.BEYOND, index, 4)])).max(axis=(1, 2))
        assert moved[still].max() == 0
        assert moved[~still].min() > 0


def test_a_motor_moves_the_joint_that_it_is_coupled_to() -> None:
    """Coupling 1 -> 2 with gain -1: a small motion of motor 1 turns joint 1 on and joint 2 back."""
    sim = random_sim(ARMS["coupled"](6), 6)
    motor, first, second = np.moveaxis(
        sim.fields([Slot(Part.DRIVE, 0), Slot(Part.JOINT, 0), Slot(Part.JOINT, 1)]), 2, 0
    )
    np.testing.assert_allclose(motor, first - second, atol=1e-15)


def test_placing_anew_is_the_small_motion_itself() -> None:
    sim = random_sim(ARMS["dh with slides"](7), 7)
    slots = placement_slots(sim.seen)
    step = np.random.default_rng(7).uniform(-0.5, 0.5, len(slots))
    moved = sim.moved_m({slot: np.full(sim.seen.count, value) for slot, value in zip(slots, step, strict=True)})
    np.testing.assert_allclose(with_placement(sim, slots, step).points_m(), moved, atol=1e-13)


@pytest.mark.parametrize("placed", [False, True])
def test_another_simulator_s_points_move_as_the_chain_s_would(placed: bool) -> None:
    sim = random_sim(ARMS["coupled"](8), 8)
    given = sim.points_m() + 1e-3 * np.random.default_rng(8).normal(size=(sim.seen.count, 3))
    rows = replace(sim.seen.campaign.measurements, simulated_point_m=given)
    seen = replace(sim.seen, campaign=replace(sim.seen.campaign, measurements=rows))
    motion = random_motion(np.random.default_rng(9)) if placed else None
    foreign = replace(sim, seen=seen, simulated_to_instrument=motion)
    points = apply(motion, given) if placed else given
    np.testing.assert_allclose(foreign.points_m(), points, atol=1e-14)
    np.testing.assert_allclose(foreign.moved_m({}), points, atol=1e-14)
    slot, value = Slot(Part.JOINT, 1), np.full(seen.count, 1e-3)
    expected = points + foreign.fields([slot])[:, :, 0] * 1e-3
    np.testing.assert_allclose(foreign.moved_m({slot: value}), expected, atol=1e-14)
    if not placed:
        np.testing.assert_allclose(foreign.fields([slot]), sim.fields([slot]), atol=5e-3)


def test_a_part_of_the_points_is_the_same_sim() -> None:
    sim = random_sim(ARMS["phi with a slide"](10), 10)
    keep = np.array([1, 4, 5, 9])
    slots = all_slots(sim)
    np.testing.assert_array_equal(sim.part(keep).points_m(), sim.points_m()[keep])
    np.testing.assert_array_equal(sim.part(keep).fields(slots), sim.fields(slots)[keep])


@pytest.mark.parametrize("name", ARMS)
def test_where_base_and_targets_are_answers_through_the_moved_chain(name: str) -> None:
    """A link that leans carries a higher target aside: derivatives at the nominal chain do not know it."""
    sim = random_sim(ARMS[name](3), 3, 24)
    parts = (Part.JOINT, Part.DRIVE, Part.AXIS, Part.LINK, Part.BEYOND)
    motions = {slot: value for slot, value in large_motions(sim, 3).items() if slot.part in parts}
    slots = placement_slots(sim.seen)
    found = sim.placed_fields(slots, motions)
    # The base is placed about the middle of the measured points, so both sides of a difference turn about it.
    for k, slot in enumerate(slots):
        ends = [with_placement(sim, slots, sign * STEP * np.eye(len(slots))[k]).moved_m(motions) for sign in (1, -1)]
        np.testing.assert_allclose(found[:, :, k], (ends[0] - ends[1]) / (2 * STEP), atol=1e-7, err_msg=str(slot))
