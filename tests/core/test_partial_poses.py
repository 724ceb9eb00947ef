"""Poses of which less, or other things, are seen than three targets: places alone, and targets that tell their turn."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from arms_in_use import EXACT, INSTRUMENT, arm, campaign, cell, with_known_targets

from core.campaign_files import read_campaign
from core.campaign_writer import write_campaign
from core.end_effector import measured_poses
from core.errors import CampaignError
from core.geometry import Array, apply, rotation_about
from core.kinematics import link_frames, nominal_net
from core.measurements import POSE, Campaign
from core.repeatability import distance_accuracy, repeated_poses
from core.rotations import quaternions, rotations_of_quaternions, rotations_of_vectors, vectors_of_rotations
from core.session_campaign import open_campaign, to_campaign
from core.twin.campaign import simulate_campaign, truth
from core.twin.noise import Noise
from core.verification import Limits, Verification, calibrated_verdict, verify
from core.verification_json import verification_to_json

MOUNTED = rotation_about(np.array([0.6, 0.0, 0.8]), 1.1)
"""How the 6-D target is really turned on the tool."""


def rows_of(found: Campaign, target: str) -> np.ndarray:
    index = [t.name for t in found.targets].index(target)
    return np.flatnonzero((found.measurements.phase == POSE) & (found.measurements.target == index))


def seen_only(found: Campaign, *names: str, poses: set[int] | None = None) -> Campaign:
    """Pose records of some targets alone; in ``poses`` only, if given."""
    points = found.measurements.point_m.copy()
    for target in found.targets:
        rows = rows_of(found, target.name)
        if target.name not in names:
            points[rows if poses is None else rows[np.isin(found.measurements.pose[rows], list(poses))]] = np.nan
    return replace(found, measurements=replace(found.measurements, point_m=points))


def true_misses(found: Verification, name: str) -> dict[str, Array]:
    """How far a target of known place really was from where each model has it, (k,)."""
    own, ready, commanded = truth(), found.arm, found.measured.seen.commanded
    index = [t.name for t in cell("l6").targets].index(name)
    place = with_known_targets(campaign("l6", EXACT)).targets[index].point_m
    tool = own.arm.robot.link_transforms[-1]
    frames = own.base @ own.tool_poses(commanded) @ np.linalg.inv(tool)
    real = apply(frames, place)
    nominal = ready.base @ link_frames(ready.nominal, nominal_net(ready.nominal, commanded))[:, -2]
    calibrated = ready.base @ link_frames(ready.robot, ready.drives.net(commanded))[:, -2]
    return {
        "nominal": np.linalg.norm(real - apply(nominal, place), axis=1),
        "calibrated": np.linalg.norm(real - apply(calibrated, place), axis=1),
    }


@cache
def framed(noise: Noise = EXACT, seed: int = 1, turn_sigma_rad: float = 0.0, repeats: int = 1) -> Campaign:
    """The paper's cell with T1 as a 6-D target, the only one that the poses show."""
    found = seen_only(campaign("l6", noise, seed), "T1")
    table, rng, own = found.measurements, np.random.default_rng(seed), truth()
    rows = rows_of(found, "T1")
    keep = np.concatenate([np.arange(table.count), *[rows] * (repeats - 1)])
    names = [name for name in vars(table) if getattr(table, name) is not None]
    table = replace(table, **{name: getattr(table, name)[keep] for name in names})
    table = replace(table, record=np.arange(1, len(keep) + 1))
    quaternion = np.full((len(keep), 4), np.nan)
    posed = (table.phase == POSE) & np.isfinite(table.point_m[:, 0])
    turned = own.base[:3, :3] @ own.tool_poses(table.commanded[posed])[:, :3, :3] @ MOUNTED
    noise_of = rotations_of_vectors(turn_sigma_rad * rng.normal(size=(posed.sum(), 3)))
    quaternion[posed] = quaternions(noise_of @ turned)
    return replace(found, measurements=replace(table, target_quaternion=quaternion))


@pytest.mark.parametrize("known", [False, True])
def test_one_target_gives_the_error_of_its_place(known: bool) -> None:
    """T1's place is known from the sweeps, or by its owner's word."""
    measured = seen_only(campaign("l6", EXACT), "T1")
    found = verify(with_known_targets(measured) if known else measured, arm())
    true = true_misses(found, "T1")
    np.testing.assert_allclose(found.nominal.position.value, true["nominal"], rtol=0, atol=1e-8)
    assert found.calibrated.position.max < 1e-8
    assert set(found.measured.reference) == {"targets"}
    assert found.nominal.orientation.count == 0
    assert np.isnan(found.nominal.orientation.mean)
    assert any("every pose shows fewer than three targets" in note for note in found.notes)
    assert found.measured.anchors == ("T1",)


def test_of_two_targets_the_one_of_known_place_is_judged() -> None:
    found = verify(seen_only(campaign("l6", EXACT), "T1", "T5"), arm())
    np.testing.assert_allclose(found.nominal.position.value, true_misses(found, "T1")["nominal"], rtol=0, atol=1e-8)


def test_targets_on_one_line_are_not_taken_for_a_body() -> None:
    measured = campaign("l6", EXACT)
    points = measured.measurements.point_m.copy()
    points[rows_of(measured, "T6")] = 0.3 * points[rows_of(measured, "T1")] + 0.7 * points[rows_of(measured, "T5")]
    found = verify(replace(measured, measurements=replace(measured.measurements, point_m=points)), arm())
    assert found.nominal.orientation.count == 0
    assert found.calibrated.position.max < 1e-8


def test_its_uncertainty_is_right() -> None:
    """Instrument noise alone: errors of single places, against the truth, in units of what is stated."""
    scores = []
    for seed in range(1, 9):
        measured = with_known_targets(campaign("l6", INSTRUMENT, seed))
        found = verify(seen_only(measured, "T5"), arm("l6", INSTRUMENT, seed))
        true = true_misses(found, "T5")
        scores.append((found.nominal.position.value - true["nominal"]) / found.nominal.position.std)
    # 96 numbers of standard deviation 1: theirs is known to 0.07.
    assert np.std(np.concatenate(scores)) == pytest.approx(1.0, abs=0.2)


def test_a_target_of_unknown_place_is_placed_by_the_other_poses_and_it_is_said() -> None:
    ready = replace(arm("l6", INSTRUMENT), targets=())
    measured = seen_only(campaign("l6", INSTRUMENT), "T5")
    found = verify(measured, ready)
    assert found.measured.anchors == ()
    assert any("hides constant errors" in note for note in found.notes)
    assert found.calibrated.position.mean < 2e-3
    # Moving the target on its link changes nothing: its place is taken from the poses.
    true = truth()
    frames = true.base @ true.tool_poses(measured.measurements.commanded)
    points = measured.measurements.point_m.copy()
    rows = rows_of(measured, "T5")
    points[rows] += np.einsum("mij,j->mi", frames[rows, :3, :3], [0.0, 0.0, 0.01])
    moved = verify(replace(measured, measurements=replace(measured.measurements, point_m=points)), ready)
    np.testing.assert_allclose(moved.calibrated.position.value, found.calibrated.position.value, rtol=0, atol=0.1e-3)


def test_whole_poses_stay_as_they_were_beside_others() -> None:
    whole = campaign("l6", INSTRUMENT)
    mixed = verify(seen_only(whole, "T1", poses={4, 7}), arm("l6", INSTRUMENT))
    assert mixed.measured.reference == tuple("targets" if k in (4, 7) else "tool" for k in range(12))
    assert (mixed.nominal.position.count, mixed.nominal.orientation.count) == (12, 10)
    keep = np.isin(np.arange(12), (4, 7), invert=True)
    alone = verify(seen_only(whole, poses={4, 7}), arm("l6", INSTRUMENT))
    np.testing.assert_allclose(mixed.nominal.position.value[keep], alone.nominal.position.value, rtol=0, atol=1e-9)
    np.testing.assert_allclose(mixed.calibrated.orientation.std[keep], alone.calibrated.orientation.std, rtol=1e-6)
    assert np.isfinite(mixed.calibrated.position.std).all()
    assert np.isfinite(mixed.calibrated.position.mean_std)


def test_the_file_says_null_for_what_was_not_measured() -> None:
    document = json.loads(verification_to_json(verify(seen_only(campaign("l6", Noise()), "T1"), arm("l6", Noise()))))
    for record in document["poses"]:
        assert record["nominal_orientation_rad"] is None
        assert record["nominal_position_mm"] > 10
        assert record["reference"] == "targets"
    summary = document["summary"]
    assert (summary["nominal_position_mm"]["n"], summary["nominal_orientation_rad"]["n"]) == (12, 0)
    assert summary["calibrated_orientation_rad"]["mean"] is None
    assert document["improvement_orientation"] is None
    assert document["improvement_position"] > 10


def test_a_limit_for_orientations_that_were_not_measured_is_undecided() -> None:
    measured = seen_only(campaign("l6", Noise()), "T1")
    assert calibrated_verdict(verify(measured, arm("l6", Noise()), Limits(0.01, None))) == "pass"
    assert calibrated_verdict(verify(measured, arm("l6", Noise()), Limits(0.01, 0.1))) == "undecided"


def test_repeated_places_have_a_repeatability_and_no_turn() -> None:
    own = cell("l6")
    protocol = replace(own.protocol, poses=np.tile(own.protocol.poses[:2], (5, 1)))
    measured = seen_only(simulate_campaign(5, replace(own, protocol=protocol), Noise()), "T1")
    found = verify(measured, arm("l6", Noise()))
    repeated = repeated_poses(found)
    assert [one.visits for one in repeated] == [5, 5]
    for one in repeated:
        assert 0.2e-3 < one.repeatability_m < 3e-3
        assert np.isnan(one.repeatability_rad).all()
        assert np.isnan(one.nominal.orientation_rad)
    assert distance_accuracy(found, found.nominal).pairs == 1
    json.loads(verification_to_json(found))


def test_one_place_alone_needs_to_be_known() -> None:
    measured = seen_only(campaign("l6", EXACT), "T5")
    table = measured.measurements
    single = np.where((table.phase == POSE)[:, None] & (table.pose != 2)[:, None], np.nan, table.point_m)
    alone = replace(measured, measurements=replace(table, point_m=single))
    with pytest.raises(CampaignError, match="where it sits"):
        verify(alone, replace(arm(), targets=()))
    assert verify(with_known_targets(alone), arm()).nominal.position.count == 1


def test_a_6d_target_gives_the_whole_pose() -> None:
    found = verify(framed(), arm())
    assert found.measured.framed == "T1"
    assert set(found.measured.reference) == {"tool"}
    assert found.nominal.position.mean == pytest.approx(0.0470, abs=5e-5)
    assert found.nominal.orientation.mean == pytest.approx(0.050, abs=5e-5)
    assert found.calibrated.position.max < 1e-8
    assert found.calibrated.orientation.max < 1e-8
    assert found.measured.free_turn
    assert any("cannot show" in note for note in found.notes)


def test_how_it_is_mounted_does_not_matter() -> None:
    first = framed(INSTRUMENT, 1, 1e-4)
    turn = rotation_about(np.array([0.0, 1.0, 0.0]), 0.7)
    table = first.measurements
    given = np.isfinite(table.target_quaternion[:, 0])
    moved = table.target_quaternion.copy()
    moved[given] = quaternions(rotations_of_quaternions(table.target_quaternion[given]) @ turn)
    second = replace(first, measurements=replace(table, target_quaternion=moved))
    one, two = (verify(c, arm("l6", INSTRUMENT)) for c in (first, second))
    np.testing.assert_allclose(two.nominal.position.value, one.nominal.position.value, rtol=0, atol=1e-9)
    np.testing.assert_allclose(two.nominal.orientation.value, one.nominal.orientation.value, rtol=0, atol=1e-9)


@pytest.mark.parametrize("how", ["stated", "repeated"])
def test_the_uncertainty_of_turns_is_as_stated_or_as_repeats_have_it(how: str) -> None:
    sigma, scores = 3e-4, []
    for seed in range(1, 9):
        measured = framed(INSTRUMENT, seed, sigma, 3 if how == "repeated" else 1)
        if how == "stated":
            measured = replace(measured, instrument=replace(measured.instrument, turn_sigma_rad=sigma))
        found = measured_poses(measured, arm("l6", EXACT))
        assert found.framed_sigma_rad == pytest.approx(sigma, rel=0.35)
        true = truth().base @ truth().tool_poses(found.seen.commanded)
        each = vectors_of_rotations(found.pose[:, :3, :3] @ np.swapaxes(true[:, :3, :3], 1, 2))
        # What is the same in all poses is the mounting, which is taken from the poses.
        on_tool = np.einsum("kji,kj->ki", true[:, :3, :3], each)
        on_tool -= on_tool.mean(axis=0)
        scores.append(np.sum(on_tool**2, axis=1) / np.trace(found.own_covariance[:, 3:, 3:], axis1=1, axis2=2))
    # 288 squares, each enlarged by a twelfth because the mounting is taken from the eleven others.
    assert np.mean(scores) == pytest.approx(12 / 11, rel=0.25)


def test_without_either_the_scatter_between_poses_is_taken_and_it_is_said() -> None:
    found = verify(framed(INSTRUMENT, 1, 3e-4), arm("l6", INSTRUMENT))
    assert found.measured.framed_sigma_rad is None
    assert any("is not stated and was not repeated" in note for note in found.notes)
    assert found.calibrated.orientation.std.min() > 3e-4


def test_three_known_targets_are_believed_more_than_a_6d_target() -> None:
    whole = with_known_targets(campaign("l6", EXACT))
    table = whole.measurements
    quaternion = np.full((table.count, 4), np.nan)
    quaternion[rows_of(whole, "T1")] = [1.0, 0.0, 0.0, 0.0]
    found = verify(replace(whole, measurements=replace(table, target_quaternion=quaternion)), arm())
    assert found.measured.framed == ""
    assert found.calibrated.orientation.max < 1e-8


def test_the_stated_noise_of_turns_survives_files_and_sessions(tmp_path) -> None:
    own = framed(INSTRUMENT, 1, 3e-4)
    own = replace(own, instrument=replace(own.instrument, turn_sigma_rad=0.25e-3))
    write_campaign(tmp_path / "campaign", own, cell("l6").robot_toml())
    again = read_campaign(tmp_path / "campaign")
    assert again.instrument.turn_sigma_rad == pytest.approx(0.25e-3)
    assert "turn_sigma_mrad" not in again.instrument.description
    with open_campaign(tmp_path / "campaign", tmp_path / "a.trueaxis") as session:
        assert to_campaign(session.state).instrument.turn_sigma_rad == pytest.approx(0.25e-3)
    text = (tmp_path / "campaign" / "campaign.toml").read_text()
    (tmp_path / "campaign" / "campaign.toml").write_text(text.replace("turn_sigma_mrad", "turn_sigma_deg"))
    with pytest.raises(CampaignError, match="turn_sigma_mrad"):
        read_campaign(tmp_path / "campaign")
