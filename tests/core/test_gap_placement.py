"""Where base and targets are found: from any orientation; what is known stays; what is left out is not fitted."""

from dataclasses import replace

import numpy as np
import pytest
from gap_arms import ARMS, campaign, kinds, measured_at, random_sim, table, with_points
from hypothesis import given, settings
from random_arms import SEEDS, random_motion

from core.gap.observations import Observations, observe
from core.gap.placement import place, placement_priors, placement_slots
from core.gap.sim import Part, Sim
from core.geometry import Array, apply, invert, rigid_fit
from core.measurements import Target
from core.robot_builders import DhRow, robot_from_dh


def posed(name: str, seed: int, count: int = 40) -> Sim:
    """A sim whose points are measured exactly where it has them."""
    return random_sim(ARMS[name](seed), seed, count)


def known(seen: Observations, places: Array, sigma_m: float = 0.0) -> Observations:
    """The same with the targets' places written down."""
    targets = tuple(
        replace(target, point_m=tuple(float(v) for v in place), sigma_m=sigma_m)
        for target, place in zip(seen.campaign.targets, places, strict=True)
    )
    return replace(seen, campaign=replace(seen.campaign, targets=targets))


def misfit(sim: Sim, seen: Observations) -> float:
    return float(np.abs(sim.points_m() - seen.point_m).max())


def test_axes_that_are_nearly_parallel_send_no_target_away() -> None:
    """All axes upright to a milliradian: how high base and targets sit together is nearly open, no more than that."""
    tilts = np.random.default_rng(1).normal(scale=1e-3, size=(4, 2))
    rows = [
        DhRow(0.1, d, a + tilt[0], tilt[1])
        for d, a, tilt in zip((0.4, 0, 0, 0.1), (0.35, 0.3, 0, 0), tilts, strict=True)
    ]
    robot = robot_from_dh("scara", kinds((False, False, True, False)), rows)
    for seed in range(4):
        sim = random_sim(robot, seed, 80)
        seen = with_points(sim.seen, sim.points_m() + 2e-5 * np.random.default_rng(seed).normal(size=(80, 3)))
        found = place(seen, np.ones(80))
        assert misfit(found, seen) < 2e-4
        assert np.abs(found.target_m).max() < 1.0


def test_along_parallel_axes_targets_are_near_the_tool() -> None:
    """Nothing tells a higher base from lower targets: then they are taken to be where tools carry them."""
    rows = [DhRow(0.1, d, a, 0.0) for d, a in ((0.4, 0.35), (0.0, 0.3), (0.0, 0.0), (0.5, 0.0))]
    robot = robot_from_dh("scara", kinds((False, False, True, False)), rows)
    sim = random_sim(robot, 2, 80)
    found = place(sim.seen, np.ones(80))
    last = [t for t, target in enumerate(sim.seen.campaign.targets) if target.link == 4]
    assert misfit(found, sim.seen) < 1e-6
    assert found.target_m[last, 2].mean() == pytest.approx(0.5, abs=0.3)


@pytest.mark.parametrize("name", ["phi", "dh with slides", "coupled"])
@settings(max_examples=3)
@given(seed=SEEDS)
def test_base_and_targets_are_recovered_from_any_orientation(name: str, seed: int) -> None:
    true = posed(name, 1)
    true = replace(true, base=random_motion(np.random.default_rng(seed)))
    true = measured_at(true, true.points_m())
    found = place(true.seen, np.ones(true.seen.count))
    assert misfit(found, true.seen) < 1e-9
    np.testing.assert_allclose(found.base[:3, :3].T @ found.base[:3, :3], np.eye(3), atol=1e-12)


def test_what_the_points_fix_is_found_itself() -> None:
    """With two targets on the last link and one on every other, only what turns with axis 1 stays open."""
    true = posed("dh", 2)
    found = place(true.seen, np.ones(true.seen.count))
    # What axis 1 leaves open: base and everything else turned about it against joint 1, and slid along it.
    left = invert(found.base @ true.seen.chain.base_transform) @ true.base @ true.seen.chain.base_transform
    np.testing.assert_allclose(left[:3, 2], [0, 0, 1], atol=1e-6)
    np.testing.assert_allclose(found.target_m[:2], true.target_m[:2], atol=1e-6)


def test_known_targets_stay_and_place_the_base() -> None:
    true = posed("coupled", 3)
    seen = known(true.seen, true.target_m)
    slots = placement_slots(seen)
    assert {slot.part for slot in slots} == {Part.BASE}
    found = place(seen, np.ones(seen.count))
    np.testing.assert_array_equal(found.target_m, true.target_m)
    np.testing.assert_allclose(found.base, true.base, atol=1e-8)


def test_wrong_known_places_are_not_moved_but_show() -> None:
    true = posed("coupled", 3)
    wrong = true.target_m + np.array([1e-3, 0.0, 0.0])
    found = place(known(true.seen, wrong), np.ones(true.seen.count))
    np.testing.assert_array_equal(found.target_m, wrong)
    assert misfit(found, true.seen) > 2e-4


def test_places_known_to_so_much_move_by_about_so_much() -> None:
    """Places written down 1 mm wrong: points good to 0.02 mm outweigh a place good to 1 mm, not one good to 1 um."""
    true = posed("dh", 4, 60)
    off = np.random.default_rng(4).normal(scale=1e-3, size=true.target_m.shape)
    moved = []
    for sigma_m in (1e-6, 1e-3):
        seen = known(true.seen, true.target_m + off, sigma_m)
        found = place(seen, np.full(seen.count, 1 / 2e-5**2))
        moved.append(np.abs(found.target_m - true.target_m - off).max())
        priors = placement_priors(seen, placement_slots(seen))
        assert set(priors) == {np.inf, sigma_m}
    assert moved[0] < 1e-4
    assert moved[1] > 1e-3


def test_points_without_weight_say_nothing() -> None:
    true = posed("phi", 5, 60)
    rng = np.random.default_rng(5)
    lost = rng.random(60) < 0.3
    points = true.points_m() + np.where(lost[:, None], rng.normal(scale=0.5, size=(60, 3)), 0.0)
    found = place(with_points(true.seen, points), np.where(lost, 0.0, 1.0))
    np.testing.assert_allclose(found.points_m(), true.points_m(), atol=1e-8)


def test_noise_moves_the_placement_no_further_than_least_squares_lets_it() -> None:
    """Residual sum of squares over noise variance: chi-square with as many degrees as points leave."""
    true = posed("dh", 6, 200)
    rng = np.random.default_rng(6)
    seen = with_points(true.seen, true.points_m() + 1e-4 * rng.normal(size=(200, 3)))
    found = place(seen, np.ones(200))
    slots = placement_slots(seen)
    freedom = 600 - np.linalg.matrix_rank(found.fields(slots).reshape(600, -1), tol=1e-6)
    chi_square = np.sum((seen.point_m - found.points_m()) ** 2) / 1e-8
    assert abs(chi_square - freedom) < 4 * np.sqrt(2 * freedom)


def test_a_single_point_is_placed_on_itself() -> None:
    true = posed("phi", 7, 1)
    assert misfit(place(true.seen, np.ones(1)), true.seen) < 1e-6


class TestAnotherSimulator:
    """``sim_*`` columns: compared as given, or placed first, as ``[sim] place`` says."""

    def seen(self, place_them: bool) -> tuple[Observations, Array, Array]:
        true = posed("coupled", 8)
        motion = random_motion(np.random.default_rng(80))
        given = apply(invert(motion), true.points_m())
        rows = replace(true.seen.campaign.measurements, simulated_point_m=given)
        changed = replace(true.seen.campaign, measurements=rows, place_simulated=place_them)
        return replace(true.seen, campaign=changed), given, motion

    def test_placed_if_asked_for(self) -> None:
        seen, _, motion = self.seen(place_them=True)
        found = place(seen, np.ones(seen.count))
        np.testing.assert_allclose(found.simulated_to_instrument, motion, atol=1e-9)
        assert misfit(found, seen) < 1e-9
        assert len(placement_slots(seen)) == 6

    def test_compared_as_given_otherwise(self) -> None:
        seen, given, _ = self.seen(place_them=False)
        found = place(seen, np.ones(seen.count))
        assert found.simulated_to_instrument is None
        np.testing.assert_array_equal(found.points_m(), given)
        assert placement_slots(seen) == []

    @pytest.mark.parametrize("place_them", [False, True])
    def test_the_chain_stands_where_the_points_are(self, place_them: bool) -> None:
        """Its axes are needed for what drives do, so it must follow the points, not the instrument."""
        seen, given, motion = self.seen(place_them)
        found = place(seen, np.ones(seen.count))
        chain = replace(found, seen=without_simulated(seen), simulated_to_instrument=None)
        np.testing.assert_allclose(chain.points_m(), apply(motion, given) if place_them else given, atol=1e-8)

    def test_rows_without_weight_do_not_place_it(self) -> None:
        seen, given, _ = self.seen(place_them=True)
        weight = np.where(np.arange(seen.count) < 30, 1.0, 0.0)
        points = seen.point_m + np.where(weight[:, None] > 0, 0.0, 0.4)
        found = place(with_points(seen, points), weight)
        best = rigid_fit(given[:30], seen.point_m[:30])
        np.testing.assert_allclose(found.simulated_to_instrument, best, atol=1e-9)


def without_simulated(seen: Observations) -> Observations:
    rows = replace(seen.campaign.measurements, simulated_point_m=None)
    return replace(seen, campaign=replace(seen.campaign, measurements=rows))


def test_targets_on_the_floor_are_no_points_of_the_gap() -> None:
    robot = ARMS["phi"](9)
    rows = table(np.zeros((4, 4)), np.array([0, 1, 0, 1]))
    seen = observe(campaign(robot, (Target("floor", 0), Target("tool", 4)), rows))
    assert seen.count == 2
    assert set(seen.link) == {4}


def test_a_target_that_only_validation_rows_show_cannot_be_placed() -> None:
    """Unless its place is known, or nothing else was measured at all."""
    robot, which, check = ARMS["phi"](9), np.array([0, 1, 2, 1, 2]), np.array([False, True, True, True, True])
    targets = (Target("seen", 4), Target("lost", 4), Target("known", 4, (0.1, 0.0, 0.0)))
    seen = observe(campaign(robot, targets, table(np.zeros((5, 4)), which, check=check)))
    assert list(seen.target) == [0, 2, 2]
    alone = observe(campaign(robot, targets, table(np.zeros((5, 4)), which, check=np.ones(5, dtype=bool))))
    assert alone.count == 5
