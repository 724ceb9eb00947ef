"""Campaigns that say little: a useful answer or one clear sentence, never an invented cause."""

from dataclasses import fields, replace
from functools import cache

import numpy as np
import pytest
from gap_arms import ARMS, campaign, chain_points, day, measured_at, net_of_motors, table
from gap_cells import POSES, crane_cell, measured

from core.errors import CampaignError
from core.gap.corrected import Diagnosis
from core.gap.diagnosis import diagnose
from core.gap.gap_json import gap_to_json
from core.gap.observations import observe
from core.gap.result import UNKNOWN, Verdict
from core.measurements import Campaign, Instrument, Measurements, Target

RATIO = "ratio:2:0.3%"


@cache
def whole(*effects: str) -> Campaign:
    return measured(crane_cell(), *effects)


def kept(campaign: Campaign, keep: np.ndarray) -> Campaign:
    """Some of the rows."""
    rows = campaign.measurements
    columns = {f.name: getattr(rows, f.name) for f in fields(Measurements)}
    return replace(campaign, measurements=replace(rows, **{k: v[keep] for k, v in columns.items() if v is not None}))


def changed(campaign: Campaign, **columns: object) -> Campaign:
    return replace(campaign, measurements=replace(campaign.measurements, **columns))


def named(report: Diagnosis) -> list[tuple[str, int | None]]:
    """What the strongest cause may be: itself and what the data cannot tell from it."""
    return [(place.effect, place.joint) for place in report.causes[0].twins]


def said(report: Diagnosis, text: str) -> bool:
    return any(text in warning for warning in report.warnings)


def makes_a_file(report: Diagnosis) -> None:
    assert '"format": "trueaxis-gap/1"' in gap_to_json(report)


@pytest.mark.parametrize(
    ("count", "told"),
    [
        (1, "1 measured point cannot be compared .* takes 9 numbers, so at least 4 points are needed"),
        (4, "4 measured points cannot be compared .* takes 12 numbers, so at least 5 points are needed"),
    ],
)
def test_fewer_points_than_placing_takes(count: int, told: str) -> None:
    """A single point; two poses of two targets."""
    first = np.flatnonzero(whole().measurements.pose >= 0)[:count]
    with pytest.raises(CampaignError, match=told):
        diagnose(kept(whole(), first))


def test_a_single_point_may_be_held_against_a_sim_that_is_placed() -> None:
    one = kept(whole(), np.array([5]))
    report = diagnose(changed(one, simulated_point_m=one.measurements.point_m + 1e-3))
    assert report.gap_rms_m == pytest.approx(np.sqrt(3) * 1e-3)
    assert not [c for c in report.causes if c.place.effect != UNKNOWN]
    makes_a_file(report)


def test_nothing_seen() -> None:
    with pytest.raises(CampaignError, match="no measured point"):
        diagnose(changed(whole(), point_m=np.full((whole().measurements.count, 3), np.nan)))


@pytest.mark.parametrize("effects", [(), (RATIO,)])
class TestStillUseful:
    """What is there is found, up to its class; nothing where there is nothing."""

    def holds(self, report: Diagnosis, effects: tuple[str, ...]) -> None:
        makes_a_file(report)
        if effects:
            assert ("ratio", 2) in named(report)
        else:
            assert report.verdict is Verdict.NO_GAP
            assert report.causes == ()

    def test_five_poses(self, effects: tuple[str, ...]) -> None:
        pose = whole(*effects).measurements.pose
        report = diagnose(kept(whole(*effects), (pose >= 0) & (pose < 5)))
        assert said(report, "There are 10 points only")
        self.holds(report, effects)

    def test_one_sweep(self, effects: tuple[str, ...]) -> None:
        rows = whole(*effects).measurements
        report = diagnose(kept(whole(*effects), (rows.joint == 2) & (rows.approach[:, 1] > 0)))
        assert said(report, "Joints that never moved: 1, 3:")
        assert said(report, "There are no poses")
        self.holds(report, effects)

    def test_joints_that_never_move(self, effects: tuple[str, ...]) -> None:
        rows = whole(*effects).measurements
        report = diagnose(kept(whole(*effects), (rows.joint == 1) | (rows.joint == 2)))
        assert said(report, "Joints that never moved: 3:")
        assert {limit.place.joint for limit in report.limits if limit.place.effect == "ratio"} == {1, 2}
        self.holds(report, effects)

    def test_no_replicates(self, effects: tuple[str, ...]) -> None:
        rows = whole(*effects).measurements
        once = (rows.pose < POSES) & ((rows.joint == 0) | (rows.approach[np.arange(rows.count), rows.joint - 1] > 0))
        report = diagnose(kept(whole(*effects), once))
        assert said(report, "Nothing was measured twice")
        assert report.noise.source != "replicates"
        assert report.noise.floor_source == "sigma"
        self.holds(report, effects)

    def test_no_approach_log(self, effects: tuple[str, ...]) -> None:
        report = diagnose(changed(whole(*effects), approach=np.zeros_like(whole(*effects).measurements.approach)))
        assert said(report, "No approach moves or senses were logged")
        assert not {"backlash", "hysteresis"} & {limit.place.effect for limit in report.limits}
        self.holds(report, effects)

    def test_nothing_but_validation_rows(self, effects: tuple[str, ...]) -> None:
        report = diagnose(changed(whole(*effects), check=np.ones(whole(*effects).measurements.count, dtype=bool)))
        self.holds(report, effects)

    def test_no_noise_stated(self, effects: tuple[str, ...]) -> None:
        rows = whole(*effects).measurements
        silent = changed(whole(*effects), covariance_m2=np.full_like(rows.covariance_m2, np.nan))
        report = diagnose(replace(silent, instrument=Instrument()))
        assert report.noise.stated_m is None
        assert report.noise.used_m == pytest.approx(np.sqrt(2e-5**2 + (1e-5 / np.sqrt(8 / np.pi)) ** 2), rel=0.2)
        self.holds(report, effects)


class TestTargetsOnOneAxis:
    """All targets on the axis of the last joint: what its drive does moves none of them."""

    def report(self, joint: int | None) -> Diagnosis:
        sim = day(ARMS["phi"](1), 3)
        sim = replace(sim, target_m=sim.target_m * [0.0, 0.0, 1.0])
        wrong = np.zeros_like(sim.seen.active)
        if joint is not None:
            wrong[:, joint - 1] = 0.003 * sim.seen.active[:, joint - 1]
        exact = chain_points(sim, net_of_motors(sim, sim.seen.active + wrong))
        noise = 2e-5 * np.random.default_rng(1).normal(size=exact.shape)
        return diagnose(measured_at(sim, exact + noise).seen.campaign)

    @pytest.mark.parametrize("joint", [None, 4])
    def test_nothing_is_invented_and_it_is_said(self, joint: int | None) -> None:
        report = self.report(joint)
        assert report.verdict is Verdict.NO_GAP
        assert said(report, "All targets lie on the axis of joint 4")

    def test_other_joints_are_diagnosed_all_the_same(self) -> None:
        assert ("ratio", 3) in named(self.report(3))


def test_one_configuration_measured_again_and_again() -> None:
    robot, rng = ARMS["phi"](1), np.random.default_rng(1)
    points = rng.normal(size=3) + 2e-5 * rng.normal(size=(40, 3))
    rows = table(np.tile(rng.normal(size=4), (40, 1)), point_m=points)
    report = diagnose(campaign(robot, (Target("T", 4),), rows))
    assert report.verdict is Verdict.NO_GAP
    assert report.noise.source == "replicates"
    assert report.noise.used_m == pytest.approx(2e-5, rel=0.2)


def test_what_kept_out_points_show_is_a_gap_also_where_fitted_ones_show_nothing() -> None:
    """An offset of joint 2 while it stood still is taken up by targets and base; validation rows move it."""
    rows = whole("zero_offset:2:0.3deg").measurements
    still = (rows.joint > 0) & (rows.joint != 2)
    some = kept(whole("zero_offset:2:0.3deg"), still | (rows.pose >= 0))
    report = diagnose(changed(some, check=some.measurements.pose >= 0))
    assert report.gap_rms_m > 1e-4
    assert report.verdict is not Verdict.NO_GAP


def test_a_zero_offset_of_a_joint_that_was_held_may_be_anything_of_its_angle() -> None:
    """Motor 2 turns along with motor 1, so that joint 2 stays where it is."""
    sim = day(ARMS["coupled"](1), 3)
    commanded = sim.seen.campaign.measurements.commanded.copy()
    commanded[:, 1] = 0.4
    seen = observe(changed(sim.seen.campaign, commanded=commanded))
    assert seen.held.tolist() == [False, True, False, False]
    assert not seen.still.any()
    held = replace(sim, seen=seen)
    exact = chain_points(held, net_of_motors(held, seen.active + np.deg2rad([0.0, 0.2, 0.0, 0.0])))
    noise = 2e-5 * np.random.default_rng(1).normal(size=exact.shape)
    report = diagnose(measured_at(held, exact + noise).seen.campaign)
    assert said(report, "held while their motors followed others: 2:")
    assert named(report)[:3] == [("zero_offset", 2), ("eccentricity", 2), ("ratio", 2)]
    assert report.causes[0].probability <= 0.5
    assert report.rivals[0].next_measurement.startswith("Sweep joint 2 itself")
    makes_a_file(report)
