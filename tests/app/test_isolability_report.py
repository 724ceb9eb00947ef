"""What planned points can tell apart, as a page and as lines: what is shown is what was found."""

import html
import re
from functools import cache

import pytest

from app.isolability_report import isolability_html, isolability_page
from app.isolability_summary import isolability_lines
from core.gap.additions import Addition, additions
from core.gap.isolability import Isolability, isolability
from core.gap.place_words import place_words
from tests.app.report_cases import HOSTILE
from tests.core.gap_cells import crane_cell, measured


@cache
def judged(drawn: bool) -> tuple[Isolability, tuple[Addition, ...]]:
    found = isolability(measured(crane_cell()), drawn)
    return found, additions(found)


def words(page: str) -> str:
    """What a reader sees."""
    body = re.sub(r"<(script|style)\b.*?</\1>", " ", page, flags=re.S)
    return html.unescape(re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", body)))


@pytest.mark.parametrize("drawn", [False, True])
def test_every_effect_that_has_rivals_is_in_the_table_of_doubts(drawn: bool) -> None:
    found, tried = judged(drawn)
    text = words(isolability_html(found, tried, "crane", simulated=True)).lower()
    doubtful = [one for one in found.effects if one.rivals]
    assert doubtful
    for one in doubtful:
        assert place_words(one.place) in text
        assert f"{place_words(one.rivals[0].place)} ({one.rivals[0].separation:.1f})" in text
    assert ("as drawn" in text) == drawn
    assert "simulated: no robot was measured" in text


def test_titles_from_files_are_escaped() -> None:
    found, tried = judged(False)
    page = isolability_html(found, tried, HOSTILE, simulated=False)
    assert HOSTILE not in page
    assert HOSTILE in words(page)


def test_without_a_title_the_robot_gives_its_name() -> None:
    page = isolability_page(*judged(False), title="", simulated=False)
    assert page.title == "crane"
    assert page.badge == ""


def test_lines_have_a_row_for_every_effect_and_mark_what_is_confused_or_hidden() -> None:
    found, tried = judged(False)
    lines = isolability_lines(found, tried)
    (offsets,) = [line.split() for line in lines if line.strip().startswith("zero offset")]
    assert offsets[:3] == ["zero", "offset", "-"]
    second = next(one for one in found.effects if place_words(one.place) == "zero offset of joint 2")
    assert offsets[3] == f"{second.limit.rms_m * 1e3:.2g}*"
    (ripple,) = [line for line in lines if line.strip().startswith("tooth ripple")]
    assert "*" not in ripple
    shown = [line for line in lines if line.strip().startswith("add ")]
    assert 1 <= len(shown) <= 3
    assert tried[0].words in shown[0]


def test_nothing_in_doubt_asks_for_nothing() -> None:
    found, _ = judged(False)
    certain = Isolability(
        found.problem, False, found.noise_m, found.needed, tuple(one for one in found.effects if one.named)
    )
    assert additions(certain) == ()
    page = isolability_page(certain, (), "crane", simulated=False)
    assert {section.id for section in page.sections} == {"limits", "unknown", "method"}
