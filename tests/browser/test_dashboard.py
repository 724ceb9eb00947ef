"""An operator's way through the demo cell, in a real browser."""

import contextlib
import json
import re
from io import BytesIO
from pathlib import Path
from zipfile import ZipFile

import pytest

from app.dashboard import Dashboard
from app.sweep_progress import sweep_progress
from app.workbench import Workbench
from core.session import Session
from core.session_events import OperatorNamed
from core.session_store import SUFFIX
from core.twin import irb_l6
from core.twin.demo import demo_events

playwright = pytest.importorskip("playwright.sync_api")

READY = """() => { const m = window.__viserMutable;
  return !!m && !!m.canvas && m.canvas.width > 0 && !!document.querySelector('[data-testid=app-ready]') }"""
BROWSERS = ("/usr/bin/chromium", "/usr/bin/google-chrome", "/usr/bin/chromium-browser")
PATIENCE_MS = 30_000
LIST_MS = 3_000
GONE_CHART = "reading '_redrawFromAutoMarginCount'"
"""Plotly, as it tells the listeners of a chart that it is drawn, finds the chart taken off the page meanwhile: nobody
listens any more, and nothing is lost."""
"""So long an open list may take to show what is in it."""


@pytest.fixture(scope="module")
def chromium():
    path = next((name for name in BROWSERS if Path(name).exists()), None)
    assert path is not None, "no chromium on this machine; tests/run installs one"
    with playwright.sync_playwright() as run:
        browser = run.chromium.launch(executable_path=path, args=["--no-sandbox", "--enable-unsafe-swiftshader"])
        yield browser
        browser.close()


@pytest.fixture
def dashboard(tmp_path):
    running = started(tmp_path / f"demo{SUFFIX}")
    yield running
    running.stop()


def started(path, port: int = 0) -> Dashboard:
    cell = irb_l6.cell()
    session = Session.open(path) if path.exists() else Session.create(path, demo_events(cell), by="A. Operator")
    return Dashboard(Workbench(session, cell), port=port)


def visit(chromium, dashboard: Dashboard):
    page = chromium.new_page(viewport={"width": 1440, "height": 860})
    page.set_default_timeout(PATIENCE_MS)
    page.problems = []
    page.on("pageerror", lambda error: page.problems.append(str(error)) if GONE_CHART not in str(error) else None)
    page.goto(f"http://127.0.0.1:{dashboard.port}/?fixedDpr=0.4")
    page.wait_for_function(READY)
    notice = page.locator(".mantine-Notification-root", has_text="Software WebGL")
    if notice.count():
        notice.get_by_role("button").click()
    return page


@pytest.fixture
def page(chromium, dashboard):
    one = visit(chromium, dashboard)
    yield one
    assert one.problems == []
    one.close()


def press(page, name: str) -> None:
    page.get_by_role("button", name=name, exact=True).filter(visible=True).first.click()


def group(page, name: str) -> None:
    page.get_by_text(name, exact=True).filter(visible=True).first.click()


def tab(page, name: str) -> None:
    page.get_by_role("tab", name=name).click()


def choose(page, label: str, option: str) -> None:
    """Choose from a list; where the list closes again before it can be read, open it once more."""
    wanted = page.get_by_role("option", name=option, exact=True).filter(visible=True)
    box = page.get_by_role("combobox", name=label, exact=True).filter(visible=True).last
    for _ in range(PATIENCE_MS // LIST_MS):
        box.click()
        try:
            wanted.click(timeout=LIST_MS)
            return
        except playwright.TimeoutError:
            page.keyboard.press("Escape")
    raise AssertionError(f"{label}: {option} cannot be chosen")


def folder(page, name: str) -> None:
    """Open a folder; a click that the page has not taken, as it was being drawn anew, is made again."""
    head = page.locator("div.mantine-Paper-root", has=page.locator("svg.tabler-icon")).filter(
        has_text=re.compile(f"^{re.escape(name)}$"), visible=True
    )
    for _ in range(PATIENCE_MS // LIST_MS):
        if head.last.locator(".tabler-icon-chevron-up").count():
            return
        head.last.click()
        with contextlib.suppress(playwright.TimeoutError):
            head.last.locator(".tabler-icon-chevron-up").wait_for(timeout=LIST_MS)
    raise AssertionError(f"the folder {name} does not open")


def fill(page, box, value: str, held) -> None:
    """Fill a box and wait until the server has it; ``held`` is the server's side of the box.

    A browser sends what it was given last, at most every 50 ms: so nothing else may be touched at once.
    """
    box.fill(value)
    until(page, lambda: held.value == (value if isinstance(held.value, str) else float(value)))
    page.wait_for_timeout(80)


def until(page, happened) -> None:
    """Wait for something on the server's side."""
    for _ in range(PATIENCE_MS // 20):
        if happened():
            return
        page.wait_for_timeout(20)
    raise AssertionError("it did not happen")


def wait_for_text(page, test_id: str, words: str) -> None:
    page.wait_for_function(
        "([id, words]) => document.querySelector(`[data-testid=${id}]`)?.innerText.includes(words)",
        arg=[test_id, words],
    )


def measure(page, times: int) -> None:
    for _ in range(times):
        before = page.get_by_test_id("step").inner_text()
        press(page, "Measure")
        page.wait_for_function(
            "before => document.querySelector('[data-testid=step]').innerText !== before", arg=before
        )


def test_from_an_empty_cell_to_an_exported_report(page, dashboard):
    bench = dashboard.bench
    tab(page, "2 Measure")
    wait_for_text(page, "step", "Joint 6: stop 1 of 17")
    measure(page, 6)
    assert len(bench.state.shots) == 6
    wait_for_text(page, "verdict", "If you stop now")
    assert page.evaluate("!!__viserMutable.nodeRefFromName['/arm/link6'] || !!__viserMutable.nodeRefFromName['/arm']")

    group(page, "Undo")
    wait_for_text(page, "step", "stop 6 of 17")
    assert len(bench.state.shots) == 5
    group(page, "Redo")
    wait_for_text(page, "step", "stop 7 of 17")

    dashboard.acquire.choose(bench.state.shots[2].id)
    wait_for_text(page, "shot", "chosen")
    group(page, "Exclude")
    page.get_by_role("alert").filter(has_text="choose one, or write").wait_for()
    choose(page, "Reason", "wrong target")
    group(page, "Exclude")
    wait_for_text(page, "shot", "excluded")
    assert bench.state.shots[2].verdict == "excluded"
    group(page, "Measure again")
    page.wait_for_function("() => !document.querySelector('[data-testid=shot]').innerText.includes('excluded')")
    assert bench.state.shots[-1].taken.replaces == bench.state.shots[2].id

    group(page, "Run all")
    wait_for_text(page, "step", "Nothing left to measure")
    assert all(row.finished for row in sweep_progress(bench.state))

    tab(page, "3 Solve")
    press(page, "Solve")
    page.wait_for_selector("[data-testid=noise]")
    found = bench.calibration
    assert page.get_by_test_id("noise").inner_text() == f"{found.estimate.noise_m * 1e3:.3f} mm"
    assert page.locator("[data-testid=findings] li").count() == len(found.findings)

    tab(page, "Geometry")
    wait_for_text(page, "table2", "Nominal")
    rows = page.locator("[data-testid=table2] tr").all_inner_texts()
    a_2 = next(row for row in rows if re.match(r"a\s*2\b", row.replace("\n", "")))
    assert f"{found.estimate.geometry.model.a_m[1] * 1e3:.1f}" in a_2
    for name in ("Residuals", "Drives"):
        tab(page, name)
        page.locator(".js-plotly-plot svg.main-svg").filter(visible=True).first.wait_for()

    tab(page, "4 Export")
    for label, ending in (
        ("Report (HTML)", "html"),
        ("Calibration (JSON)", "json"),
        ("Tables (XLSX)", "xlsx"),
        ("Points (CSV)", "csv"),
    ):
        with page.expect_download() as waiting:
            press(page, label)
        sent = waiting.value
        assert re.fullmatch(rf"\d{{4}}-\d\d-\d\d_\d{{6}}_trueaxis_calibration\.{ending}", sent.suggested_filename)
        content = Path(sent.path()).read_bytes()
        if ending == "json":
            assert json.loads(content)["noise_mm"] == pytest.approx(found.estimate.noise_m * 1e3)
        elif ending == "xlsx":
            assert "xl/workbook.xml" in ZipFile(BytesIO(content)).namelist()
        else:
            assert len(content) > 1000


def test_export_before_solving_says_what_to_do(page):
    tab(page, "4 Export")
    press(page, "Calibration (JSON)")
    page.get_by_role("alert").filter(has_text="Nothing is solved yet").wait_for()


def test_keys_measure_and_undo(page, dashboard):
    tab(page, "2 Measure")
    page.locator("canvas[data-engine]").click(position={"x": 20, "y": 20})
    page.keyboard.press("Space")
    wait_for_text(page, "step", "stop 2 of 17")
    page.keyboard.press("Backspace")
    wait_for_text(page, "step", "stop 1 of 17")
    assert dashboard.bench.state.shots == ()


def test_one_browser_acts_and_the_other_watches(chromium, dashboard, page):
    watcher = visit(chromium, dashboard)
    try:
        wait_for_text(watcher, "seat", "You are watching")
        wait_for_text(page, "seat", "You hold the operator's seat")
        tab(watcher, "2 Measure")
        tab(page, "2 Measure")
        press(watcher, "Measure")
        watcher.get_by_role("alert").filter(has_text="Another browser holds").wait_for()
        assert dashboard.bench.state.shots == ()
        measure(page, 1)
        wait_for_text(watcher, "step", "stop 2 of 17")
        press(watcher, "Ask for the operator's seat")
        press(page, "Give the seat")
        wait_for_text(watcher, "seat", "You hold the operator's seat")
        measure(watcher, 1)
        assert len(dashboard.bench.state.shots) == 2
    finally:
        watcher.close()


def test_reload_in_the_middle_of_a_sweep(page, dashboard):
    tab(page, "2 Measure")
    measure(page, 3)
    page.reload()
    page.wait_for_function(READY)
    tab(page, "2 Measure")
    wait_for_text(page, "step", "stop 4 of 17")
    wait_for_text(page, "seat", "You hold the operator's seat")
    measure(page, 1)
    assert len(dashboard.bench.state.shots) == 4


def test_the_server_comes_back_at_the_same_stop(chromium, tmp_path):
    path = tmp_path / f"demo{SUFFIX}"
    first = started(path)
    port = first.port
    page = visit(chromium, first)
    tab(page, "2 Measure")
    measure(page, 3)
    first.stop()
    second = started(path, port)
    try:
        # The page connects again by itself and is drawn anew, from its first tab.
        page.get_by_test_id("cell").wait_for()
        tab(page, "2 Measure")
        wait_for_text(page, "step", "stop 4 of 17")
        measure(page, 1)
        assert len(second.bench.state.shots) == 4
    finally:
        page.close()
        second.stop()


def test_hostile_names_are_shown_as_they_are(chromium, dashboard):
    name = "<img src=x onerror='window.hacked=1'><script>window.hacked=1</script>"
    dashboard.bench.session.append(OperatorNamed(name))
    dashboard.bench.changed()
    page = visit(chromium, dashboard)
    try:
        tab(page, "1 Cell")
        wait_for_text(page, "cell", "<img src=x")
        assert page.evaluate("window.hacked") is None
        assert page.problems == []
    finally:
        page.close()


def test_check_the_instrument_then_begin_a_new_session(page, dashboard):
    tab(page, "Check")
    press(page, "Check")
    wait_for_text(page, "check", "8 shots at T1")
    tab(page, "2 Measure")
    measure(page, 2)
    first = dashboard.bench.session.path.name
    tab(page, "1 Cell")
    folder(page, "New session")
    press(page, "Begin")
    page.wait_for_function(
        "first => !document.querySelector('[data-testid=cell]').innerText.includes(first)", arg=first
    )
    tab(page, "2 Measure")
    wait_for_text(page, "step", "stop 1 of 17")
    assert dashboard.bench.state.shots == ()
    assert dashboard.bench.session.path.name != first
