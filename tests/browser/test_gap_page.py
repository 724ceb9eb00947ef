"""The page of a diagnosis in a browser, from a file and without a network."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from app.gap_report import gap_html, gap_page
from core.gap.result import GapReport
from tests.app.report_cases import HOSTILE
from tests.browser.test_report import A4_PX, ARGUMENTS, CHROMIUM, pytestmark  # noqa: F401
from tests.core import gap_reports

WEBGL = ["--enable-unsafe-swiftshader", "--use-gl=angle", "--use-angle=swiftshader", "--ignore-gpu-blocklist"]
MADE = ("explained", "partly_explained", "unexplained", "no_gap", "barely_known")
SIZES = ((1366, 768), (2560, 1440))


@pytest.fixture(scope="module")
def browser():
    from playwright.sync_api import sync_playwright

    drawing = [one for one in ARGUMENTS if one != "--disable-gpu"]
    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=CHROMIUM, args=[*drawing, *WEBGL])
        yield running
        running.close()


@contextmanager
def opened(browser, folder: Path, report: GapReport, size: tuple[int, int] = SIZES[0], **options) -> Iterator:
    """The page, opened from a file; fails on any error and on any request but for the file."""
    file = folder / "report.html"
    file.write_text(gap_html(report), encoding="utf-8")
    page = browser.new_page(viewport={"width": size[0], "height": size[1]}, **options)
    asked, complaints = [], []
    page.on("request", lambda r: asked.append(r.url) if r.url.startswith(("http", "ws", "//")) else None)
    page.on("console", lambda m: complaints.append(m.text) if m.type == "error" else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto(file.as_uri())
    try:
        yield page
    finally:
        page.close()
    assert asked == []
    assert complaints == []


@pytest.mark.parametrize("name", MADE)
def test_every_figure_is_drawn(browser, tmp_path, name):
    report = getattr(gap_reports, name)()
    with opened(browser, tmp_path, report) as page:
        plots = sum(len(section.plots) for section in gap_page(report).sections)
        assert page.locator(".js-plotly-plot").count() == plots
        assert page.locator(".lead").inner_text() == gap_page(report).lead


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_nothing_hangs_over_the_edge(browser, tmp_path, size, scheme):
    with opened(browser, tmp_path, gap_reports.explained(), size, color_scheme=scheme) as page:
        assert page.evaluate("document.documentElement.scrollWidth") <= size[0]
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


def test_a_switch_shows_the_arrows_of_its_choice_and_no_others(browser, tmp_path):
    shown = """() => [...document.querySelectorAll('.js-plotly-plot')].flatMap(p => p.data)
        .filter(t => t.meta && t.visible !== false).map(t => t.meta.mask)"""
    with opened(browser, tmp_path, gap_reports.explained()) as page:
        boxes = page.locator(".switches input")
        assert boxes.count() == 3
        assert set(page.evaluate(shown)) == {0}
        boxes.nth(0).check()
        boxes.nth(2).check()
        assert set(page.evaluate(shown)) == {5}
        boxes.nth(0).uncheck()
        assert set(page.evaluate(shown)) == {4}


def test_texts_from_files_do_nothing(browser, tmp_path):
    with opened(browser, tmp_path, gap_reports.hostile(HOSTILE)) as page:
        page.locator(".switches input").first.check()
        assert page.evaluate("window.broken") is None
        assert page.locator("body img").count() == 0
        assert page.locator("h1").text_content() == HOSTILE


def test_it_fits_on_a4(browser, tmp_path):
    with opened(browser, tmp_path, gap_reports.explained(), (A4_PX, 900)) as page:
        page.emulate_media(media="print")
        too_wide = page.evaluate(
            f"""[...document.querySelectorAll('table, .plot, figure')]
            .filter(e => e.getBoundingClientRect().right > {A4_PX} + 1).map(e => e.textContent.slice(0, 40))"""
        )
        assert too_wide == []
        assert page.locator(".switches").first.is_hidden()
