"""The Gap tab in a real browser, with diagnoses made by hand.

Pictures are written to the folder that TRUEAXIS_SCREENSHOTS names.
"""

import json
import os
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import pytest

from app.dashboard import Dashboard
from app.gap_bench import LEAST_POINTS
from app.workbench import Workbench
from core.errors import CampaignError
from core.gap.verdict_words import verdict_sentence
from core.session import Session
from core.session_campaign import open_campaign
from core.session_store import SUFFIX
from core.twin import irb_l6
from core.twin.demo import demo_events
from tests.app import in_thread
from tests.app.command_line import SAMPLES
from tests.browser.test_dashboard import chromium, press, tab, visit, wait_for_text  # noqa: F401
from tests.core import gap_reports
from tests.core.test_campaign_archive import packed, sample

SCREENSHOTS = os.environ.get("TRUEAXIS_SCREENSHOTS", "")


@pytest.fixture
def diagnose(monkeypatch):
    """What the diagnosis is to return; a callable that may be replaced."""
    module = ModuleType("core.gap.diagnosis")

    def diagnose(campaign, arm=None, told=None, progress=None):
        progress(0.3, "looking for effects")
        return made_for(campaign)

    module.diagnose = diagnose
    monkeypatch.setitem(sys.modules, "core.gap.diagnosis", module)
    monkeypatch.setattr("app.beside.started", in_thread.started)
    return module


def made_for(campaign):
    """Three causes found in whatever was measured."""
    return gap_reports.explained(campaign)


@pytest.fixture
def dashboard(tmp_path):
    """A session with everything measured."""
    running = Dashboard(Workbench(open_campaign(SAMPLES / "irb_l6", tmp_path / f"gap{SUFFIX}")), port=0)
    yield running
    running.stop()


@pytest.fixture
def page(chromium, dashboard):  # noqa: F811
    one = visit(chromium, dashboard)
    yield one
    assert one.problems == []
    one.close()


def shot(page, name: str) -> None:
    if SCREENSHOTS:
        page.screenshot(path=str(Path(SCREENSHOTS) / f"{name}.png"))


def test_the_tab_comes_with_the_points(chromium, tmp_path):  # noqa: F811
    cell = irb_l6.cell()
    session = Session.create(tmp_path / f"new{SUFFIX}", demo_events(cell), by="A. Operator")
    running = Dashboard(Workbench(session, cell), port=0)
    page = visit(chromium, running)
    try:
        assert page.get_by_role("tab", name="Gap").count() == 0
        for _ in range(LEAST_POINTS):
            running.bench.shooting.measure()
        page.get_by_role("tab", name="Gap").first.wait_for()
    finally:
        page.close()
        running.stop()


def test_diagnose_read_switch_and_download(page, dashboard, diagnose):
    page.get_by_role("tab", name="Gap").first.click()
    wait_for_text(page, "gap-verdict", "Nothing is diagnosed yet")
    press(page, "Diagnose")
    wait_for_text(page, "gap-verdict", "explained")
    report = dashboard.gap.panel._drawn.report
    assert verdict_sentence(report).replace(" -", " \u2212") in page.get_by_test_id("gap-verdict").inner_text()
    rows = page.locator("[data-testid=gap-causes] tr").all_inner_texts()
    assert len(rows) == 1 + len(report.causes)
    assert "or flexure of link 1" in rows[1]
    page.get_by_role("tab", name="Gap").last.click()
    page.locator(".js-plotly-plot svg.main-svg").filter(visible=True).first.wait_for()
    page.wait_for_function("() => !!window.__viserMutable.nodeRefFromName['/gap/as_it_is/arrows']")
    shot(page, "gap_tab")

    page.get_by_label("backlash of joint 3").filter(visible=True).check()
    page.wait_for_function("() => !!window.__viserMutable.nodeRefFromName['/gap/with_causes/arrows']")
    page.wait_for_function("() => !window.__viserMutable.nodeRefFromName['/gap/as_it_is/arrows']")
    shot(page, "gap_tab_added")

    for label, ending in (("gap.json", "json"), ("Report (HTML)", "html")):
        with page.expect_download() as waiting:
            press(page, label)
        content = Path(waiting.value.path()).read_bytes()
        assert waiting.value.suggested_filename.endswith(f"_trueaxis_gap.{ending}")
        if ending == "json":
            assert json.loads(content)["verdict"] == "explained"
        else:
            assert b"Sim-to-real gap" in content


def test_shots_that_are_left_out_afterwards_make_it_old(page, dashboard, diagnose):
    page.get_by_role("tab", name="Gap").first.click()
    press(page, "Diagnose")
    wait_for_text(page, "gap-verdict", "explained")
    dashboard.bench.decisions.exclude(dashboard.bench.state.shots[0].id, "bumped")
    wait_for_text(page, "gap-verdict", "diagnose again")


def test_what_goes_wrong_is_said_and_the_bar_goes_away(page, dashboard, diagnose):
    def refuse(campaign, arm=None, told=None, progress=None):
        raise CampaignError("the campaign says nothing of its joints")

    diagnose.diagnose = refuse
    page.get_by_role("tab", name="Gap").first.click()
    press(page, "Diagnose")
    page.get_by_role("alert").filter(has_text="says nothing of its joints").wait_for()
    wait_for_text(page, "gap-verdict", "Nothing is diagnosed yet")
    assert not dashboard.gap.panel._bar.visible


def test_another_campaign_comes_in_a_zip_file_and_its_texts_stay_texts(page, dashboard, diagnose, tmp_path):
    hostile = "<img src=x onerror='window.hacked=1'>"
    diagnose.diagnose = lambda campaign, arm=None, told=None, progress=None: replace(
        gap_reports.hostile(hostile), campaign=gap_reports.renamed(campaign, hostile)
    )
    page.get_by_role("tab", name="Gap").first.click()
    page.get_by_text("Another campaign", exact=True).filter(visible=True).click()
    file = tmp_path / "irb_l6.zip"
    file.write_bytes(packed(sample()))
    with page.expect_file_chooser() as choosing:
        press(page, "Diagnose a campaign (ZIP)")
    choosing.value.set_files(str(file))
    wait_for_text(page, "gap-verdict", "Of irb_l6.zip")
    page.get_by_role("tab", name="Gap").last.click()
    page.locator(".js-plotly-plot svg.main-svg").filter(visible=True).first.wait_for()
    assert page.evaluate("window.hacked") is None
    assert not page.evaluate("!!window.__viserMutable.nodeRefFromName['/gap/as_it_is/arrows']")
    shot(page, "gap_tab_upload")


def test_both_themes(page, dashboard, diagnose):
    tab(page, "View")
    page.get_by_label("Dark theme").check()
    page.get_by_role("tab", name="Gap").first.click()
    press(page, "Diagnose")
    wait_for_text(page, "gap-verdict", "explained")
    page.get_by_role("tab", name="Gap").last.click()
    page.locator(".js-plotly-plot svg.main-svg").filter(visible=True).first.wait_for()
    shot(page, "gap_tab_dark")
