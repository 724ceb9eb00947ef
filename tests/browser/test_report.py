"""The report in a browser, from a file and without a network."""

import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from app.report_html import report_html, report_page
from core.calibration import Calibration
from core.report import parameters_table
from core.wording import decimals_for
from tests.app.report_cases import HOSTILE, NAMED, hostile, six_joints

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
A4_PX = 703
"""Printable width of A4 with the report's margins, at 96 pixels an inch."""

pytestmark = pytest.mark.skipif(CHROMIUM is None and not os.environ.get("CI"), reason="there is no Chromium here")


@pytest.fixture(scope="module")
def browser():
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield running
        running.close()


@contextmanager
def opened(browser, folder: Path, calibration: Calibration, width: int = 1400) -> Iterator:
    """The report of a calibration, opened from a file; fails on any complaint and on any request but for the file."""
    file = folder / "report.html"
    file.write_text(report_html(calibration), encoding="utf-8")
    page = browser.new_page(viewport={"width": width, "height": 900})
    asked, complaints = [], []
    page.route(lambda url: not url.startswith("file:"), lambda route: (asked.append(route.request.url), route.abort()))
    page.on("request", lambda r: asked.append(r.url) if r.url.startswith(("http", "ws", "//")) else None)
    page.on("console", lambda m: complaints.append(m.text) if m.type in ("error", "warning") else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto(file.as_uri())
    try:
        yield page
    finally:
        page.close()
    assert asked == []
    assert complaints == []


def plots(calibration: Calibration) -> int:
    return sum(len(section.plots) for section in report_page(calibration).sections)


@pytest.mark.parametrize("case", NAMED)
def test_every_figure_is_drawn(browser, tmp_path, case):
    calibration = NAMED[case]()
    with opened(browser, tmp_path, calibration) as page:
        assert page.locator(".js-plotly-plot").count() == plots(calibration)
        empty = page.evaluate(
            "[...document.querySelectorAll('.js-plotly-plot')].filter(p => !p.querySelector('.points path')).length"
        )
        assert empty == 0


def test_numbers_of_table_2_are_those_of_the_calibration(browser, tmp_path):
    calibration = six_joints()
    frame = parameters_table(calibration).frame
    with opened(browser, tmp_path, calibration) as page:
        rows = page.evaluate(
            """[...document.querySelectorAll('table')].find(t => t.caption.textContent.startsWith('Table 2'))
            .querySelectorAll('tbody tr').values().map(r => [...r.querySelectorAll('td')].map(c => c.textContent))
            .toArray()"""
        )
    assert len(rows) == len(frame)
    for shown, row in zip(rows, frame.itertuples(), strict=True):
        nominal, actual = (float(text.replace("\u2212", "-")) for text in shown[2:4])
        decimals = decimals_for(row.std, 2)
        assert actual == pytest.approx(row.actual, abs=0.51 * 10.0**-decimals)
        assert nominal == pytest.approx(row.nominal, abs=0.51 * 10.0**-decimals)
        if row.fixed:
            assert shown[4] == "fixed by convention"
            continue
        difference, std = (float(text.replace("\u2212", "-")) for text in shown[4:6])
        assert difference == pytest.approx(row.difference, abs=0.51 * 10.0**-decimals)
        assert std == pytest.approx(row.std, rel=0.05)
        assert ("▲ significant" in shown) == row.significant


def test_texts_from_files_do_nothing(browser, tmp_path):
    with opened(browser, tmp_path, hostile()) as page:
        assert page.evaluate("window.broken") is None
        assert page.locator("h1").text_content() == HOSTILE
        assert page.title().endswith(re.sub(r"\s+", " ", HOSTILE))
        assert page.locator("body img").count() == 0
        legend = page.locator(".legendtext").all_text_contents()
        assert any(text.startswith("P1</script>") for text in legend)


@pytest.mark.parametrize("width", [1024, 1400])
def test_nothing_hangs_over_the_edge(browser, tmp_path, width):
    with opened(browser, tmp_path, six_joints(), width) as page:
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        clipped = page.evaluate(
            """[...document.querySelectorAll('.js-plotly-plot')].flatMap(p => {
                const frame = p.getBoundingClientRect();
                return [...p.querySelectorAll('text')].filter(t => t.textContent.trim()).filter(t => {
                    const box = t.getBoundingClientRect();
                    return box.width && (box.left < frame.left - 1 || box.right > frame.right + 1
                        || box.top < frame.top - 1 || box.bottom > frame.bottom + 1);
                }).map(t => t.textContent);
            })"""
        )
        assert clipped == []


def test_everything_fits_on_a4(browser, tmp_path):
    with opened(browser, tmp_path, six_joints(), A4_PX) as page:
        page.emulate_media(media="print")
        too_wide = page.evaluate(
            f"""[...document.querySelectorAll('table, .plot, figure')]
            .filter(e => e.getBoundingClientRect().right > {A4_PX} + 1).map(e => e.textContent.slice(0, 40))"""
        )
        assert too_wide == []
        assert page.locator("nav").is_hidden()
        printed = page.pdf(prefer_css_page_size=True)
    assert printed.startswith(b"%PDF")
    assert 5 <= len(re.findall(rb"/Type\s*/Page\b", printed)) <= 14


@pytest.mark.parametrize("case", ["six joints", "two joints swept"])
def test_the_scene_is_in_the_page_and_needs_no_network(browser, tmp_path, case):
    file = tmp_path / "report.html"
    file.write_text(report_html(NAMED[case]()), encoding="utf-8")
    page = browser.new_page(viewport={"width": 1200, "height": 800})
    asked, errors = [], []
    page.on("request", lambda r: asked.append(r.url) if r.url.startswith(("http", "ws", "//")) else None)
    page.on("console", lambda m: errors.append(m.text) if m.type == "error" else None)
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(file.as_uri())
    assert page.locator(".scene iframe").count() == 0
    page.locator("#scene").scroll_into_view_if_needed()
    frame = page.frame_locator(".scene iframe")
    frame.locator("canvas[data-engine]").wait_for(timeout=30_000)
    inside = page.frames[1]
    inside.wait_for_function("() => !!window.__viserMutable?.nodeRefFromName['/points/kept']", timeout=30_000)
    names = set(inside.evaluate("Object.keys(window.__viserMutable.nodeRefFromName)"))
    assert {"/arm/link6/body", "/floor"} <= names
    assert ("/diagnosis/dimensions/2_b_m" in names) == (case == "six joints")
    # What is in the frame can reach neither the page about it nor its file.
    assert inside.evaluate("(() => { try { return window.parent.document.title } catch { return null } })()") is None
    page.close()
    assert asked == []
    assert errors == []
