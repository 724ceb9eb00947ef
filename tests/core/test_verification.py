"""Verification: it reports the truth of the simulated arm, says how sure it is, and hides nothing that can be seen."""

import json
from dataclasses import replace

import numpy as np
import pytest
from arms_in_use import EXACT, INSTRUMENT, arm, calibration, campaign, cell, with_known_targets

from core.calibrated_arm import CalibratedArm
from core.end_effector import measured_poses
from core.errors import CampaignError
from core.geometry import Array, apply, invert, rotation_about, transform
from core.kinematics import forward, nominal_net
from core.measurements import POSE, Campaign
from core.repeatability import distance_accuracy, repeated_poses
from core.rotations import vectors_of_rotations
from core.twin.campaign import simulate_campaign, truth
from core.twin.effects import parse_effect
from core.twin.noise import Noise
from core.verification import Errors, Limits, Verification, calibrated_verdict, overall, verdicts, verify
from core.verification_json import verification_to_json

FOUR = ("nominal_position_mm", "calibrated_position_mm", "nominal_orientation_rad", "calibrated_orientation_rad")


def differences(poses: Array, others: Array) -> tuple[Array, Array]:
    """Distances and angles between poses."""
    turns = vectors_of_rotations(poses[:, :3, :3] @ np.swapaxes(others[:, :3, :3], 1, 2))
    return np.linalg.norm(poses[:, :3, 3] - others[:, :3, 3], axis=1), np.linalg.norm(turns, axis=1)


def true_tool(found: Verification) -> Array:
    """Where the tool really was, in the instrument's frame."""
    return truth().base @ truth().tool_poses(found.measured.seen.commanded)


def predicted(found: Verification) -> dict[str, Array]:
    """Where the models have it."""
    commanded, ready = found.measured.seen.commanded, found.arm
    return {
        "nominal": ready.base @ forward(ready.nominal, nominal_net(ready.nominal, commanded)),
        "calibrated": ready.base @ forward(ready.robot, ready.drives.net(commanded)),
    }


def edited(found: Campaign, **columns: Array) -> Campaign:
    return replace(found, measurements=replace(found.measurements, **columns))


def pose_rows(found: Campaign) -> np.ndarray:
    return np.flatnonzero(found.measurements.phase == POSE)


def rows_of(found: Campaign, target: str, pose: int | None = None) -> np.ndarray:
    table = found.measurements
    index = [t.name for t in found.targets].index(target)
    rows = (table.phase == POSE) & (table.target == index)
    return np.flatnonzero(rows if pose is None else rows & (table.pose == pose))


@pytest.mark.parametrize("known", [False, True])
def test_without_noise_it_reports_the_truth(known: bool) -> None:
    measured = campaign("l6", EXACT)
    found = verify(with_known_targets(measured) if known else measured, arm("l6", EXACT))
    distance, angle = differences(true_tool(found), predicted(found)["nominal"])
    np.testing.assert_allclose(found.nominal.position.value, distance, rtol=0, atol=1e-8)
    np.testing.assert_allclose(found.nominal.orientation.value, angle, rtol=0, atol=1e-8)
    # The twin is made to miss its test poses as the paper's arm did.
    assert found.nominal.position.mean == pytest.approx(0.0470, abs=5e-5)
    assert found.nominal.orientation.mean == pytest.approx(0.050, abs=5e-5)
    assert found.calibrated.position.max < 1e-8
    assert found.calibrated.orientation.max < 1e-8


def test_with_known_targets_it_reports_the_truth_within_its_uncertainty() -> None:
    """Instrument noise alone: what the calibration gets wrong (0.8 mm, 2.4 mrad) is found to a tenth of it."""
    scores, means = [], []
    for seed in range(1, 9):
        found = verify(with_known_targets(campaign("l6", INSTRUMENT, seed)), arm("l6", INSTRUMENT, seed))
        true, models = true_tool(found), predicted(found)
        error = np.concatenate(
            [
                found.measured.pose[:, :3, 3] - true[:, :3, 3],
                vectors_of_rotations(found.measured.pose[:, :3, :3] @ np.swapaxes(true[:, :3, :3], 1, 2)),
            ],
            axis=1,
        )
        scores.append(np.einsum("ki,kij,kj->k", error, np.linalg.inv(found.measured.covariance), error))
        for name, model in (("nominal", found.nominal), ("calibrated", found.calibrated)):
            distance, angle = differences(true, models[name])
            means.append((model.position.mean - distance.mean()) / model.position.mean_std)
            means.append((model.orientation.mean - angle.mean()) / model.orientation.mean_std)
        assert np.abs(found.calibrated.position.value - differences(true, models["calibrated"])[0]).max() < 0.6e-3
    # 96 chi-square numbers of 6 degrees of freedom: their mean has a standard deviation of 0.35.
    assert np.mean(scores) == pytest.approx(6.0, abs=1.2)
    # Lengths of small errors are biased upwards by their noise, hence not 1.
    assert np.sqrt(np.mean(np.square(means))) < 2.0


def test_with_repeatability_the_paper_s_improvement_is_seen() -> None:
    nominal, calibrated = [], []
    for seed in range(1, 6):
        found = verify(campaign("l6", Noise(), seed), arm("l6", Noise(), seed))
        nominal.append(found.nominal.position.mean)
        calibrated.append(found.calibrated.position.mean)
        assert found.nominal.orientation.mean == pytest.approx(0.05, abs=0.02)
        assert found.measured.anchors == ("T1",)
        assert found.improvement_position > 25
    assert np.mean(nominal) == pytest.approx(0.047, abs=0.003)
    assert 0.3e-3 < np.mean(calibrated) < 2e-3


def test_a_fault_that_came_after_the_calibration_shows_in_full() -> None:
    """Half a degree at joint 1: every pose is off by half a degree, and by as much as its distance makes of it."""
    fault = (parse_effect("zero_offset:1:0.5deg", cell("l6").robot),)
    faulty, turn = simulate_campaign(1, cell("l6"), EXACT, fault), np.deg2rad(0.5)
    known = verify(with_known_targets(faulty), arm("l6", EXACT))
    axis = arm().drives.axes[0]
    lever = np.linalg.norm(np.cross(axis.direction, known.measured.pose[:, :3, 3] - axis.point_m), axis=1)
    np.testing.assert_allclose(known.calibrated.orientation.value, turn, rtol=1e-3)
    np.testing.assert_allclose(known.calibrated.position.value, turn * lever, rtol=1e-3)
    # With one anchor the common part of the turn is hidden, but not what it does to the anchor's place.
    assert verify(faulty, arm("l6", EXACT)).calibrated.position.mean == pytest.approx(np.mean(turn * lever), rel=0.25)


def test_how_the_targets_sit_about_their_anchor_does_not_matter() -> None:
    """T5 and T6 turned about T1 by the same in every pose: another sticker, the same arm."""
    measured = campaign("l6", EXACT)
    found = verify(measured, arm())
    points, table = measured.measurements.point_m.copy(), measured.measurements
    frames = truth().base @ truth().tool_poses(table.commanded)
    anchor = apply(invert(frames[rows_of(measured, "T1")[0]]), points[rows_of(measured, "T1")[0]])
    turn = transform(rotation_about([0.0, 0.6, 0.8], 0.4), np.zeros(3))
    for row in [*rows_of(measured, "T5"), *rows_of(measured, "T6")]:
        on_tool = apply(invert(frames[row]), points[row])
        points[row] = apply(frames[row], anchor + apply(turn, on_tool - anchor))
    again = verify(edited(measured, point_m=points), arm())
    np.testing.assert_allclose(again.nominal.position.value, found.nominal.position.value, rtol=0, atol=1e-7)
    np.testing.assert_allclose(again.nominal.orientation.value, found.nominal.orientation.value, rtol=0, atol=1e-7)


def test_what_cannot_be_seen_is_said() -> None:
    noisy = verify(campaign("l6", Noise()), arm("l6", Noise()))
    assert noisy.measured.free_turn
    assert any("cannot show" in note and "mrad" in note for note in noisy.notes)
    assert any("simulated" in note for note in noisy.notes)
    known = verify(with_known_targets(campaign("l6", Noise())), arm("l6", Noise()))
    assert not known.measured.free_turn
    assert not any("cannot show" in note for note in known.notes)
    other = replace(arm("l6", Noise()), digest="b" * 64, source="last week")
    moved = verify(replace(campaign("l6", Noise()), digest="a" * 64), other)
    assert any("last week" in note and "another campaign" in note for note in moved.notes)


def test_without_anchors_the_poses_place_the_targets_and_it_is_said() -> None:
    ready = replace(arm("l6", INSTRUMENT), targets=())
    found = verify(campaign("l6", INSTRUMENT), ready)
    assert found.measured.anchors == ()
    assert any("hides constant errors" in note for note in found.notes)
    assert found.calibrated.position.mean < 2e-3


def test_the_more_certain_of_two_statements_about_a_target_is_believed() -> None:
    measured = campaign("l6", INSTRUMENT)
    exact, vague = with_known_targets(measured, 1e-6), with_known_targets(measured, 0.05)
    assert measured_poses(exact, arm("l6", INSTRUMENT)).anchors == ("T1", "T5", "T6")
    rough = measured_poses(vague, arm("l6", INSTRUMENT))
    assert rough.anchors == ("T1", "T5", "T6")
    # T5 and T6 are known badly: so is the orientation of the body.
    assert np.sqrt(rough.placement_covariance[3:, 3:].trace()) > 0.05


def test_a_robot_without_a_tool_is_judged_by_the_middle_of_its_targets() -> None:
    found = calibration("l6", EXACT)
    bare = replace(
        found.campaign.robot,
        link_transforms=np.concatenate([found.campaign.robot.link_transforms[:-1], np.eye(4)[None]]),
    )
    ready = replace(
        arm(),
        nominal=bare,
        robot=replace(arm().robot, link_transforms=np.concatenate([arm().robot.link_transforms[:-1], np.eye(4)[None]])),
    )
    seen = verify(replace(found.campaign, robot=bare), ready)
    assert set(seen.measured.reference) == {"targets"}
    middle = np.stack(
        [found.campaign.measurements.point_m[rows_of(found.campaign, t, 3)[0]] for t in ("T1", "T5", "T6")]
    )
    np.testing.assert_allclose(seen.measured.pose[3, :3, 3], middle.mean(axis=0), rtol=0, atol=1e-7)
    assert seen.calibrated.position.max < 1e-7


def test_poses_that_show_fewer_targets_have_a_position_alone_and_it_is_said() -> None:
    measured = campaign("l6", EXACT)
    points = measured.measurements.point_m.copy()
    points[rows_of(measured, "T5", 4)] = np.nan
    points[rows_of(measured, "T1", 7)] = np.nan
    found = verify(edited(measured, point_m=points), arm())
    assert found.measured.skipped == ()
    assert (found.nominal.position.count, found.nominal.orientation.count) == (12, 10)
    assert np.isnan(found.nominal.orientation.value).nonzero()[0].tolist() == [4, 7]
    assert any("pose 4, 7" in note and "position only" in note for note in found.notes)


def test_shots_of_one_standstill_are_averaged() -> None:
    measured = campaign("l6", INSTRUMENT)
    table, rows = measured.measurements, pose_rows(measured)
    twice = np.concatenate([np.arange(table.count), rows])
    names = (
        "record",
        "phase",
        "joint",
        "sweep",
        "step",
        "pose",
        "target",
        "commanded",
        "point_m",
        "covariance_m2",
        "check",
        "approach",
    )
    columns = {name: getattr(table, name)[twice] for name in names}
    optional = dict.fromkeys(("time_s", "temperature_c", "arm_temperature_c", "payload_kg"))
    doubled = edited(measured, **columns, **optional)
    once, both = (measured_poses(c, arm("l6", INSTRUMENT)) for c in (measured, doubled))
    np.testing.assert_allclose(both.pose, once.pose, rtol=0, atol=1e-9)
    own = [found.own_covariance / found.noise_factor**2 for found in (once, both)]
    np.testing.assert_allclose(own[1] * 2, own[0], rtol=1e-6)


def test_points_without_a_stated_uncertainty_have_that_of_the_calibration() -> None:
    measured = campaign("l6", INSTRUMENT)
    unstated = edited(measured, covariance_m2=np.full_like(measured.measurements.covariance_m2, np.nan))
    ready = arm("l6", INSTRUMENT)
    found = measured_poses(unstated, ready)
    level = ready.noise_m * found.noise_factor
    np.testing.assert_allclose(found.seen.points.covariance_m2[0, 0], level**2 * np.eye(3), rtol=1e-9)


def test_a_gross_error_of_one_point_is_named() -> None:
    measured = campaign("l6", Noise())
    points = measured.measurements.point_m.copy()
    points[rows_of(measured, "T6", 5)] += [0.004, -0.003, 0.0]
    found = verify(edited(measured, point_m=points), arm("l6", Noise()))
    assert 5 in found.measured.suspects
    assert any("common shape" in note and "5" in note for note in found.notes)
    assert verify(measured, arm("l6", Noise())).measured.suspects == ()


def refused(measured: Campaign, ready: CalibratedArm, *words: str) -> None:
    with pytest.raises(CampaignError) as said:
        verify(measured, ready)
    for word in words:
        assert word in str(said.value)


def test_what_cannot_be_verified_is_refused() -> None:
    measured, ready = campaign("l6", EXACT), arm()
    table = measured.measurements
    rows = pose_rows(measured)
    nothing = table.point_m.copy()
    nothing[rows] = np.nan
    refused(edited(measured, point_m=nothing), ready, "no pose records")
    lonely = nothing.copy()
    lonely[rows_of(measured, "T6", 3)] = table.point_m[rows_of(measured, "T6", 3)]
    refused(edited(measured, point_m=lonely), ready, "three or more targets", "where it sits")
    shifted = table.commanded.copy()
    shifted[rows_of(measured, "T5", 3), 1] += 0.01
    refused(edited(measured, commanded=shifted), ready, "pose 3", "different commands")
    refused(campaign("scara", EXACT), ready, "4 joints", "6")
    longer = measured.robot.link_transforms.copy()
    longer[2, 0, 3] += 0.001
    refused(replace(measured, robot=replace(measured.robot, link_transforms=longer)), ready, "same robot.toml")
    low = replace(measured, targets=tuple(replace(t, link=min(t.link, 5)) for t in measured.targets))
    refused(low, ready, "link 6")


def test_one_pose_alone_needs_known_targets() -> None:
    measured = campaign("l6", EXACT)
    table = measured.measurements
    single = np.where((table.phase == POSE)[:, None] & (table.pose != 2)[:, None], np.nan, table.point_m)
    refused(edited(measured, point_m=single), arm(), "one pose alone")
    found = verify(with_known_targets(edited(measured, point_m=single)), arm())
    assert found.nominal.position.count == 1
    assert found.calibrated.position.max < 1e-7
    assert distance_accuracy(found, found.nominal) is None


def test_statistics_are_what_they_are_called() -> None:
    errors = Errors(np.arange(1.0, 101.0), np.ones(100), 0.1)
    assert (errors.mean, errors.max, errors.count) == (50.5, 100.0, 100)
    assert errors.rms == pytest.approx(np.sqrt(np.mean(np.arange(1.0, 101.0) ** 2)))
    assert errors.p95 == pytest.approx(95.05)


def test_verdicts_leave_room_for_the_uncertainty() -> None:
    errors = Errors(np.array([0.5, 0.85, 1.0, 1.15, 1.3]), np.full(5, 0.1), 0.1)
    assert verdicts(errors, 1.0) == ("pass", "undecided", "undecided", "undecided", "fail")
    assert verdicts(errors, None) == ()
    assert overall(("pass", "pass")) == "pass"
    assert overall(("pass", "undecided")) == "undecided"
    assert overall(("undecided", "fail", "pass")) == "fail"


@pytest.mark.parametrize(
    ("limits", "verdict"),
    [
        (Limits(), ""),
        (Limits(position_m=0.01), "pass"),
        (Limits(orientation_rad=0.1), "pass"),
        (Limits(0.01, 1e-5), "fail"),
        (Limits(1e-5, 0.1), "fail"),
    ],
)
def test_the_arm_is_held_to_both_limits(limits: Limits, verdict: str) -> None:
    found = verify(campaign("l6", Noise()), arm("l6", Noise()), limits)
    assert calibrated_verdict(found) == verdict


def repeated_campaign(noise: Noise, visits: int = 30) -> Campaign:
    """The paper's cell, its first two test poses visited many times."""
    own = cell("l6")
    protocol = replace(own.protocol, poses=np.tile(own.protocol.poses[:2], (visits, 1)))
    return simulate_campaign(5, replace(own, protocol=protocol), noise)


def test_repeatability_is_that_of_the_arm() -> None:
    found = verify(repeated_campaign(Noise()), arm("l6", Noise()))
    repeated = repeated_poses(found)
    assert [one.visits for one in repeated] == [30, 30]
    assert repeated[0].poses == tuple(range(0, 60, 2))
    own = cell("l6").repeatability
    for one in repeated:
        # The tool is not where the link was displaced about, so a turn of 3.3 mrad adds to 0.34 mm.
        assert own.mean_translation_m < one.repeatability_m < 4e-3
        assert 3 * own.mean_rotation_rad / 3 < np.linalg.norm(one.repeatability_rad) < 9 * own.mean_rotation_rad
        assert one.nominal.position_m > 0.03
        assert one.calibrated.position_m < 2e-3


def test_repeatability_by_its_formula() -> None:
    found = verify(repeated_campaign(Noise(), 7), arm("l6", Noise()))
    one = repeated_poses(found)[1]
    rows = np.flatnonzero(np.isin(found.measured.seen.pose, one.poses))
    points = found.measured.pose[rows, :3, 3]
    away = np.linalg.norm(points - points.mean(axis=0), axis=1)
    spread = np.sqrt(np.sum((away - away.mean()) ** 2) / (len(away) - 1))
    assert one.repeatability_m == pytest.approx(away.mean() + 3 * spread)
    goal = found.nominal.predicted[rows[0], :3, 3]
    assert one.nominal.position_m == pytest.approx(np.linalg.norm(points.mean(axis=0) - goal))


def test_an_arm_that_repeats_exactly_has_no_repeatability_error() -> None:
    repeated = repeated_poses(verify(repeated_campaign(EXACT, 3), arm()))
    assert max(one.repeatability_m for one in repeated) < 1e-8
    assert repeated_poses(verify(campaign("l6", EXACT), arm())) == ()


def test_distances_know_nothing_of_the_base() -> None:
    ready, measured = arm("l6", INSTRUMENT), with_known_targets(campaign("l6", INSTRUMENT))
    shifted = replace(ready, base=transform(rotation_about([0, 0, 1.0], 0.01), [0.01, 0, 0]) @ ready.base)
    here, there = verify(measured, ready), verify(measured, shifted)
    assert there.calibrated.position.mean > 5 * here.calibrated.position.mean
    for model in ("nominal", "calibrated"):
        first, second = (distance_accuracy(v, getattr(v, model)) for v in (here, there))
        assert first.pairs == 66
        assert first.rms_m == pytest.approx(second.rms_m, rel=1e-6)
    assert distance_accuracy(here, here.calibrated).max_m < 1e-3 < distance_accuracy(here, here.nominal).max_m


@pytest.mark.parametrize("limits", [Limits(), Limits(1.5e-3, 0.01)])
def test_the_file_has_what_the_contract_says(limits: Limits) -> None:
    found = verify(campaign("l6", Noise()), arm("l6", Noise()), limits)
    document = json.loads(verification_to_json(found))
    assert len(document["poses"]) == 12
    for k, record in enumerate(document["poses"]):
        assert {"pose", *FOUR} <= set(record)
        assert record["nominal_position_mm"] == pytest.approx(found.nominal.position.value[k] * 1e3)
        assert np.linalg.norm(record["error_mm"]["calibrated"]) == pytest.approx(record["calibrated_position_mm"])
        assert np.linalg.norm(record["turn_rad"]["nominal"]) == pytest.approx(record["nominal_orientation_rad"])
        assert ("verdict" in record) == (limits != Limits())
    assert set(document["summary"]) == set(FOUR)
    for name in FOUR:
        own = [record[name] for record in document["poses"]]
        said = document["summary"][name]
        assert {"mean", "rms", "p95", "max", "n"} <= set(said)
        assert said["mean"] == pytest.approx(np.mean(own))
        assert said["rms"] == pytest.approx(np.sqrt(np.mean(np.square(own))))
        assert said["p95"] == pytest.approx(np.percentile(own, 95))
        assert (said["max"], said["n"]) == (pytest.approx(max(own)), 12)
    means = {name: document["summary"][name]["mean"] for name in FOUR}
    assert document["improvement_position"] == pytest.approx(means[FOUR[0]] / means[FOUR[1]])
    assert document["improvement_orientation"] == pytest.approx(means[FOUR[2]] / means[FOUR[3]])
    assert (document["limits"] is None) == (limits == Limits())
    assert verification_to_json(found) == verification_to_json(found)
