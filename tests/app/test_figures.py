"""Figures of a calibration: that what is drawn is what was found, and that no campaign leaves a panel empty."""

import numpy as np
import plotly.graph_objects as go
import pytest

from app.figures.axis_uncertainty import axis_uncertainty_figure
from app.figures.couplings import coupling_figure
from app.figures.curves import COVERAGE
from app.figures.deviations import deviations_figure
from app.figures.over_time import over_time_figure
from app.figures.residuals import residual_figure
from app.figures.style import MOST_POINTS, in_theme, lines_of_legend, plain, thinned
from app.figures.transmissions import transmission_figure
from core.report import parameters_table, sweep_rows
from core.sweep_fits import active_from_zero
from tests.app.report_cases import (
    NAMED,
    families_compared,
    hostile,
    one_joint_two_turns,
    six_joints,
    two_joints_swept,
    with_outliers,
    with_slide,
)


def markers(figure: go.Figure, row: int) -> list[go.Scatter]:
    axis = "y" if row == 1 else f"y{row}"
    return [t for t in figure.data if t.mode == "markers" and (t.yaxis or "y") == axis]


@pytest.mark.parametrize("case", NAMED)
def test_every_figure_has_points_titles_and_units(case):
    calibration = NAMED[case]()
    figures = [residual_figure(calibration, k) for k in range(len(calibration.found.fits))]
    figures += [transmission_figure(calibration, j) for j in calibration.found.swept]
    figures += [coupling_figure(calibration, j) for j, f in enumerate(calibration.estimate.couplings, 1) if f]
    for figure in figures:
        assert figure.layout.title.text
        panels = sum(1 for _ in figure.select_yaxes())
        for row, axis in enumerate(figure.select_yaxes(), 1):
            assert axis.title.text.endswith(("[mm]", "[deg]"))
            assert any(len(t.x) for t in markers(figure, row))
        assert [a.title.text for a in figure.select_xaxes()][panels - 1].endswith(("[mm]", "[deg]"))
        for trace in figure.data:
            assert np.isfinite(np.asarray(trace.x, dtype=float)).all()
            assert np.isfinite(np.asarray(trace.y, dtype=float)).all()


def test_residuals_are_drawn_where_they_were_measured():
    calibration = six_joints()
    found, rows = list(sweep_rows(calibration))[2]
    figure = residual_figure(calibration, 2)
    residuals = calibration.refinement.residuals
    for row, values in enumerate((residuals.axial_m, residuals.radial_m, residuals.tangential_m), 1):
        traces = markers(figure, row)
        assert [t.name for t in traces] == ["T2", "T1"]
        drawn = np.concatenate([t.y for t in traces])
        assert np.sort(drawn) == pytest.approx(np.sort(values[rows] * 1e3))
    where = np.rad2deg(found.sweep.commanded[found.sweep.stop, found.sweep.joint - 1])
    assert np.sort(np.concatenate([t.x for t in markers(figure, 1)])) == pytest.approx(np.sort(where))


def test_the_grey_band_holds_about_what_it_says():
    calibration = six_joints()
    inside = total = 0
    for k in range(len(calibration.found.fits)):
        figure = residual_figure(calibration, k)
        for row in (1, 2, 3):
            axis = "y" if row == 1 else f"y{row}"
            top = next(max(t.y) for t in figure.data if t.fill and (t.yaxis or "y") == axis)
            values = np.concatenate([t.y for t in markers(figure, row)])
            inside, total = inside + int((np.abs(values) <= top).sum()), total + len(values)
    assert total == 3 * 129
    # 95 % of 387, give or take four standard deviations, and up for the freedom that the fit took.
    assert 0.90 < inside / total < 0.995


def test_rejected_points_are_crosses_within_the_panel():
    figure = residual_figure(with_outliers(), 0)
    crosses = [t for t in figure.data if t.name == "rejected"]
    assert len(crosses) == 3
    for trace in crosses:
        assert trace.marker.symbol == "x-open"
    top = figure.layout.yaxis2.range[1]
    radial = crosses[1]
    assert abs(radial.y[0]) < top
    assert abs(radial.customdata[0]) > top


def test_all_residual_panels_share_one_scale():
    calibration = six_joints()
    ranges = {
        tuple(axis.range)
        for k in range(len(calibration.found.fits))
        for axis in residual_figure(calibration, k).select_yaxes()
    }
    assert len(ranges) == 1


@pytest.mark.parametrize(
    ("case", "joint"), [("six joints", 3), ("six joints", 5), ("with slide", 3), ("with slide", 4)]
)
def test_points_less_the_fitted_line_are_what_is_left(case, joint):
    figure = transmission_figure(NAMED[case](), joint)
    line = next(t for t in figure.data if t.name == "fit")
    before, after = markers(figure, 1)[0], markers(figure, 2)[0]
    assert before.y - np.interp(before.x, line.x, line.y) == pytest.approx(after.y, abs=2e-4 * np.ptp(before.y))


def test_the_error_of_a_drive_is_commanded_minus_actual():
    calibration = with_slide()
    motion = next(m for m in calibration.motions if m.found.sweep.joint == 3)
    trace = markers(transmission_figure(calibration, 3), 1)[0]
    asked = active_from_zero(calibration.campaign, motion.found.sweep.commanded)[:, 2] * 1e3
    assert trace.x + trace.y == pytest.approx(asked)
    # The simulated slide is commanded 0.15 % further than it goes.
    assert np.polyfit(trace.x, trace.y, 1)[0] == pytest.approx(0.0015, abs=2e-4)


def test_the_band_is_that_of_the_constants():
    calibration = with_slide()
    figure, fit = transmission_figure(calibration, 3), calibration.estimate.transmissions[2]
    band = next(t for t in figure.data if t.name == "95 % band")
    line = next(t for t in figure.data if t.name == "fit")
    half = (max(band.y[: len(line.x)] - line.y), COVERAGE * fit.std[0] * max(abs(line.x)))
    assert half[0] == pytest.approx(half[1], rel=1e-6)


def test_a_direct_drive_has_no_band():
    assert "95 % band" not in [t.name for t in transmission_figure(six_joints(), 4).data]


def test_deviations_are_those_of_table_2():
    figure = deviations_figure(six_joints())
    frame = parameters_table(six_joints()).frame
    free = frame[~frame["fixed"]]
    drawn = np.sort(np.concatenate([t.x for t in figure.data]))
    assert drawn == pytest.approx(np.sort(free["difference"].to_numpy()))
    by_name = {t.name: np.sum([len(u.x) for u in figure.data if u.name == t.name]) for t in figure.data}
    assert by_name["significant"] == free["significant"].sum()
    assert deviations_figure(two_joints_swept()) is None


def test_thousands_of_points_are_thinned_and_the_largest_stay():
    calibration = one_joint_two_turns()
    figure = residual_figure(calibration, 0)
    residuals = calibration.refinement.residuals
    for row, values in enumerate((residuals.axial_m, residuals.radial_m, residuals.tangential_m), 1):
        drawn = markers(figure, row)[0].y
        assert len(drawn) <= MOST_POINTS < len(values)
        assert np.abs(drawn).max() == pytest.approx(np.abs(values).max() * 1e3)
    assert max(markers(figure, 1)[0].x) == pytest.approx(720.0, abs=0.1)


def test_few_points_are_not_thinned():
    assert thinned(17).tolist() == list(range(17))


def test_names_from_files_are_text():
    names = [t.name for k in range(4) for t in residual_figure(hostile(), k).data]
    assert not any("<" in name for name in names)
    assert any("&lt;/script" in name for name in names)
    assert plain("a" * 40) == "a" * 23 + "…"


def test_legends_have_room():
    for calibration in (six_joints(), families_compared()):
        figure = transmission_figure(calibration, 5)
        assert figure.layout.margin.b >= 18 * lines_of_legend(figure.data, figure.layout.width) + 40


@pytest.mark.parametrize("case", NAMED)
def test_every_point_has_its_residual_at_its_time(case):
    calibration = NAMED[case]()
    figure, residuals = over_time_figure(calibration), calibration.refinement.residuals
    for row, name in enumerate(("axial_m", "radial_m", "tangential_m"), 1):
        values = np.asarray(getattr(residuals, name))
        known = np.isfinite(values) & residuals.used
        kept = [t for t in markers(figure, row) if t.name != "rejected"]
        drawn = np.concatenate([t.y for t in kept])
        if known.sum() <= MOST_POINTS:
            assert np.sort(drawn) == pytest.approx(np.sort(values[known] * 1e3))
        assert np.isin(drawn, values[known] * 1e3).all()
        assert {t.name for t in kept} == {f"joint {j}" for j in np.unique(residuals.joint[residuals.used])}
    time = calibration.campaign.measurements.time_s
    title = next(a.title.text for a in figure.select_xaxes() if a.title.text)
    assert title.startswith("record" if time is None else "time since")


def test_time_runs_from_the_first_point_in_a_unit_that_suits_it():
    calibration = six_joints()
    time = calibration.campaign.measurements.time_s[calibration.refinement.residuals.row]
    x = np.concatenate([t.x for t in markers(over_time_figure(calibration), 1)])
    assert np.sort(x) == pytest.approx(np.sort(time - time.min()) / 60.0)


def test_uncertainties_of_axes_are_those_of_both_estimates():
    calibration = six_joints()
    figure = axis_uncertainty_figure(calibration)
    for row in (1, 2):
        for trace, estimate in zip(
            markers(figure, row), (calibration.joint_by_joint, calibration.estimate), strict=True
        ):
            expected = [estimate.axis_std(int(joint))[row - 1] * 1e3 for joint in trace.x]
            assert trace.y == pytest.approx(expected)
            assert list(trace.x) == ["1", "2", "3", "4", "5", "6"]


def test_a_dark_page_changes_the_look_and_nothing_that_is_drawn():
    light, dark = (in_theme(residual_figure(six_joints(), 0), theme) for theme in (False, True))
    assert light.layout.template.layout.font.color != dark.layout.template.layout.font.color
    assert [t.to_plotly_json()["name"] for t in light.data] == [t.to_plotly_json()["name"] for t in dark.data]
    assert in_theme(dark, False).layout == light.layout
