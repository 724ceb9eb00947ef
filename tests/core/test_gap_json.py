"""gap.json: every key of the contract, in its units, for every kind of diagnosis."""

import json
from dataclasses import replace

import numpy as np
import pytest

from core.gap.gap_json import gap_to_json, place_record
from core.gap.parameter_units import shown_parameter
from core.gap.result import DetectionLimit, Parameter, Place
from tests.core import gap_reports

KEYS = {
    *("format", "gap_rms_mm", "floor_rms_mm", "floor_source", "outliers", "noise", "verdict", "detection_limits"),
    *("warnings", "where", "causes", "transfer", "left_rms_mm", "left_is_noise", "left_test", "rivals"),
}
MADE = ("explained", "partly_explained", "unexplained", "no_gap", "barely_known")


def document(name: str = "explained") -> dict:
    return json.loads(gap_to_json(getattr(gap_reports, name)()))


@pytest.mark.parametrize("name", MADE)
def test_every_key_of_the_contract_is_there(name: str) -> None:
    found = document(name)
    assert set(found) >= KEYS
    assert found["format"] == "trueaxis-gap/1"
    assert found["verdict"] in ("explained", "partly_explained", "unexplained", "no_gap")
    assert set(found["noise"]) >= {"sigma_stated_mm", "sigma_used_mm", "model", "from"}
    assert set(found["where"]) >= {"by_joint", "by_direction", "by_record", "worst_region"}
    assert set(found["left_test"]) == {"name", "p_value"}
    for cause in found["causes"]:
        assert set(cause) >= {
            *("effect", "probability", "class", "parameters", "std", "gap_before_rms_mm", "gap_after_rms_mm"),
            *("share_closed", "share_closed_last"),
        }
        assert set(cause["std"]) == set(cause["parameters"])
        assert cause["class"]


def test_lengths_are_millimetres() -> None:
    report, found = gap_reports.explained(), document()
    assert found["gap_rms_mm"] == pytest.approx(0.9)
    assert found["floor_rms_mm"] == pytest.approx(report.noise.floor_rms_m * 1e3)
    assert found["noise"]["sigma_stated_mm"] == pytest.approx(0.11)
    assert found["noise"]["model"]["scale"] == pytest.approx(13 / 11)
    assert found["causes"][1]["gap_before_rms_mm"] == pytest.approx(0.5)
    assert found["outliers"][0]["length_mm"] == pytest.approx(3.1)
    assert found["transfer"][0]["gap_after_rms_mm"] == pytest.approx(0.26)
    by_record = found["where"]["by_record"]
    assert [one["record"] for one in by_record] == report.campaign.measurements.record[report.rows].tolist()
    shown = np.array([one["real_minus_sim_mm"] for one in by_record])
    np.testing.assert_allclose(shown, report.difference_m * 1e3, rtol=1e-9)


def test_what_is_not_known_is_null() -> None:
    found = document("barely_known")
    assert found["causes"][0]["share_closed"] is None
    assert found["causes"][0]["share_closed_last"] is None
    assert found["causes"][0]["std"]["gap_deg"] is None
    assert found["left_test"]["p_value"] is None
    assert found["noise"]["sigma_stated_mm"] is None
    assert found["where"]["by_direction"] == {}
    assert found["reliability"] is None


@pytest.mark.parametrize(
    ("place", "record"),
    [
        (Place("backlash", joint=3), {"effect": "backlash", "joint": 3}),
        (Place("coupling", joint=4, source=3), {"effect": "coupling", "from": 3, "to": 4}),
        (Place("geometry", frame=2), {"effect": "geometry", "frame": 2}),
        (Place("target_slip", target="T1", record=80), {"effect": "target_slip", "target": "T1", "record": 80}),
        (Place("base_shift", record=0), {"effect": "base_shift", "record": 0}),
        (Place("unknown", variable="time"), {"effect": "unknown", "variable": "time"}),
        (Place("scale"), {"effect": "scale"}),
    ],
)
def test_a_place_has_the_keys_that_apply(place: Place, record: dict) -> None:
    assert place_record(place) == record


@pytest.mark.parametrize(
    ("name", "value", "shown", "expected"),
    [
        ("amplitude_rad", np.pi / 180, "amplitude_deg", 1.0),
        ("gap_m", 2e-3, "gap_mm", 2.0),
        ("compliance_rad_per_nm", 3e-6, "compliance_urad_per_nm", 3.0),
        ("growth_per_k", 12e-6, "growth_ppm_per_k", 12.0),
        ("rate_m_per_s", 1e-3 / 3600, "rate_mm_per_h", 1.0),
        ("delay_s", 0.003, "delay_s", 0.003),
        ("order_1", 9.5, "order", 9.5),
        ("ratio_1", 2e-4, "ratio_ppm", 200.0),
        ("scale_1", 3e-5, "scale_ppm", 30.0),
        ("mass_kg", 2.0, "mass_kg", 2.0),
        ("centre_x_m", 0.1, "centre_x_mm", 100.0),
        ("odd", 7.0, "odd", 7.0),
    ],
)
def test_parameters_change_name_with_their_unit(name: str, value: float, shown: str, expected: float) -> None:
    found = shown_parameter(Parameter(name, value, value / 10))
    assert found.name == shown
    assert found.value == pytest.approx(expected)
    assert found.std == pytest.approx(expected / 10)


def test_a_hostile_text_stays_a_text() -> None:
    text = 'x"}]</script>\n\u2028'
    found = json.loads(gap_to_json(gap_reports.hostile(text)))
    assert found["warnings"] == [text]
    assert found["causes"][0]["target"] == text


def test_a_limit_that_no_arm_could_reach_is_no_limit() -> None:
    report = gap_reports.explained()
    limits = (DetectionLimit(Place("zero_offset", joint=1), 31.0, "rad", 20.0), report.limits[2])
    found = json.loads(gap_to_json(replace(report, limits=limits)))["detection_limits"]
    assert (found[0]["size"], found[0]["unit"], found[0]["rms_mm"]) == (None, "deg", None)
    assert found[1]["size"] == pytest.approx(np.rad2deg(2e-4))
    assert found[1]["rms_mm"] == pytest.approx(0.1)
