"""The report's page: that it holds what it should, escapes what it must, and stays small."""

import html
import json
import re
from dataclasses import replace
from html.parser import HTMLParser

import plotly.graph_objects as go
import pytest

from app.report_cells import aligned, number, uncertainty
from app.report_html import report_html, report_page
from app.report_page import Cell, Plot
from app.report_tables import family_words, reason_words, shown_parameters
from core.calibration import calibrate
from core.twin import scara
from core.twin.campaign import simulate_campaign
from tests.app.report_cases import (
    HOSTILE,
    NAMED,
    families_compared,
    hostile,
    six_joints,
    two_joints_swept,
    unlabelled,
    with_outliers,
    with_slide,
)


class Elements(HTMLParser):
    """The elements of a page with their attributes, and the text outside scripts and styles."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.text: list[str] = []
        self.within = ""
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))
        if tag in ("script", "style"):
            self.within = tag

    def handle_endtag(self, tag):
        if tag == self.within:
            self.within = ""

    def handle_data(self, data):
        if not self.within:
            self.text.append(data)

    @property
    def words(self) -> str:
        return re.sub(r"\s+", " ", " ".join(self.text))


@pytest.mark.parametrize("case", NAMED)
def test_every_campaign_has_a_report_of_moderate_size(case):
    page = report_html(NAMED[case]())
    assert len(page.encode()) < 8e6
    elements = Elements(page)
    assert [tag for tag, _ in elements.found].count("h1") == 1
    assert not re.search(r"\bnan\b|\bNone\b|\binf\b", elements.words)
    assert "End of report" in elements.words


def test_the_page_asks_for_nothing_from_outside():
    elements = Elements(report_html(six_joints()))
    for _, attributes in elements.found:
        assert not attributes.get("src")
        assert (attributes.get("href") or "#").startswith("#")


def test_plotly_is_written_once():
    page = report_html(six_joints())
    assert page.count("plotly.js v") == 1


def test_texts_from_files_stay_texts():
    page = report_html(hostile())
    elements = Elements(page)
    tags = [tag for tag, _ in elements.found]
    assert "img" not in tags
    # Plotly, the drawing of figures and scene, the scene, and one script of data for each figure.
    assert tags.count("script") == 4 + sum(len(s.plots) for s in report_page(hostile()).sections)
    assert "window.broken=1" in page
    assert HOSTILE in html.unescape(page)


def test_a_figure_s_data_cannot_end_its_script():
    text = "</script><!-- & ' \" \u2028"
    written = Plot(go.Figure(layout={"title": {"text": text}}), "").json
    assert not set("<>&") & set(written)
    assert json.loads(written)["layout"]["title"]["text"] == text


def test_simulated_campaigns_say_so_and_others_do_not():
    assert "SIMULATED" in Elements(report_html(six_joints())).words
    assert "SIMULATED" not in Elements(report_html(NAMED["one joint, two turns"]())).words


def test_conditions_and_origin_stand_in_the_head():
    campaign = replace(simulate_campaign(1, scara.cell()), digest="ab12" * 16)
    facts = dict(report_page(calibrate(campaign)).facts)
    assert facts["SHA-256 of input"] == "ab12" * 16
    assert facts["Instrument"] == "laser tracker"
    assert facts["Air temperature"] == "21.0 to 21.5 °C"
    assert facts["Payload"] == "0 kg"
    assert facts["Source"].startswith("simulated")
    assert facts["Software"].startswith("trueaxis ")


def test_a_campaign_without_words_is_told_from_its_robot():
    page = report_page(calibrate(unlabelled(simulate_campaign(1, scara.cell()))))
    facts = dict(page.facts)
    assert page.title == "SCARA 650"
    assert page.badge == ""
    assert facts["Air temperature"] == facts["Time span"] == facts["Payload"] == "not recorded"


def test_significant_findings_come_first_and_carry_a_sign():
    section = next(s for s in report_page(six_joints()).sections if s.id == "findings")
    clear = [f for f in six_joints().findings if f.significant]
    assert len(section.items) == len(clear)
    assert all(item.significant for item in section.items)
    assert len(section.minor_items) == len(six_joints().findings) - len(clear)


def test_rejected_points_are_listed_with_the_reason():
    words = Elements(report_html(with_outliers())).words
    assert "3 were rejected" in words
    assert "stands out of the scatter" in words


def test_a_partial_campaign_names_the_joints_that_are_missing():
    page = report_page(two_joints_swept())
    words = Elements(report_html(two_joints_swept())).words
    assert "joints 1, 2, 3 and 4 have none" in words
    assert not any(t.caption.startswith("Table 2") for s in page.sections for t in s.tables_after)


def test_an_arm_without_couplings_has_no_such_section():
    assert "couplings" not in [s.id for s in report_page(with_slide()).sections]
    assert "couplings" in [s.id for s in report_page(six_joints()).sections]


def test_compared_families_are_shown_in_words():
    words = Elements(report_html(families_compared())).words
    assert "Families that were compared" in words
    assert "harmonics_2" not in words
    assert "first_harmonic" not in words


def test_reasons_use_the_words_of_the_tables():
    assert reason_words("more so than harmonics_3") == "more so than 1 to 3 times a turn"
    assert family_words("arctangent") == "four-bar linkage"


def test_parameters_that_nobody_measured_are_marked():
    groups = shown_parameters(with_slide()).groups
    texts = [[c.text for c in row] for group in groups for row in group]
    fixed = [row for row in texts if "fixed by convention" in row]
    assert len(fixed) == int((~with_slide().convention.free).sum())


def test_numbers_of_a_column_have_their_points_below_each_other():
    rows = [[number(1.25, 0.1)], [number(-12.5, 2.0)], [number(3.0, 25.0)], [uncertainty(0.0123)]]
    cells = [row[0] for row in aligned([rows])[0]]
    assert [c.tail for c in cells] == [".25", ".5", "", ".012"]
    assert {c.tail_width for c in cells} == {3}


def test_spanning_cells_do_not_shift_the_columns():
    first = [Cell("1", rows=2, heading=True), number(1.0, 0.001), number(2.0, 0.1)]
    second = [Cell("agreed", columns=2)]
    third = [Cell("2", heading=True), number(1.0, 1.0), number(2.0, 0.01)]
    groups = aligned([[first, second], [third]])
    assert groups[0][0][1].tail_width == groups[1][0][1].tail_width == 4
    assert groups[0][0][2].tail_width == groups[1][0][2].tail_width == 3
