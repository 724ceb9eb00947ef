"""calibration.json: the keys that other programs rely on, and that its numbers are those of the calibration."""

import json
import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from core.calibration import Calibration, calibrate
from core.calibration_json import calibration_to_json
from core.measurements import Campaign
from core.phi_model import PhiModel, axes
from core.twin import irb_l6, scara
from core.twin.campaign import simulate_campaign

KEYS = ("a_mm", "b_mm", "alpha_deg", "theta_deg")
CONTRACT = {
    "axes": {
        "joint",
        "kind",
        "point_mm",
        "direction",
        "point_std_mm",
        "direction_std_rad",
        "rms_axial_mm",
        "rms_radial_mm",
        "points",
    },
    "frames": {"frame", "phi_deg", "nominal", "actual", "std"},
    "transmissions": {"joint", "form", "coefficients", "std", "rms_before_rad", "rms_after_rad"},
    "couplings": {"from", "to", "form", "coefficients", "std", "rms_after_rad"},
    "findings": {"text", "parameter", "deviation", "std", "significant"},
}

ROW_WITH_ERROR = 120
"""In the sweep of joint 1."""


def without_joint(campaign: Campaign, joint: int) -> Campaign:
    table = campaign.measurements
    return replace(campaign, measurements=replace(table, check=table.check | (table.joint == joint)))


def with_gross_error(campaign: Campaign) -> Campaign:
    table = campaign.measurements
    points = table.point_m.copy()
    points[ROW_WITH_ERROR] += [0.02, -0.01, 0.015]
    return replace(campaign, measurements=replace(table, point_m=points))


@cache
def calibration(which: str) -> Calibration:
    if which == "slide":
        return calibrate(simulate_campaign(4, scara.cell()))
    campaign = simulate_campaign(4, irb_l6.cell())
    spoiled = {"whole": campaign, "partial": without_joint(campaign, 6), "outlier": with_gross_error(campaign)}
    return calibrate(spoiled[which])


def document(which: str) -> dict[str, Any]:
    return json.loads(calibration_to_json(calibration(which)), parse_constant=refuse)


def refuse(constant: str) -> None:
    raise AssertionError(f"{constant} is no JSON")


ALL = ("whole", "slide", "partial", "outlier")


@pytest.mark.parametrize("which", ALL)
def test_every_key_of_the_contract_is_there(which: str) -> None:
    found = document(which)
    assert found["format"] == "trueaxis-calibration/1"
    assert {"noise_mm", "not_swept", "not_moved", *CONTRACT} <= set(found)
    for name, keys in CONTRACT.items():
        assert all(keys <= set(record) for record in found[name]), name
    for finding in found["findings"]:
        assert ("frame" in finding) != ("joint" in finding)


@pytest.mark.parametrize("which", ALL)
def test_the_same_calibration_gives_the_same_text_of_finite_numbers(which: str) -> None:
    text = calibration_to_json(calibration(which))
    assert text == calibration_to_json(calibration(which))
    assert text.endswith("}\n")
    for word in ("NaN", "Infinity", "-0.0,"):
        assert word not in text


def test_axes_are_those_of_the_estimate_in_mm() -> None:
    found, estimate = document("whole"), calibration("whole").estimate
    assert [record["joint"] for record in found["axes"]] == [1, 2, 3, 4, 5, 6]
    for record, line in zip(found["axes"], estimate.arm.axes, strict=True):
        np.testing.assert_allclose(record["point_mm"], 1e3 * line.point_m, rtol=1e-10)
        np.testing.assert_allclose(record["direction"], line.direction, rtol=1e-10, atol=1e-12)
        direction_std, point_std = estimate.axis_std(record["joint"])
        assert record["direction_std_rad"] == pytest.approx(direction_std)
        assert record["point_std_mm"] == pytest.approx(1e3 * point_std)
        assert record["kind"] == "revolute"
        assert 0.3 < record["rms_axial_mm"] / found["noise_mm"] < 2
        assert 0.3 < record["rms_radial_mm"] / found["noise_mm"] < 2
    assert [record["points"] for record in found["axes"]] == [16, 16, 16, 16, 16, 17]


@pytest.mark.parametrize("which", ["whole", "slide"])
def test_the_axes_follow_from_the_frames_and_the_base(which: str) -> None:
    found, sliding = document(which), calibration(which).campaign.robot.sliding
    base = np.array(found["base_to_instrument"])
    base[:3, 3] /= 1e3
    rows = np.array([[frame["actual"][key] for key in KEYS] for frame in found["frames"]])
    a, b, alpha, theta = (rows * [1e-3, 1e-3, np.pi / 180, np.pi / 180]).T
    phi = np.deg2rad([frame["phi_deg"] for frame in found["frames"]])
    for line, record in zip(axes(PhiModel(phi, a, b, alpha, theta, sliding), base), found["axes"], strict=True):
        np.testing.assert_allclose(line.direction, record["direction"], atol=1e-9)
        if record["kind"] == "revolute":
            off = 1e3 * np.cross(line.direction, line.point_m) - np.cross(line.direction, record["point_mm"])
            assert np.abs(off).max() < 1e-6


def test_frames_stand_beside_their_design_and_the_first_estimate() -> None:
    found, made = document("whole"), calibration("whole")
    nominal = irb_l6.cell().nominal.parameters
    for frame, design, std in zip(found["frames"], nominal, made.estimate.geometry.std, strict=True):
        scale = [1e3, 1e3, 180 / np.pi, 180 / np.pi]
        np.testing.assert_allclose([frame["nominal"][key] for key in KEYS], design * scale, atol=1e-9)
        np.testing.assert_allclose([frame["std"][key] for key in KEYS], std * scale, rtol=1e-9, atol=1e-12)
        assert set(frame["joint_by_joint"]) == {"values", "std"}
    assert found["frames"][0]["std"]["b_mm"] == 0


def test_the_arctangent_is_written_as_in_the_paper_too() -> None:
    (coupling,) = [record for record in document("whole")["couplings"] if record["form"] == "arctangent"]
    assert (coupling["from"], coupling["to"]) == (2, 3)
    constants = coupling["coefficients"]
    assert constants["n2"] == -constants["n1"]
    assert (constants["d0"], coupling["std"]["d0"]) == (1.0, 0.0)
    assert coupling["std"]["n2"] == coupling["std"]["n1"]
    made = calibration("whole").estimate.arm.couplings[2]
    x = np.linspace(-0.3, 0.3, 7)
    top = constants["n0"] * np.sin(x) + constants["n1"] * np.cos(x) + constants["n2"]
    bottom = constants["d0"] * np.cos(x) + constants["d1"] * np.sin(x) + constants["d2"]
    np.testing.assert_allclose(np.arctan(top / bottom), made(x), atol=1e-9)


def test_a_gear_tells_its_ratio_and_every_drive_its_offset() -> None:
    found, made = document("whole"), calibration("whole")
    gears = [record for record in found["transmissions"] if record["form"] == "gear"]
    assert gears
    for record in gears:
        assert record["constants"]["N"] == pytest.approx(made.campaign.robot.joints[record["joint"] - 1].drive_ratio)
    for record in found["transmissions"]:
        function = made.estimate.arm.transmissions[record["joint"] - 1]
        assert record["offset_deg"] == pytest.approx(math.degrees(function.offset))
        assert record["offset_std_deg"] == pytest.approx(math.degrees(made.estimate.offset_std[record["joint"] - 1]))
        assert list(record["coefficients"].values()) == pytest.approx(function.coefficients.tolist())
        fit = made.estimate.transmissions[record["joint"] - 1]
        assert record["rms_before_rad"] == pytest.approx(fit.rms_before)
        assert record["rms_after_rad"] == pytest.approx(fit.rms_after)
    assert found["home_deg"] == pytest.approx(np.rad2deg(made.campaign.home).tolist())


def test_a_sliding_joint_is_told_in_mm_and_has_no_place() -> None:
    found = document("slide")
    (axis,) = [record for record in found["axes"] if record["kind"] == "prismatic"]
    (drive,) = [record for record in found["transmissions"] if record["joint"] == axis["joint"] == 3]
    assert axis["point_std_mm"] is None
    assert (drive["rms_before_rad"], drive["rms_after_rad"]) == (None, None)
    assert 0 < drive["rms_after_mm"] < drive["rms_before_mm"] < 1
    assert drive["coefficients"]["ratio"] == pytest.approx(scara.SLIDE_RATIO, abs=5 * drive["std"]["ratio"])
    assert drive["offset_mm"] is None
    assert "home_deg" not in found


def test_an_arm_with_a_joint_that_was_not_swept_has_no_frames_and_says_why() -> None:
    found = document("partial")
    assert (found["frames"], found["base_to_instrument"], found["not_swept"]) == ([], None, [6])
    assert [record["joint"] for record in found["axes"]] == [1, 2, 3, 4, 5]
    assert any("joint 6 was not swept" in note for note in found["notes"])
    assert {finding.get("joint") for finding in found["findings"]} <= {1, 2, 3, 4, 5}
    assert document("whole")["notes"] == []


def test_a_rejected_point_is_told_with_its_record_and_reason() -> None:
    found, whole = document("outlier"), document("whole")
    rejected = {record["record"]: record for record in found["rejected"]}
    bad = rejected[ROW_WITH_ERROR + 1]
    assert (bad["joint"], bad["target"]) == (1, "T1")
    assert bad["reason"]
    assert bad["residual_mm"] == pytest.approx(1e3 * np.linalg.norm([0.02, -0.01, 0.015]), rel=0.1)
    assert found["points"]["rejected"] == len(found["rejected"]) > len(whole["rejected"])
    (sweep,) = [record for record in found["sweeps"] if record["joint"] == 1]
    assert sweep["used"] == sweep["points"] - 1


@pytest.mark.parametrize("which", ALL)
def test_findings_are_in_units_of_people_and_significant_beyond_two_uncertainties(which: str) -> None:
    found = document(which)
    scales = {"mm": 1e3, "deg": 180 / np.pi, "1": 1.0}
    assert len(found["findings"]) == len(calibration(which).findings) > 0
    for record, finding in zip(found["findings"], calibration(which).findings, strict=True):
        assert record["deviation"] == pytest.approx(finding.deviation * scales[record["unit"]])
        assert record["std"] == pytest.approx(finding.std * scales[record["unit"]])
        assert record["parameter"].endswith(f"_{record['unit']}") or record["unit"] == "1"
        assert record["significant"] is (abs(record["deviation"]) > 2 * record["std"])


def test_targets_and_sweeps_are_told() -> None:
    found, made = document("whole"), calibration("whole")
    by_name = {record["name"]: record for record in found["targets"]}
    assert set(by_name) == {"T1", "T2", "T3", "T4", "T5", "T6"}
    np.testing.assert_allclose(by_name["T1"]["point_mm"], 1e3 * made.refinement.rest_points_m[0])
    assert by_name["T5"]["point_mm"] == [None, None, None]
    assert [(record["joint"], record["sweep"]) for record in found["sweeps"]] == [(j, 1) for j in (6, 5, 4, 3, 2, 1)]
    for record, fit in zip(found["sweeps"], made.found.fits, strict=True):
        np.testing.assert_allclose(record["axis"]["point_mm"], 1e3 * fit.fit.line.point_m)
        assert record["rms_radial_mm"] == pytest.approx(1e3 * fit.fit.rms_radial_m)
    assert found["noise_mm"] == pytest.approx(1e3 * made.estimate.noise_m)


def test_where_it_comes_from_is_told() -> None:
    campaign = replace(calibration("whole").campaign, digest="ab" * 32)
    found = json.loads(calibration_to_json(replace(calibration("whole"), campaign=campaign)))
    assert found["digest_sha256"] == "ab" * 32
    assert (found["robot"], found["campaign"]) == (campaign.robot.name, campaign.title)
    assert found["campaign_notes"]["source"].startswith("simulated")
    assert found["instrument"]["kind"] == "theodolite-pair"
    assert found["conditions"]["temperature_c"]["min"] < found["conditions"]["temperature_c"]["max"]
