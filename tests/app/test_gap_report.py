"""The page of a diagnosis: what is shown is what was found, whatever that was."""

import html
import json
import re
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from app.figures.gap_map import gap_map_figure
from app.figures.gap_steps import gap_steps_figure
from app.figures.gap_vectors import gap_vectors_figure, magnification
from app.figures.gap_where import gap_records_figure, gap_shares_figure
from app.figures.reliability import reliability_figure
from app.gap_report import gap_html, gap_page
from app.gap_tables import cause_parameters, probability_words, shown_limits, shown_transfers
from core.gap.ledger import difference_with, ledger, switches
from core.gap.place_words import CALIBRATION
from core.gap.result import DetectionLimit, Parameter, Place, Transfer
from core.gap.verdict_words import verdict_sentence
from core.wording import typeset
from tests.app.report_cases import HOSTILE
from tests.core import gap_reports

MADE = ("explained", "partly_explained", "unexplained", "no_gap", "barely_known")


def made(name: str = "explained"):
    return getattr(gap_reports, name)()


def words(page: str) -> str:
    """What a reader sees."""
    body = re.sub(r"<(script|style)\b.*?</\1>", " ", page, flags=re.S)
    return html.unescape(re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", body)))


@pytest.mark.parametrize("name", MADE)
def test_every_diagnosis_has_a_page_that_begins_with_the_verdict(name: str) -> None:
    page = gap_page(made(name))
    assert page.lead == typeset(verdict_sentence(made(name)))
    shown = words(gap_html(made(name)))
    assert page.lead in shown
    assert not re.search(r"\bnan\b|\bNone\b|\binf\b", shown)
    assert "SIMULATED" in shown


def test_the_page_has_everything_that_a_decision_needs() -> None:
    ids = [section.id for section in gap_page(made()).sections]
    assert ids == [
        *("shrinks", "causes", "space", "where", "transfer", "unknown", "next", "noise", "limits", "outliers"),
        *("reliability", "method"),
    ]
    assert [section.id for section in gap_page(made("no_gap")).sections] == [
        *("shrinks", "causes", "where", "unknown", "noise", "limits", "method"),
    ]


def test_the_ledger_and_the_causes_are_those_of_the_diagnosis() -> None:
    shown = words(gap_html(made()))
    assert "compliance 3.10 ± 0.20 µrad/Nm" in shown
    assert "gap 0.0688 ± 0.0029 deg" in shown
    assert "gain 0.01230 ± 0.00040" in shown
    assert "flexure of link 1" in shown
    assert "0 .5600" in shown
    assert "0 .8100" in shown


def test_the_steps_end_at_the_floor() -> None:
    report = made()
    bars = gap_steps_figure(report).data[0]
    expected = [report.gap_rms_m, *(c.gap_after_rms_m for c in report.causes), report.noise.floor_rms_m]
    np.testing.assert_allclose(np.array(bars.x, dtype=float), np.array(expected) * 1e3)
    assert len(set(bars.y)) == len(bars.y)
    assert len(gap_steps_figure(made("unexplained")).data[0].x) == 2


def test_steps_of_long_names_stay_apart() -> None:
    report = gap_reports.explained(gap_reports.renamed(gap_reports.six_joints(), "x" * 300))
    same = replace(report, causes=(report.causes[0],) * 3, left_rms_m=report.causes[0].gap_after_rms_m)
    assert len(set(gap_steps_figure(same).data[0].y)) == 5


def test_the_map_shows_every_cell_and_marks_causes_and_twins() -> None:
    report = made()
    figure = gap_map_figure(report)
    heat = figure.data[0]
    shares = np.array(heat.z, dtype=float)
    names, columns = list(heat.y), list(heat.x)
    assert columns == ["1", "2", "3", "4", "5", "6", "–"]
    assert shares[names.index("compliance"), columns.index("2")] == pytest.approx(0.7)
    assert shares[names.index("coupling"), columns.index("4")] == pytest.approx(0.14)
    assert np.isnan(shares[names.index("payload"), columns.index("2")])
    texts = {
        (x, y): t
        for trace in figure.data
        if trace.type == "scatter" and trace.mode == "text"
        for x, y, t in zip(trace.x, trace.y, trace.text, strict=True)
    }
    assert texts == {
        ("2", "compliance"): "<b>1</b>",
        ("1", "flexure"): "<b>1?</b>",
        ("3", "backlash"): "<b>2</b>",
        ("4", "coupling"): "<b>3</b>",
    }
    links = [trace for trace in figure.data if trace.type == "scatter" and trace.mode == "lines"]
    assert [(list(one.x), list(one.y)) for one in links] == [(["2", "1"], ["compliance", "flexure"])]
    assert gap_map_figure(made("no_gap")) is None


def test_the_switches_show_the_arrows_of_every_choice_of_causes() -> None:
    report = made()
    figure = gap_vectors_figure(report)
    assert len(switches(report)) == 3
    by_mask = {trace.meta["mask"]: trace for trace in figure.data if trace.meta and trace.type == "scatter3d"}
    assert sorted(by_mask) == list(range(8))
    assert [mask for mask, trace in by_mask.items() if trace.visible] == [0]
    sim = report.campaign.measurements.point_m[report.rows] - report.difference_m
    factor = magnification(sim, report.difference_m[report.where.worst_rows])
    for mask, trace in by_mask.items():
        ends = np.stack([np.array(trace[axis], dtype=float) for axis in "xyz"], axis=1).reshape(-1, 3, 3)
        expected = difference_with(report, mask)[report.where.worst_rows] * factor * 1e3
        np.testing.assert_allclose(ends[:, 1] - ends[:, 0], expected, atol=0.011)
    assert gap_vectors_figure(made("barely_known")) is None


@pytest.mark.parametrize(("size", "length"), list(product((0.1, 1.0, 3.0), (1e-6, 3e-4, 1e-2))))
def test_arrows_are_seen_and_do_not_fill_the_figure(size: float, length: float) -> None:
    sim = np.array([[0.0, 0.0, 0.0], [size, 0.0, 0.0]])
    factor = magnification(sim, np.array([[length, 0.0, 0.0]] * 2))
    assert 0.04 * size < factor * length < 0.13 * size or factor == 1.0


def test_points_without_extent_are_not_magnified() -> None:
    assert magnification(np.zeros((3, 3)), np.ones((3, 3))) == 1.0
    assert magnification(np.eye(3), np.zeros((3, 3))) == 1.0


def test_where_shows_the_shares_and_every_point() -> None:
    report = made()
    shares = gap_shares_figure(report)
    assert [len(trace.x) for trace in shares.data] == [6, 3, 3]
    assert len(gap_shares_figure(made("barely_known")).data) == 1
    before, after = gap_records_figure(report).data[:2]
    np.testing.assert_allclose(np.array(before.y, dtype=float), np.linalg.norm(report.difference_m, axis=1) * 1e3)
    np.testing.assert_allclose(np.array(after.y, dtype=float), np.linalg.norm(report.left_m, axis=1) * 1e3)


def test_the_reliability_figure_leaves_empty_bins_out() -> None:
    figure = reliability_figure(np.array([0.1, 0.9]), np.array([np.nan, 0.8]), np.array([0, 10]), "worlds", "Title")
    assert [float(x) for x in figure.data[1].x] == [0.9]


def test_texts_of_files_stay_texts() -> None:
    report = gap_reports.hostile(HOSTILE)
    page = gap_html(report)
    assert "<img" not in page.split("<main>")[1]
    scripts = sum(len(section.plots) for section in gap_page(report).sections)
    blocks = page.split('<script type="application/json">')[1:]
    assert len(blocks) == scripts
    for block in blocks:
        figure = block.split("</script>")[0]
        assert json.loads(figure)["data"]
        assert "<" not in figure
        # Plotly reads markup in what it shows: none of it may be that of a file.
        assert "<img" not in json.dumps(json.loads(figure))


def test_an_arm_with_a_slide_has_a_page() -> None:
    assert "joint 4" in words(gap_html(gap_reports.explained(gap_reports.with_slide())))


def test_of_many_parameters_the_clearest_are_shown() -> None:
    parameters = tuple(Parameter(f"part {k}_m", k * 1e-3, 1e-3) for k in range(9))
    words = cause_parameters(replace(made().causes[0], parameters=parameters))
    assert [f"part {k}" in words for k in range(9)] == [False] * 5 + [True] * 4
    assert words.endswith("5 more in gap.json")


def test_what_all_causes_leave_together_is_a_bar_of_its_own_where_it_differs() -> None:
    assert len(gap_steps_figure(made()).data[0].x) == 5
    assert len(gap_steps_figure(replace(made(), left_rms_m=2.8e-4)).data[0].x) == 6


def test_many_causes_share_the_last_bar_and_the_end_of_the_summary() -> None:
    many = replace(made(), causes=made().causes * 5)
    assert len(gap_steps_figure(many).data[0].x) == 1 + 8 + 1
    assert any("10 more causes are in the table" in line for line in gap_page(many).summary)


def test_small_shares_are_seen_on_the_map() -> None:
    report = made()
    small = replace(
        report, evidence_map=tuple(replace(c, share_closed=c.share_closed / 10) for c in report.evidence_map)
    )
    assert gap_map_figure(report).data[0].zmax == 1.0
    assert gap_map_figure(small).data[0].zmax == 0.1


def test_an_unknown_cause_has_its_mark_on_the_map() -> None:
    figure = gap_map_figure(made("partly_explained"))
    marks = {
        t: (x, y) for trace in figure.data[1:] for x, y, t in zip(trace.x, trace.y, trace.text or (), strict=False)
    }
    assert marks["<b>2</b>"] == ("5", "unknown effect")


def test_an_effect_that_placement_absorbs_has_no_limit() -> None:
    limit = DetectionLimit(Place("zero_offset", joint=1), 31.0, "rad", 20.0)
    shown = words(gap_html(replace(made(), limits=(limit, *made().limits[1:]))))
    assert "∞: not to be seen at any size" in shown
    assert "∞" not in words(gap_html(made()))


def test_limits_of_couplings_stand_under_the_joint_that_follows() -> None:
    limits = tuple(DetectionLimit(Place("coupling", joint=k, source=2), k * 1e-3, "1", 1e-4) for k in (1, 3, 4))
    (table,) = shown_limits(replace(made(), limits=limits))
    assert [cell.text for cell in table.groups[0][0]] == [
        *("coupling from joint 2, to", "ppm", "1000", "", "3000", "4000", "", ""),
    ]


@pytest.mark.parametrize(
    ("probability", "words"), [(0.0, "< 1 %"), (0.004, "< 1 %"), (0.5, "50 %"), (0.97, "97 %"), (1.0, "> 99 %")]
)
def test_no_cause_is_said_to_be_impossible_or_certain(probability: float, words: str) -> None:
    assert probability_words(probability) == words


@pytest.mark.parametrize(
    ("after", "said"), [(2.6e-4, "better"), (9.45e-4, "the same"), (9.5e-4, "the same"), (9.8e-4, "worse")]
)
def test_whether_causes_hold_elsewhere_is_said_in_a_word(after: float, said: str) -> None:
    report = replace(gap_reports.explained(), transfers=(Transfer("sweeps", "poses", 36, 9.5e-4, after),))
    ((row,),) = shown_transfers(report).groups
    assert row[-1].text == said


def test_what_a_calibration_leaves_uncertain_has_a_step_a_line_and_a_number_of_its_own() -> None:
    plain = gap_reports.explained()
    report = replace(plain, within_calibration_rms_m=0.6 * plain.gap_rms_m)
    names = list(gap_steps_figure(report).data[0].y)
    assert len(names) == len(gap_steps_figure(plain).data[0].y) + 1
    assert CALIBRATION.split()[-1] in names[1]
    assert ledger(report)[0].words == CALIBRATION
    text = gap_html(report)
    assert "Calibration moved" in text
    assert CALIBRATION in verdict_sentence(report)
    assert "Calibration moved" not in gap_html(plain)
    assert "Calibration moved" not in gap_html(replace(plain, within_calibration_rms_m=0.99 * plain.gap_rms_m))
