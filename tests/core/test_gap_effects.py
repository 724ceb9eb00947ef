"""Every candidate against its formula in the contract, applied by core.kinematics to displacements or links."""

from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from gap_arms import ARMS, Day, chain_points, day, kinds, masses, net_of_motors
from scipy.spatial.transform import Rotation

from core.gap.design import Design
from core.gap.doings import Doings, doings
from core.gap.effects import drives, instrument
from core.gap.effects.candidate import Candidate
from core.gap.effects.elastic import beam_axes
from core.gap.effects.thermal import thermals
from core.gap.library import candidates
from core.gap.sim import Sim
from core.geometry import Array, apply, invert
from core.kinematics import active_commands, link_frames, nominal_net
from core.robot_builders import DhRow, robot_from_dh

TURNING, SLIDING = "coupled", "dh with slides"
CONTRACT = (
    "geometry zero_offset ratio eccentricity mesh backlash compliance coupling axis_wobble latency thermal drift "
    "base_shift target_slip scale hysteresis flexure payload linkage quantisation"
)
ALONE = "of the joint alone"


@cache
def world(name: str) -> tuple[Sim, Doings, tuple[Candidate, ...]]:
    sim = day(ARMS[name](1), 1, Day(arc=7, poses=14))
    told = doings(sim.seen)
    return sim, told, tuple(candidates(told))


def of(name: str, effect: str, alone: bool = False) -> list[Candidate]:
    """Candidates of an effect; of motors, or of joints that do not pass it on."""
    found = [c for c in world(name)[2] if c.place.effect == effect and (ALONE in c.atom) == alone]
    assert found
    return found


def moved(name: str, candidate: Candidate, numbers: Iterable[float]) -> Array:
    """The sim with a candidate at some size, composed without approximation."""
    sim, told, _ = world(name)
    columns = tuple(candidate.columns(told))
    return sim.moved_m(Design(sim, columns, np.ones(len(columns))).motions(np.array(list(numbers))))


def with_motors(name: str, joint: int, error: Array) -> Array:
    """The points if a motor (1..n) goes wrong; what it moves through a coupling goes wrong with it."""
    sim, told, _ = world(name)
    active = told.active.copy()
    active[:, joint - 1] += error
    return chain_points(sim, net_of_motors(sim, active))


def with_joint(name: str, joint: int, error: Array) -> Array:
    """The points if one joint alone goes wrong."""
    sim, told, _ = world(name)
    net = told.seen.net.copy()
    net[:, joint - 1] += error
    return chain_points(sim, net)


def x_of(name: str, joint: int) -> Array:
    return world(name)[1].active[:, joint - 1]


def same(found: Array, expected: Array) -> None:
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_where_the_height_of_an_upright_arm_is_open_a_flexure_may_turn_about_a_lower_base() -> None:
    rows = [DhRow(0.1, d, a, 0.0) for d, a in ((0.4, 0.35), (0.1, 0.3), (0.0, 0.0), (0.1, 0.0))]
    rng, lower_m = np.random.default_rng(1), 0.2
    robot = robot_from_dh("scara", kinds((False, False, True, False)), rows, (), masses(rng, 4), (0.0, 0.0, -1.0))
    sim = day(robot, 1, Day(arc=7, poses=14))
    down = sim.base[:3, :3] @ [0.0, 0.0, -lower_m]
    lower = replace(sim, base=sim.base.copy(), target_m=sim.target_m + np.array([0.0, 0.0, lower_m]))
    lower.base[:3, 3] += down
    np.testing.assert_allclose(lower.points_m(), sim.points_m(), atol=1e-12)
    told = doings(sim.seen)
    for one in (c for c in candidates(told) if c.place.effect == "flexure" and "roughly" in c.atom):
        tilting = [name for name in one.names if name.startswith("height")]
        assert tilting
        columns = Design(sim, tuple(one.columns(told)), np.ones(len(one.names))).whole()
        below = Design(lower, tuple(one.columns(told)), np.ones(len(one.names))).whole()
        for name in tilting:
            give = one.names.index(f"{name.removeprefix('height_times_').removesuffix('_m_per_nm')}_rad_per_nm")
            expected = columns[:, :, give] - lower_m * columns[:, :, one.names.index(name)]
            np.testing.assert_allclose(below[:, :, give], expected, atol=1e-12 * np.abs(expected).max())


def test_every_effect_of_the_contract_has_candidates_but_steps_that_have_to_be_found() -> None:
    effects = {c.place.effect for c in (*world(TURNING)[2], *world(SLIDING)[2]) if c.named}
    assert effects | {"quantisation"} == set(CONTRACT.split())


@pytest.mark.parametrize("name", [TURNING, SLIDING, "coupled slide"])
def test_columns_are_derivatives(name: str) -> None:
    """Of every candidate, by a small number of each unknown on its own."""
    sim, told, library = world(name)
    step = 1e-6
    for candidate in library:
        columns = tuple(candidate.columns(told))
        assert len(columns) == len(candidate.names), candidate.place
        design = Design(sim, columns, np.ones(len(columns)))
        derivative = design.whole()
        for k in {0, len(columns) // 2, len(columns) - 1}:
            numbers = np.zeros(len(columns))
            numbers[k] = step / max(np.abs(derivative[:, :, k]).max(), 1.0)
            slope = (sim.moved_m(design.motions(numbers)) - sim.moved_m(design.motions(-numbers))) / (2 * numbers[k])
            scale = max(np.abs(derivative[:, :, k]).max(), 1.0)
            np.testing.assert_allclose(derivative[:, :, k] / scale, slope / scale, atol=1e-8, err_msg=str(candidate))


@pytest.mark.parametrize("name", [TURNING, SLIDING])
class TestDrives:
    def test_zero_offset(self, name: str) -> None:
        for one in of(name, "zero_offset"):
            same(moved(name, one, [0.2]), with_motors(name, one.place.joint, np.full(world(name)[1].count, 0.2)))

    def test_ratio(self, name: str) -> None:
        for one in of(name, "ratio"):
            same(moved(name, one, [0.1]), with_motors(name, one.place.joint, 0.1 * x_of(name, one.place.joint)))

    @pytest.mark.parametrize("effect", ["eccentricity", "mesh"])
    def test_periodic_errors(self, name: str, effect: str) -> None:
        for one in of(name, effect)[::7]:
            fixed = dict(one.fixed)
            order = 2 * np.pi / fixed["lead_m"] if "lead_m" in fixed else fixed.get("order_1", 1.0)
            x = order * x_of(name, one.place.joint)
            error = 0.02 * np.sin(x) - 0.03 * np.cos(x)
            same(moved(name, one, [0.02, -0.03]), with_motors(name, one.place.joint, error))

    def test_coupling(self, name: str) -> None:
        for one in of(name, "coupling"):
            error = 0.1 * x_of(name, one.place.source)
            same(moved(name, one, [0.1]), with_joint(name, one.place.joint, error))

    def test_latency_along_the_speed(self, name: str) -> None:
        """Commands come late, all joints' by the same time: the arm is where its commands were."""
        sim, told, _ = world(name)
        late = told.seen.campaign.measurements.commanded[told.seen.rows] - 0.05 * told.logged("speed")
        everything = next(c for c in of(name, "latency") if c.place.joint is None and c.atom == "along the speed")
        same(moved(name, everything, [0.05]), chain_points(sim, nominal_net(told.seen.campaign.robot, late)))

    def test_latency_of_one_motor(self, name: str) -> None:
        _, told, _ = world(name)
        speed = active_commands(told.seen.campaign.robot, told.logged("speed"))
        for one in of(name, "latency"):
            if one.place.joint is not None and one.atom == "along the speed":
                same(
                    moved(name, one, [0.05]), with_motors(name, one.place.joint, -0.05 * speed[:, one.place.joint - 1])
                )

    def test_values_read_back(self, name: str) -> None:
        _, told, _ = world(name)
        rows = told.seen.campaign.measurements
        away = (rows.readback - rows.commanded)[told.seen.rows]
        for one in of(name, "latency"):
            if one.place.joint is not None and one.atom == "as read back":
                same(moved(name, one, [0.8]), with_joint(name, one.place.joint, 0.8 * away[:, one.place.joint - 1]))

    def test_quantisation(self, name: str) -> None:
        """At a share of one the displacement is whole steps away from its phase."""
        _, told, _ = world(name)
        one = drives.quantisation(told, {0: (0.01, 0.0), 2: (0.02, 0.25)})
        active = told.active.copy()
        active[:, 0] = 0.01 * np.round(active[:, 0] / 0.01)
        active[:, 2] = 0.02 * (np.round(active[:, 2] / 0.02 - 0.25) + 0.25)
        sim = world(name)[0]
        same(moved(name, one, [1.0]), chain_points(sim, net_of_motors(sim, active)))

    def test_backlash_is_half_the_gap_behind_the_motor(self, name: str) -> None:
        _, told, _ = world(name)
        for one in of(name, "backlash"):
            if one.atom == "taken up by the motor":
                error = -0.5 * 0.02 * told.sense[:, one.place.joint - 1]
                same(moved(name, one, [0.02]), with_motors(name, one.place.joint, error))

    def test_backlash_under_gravity_is_half_the_gap_on_the_flank(self, name: str) -> None:
        _, told, _ = world(name)
        for one in of(name, "backlash"):
            if one.atom.startswith("taken up by loads"):
                flank = told.past.flank(one.place.joint - 1, float(one.atom.split()[5]))
                found, expected = moved(name, one, [0.02]), with_motors(name, one.place.joint, 0.01 * flank)
                assert np.mean(np.abs(found - expected).max(axis=1) < 1e-12) > 0.98

    def test_hysteresis(self, name: str) -> None:
        """A loss of 20 that is 15 less right after a reversal and grows by 5 at full load."""
        _, told, _ = world(name)
        for one in of(name, "hysteresis"):
            if one.atom != "lost at once":
                continue
            j = one.place.joint - 1
            way = 0.015 if world(name)[0].seen.chain.sliding[j] else 0.15
            names = [f"not_yet_after_{1e3 * way:g}" in n for n in one.names]
            numbers = np.where(names, -0.015, 0.0)
            numbers[0] = 0.02
            loss = 0.02 - 0.015 * np.exp(-told.travel[:, j] / way)
            if one.names[-1].startswith("with_load"):
                numbers[-1] = 0.005
                loss += 0.005 * np.abs(told.drive_load[:, j]) / np.abs(told.drive_load[:, j]).max()
            same(moved(name, one, numbers), with_motors(name, one.place.joint, -0.5 * told.sense[:, j] * loss))

    def test_hysteresis_that_is_given_back(self, name: str) -> None:
        """A joint that a spring with friction holds: half the loss times how far it trails."""
        _, told, _ = world(name)
        found = [one for one in of(name, "hysteresis") if one.atom == "given back along the way"]
        assert found
        for one in found:
            j = one.place.joint - 1
            way = 0.015 if world(name)[0].seen.chain.sliding[j] else 0.15
            numbers = np.where([f"not_yet_after_{1e3 * way:g}" in n for n in one.names], -0.04, 0.0)
            numbers[0] = 0.02
            same(moved(name, one, numbers), with_motors(name, one.place.joint, -0.01 * told.past.dragged(j, way)))

    def test_compliance(self, name: str) -> None:
        _, told, _ = world(name)
        for one in of(name, "compliance"):
            load = told.logged("torque_nm") if "reported" in one.atom else told.drive_load
            numbers = np.zeros(len(one.names))
            numbers[0] = 3e-4
            error = 3e-4 * load[:, one.place.joint - 1]
            same(moved(name, one, numbers), with_motors(name, one.place.joint, error))

    def test_compliance_with_a_payload_beside_the_tool(self, name: str) -> None:
        """give times payload at an offset: the numbers are give x offset."""
        _, told, _ = world(name)
        offset = np.array([0.03, -0.02, 0.05])
        for one in of(name, "compliance"):
            if "roughly" in one.atom:
                j = one.place.joint - 1
                more = told.seen.payload_kg * (told.offset_load[:, j] @ offset)
                numbers = np.array([3e-4, 0, 0, *(3e-4 * offset)])
                same(moved(name, one, numbers), with_motors(name, j + 1, 3e-4 * (told.drive_load[:, j] + more)))

    def test_payload_bends_all_loaded_drives(self, name: str) -> None:
        sim, told, _ = world(name)
        for one in of(name, "payload"):
            if "elsewhere" in one.atom:
                continue
            kg = told.seen.payload_kg if "logged" in one.atom else np.ones(told.count)
            joints = [int(n.split("_")[3]) - 1 for n in one.names]
            active = told.active.copy()
            active[:, joints] += 2e-4 * kg[:, None] * told.kilogram_load[:, joints]
            same(moved(name, one, np.full(len(joints), 2e-4)), chain_points(sim, net_of_motors(sim, active)))


def test_what_a_joint_does_alone_is_not_passed_on() -> None:
    """Joints 1..3 are coupled: the same faults behind the branching, of net displacements."""
    _, told, _ = world(TURNING)
    speed = nominal_net(told.seen.campaign.robot, told.logged("speed"))
    for one in of(TURNING, "latency", alone=True):
        if one.place.joint is not None:
            error = -0.05 * speed[:, one.place.joint - 1]
            same(moved(TURNING, one, [0.05]), with_joint(TURNING, one.place.joint, error))
    for one in of(TURNING, "ratio", alone=True):
        error = 0.1 * told.seen.net[:, one.place.joint - 1]
        same(moved(TURNING, one, [0.1]), with_joint(TURNING, one.place.joint, error))
    assert {c.place.joint for c in of(TURNING, "ratio", alone=True)} == {1, 2, 3}
    assert not [c for c in world(SLIDING)[2] if ALONE in c.atom]


class TestLinkage:
    """A four-bar whose lengths are a little off: the loop closed exactly, differentiated, is a sum of the columns."""

    @staticmethod
    def rocker(crank: Array, bars: Array) -> Array:
        """Angle of the output crank; lengths: crank, coupler, output crank, ground."""
        a, b, c, d = bars
        end = a * np.exp(1j * crank) - d
        reach = np.abs(end)
        return np.angle(end) - np.arccos((reach**2 + c**2 - b**2) / (2 * reach * c))

    def test_every_difference_of_lengths_is_described(self) -> None:
        _, told, _ = world(TURNING)
        for one in of(TURNING, "linkage"):
            crank = x_of(TURNING, one.place.joint) + dict(one.fixed)["crank_at_zero_rad"]
            features = np.stack([column[0][1] for column in one.columns(told)], axis=1)
            for k in range(4):
                bars, step = np.array([1.0, 2.5, 1.0, 2.5]), 1e-6 * np.eye(4)[k]
                slope = (self.rocker(crank, bars + step) - self.rocker(crank, bars - step)) / 2e-6
                coefficients, *_ = np.linalg.lstsq(features, slope, rcond=None)
                np.testing.assert_allclose(features @ coefficients, slope, atol=1e-8)

    def test_no_crank_at_its_dead_point(self) -> None:
        for one in of(TURNING, "linkage"):
            crank = x_of(TURNING, one.place.joint) + dict(one.fixed)["crank_at_zero_rad"]
            assert np.sin(crank).min() > 0.1


def inserted(name: str, link: int, where: str, motion: Array, beyond: int) -> Array:
    """The points if everything beyond is moved by 4x4 motions (m, 4, 4) written in a frame of a link (from 0).

    Args:
        where: ``before`` the joint of that link moved, or ``after``.
        beyond: links from this one on (1..n) are moved.
    """
    sim, told, _ = world(name)
    seen = sim.seen
    frames = link_frames(seen.chain, seen.net)
    after = frames[:, link]
    before = (
        frames[:, link - 1] @ seen.chain.link_transforms[link - 1]
        if link
        else np.tile(seen.chain.base_transform, (told.count, 1, 1))
    )
    frame = sim.base @ (after if where == "after" else before)
    points = apply(frame @ motion @ invert(frame), sim.points_m())
    return np.where((seen.link >= beyond)[:, None], points, sim.points_m())


def beyond(name: str, link: int) -> int:
    """The first link (1..n) that a link (from 0) carries; the last one carries its own targets."""
    return min(link + 2, world(name)[0].seen.joint_count)


def turns(vectors: Array, about: Array | None = None) -> Array:
    out = np.tile(np.eye(4), (len(vectors), 1, 1))
    out[:, :3, :3] = Rotation.from_rotvec(vectors).as_matrix()
    if about is not None:
        out[:, :3, 3] = about - out[:, :3, :3] @ about
    return out


def shifts(vectors: Array) -> Array:
    out = np.tile(np.eye(4), (len(vectors), 1, 1))
    out[:, :3, 3] = vectors
    return out


@pytest.mark.parametrize("name", [TURNING, SLIDING])
class TestStructure:
    def test_geometry_is_another_link_transform(self, name: str) -> None:
        """Points are where the other chain has them, also those of targets on the link itself."""
        sim, _, _ = world(name)
        numbers = np.array([0.02, -0.03, 0.01, 0.02, -0.015])
        motion = np.eye(4)
        motion[:3, :3] = Rotation.from_rotvec([0.02, -0.03, 0.0]).as_matrix()
        motion[:3, 3] = numbers[2:]
        for one in of(name, "geometry"):
            transforms = sim.seen.chain.link_transforms.copy()
            transforms[one.place.frame - 1] = motion @ transforms[one.place.frame - 1]
            other = replace(sim, seen=replace(sim.seen, chain=replace(sim.seen.chain, link_transforms=transforms)))
            same(moved(name, one, numbers), other.points_m())

    def test_axis_wobble(self, name: str) -> None:
        for one in of(name, "axis_wobble"):
            j = one.place.joint - 1
            x = x_of(name, j + 1)
            if world(name)[0].seen.chain.sliding[j]:
                # Half waves from one end of the way to the other.
                x = np.pi * (x - (x.min() + x.max()) / 2) / np.ptp(x)
            times = {"": 1, "_of_twice": 2, "_of_three_times": 3, "_of_four_times": 4, "_of_five_times": 5}
            waves = {f"sine{words}": np.sin(k * x) for words, k in times.items()}
            waves |= {f"cosine{words}": np.cos(k * x) for words, k in times.items()}
            numbers = np.linspace(-0.02, 0.03, len(one.names))
            vectors = {"tilt": np.zeros((len(x), 3)), "shift": np.zeros((len(x), 3))}
            for label, number in zip(one.names, numbers, strict=True):
                kind, _, axis, wave = label.rsplit("_", 1)[0].split("_", 3)
                vectors[kind][:, "xyz".index(axis)] += number * waves[wave]
            motion = shifts(vectors["shift"]) @ turns(vectors["tilt"])
            same(moved(name, one, numbers), inserted(name, j, "before", motion, j + 1))

    def test_flexure_turns_what_lies_beyond_the_middle(self, name: str) -> None:
        sim, told, _ = world(name)
        for one in (one for one in of(name, "flexure") if "beam" not in one.atom):
            i = one.place.joint - 1
            numbers = np.zeros(len(one.names))
            numbers[:3] = [2e-4, -1e-4, 3e-4]
            middle = sim.seen.chain.link_transforms[i, :3, 3] / 2
            axes = beam_axes(middle)
            bend = (told.middle_moment[:, i] @ axes.T * numbers[:3]) @ axes
            # Shift and turn are composed one after the other: equal to a turn about the middle for small ones.
            expected = inserted(name, i, "after", turns(bend, middle), beyond(name, i))
            size = np.abs(expected - sim.points_m()).max()
            np.testing.assert_allclose(moved(name, one, numbers), expected, atol=np.abs(bend).max() * size + 1e-12)

    def test_a_clamped_beam_bends_as_its_curvature_summed_up(self, name: str) -> None:
        """Euler and Bernoulli: curvature is the moment of what lies beyond each place over the stiffness there."""
        sim, told, _ = world(name)
        for one in (one for one in of(name, "flexure") if one.atom == "as a clamped beam"):
            i = one.place.joint - 1
            give = np.array([0.0, 2e-6, -1e-6])
            along = sim.seen.chain.link_transforms[i, :3, 3]
            axes = beam_axes(along)
            kilograms = (told.loads.carried_kg[i] + told.seen.payload_kg)[:, None]
            force = kilograms * told.loads.force_kilogram[:, i]
            weight = told.loads.link_kg[i] * told.loads.force_kilogram[:, i]
            slope, shift = np.zeros((len(force), 3)), np.zeros((len(force), 3))
            places = (np.arange(400) + 0.5) / 400
            for share in places:
                moment = told.middle_moment[:, i] + np.cross((0.5 - share) * along, force)
                moment += np.cross((1 - share) / 2 * along, (1 - share) * weight)
                curve = (moment @ axes.T * give) @ axes / len(places)
                slope += curve
                shift += np.cross(curve, (1 - share) * along)
            motion = shifts(shift + along) @ turns(slope) @ shifts(np.broadcast_to(-along, shift.shape))
            expected = inserted(name, i, "after", motion, beyond(name, i))
            numbers = np.append(give, np.zeros(len(one.names) - 3))
            size = np.abs(expected - sim.points_m()).max()
            assert size > 1e-6 or not np.any(slope)
            np.testing.assert_allclose(
                moved(name, one, numbers), expected, atol=2e-5 * size + np.abs(slope).max() * size
            )

    def test_thermal_growth_makes_every_length_longer(self, name: str) -> None:
        sim, told, _ = world(name)
        rise = told.logged("arm_temperature_c") - told.logged("arm_temperature_c")[0]
        one = next(c for c in of(name, "thermal") if c.place.joint is None and "arm" in c.atom)
        numbers = np.zeros(len(one.names))
        numbers[0] = 1e-3
        found = moved(name, one, numbers)
        last = sim.seen.joint_count
        for k in np.flatnonzero(sim.seen.link == last)[::9]:
            transforms = sim.seen.chain.link_transforms.copy()
            transforms[:-1, :3, 3] *= 1 + 1e-3 * rise[k]
            chain = replace(sim.seen.chain, link_transforms=transforms)
            grown = replace(sim, seen=replace(sim.seen.part([k]), chain=chain)).points_m()[0]
            # The last link's own growth moves its targets; no drawing says how.
            own = Design(sim, tuple(one.columns(told)[-1:]), np.ones(1)).whole()[k, :, 0] * 1e-3
            if one.names[-1] != f"growth_of_link_{last}_per_k":
                own = np.zeros(3)
            np.testing.assert_allclose(
                found[k], grown + own, atol=1e-4 * np.abs(grown - sim.points_m()[k]).max() + 1e-9
            )

    def test_thermal_growth_of_one_link(self, name: str) -> None:
        sim, told, _ = world(name)
        air = told.logged("temperature_c")
        for one in of(name, "thermal"):
            if one.place.joint is not None and "air" in one.atom:
                i = one.place.joint - 1
                step = sim.seen.chain.link_transforms[i, :3, 3]
                motion = shifts(1e-3 * (air - air[0])[:, None] * step)
                same(moved(name, one, [1e-3]), inserted(name, i, "after", motion, beyond(name, i)))

    def test_warming_up_without_a_thermometer(self, name: str) -> None:
        _, told, _ = world(name)
        found = [c for c in of(name, "thermal") if c.place.joint is None and c.atom.startswith("warming")]
        assert len(found) == 3
        for one in found:
            minutes = float(one.atom.split()[3])
            law = 1 - np.exp(-told.elapsed_s / 60 / minutes)
            ratio = one.columns(told)[0][0][1][1:] / law[1:]
            np.testing.assert_allclose(ratio, ratio[-1], rtol=0.02)

    def test_an_arm_that_rests_may_cool(self, name: str) -> None:
        sim, _, _ = world(name)
        rows = sim.seen.campaign.measurements
        late = replace(rows, time_s=rows.time_s + np.where(rows.record > 20, 5400.0, 0.0))
        rested = doings(replace(sim.seen, campaign=replace(sim.seen.campaign, measurements=late)))
        found = [c for c in thermals(rested) if c.place.joint is None and c.atom.startswith("warming")]
        assert sorted(c.atom.endswith("of work") for c in found) == [False] * 3 + [True] * 3
        for one in found:
            rise = one.columns(rested)[0][0][1]
            cools = np.abs(rise[rested.seen.record == 21]) < np.abs(rise[rested.seen.record == 20])
            assert cools.all() == one.atom.endswith("of work")


@pytest.mark.parametrize("name", [TURNING, SLIDING])
class TestInstrument:
    def test_scale(self, name: str) -> None:
        sim, _, _ = world(name)
        even, *uneven = of(name, "scale")
        away = sim.points_m() - sim.middle_m
        same(moved(name, even, [0.01]), sim.points_m() + 0.01 * away)
        sight = sim.middle_m / np.linalg.norm(sim.middle_m)
        for one in uneven:
            deeper = (away @ sight)[:, None] * sight
            same(moved(name, one, [0.01, -0.004]), sim.points_m() + 0.01 * away - 0.004 * deeper)

    def test_depth_is_known_apart_where_the_instrument_stands_outside(self, name: str) -> None:
        _, told, _ = world(name)
        about_m = told.seen.point_m - told.seen.point_m.mean(axis=0)
        for far_m, many in ((50.0, 2), (0.0, 1)):
            seen = SimpleNamespace(point_m=about_m + np.array([far_m, 0.0, 0.0]))
            assert len(instrument.scales(SimpleNamespace(seen=seen, count=told.count))) == many

    def test_drift(self, name: str) -> None:
        sim, told, _ = world(name)
        even = next(c for c in of(name, "drift") if c.atom == "evenly")
        numbers = np.array([0.01, 0.0, -0.02, 0.003, 0.001, -0.002])
        turn = turns(told.seen.time[:, None] * numbers[:3], sim.middle_m)
        expected = apply(turn, sim.points_m()) + told.seen.time[:, None] * numbers[3:]
        same(moved(name, even, numbers), expected)

    def test_creep_ends_where_even_drift_does(self, name: str) -> None:
        _, told, _ = world(name)
        for one in of(name, "drift"):
            law = one.columns(told)[0][0][1]
            assert law[0] == 0
            assert law[-1] == pytest.approx(1.0)
            assert np.all(np.diff(law) > 0)

    def test_base_shift_and_target_slip(self, name: str) -> None:
        sim, told, _ = world(name)
        record = int(sim.seen.record[told.count // 3])
        after = sim.seen.record >= record
        shifted = moved(name, instrument.base_shift(record, 1), [0, 0, 0, 0.1, 0.2, 0.3])
        same(shifted, sim.points_m() + np.where(after[:, None], [0.1, 0.2, 0.3], 0.0))
        slipped = moved(name, instrument.target_slip(told, 1, record, 1), [0.01, 0.02, 0.03])
        target_m = sim.target_m + np.array([0.01, 0.02, 0.03])
        other = replace(sim, target_m=target_m).points_m()
        same(slipped, np.where((after & (sim.seen.target == 1))[:, None], other, sim.points_m()))

    def test_moments_are_the_first_records_of_standstills(self, name: str) -> None:
        _, told, _ = world(name)
        firsts = set(told.seen.record[np.append(True, np.diff(told.seen.standstill) != 0)])
        for effect in ("base_shift", "target_slip"):
            assert {c.place.record for c in of(name, effect)} <= firsts


def test_saw_rounds_to_whole_steps() -> None:
    x = np.random.default_rng(1).uniform(-3, 3, 500)
    for step, phase in ((0.1, 0.0), (0.03, 0.5), (0.7, 0.2)):
        teeth = drives.saw(x, step, phase)
        assert np.abs(teeth).max() <= step / 2 + 1e-12
        rest = (x + teeth) / step - phase
        np.testing.assert_allclose(rest, np.round(rest), atol=1e-9)


def test_one_cause_is_counted_once_however_many_forms_it_has() -> None:
    """What choosing costs is at least the number of forms that compete at one place."""
    for name in (TURNING, SLIDING):
        forms: dict[object, list[Candidate]] = {}
        for one in world(name)[2]:
            place = one.place
            if one.named:
                forms.setdefault((place.effect, place.joint, place.source, place.frame, place.target), []).append(one)
        for key, some in forms.items():
            if key[0] not in ("compliance", "latency"):
                assert max(c.choices for c in some) >= len(some) / 2, key
