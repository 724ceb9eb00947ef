"""What a plan can show and tell apart: algebra against worlds drawn by hand, known confusions, simulated campaigns."""

from dataclasses import fields, replace
from functools import cache

import numpy as np
import pytest
from gap_arms import Day, day, phi_arm, random_sim
from gap_cells import crane_cell, measured

from core.errors import CampaignError
from core.gap.additions import Addition, additions, best_for
from core.gap.analysis import AS_CALIBRATED
from core.gap.diagnosis import diagnose
from core.gap.effects.candidate import Candidate
from core.gap.evidence import Chosen, best_sizes
from core.gap.expected_evidence import columns_of, expected_evidence, granting, size_for
from core.gap.isolability import APART, Isolability, Isolated, isolability
from core.gap.isolability_field import STATED, one_quantity
from core.gap.isolability_json import isolability_record
from core.gap.planned import as_planned, planned_problem, untested, with_expected_points
from core.gap.planned import with_noise as with_expected_noise
from core.gap.problem import Problem
from core.gap.result import Place, Verdict
from core.json_values import json_text
from core.measurements import SWEEP, Campaign, Instrument, Measurements

NOISE_M = float(np.hypot(2e-5, 1e-5 / np.sqrt(8 / np.pi)))
"""Of the crane: instrument and repeatability."""
SEEDS = range(300, 304)


def with_noise(campaign: Campaign, sigma_m: float = NOISE_M) -> Campaign:
    rows = campaign.measurements
    stated = np.tile(sigma_m**2 * np.eye(3), (rows.count, 1, 1))
    return replace(campaign, measurements=replace(rows, covariance_m2=stated))


def some(campaign: Campaign, keep: np.ndarray) -> Campaign:
    """The same campaign with some of its rows."""
    table = campaign.measurements
    columns = {field.name: getattr(table, field.name) for field in fields(Measurements)}
    kept = {name: None if values is None else values[keep] for name, values in columns.items()}
    return replace(campaign, measurements=Measurements(**kept))


def sweeps_one_way() -> Campaign:
    """Arcs forwards only, every motor always brought to its place from below."""
    whole = with_noise(measured(crane_cell()))
    table = whole.measurements
    own = table.approach[np.arange(table.count), np.maximum(table.joint - 1, 0)]
    there = some(whole, (table.phase == SWEEP) & (own > 0))
    rows = there.measurements
    return replace(there, measurements=replace(rows, approach=np.ones_like(rows.approach)))


def under_one_load() -> Campaign:
    """The same with 5 kg at the tool all the time, of an arm whose own masses nobody knows."""
    campaign = sweeps_one_way()
    load = np.full(campaign.measurements.count, 5.0)
    robot = replace(campaign.robot, links=())
    return replace(campaign, robot=robot, measurements=replace(campaign.measurements, payload_kg=load))


PLANS = {
    "whole": lambda: with_noise(measured(crane_cell())),
    "one way": sweeps_one_way,
    "one load": under_one_load,
}


@cache
def judged(plan: str, drawn: bool = False) -> Isolability:
    return isolability(PLANS[plan](), drawn)


@cache
def tried(plan: str) -> tuple[Addition, ...]:
    return additions(judged(plan))


def of(found: Isolability, place: Place) -> Isolated:
    (one,) = [effect for effect in found.effects if effect.place == place]
    return one


def rivals(one: Isolated) -> set[Place]:
    return {rival.place for rival in one.rivals}


@cache
def small_problem() -> Problem:
    return planned_problem(with_noise(day(phi_arm(5), 5, Day(arc=5, poses=12)).seen.campaign))


def plain(problem: Problem, count: int = 12) -> list[int]:
    """Candidates of all widths, spread over the library."""
    return [int(g) for g in problem.named[:: max(1, len(problem.named) // count)]]


class TestExpectedEvidence:
    def test_what_is_granted_is_taken_out_as_by_least_squares_with_priors(self) -> None:
        problem = small_problem()
        groups = plain(problem, 6)
        granted = Chosen((groups[0], groups[1]), (3.0, 0.5))
        found = granting(problem, granted, groups[2:])
        fixed = np.concatenate([np.arange(problem.nuisance), columns_of(problem, granted.groups)])
        own = columns_of(problem, groups[2:])
        root = problem.design.whole() / NOISE_M
        x, y = (root[:, :, part].reshape(-1, len(part)) for part in (fixed, own))
        widths = [problem.slices[g].stop - problem.slices[g].start for g in granted.groups]
        sigma = np.concatenate([problem.nuisance_precision(AS_CALIBRATED) ** -0.5, np.repeat(granted.sizes, widths)])
        # Priors are as good as measurements of the numbers themselves.
        q, _ = np.linalg.qr(np.vstack([x, np.diag(1 / sigma)]))
        with_priors = np.vstack([y, np.zeros((len(sigma), y.shape[1]))])
        left = with_priors - q @ (q.T @ with_priors)
        expected = left.T @ left
        here = found.square.whole[found.nuisance :, found.nuisance :]
        np.testing.assert_allclose(here, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())

    def test_it_is_the_mean_over_drawn_worlds(self) -> None:
        """Where one scale fits all worlds best; a scale chosen for each world gains a little more."""
        problem, rng, draws = small_problem(), np.random.default_rng(4), 40_000
        groups = plain(problem, 10)
        evidence = granting(problem, Chosen(), groups)
        acting, size = 3, 0.6
        found = expected_evidence(evidence, [acting], np.array([size]))[0]
        tail = slice(evidence.nuisance, None)
        values, vectors = np.linalg.eigh(evidence.square.whole[tail, tail])
        noise = (vectors * np.sqrt(np.clip(values, 0, None))) @ rng.standard_normal((len(values), draws))
        numbers = size * rng.standard_normal((len(evidence.index([acting])), draws))
        pulls = evidence.square.whole[:, evidence.index([acting])] @ numbers
        pulls[tail] += noise
        for members, spectrum, basis in evidence.bases:
            for k, g in enumerate(members):
                seen = basis[k].T @ pulls[evidence.index([g])]
                mean_power = np.sqrt(np.mean(seen**2, axis=1))[None, :, None]
                at_mean = best_sizes(spectrum[k : k + 1], mean_power)[0].item()
                each = best_sizes(spectrum[k : k + 1], seen[None])[0].ravel()
                assert found[g] == pytest.approx(at_mean, rel=0.1, abs=0.1)
                assert found[g] <= each.mean() + 4 * each.std() / np.sqrt(draws)

    def test_the_size_for_an_amount_of_evidence_gathers_it(self) -> None:
        problem = small_problem()
        groups = plain(problem)
        evidence = granting(problem, Chosen(), groups)
        size = size_for(evidence, np.full(len(groups), 9.0))
        seen = np.flatnonzero(np.isfinite(size))
        assert len(seen) > 5
        gathered = expected_evidence(evidence, list(seen), size[seen])[np.arange(len(seen)), seen]
        np.testing.assert_allclose(gathered, 9.0, atol=0.3)

    def test_what_placement_takes_back_gathers_nothing(self) -> None:
        first = of(judged("whole"), Place("zero_offset", joint=1))
        assert not first.limit.shown
        assert not first.named


class TestPlans:
    def test_twice_the_noise_needs_twice_the_size(self) -> None:
        louder = isolability(with_noise(measured(crane_cell()), 2 * NOISE_M))
        for place in (Place("ratio", joint=1), Place("backlash", joint=2), Place("coupling", joint=2, source=1)):
            once, twice = of(judged("whole"), place).limit, of(louder, place).limit
            assert twice.rms_m == pytest.approx(2 * once.rms_m, rel=0.1)
            assert twice.size / once.size == pytest.approx(twice.rms_m / once.rms_m)

    def test_geometry_as_drawn_hides_more(self) -> None:
        for place in (Place("ratio", joint=2), Place("geometry", frame=1), Place("scale")):
            assert of(judged("whole", True), place).limit.rms_m >= of(judged("whole"), place).limit.rms_m * 0.999
        places = [one.place for one in judged("whole", True).effects]
        assert len(places) == len(set(places))
        assert set(places) == {one.place for one in judged("whole").effects}

    def test_rivals_are_nearer_than_what_is_told_apart(self) -> None:
        for one in judged("whole").effects:
            far = [rival.separation for rival in one.rivals]
            assert far == sorted(far)
            assert all(0 <= value < APART for value in far)
            assert one.place not in rivals(one)
            if one.limit.shown:
                least = STATED * np.sqrt(3) * NOISE_M
                assert one.rms_m >= max(least, 2 * one.limit.rms_m) * (1 - 1e-9)

    def test_it_is_the_same_every_time(self) -> None:
        campaign = PLANS["one load"]()
        texts = []
        for _ in range(2):
            found = isolability(campaign)
            texts.append(json_text(isolability_record(found, additions(found))))
        assert texts[0] == texts[1]


class TestOneSense:
    def test_backlash_is_a_zero_offset_until_a_sweep_is_reversed(self) -> None:
        lost = of(judged("one way"), Place("backlash", joint=2))
        assert Place("zero_offset", joint=2) in rivals(lost)
        assert lost.rivals[0].separation < 0.5
        way, parting = best_for(lost.place, tried("one way"))
        assert "joint 2 once more in the other sense" in way.words
        assert Place("zero_offset", joint=2) in parting.parted

    def test_of_the_first_axis_it_is_not_seen_at_all_until_then(self) -> None:
        lost = of(judged("one way"), Place("backlash", joint=1))
        assert not lost.limit.shown
        way, parting = best_for(lost.place, tried("one way"))
        assert "joint 1 once more in the other sense" in way.words
        assert parting.shows

    def test_measured_both_ways_it_is_told_from_it(self) -> None:
        for joint in (1, 2, 3):
            lost = of(judged("whole"), Place("backlash", joint=joint))
            assert lost.limit.shown
            assert rivals(lost) == {Place("hysteresis", joint=joint)}


class TestOneLoad:
    def test_what_gives_under_it_looks_like_kinematics_until_the_load_changes(self) -> None:
        found, shoulder = judged("one load"), Place("compliance", joint=2)
        alike = {Place("ratio", joint=2), Place("eccentricity", joint=2)}
        assert alike <= rivals(of(found, shoulder))
        loads = [one for one in tried("one load") if "joint 2 with 5 kg more" in one.words]
        (parting,) = [parting for parting in loads[0].partings if parting.effect == shoulder]
        assert alike <= set(parting.parted)
        assert "compliance of joint 2" not in " ".join(untested(found.problem))
        assert any("payload is never changed" in sentence for sentence in untested(found.problem))

    def test_a_drive_and_the_link_before_it_bend_alike_whatever_is_added(self) -> None:
        """The same axis, the same moment (reference: wind-up against torsion, bending)."""
        for one in tried("whole"):
            for parting in one.partings:
                if parting.effect == Place("compliance", joint=2):
                    assert Place("flexure", joint=1) in parting.left


LIMITS = (
    (Place("backlash", joint=1), "backlash:1:{:.10f}deg", 180 / np.pi),
    (Place("ratio", joint=2), "ratio:2:{:.12f}", 1.0),
    (Place("compliance", joint=3), "compliance:3:{:.9f}urad/Nm", 1e6),
)


class TestSimulatedCampaigns:
    def said(self, text: str, factor: float, size: float) -> list:
        return [diagnose(measured(crane_cell(), text.format(factor * size), seed=seed)) for seed in SEEDS]

    def test_effects_at_their_limit_are_found_mostly_and_at_a_third_of_it_hardly_ever(self) -> None:
        at, below = [], []
        for place, text, factor in LIMITS:
            size = of(judged("whole"), place).limit.size
            at += [(place, found) for found in self.said(text, factor, size)]
            below += [(place, found) for found in self.said(text, factor, size / 3)]
        named = [any(place.same_as(twin) for c in found.causes for twin in c.twins) for place, found in at]
        assert np.mean(named) >= 2 / 3
        assert np.mean([found.verdict is not Verdict.NO_GAP for _, found in below]) <= 1 / 6

    @pytest.mark.parametrize(
        ("place", "text", "factor"),
        [
            (Place("coupling", joint=2, source=1), "coupling:1-2:{:.12f}", 1.0),
            (Place("compliance", joint=2), "compliance:2:{:.9f}urad/Nm", 1e6),
        ],
        ids=["alone", "with rivals"],
    )
    def test_a_diagnosis_names_alone_what_was_to_be_told_apart_and_classes_else(
        self, place: Place, text: str, factor: float
    ) -> None:
        one = of(judged("whole"), place)
        for found in self.said(text, factor, one.limit.size * one.rms_m / one.limit.rms_m):
            twins = found.causes[0].twins
            assert any(place.same_as(twin) for twin in twins)
            assert (len(twins) == 1) == one.named
            assert all(any(twin.same_as(known) for known in (place, *rivals(one))) for twin in twins)


class TestPlaces:
    def test_points_are_where_the_robot_will_have_them(self) -> None:
        sim = random_sim(phi_arm(8), 8)
        targets = tuple(
            replace(target, point_m=tuple(map(float, place)))
            for target, place in zip(sim.seen.campaign.targets, sim.target_m, strict=True)
        )
        rows = sim.seen.campaign.measurements
        blank = replace(rows, point_m=np.full_like(rows.point_m, np.nan))
        filled = with_expected_points(replace(sim.seen.campaign, targets=targets, measurements=blank), sim.base)
        np.testing.assert_allclose(filled.measurements.point_m, sim.points_m(), atol=1e-12)

    def test_a_target_without_a_place_is_refused(self) -> None:
        campaign = random_sim(phi_arm(8), 8).seen.campaign
        with pytest.raises(CampaignError, match="target 'A' has no place on its link"):
            with_expected_points(campaign, np.eye(4))

    def test_measured_points_give_way_to_expected_ones_of_the_placed_sim(self) -> None:
        sim = random_sim(phi_arm(8), 8, count=60)
        rows = sim.seen.campaign.measurements
        partly = np.where(np.arange(60)[:, None] < 50, rows.point_m, np.nan)
        found = as_planned(replace(sim.seen.campaign, measurements=replace(rows, point_m=partly)))
        np.testing.assert_allclose(found.measurements.point_m, sim.points_m(), atol=1e-7)
        assert all(target.sigma_m == np.inf for target in found.targets)

    def test_noise_is_as_stated_or_as_given_and_has_to_be_known(self) -> None:
        stated = PLANS["whole"]()
        for sigma_m, repeats_m, expected in ((None, None, NOISE_M), (3e-5, 4e-5, 5e-5)):
            found = with_expected_noise(stated, sigma_m, repeats_m).measurements.covariance_m2
            np.testing.assert_allclose(found, np.broadcast_to(expected**2 * np.eye(3), found.shape), rtol=1e-9)
        silent = replace(stated, instrument=Instrument("other"))
        rows = silent.measurements
        silent = replace(silent, measurements=replace(rows, covariance_m2=np.full_like(rows.covariance_m2, np.nan)))
        with pytest.raises(CampaignError, match="does not state how exact its points will be"):
            with_expected_noise(silent, None, 1e-5)

    def test_what_cannot_be_asked_is_said(self) -> None:
        campaign = PLANS["whole"]()
        rows = replace(campaign.measurements, approach=np.zeros_like(campaign.measurements.approach), time_s=None)
        rows = replace(rows, temperature_c=None, arm_temperature_c=None)
        bare = replace(campaign, robot=replace(campaign.robot, gravity_direction=None), measurements=rows)
        said = " ".join(untested(planned_problem(bare)))
        for word in ("lost motion", "gravity", "latency", "thermal growth", "encoders"):
            assert word in said


@pytest.mark.parametrize(
    ("names", "unit"),
    [
        (("offset_rad",), "rad"),
        (("sine_rad", "cosine_rad"), "rad"),
        (("shift_along_x_m", "shift_along_y_m", "shift_along_z_m"), "m"),
        (("give_about_x_rad_per_nm", "give_about_y_rad_per_nm"), "rad_per_nm"),
        (("turn_about_x_rad", "shift_along_x_m"), ""),
        (("loss_rad", "not_yet_after_50_mrad_rad"), ""),
    ],
)
def test_numbers_of_one_quantity_have_its_unit(names: tuple[str, ...], unit: str) -> None:
    assert one_quantity(names) == unit


def test_every_named_place_of_the_library_is_judged_once() -> None:
    found = judged("whole")
    named: list[Candidate] = [found.problem.candidates[k] for k in found.problem.named]
    assert {one.place for one in found.effects} == {replace(c.place, record=None) for c in named}
    assert len({one.place for one in found.effects}) == len(found.effects)
