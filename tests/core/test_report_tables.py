"""Tables of a calibration: that they say what the calibration says, in the units that their columns name."""

import io

import numpy as np
import pandas as pd
import pytest

from core.calibration import Calibration
from core.report import Table, tables
from core.wording import decimals_for, fixed, is_simulated, summary, typeset, with_capital, with_uncertainty
from tests.app.report_cases import NAMED, families_compared, six_joints, two_joints_swept, with_outliers, with_slide


def table(calibration: Calibration, name: str) -> pd.DataFrame:
    return {t.name: t for t in tables(calibration)}[name].frame


@pytest.mark.parametrize("case", NAMED)
def test_every_campaign_has_all_tables_and_they_survive_csv(case):
    found = tables(NAMED[case]())
    assert [t.name for t in found] == [t.name for t in tables(six_joints())]
    for one in found:
        assert isinstance(one, Table)
        assert one.title
        assert one.name.isidentifier()
        again = pd.read_csv(io.StringIO(one.frame.to_csv(index=False))) if len(one.frame) else one.frame
        assert list(again.columns) == list(one.frame.columns)
        assert len(again) == len(one.frame)


def test_table_1_is_the_paper_s():
    frame = table(six_joints(), "sweeps")
    assert frame["joint"].tolist() == [6, 5, 4, 3, 2, 1]
    assert frame["span"].to_numpy() == pytest.approx([50, 60, 90, 45, 45, 48])
    assert frame["points"].tolist() == ["17", "16", "2 x 16", "16", "2 x 16", "16"]
    assert frame["extra_point"].tolist() == ["no", "no", "yes", "no", "yes", "no"]
    assert (frame["used"] + frame["rejected"]).sum() == 129


def test_rejected_points_are_counted_where_they_were_measured():
    calibration = with_outliers()
    frame = table(calibration, "sweeps").set_index("joint")
    assert frame["rejected"].to_dict() == {4: 1, 3: 1, 2: 0, 1: 1}
    rejected = table(calibration, "rejected")
    assert sorted(rejected["record"]) == [6, 51, 121]
    sizes = rejected.sort_values("record")["residual_mm"].to_numpy()
    # What was put in, less what noise of 0.02 mm a coordinate and the fit do to it.
    assert sizes == pytest.approx([3.0, 5.0, 2.0], abs=0.15)


@pytest.mark.parametrize("case", ["six joints", "with slide"])
def test_parameters_are_those_of_the_estimate(case):
    calibration = NAMED[case]()
    frame = table(calibration, "parameters")
    geometry, nominal = calibration.estimate.geometry, calibration.nominal
    scale = np.where(np.array([0, 0, 1, 1]) == 1, 180 / np.pi, 1e3)
    assert frame["actual"].to_numpy() == pytest.approx((geometry.model.parameters * scale).ravel(), abs=1e-9)
    assert frame["nominal"].to_numpy() == pytest.approx((nominal.parameters * scale).ravel(), abs=1e-9)
    assert frame["std"].to_numpy() == pytest.approx((geometry.std * scale).ravel())
    assert frame["difference"].to_numpy() == pytest.approx((frame["actual"] - frame["nominal"]).to_numpy(), abs=2e-9)
    assert frame["fixed"].tolist() == (~calibration.convention.free).ravel().tolist()
    expected = ~frame["fixed"] & (frame["difference"].abs() > 2 * frame["std"])
    assert frame["significant"].tolist() == expected.tolist()


def test_a_partial_campaign_has_no_parameters_and_says_why():
    found = {t.name: t for t in tables(two_joints_swept())}
    assert found["parameters"].frame.empty
    assert "every joint" in found["parameters"].note
    assert found["axes"].frame["joint"].unique().tolist() == [5, 6]


def test_axes_stand_side_by_side_and_sliding_ones_have_no_place():
    frame = table(with_slide(), "axes")
    assert frame.groupby("joint")["method"].nunique().eq(2).all()
    sliding = frame[frame["joint"] == 3]
    assert sliding[["x_mm", "y_mm", "z_mm", "point_std_mm"]].isna().all(axis=None)
    length = np.linalg.norm(frame[["direction_x", "direction_y", "direction_z"]].to_numpy(), axis=1)
    assert length == pytest.approx(np.ones(len(frame)))
    assert frame[frame["joint"] != 3]["point_std_mm"].between(0.001, 0.1).all()


def test_residuals_are_split_into_directions_without_loss():
    frame = table(six_joints(), "residuals")
    whole = (frame[["x_mm", "y_mm", "z_mm"]] ** 2).sum(axis=1)
    # Radial and tangential directions are those of the predicted point, so nothing is lost but second order.
    parts = (frame[["axial_mm", "radial_mm", "tangential_mm"]] ** 2).sum(axis=1)
    assert parts.to_numpy() == pytest.approx(whole.to_numpy(), rel=1e-3, abs=1e-6)


def test_candidates_appear_where_families_were_compared():
    assert table(six_joints(), "candidates").empty
    frame = table(families_compared(), "candidates")
    groups = frame.groupby(["kind", "joint"])
    assert groups["chosen"].sum().eq(1).all()
    assert groups["probability"].sum().to_numpy() == pytest.approx(np.ones(len(groups)))


def test_zeros_are_the_readings_at_the_marks():
    calibration = six_joints()
    frame = table(calibration, "zeros")
    assert frame["reading_at_marks"].to_numpy() == pytest.approx(np.rad2deg(calibration.campaign.home))
    # By the definition of the marks the calibrated arm is at zero under just these commands.
    assert frame["command_for_zero"].to_numpy() == pytest.approx(frame["reading_at_marks"].to_numpy(), abs=1e-6)
    assert table(with_slide(), "zeros")["offset"].isna().all()


@pytest.mark.parametrize(
    ("value", "std", "text"),
    [
        (3.14159, 0.0213, "3.142 ± 0.021"),
        (-12.3456, 1.99, "\u221212.3 ± 2.0"),
        (1234.5, 250.0, "1234 ± 250"),
        (0.5, 0.0996, "0.50 ± 0.10"),
        (-0.001, 0.3, "0.00 ± 0.30"),
        (2.0, 0.0, "2.000"),
    ],
)
def test_numbers_show_two_digits_of_their_uncertainty(value, std, text):
    assert with_uncertainty(value, std) == text


def test_rounding_never_hides_more_than_a_twentieth_of_the_uncertainty():
    rng = np.random.default_rng(1)
    for std in 10 ** rng.uniform(-5, 2, 300):
        value = rng.normal(scale=10 * std)
        shown = float(fixed(value, decimals_for(std)).replace("\u2212", "-"))
        assert abs(shown - value) <= 0.5 * 10.0 ** -decimals_for(std) * (1 + 1e-9)
        assert 10.0 ** -decimals_for(std) <= max(0.11 * std, 1e-7) or decimals_for(std) == 0


def test_a_unit_said_twice_is_said_once():
    assert typeset("off by -4.02 deg +- 0.16 deg once") == "off by \u22124.02 ± 0.16 deg once"
    assert typeset("moves 0.15% +- 0.01% less") == "moves 0.15% ± 0.01% less"


@pytest.mark.parametrize("case", NAMED)
def test_the_summary_is_short_and_names_what_is_missing(case):
    calibration = NAMED[case]()
    sentences = summary(calibration)
    assert 3 <= len(sentences) <= 6
    assert all(s.endswith(".") and "nan" not in s for s in sentences)
    absent = bool(calibration.not_swept or calibration.not_moved)
    assert absent == any("say nothing" in s for s in sentences)


def test_only_what_says_so_is_simulated():
    assert is_simulated(six_joints().campaign)
    assert not is_simulated(NAMED["one joint, two turns"]().campaign)


@pytest.mark.parametrize(
    ("said", "shown"),
    [
        ("joint 3, sweep 1: expected a number", "Joint 3, sweep 1: expected a number"),
        ("robot.toml, joint 2: no limits", "robot.toml, joint 2: no limits"),
        ("sigma_mm is 0, expected more", "sigma_mm is 0, expected more"),
        ("The disk is full.", "The disk is full."),
        ("", ""),
    ],
)
def test_sentences_begin_with_a_capital_unless_with_a_name(said: str, shown: str) -> None:
    assert with_capital(said) == shown
