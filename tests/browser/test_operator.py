"""The less smooth ways of an operator in a real browser: wrong inputs, pauses, any order, clicks in 3-D, two seats."""

import contextlib
import re

import numpy as np
import pytest
from test_dashboard import (  # noqa: F401
    LIST_MS,
    READY,
    choose,
    chromium,
    fill,
    folder,
    group,
    measure,
    playwright,
    press,
    started,
    tab,
    until,
    visit,
    wait_for_text,
)
from test_own_cell import alert, text_box

from core.session_store import SUFFIX

PROJECT = """p => { const m = __viserMutable, v = m.camera.position.clone().set(...p);
  v.applyMatrix4(m.nodeRefFromName['/points'].matrixWorld).project(m.camera);
  const r = m.canvas.getBoundingClientRect();
  return [r.left + (v.x + 1) / 2 * r.width, r.top + (1 - v.y) / 2 * r.height] }"""

POINTED_AT = "() => document.querySelector('canvas[data-engine]').style.cursor === 'pointer'"
CHOSEN = "() => document.querySelector('[data-testid=shot]').innerText.includes('chosen')"

LAYOUT = """() => {
  const wrong = [], shown = e => e.offsetParent && e.getBoundingClientRect().width > 0;
  const name = e => e.dataset.testid || e.title || e.innerText?.trim().slice(0, 30) || e.tagName;
  const seen = e => {
    let { left, right, top, bottom } = e.getBoundingClientRect();
    const viewport = '[data-scrollarea-viewport]';
    for (let p = e.closest(viewport); p; p = p.parentElement.closest(viewport)) {
      const window_ = p.getBoundingClientRect();
      top = Math.max(top, window_.top); bottom = Math.min(bottom, window_.bottom) }
    return { left, right, top, bottom } };
  const meet = (a, b) => Math.min(a.right, b.right) - Math.max(a.left, b.left) > 2
    && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 2;
  for (const e of document.querySelectorAll('.ta, .ta table'))
    if (shown(e) && e.scrollWidth > e.clientWidth + 1) wrong.push(`${name(e)} is clipped`);
  const regions = [...document.querySelectorAll('[data-dock-region]')];
  const [left, right] = ['left', 'right'].map(side => regions.find(r => r.dataset.dockRegion === side));
  const room = right.getBoundingClientRect().left - left.getBoundingClientRect().right;
  if (room < 400) wrong.push(`only ${room} pixels are left for the scene`);
  for (const region of regions) {
    const place = region.getBoundingClientRect();
    const kinds = 'button:not([tabindex="-1"]), input:not([type=hidden]), textarea, .ta, [role=tab]';
    const pieces = [...region.querySelectorAll(kinds)].filter(shown).map(e => [e, seen(e)]);
    for (const [e, box] of pieces)
      if (box.left < place.left - 1 || box.right > place.right + 1) wrong.push(`${name(e)} leaves its panel`);
    pieces.forEach(([a, one], k) => pieces.slice(k + 1).forEach(([b, other]) => {
      if (!a.contains(b) && !b.contains(a) && meet(one, other)) wrong.push(`${name(a)} lies on ${name(b)}`);
    }));
  }
  return wrong }"""
"""What does not stand as it should: pieces clipped, outside of their panel, or on top of each other."""


@pytest.fixture
def dashboard(tmp_path):
    running = started(tmp_path / f"demo{SUFFIX}")
    yield running
    running.stop()


@pytest.fixture
def page(chromium, dashboard):  # noqa: F811
    one = visit(chromium, dashboard)
    yield one
    assert one.problems == []
    one.close()


def test_who_and_what_are_kept_checked_and_signed(page, dashboard):
    start = dashboard.start
    warmth, load = text_box(page, r"Air temperature \[°C\]"), text_box(page, r"Payload \[kg\]")
    fill(page, text_box(page, "Operator"), "B. Somebody", start._who)
    fill(page, warmth, "warm", start._conditions["temperature_c"])
    press(page, "Keep these")
    alert(page, "expected a number from -60 to 100")
    assert dashboard.bench.state.operator != "B. Somebody"
    fill(page, warmth, "22.5", start._conditions["temperature_c"])
    fill(page, load, "3", start._conditions["payload_kg"])
    # A scanner types faster than a browser sends, and ends with Enter.
    text_box(page, "Robot serial number").press_sequentially("SN-12345", delay=0)
    page.keyboard.press("Enter")
    until(page, lambda: start._facts["Robot serial number"].value == "SN-12345")
    page.wait_for_timeout(80)
    press(page, "Keep these")
    wait_for_text(page, "cell", "22.5")
    wait_for_text(page, "cell", "SN-12345")
    tab(page, "2 Measure")
    measure(page, 1)
    shot = dashboard.bench.state.shots[0]
    assert (shot.by, shot.taken.payload_kg) == ("B. Somebody", 3.0)


def test_a_run_is_paused_gone_on_with_and_stopped(page, dashboard):
    dashboard.bench.robot._seconds = 0.2
    tab(page, "2 Measure")
    group(page, "Run all")
    wait_for_text(page, "run", "The robot runs the whole plan")
    group(page, "Undo")
    alert(page, "The robot is running")
    page.locator("canvas[data-engine]").click(position={"x": 40, "y": 600})
    page.keyboard.press("p")
    wait_for_text(page, "run", "Paused")
    taken = len(dashboard.bench.state.shots)
    page.wait_for_timeout(600)
    assert len(dashboard.bench.state.shots) == taken
    page.keyboard.press("p")
    wait_for_text(page, "run", "The robot runs the whole plan")
    page.keyboard.press("Escape")
    page.wait_for_function("() => document.querySelector('[data-testid=run]').innerText.trim() === ''")
    stopped = len(dashboard.bench.state.shots)
    assert stopped < 129
    page.wait_for_timeout(600)
    assert len(dashboard.bench.state.shots) == stopped


def test_sweeps_are_made_in_any_order_with_extra_stops_and_skips(page, dashboard):
    bench = dashboard.bench
    tab(page, "2 Measure")
    page.locator("[data-say='sweep-4-1']").click()
    wait_for_text(page, "step", "Joint 4: stop 1 of 16, target T2")
    measure(page, 2)
    assert [shot.taken.target for shot in bench.state.shots] == ["T2", "T1"]
    group(page, "Skip")
    wait_for_text(page, "sweeps", "1 skipped")
    wait_for_text(page, "undo", "the skipping of joint 4, stop 2")
    folder(page, "Extra stop")
    choose(page, "Sweep", "joint 4, sweep 1")
    command = page.get_by_label("Command [° or mm]", exact=True).filter(visible=True).first
    fill(page, command, "12.5", dashboard.acquire._extra._at)
    press(page, "Measure extra stop")
    wait_for_text(page, "sweeps", "2 extra")
    assert np.rad2deg(bench.state.shots[-1].taken.commanded[3]) == pytest.approx(12.5, abs=1e-3)
    fill(page, command, "300", dashboard.acquire._extra._at)
    press(page, "Measure extra stop")
    alert(page, "beyond its limits -90 to 90 deg")


def test_a_point_is_chosen_by_click_excluded_for_a_reason_and_the_solution_follows(page, dashboard):
    bench = dashboard.bench
    tab(page, "2 Measure")
    group(page, "Run all")
    wait_for_text(page, "step", "Nothing left to measure")
    tab(page, "3 Solve")
    press(page, "Solve")
    page.wait_for_selector("[data-testid=noise]")
    before = bench.calibration.estimate.noise_m
    tab(page, "2 Measure")
    chosen = click_a_shot(page, dashboard)
    choose(page, "Reason", "in my own words")
    fill(page, text_box(page, "In my words"), "<b>a bird</b> sat on it", dashboard.acquire._words)
    group(page, "Exclude")
    wait_for_text(page, "shot", "<b>a bird</b> sat on it")
    shot = bench.state.shot(chosen)
    assert (shot.verdict, shot.reason) == ("excluded", "<b>a bird</b> sat on it")
    tab(page, "3 Solve")
    wait_for_text(page, "stale", "One shot or decision since the last solution")
    press(page, "Solve")
    page.wait_for_function("() => !document.querySelector('[data-testid=stale]')")
    assert page.get_by_test_id("solution").inner_text().startswith("128 points used")
    assert page.get_by_test_id("noise").inner_text() == f"{bench.calibration.estimate.noise_m * 1e3:.3f} mm"
    assert bench.calibration.estimate.noise_m != before
    page.locator("summary", has_text="What changed").click()
    assert "points used: 129 → 128" in page.get_by_test_id("changes").inner_text()
    tab(page, "2 Measure")
    group(page, "Undo")
    wait_for_text(page, "shot", "kept")


def click_a_shot(page, dashboard) -> int:
    """Click shots in 3-D until one is chosen; its id."""
    bench = dashboard.bench
    for shot in bench.state.shots[40:100:6]:
        x, y = page.evaluate(PROJECT, list(shot.taken.point_m))
        page.mouse.move(x, y)
        # Another shot may lie in front of this one, or the arm: the next one is tried then.
        with contextlib.suppress(playwright.TimeoutError):
            page.wait_for_function(POINTED_AT, timeout=LIST_MS)
            page.mouse.click(x, y)
            page.wait_for_function(CHOSEN, timeout=LIST_MS)
            record = int(re.search(r"Record (\d+)", page.get_by_test_id("shot").inner_text())[1])
            return next(one.id for one in bench.state.shots if one.record == record)
    raise AssertionError("no shot could be clicked")


def test_the_family_of_a_drive_is_chosen_and_limits_are_counted(page, dashboard):
    bench = dashboard.bench
    tab(page, "2 Measure")
    group(page, "Run all")
    wait_for_text(page, "step", "Nothing left to measure")
    tab(page, "3 Solve")
    folder(page, "Families of drives and couplings")
    choose(page, "Drive of joint 1", "harmonics_2")
    page.wait_for_timeout(400)
    press(page, "Solve")
    page.wait_for_selector("[data-testid=noise]")
    assert bench.calibration.estimate.transmissions[0].form.name == "harmonics_2"
    tab(page, "Geometry")
    limit = page.get_by_label("Limit for lengths [mm]", exact=True).filter(visible=True)
    fill(page, limit, "1000", dashboard.results._limits["limit_length_mm"])
    press(page, "Keep limits")
    wait_for_text(page, "limits", "0 beyond")
    assert bench.state.settings["limit_length_mm"] == 1000.0


def test_the_seat_is_asked_for_refused_given_and_kept_over_a_reload(chromium, dashboard, page):  # noqa: F811
    watcher = visit(chromium, dashboard)
    try:
        press(watcher, "Ask for the operator's seat")
        press(page, "Keep the seat")
        alert(watcher, "The operator keeps the seat")
        wait_for_text(watcher, "seat", "You are watching")
        page.reload()
        page.wait_for_function(READY)
        wait_for_text(page, "seat", "You hold the operator's seat")
        wait_for_text(watcher, "seat", "You are watching")
        dashboard.seat._answer_s = 0.5
        press(watcher, "Ask for the operator's seat")
        wait_for_text(watcher, "seat", "You hold the operator's seat")
        wait_for_text(page, "seat", "You are watching")
        dashboard.seat._away_s = 0.3
        watcher.close()
        wait_for_text(page, "seat", "You hold the operator's seat")
    finally:
        watcher.close()


def test_help_opens_on_a_key_and_terms_explain_themselves(page):
    page.locator("canvas[data-engine]").click(position={"x": 40, "y": 600})
    page.keyboard.press("h")
    dialog = page.get_by_role("dialog")
    dialog.wait_for()
    assert "Measure the next shot" in dialog.inner_text()
    assert "Transmission error" in dialog.inner_text()
    press(page, "Close")
    dialog.wait_for(state="detached")
    tab(page, "2 Measure")
    assert page.locator("th abbr", has_text="Targets").get_attribute("title").startswith("A point that the instrument")


def test_keys_do_what_the_list_says(page, dashboard):
    bench = dashboard.bench
    tab(page, "2 Measure")
    page.locator("canvas[data-engine]").click(position={"x": 40, "y": 600})
    for key, words in (("Space", "stop 2 of"), ("Enter", "stop 3 of"), ("k", "stop 4 of"), ("Backspace", "stop 3 of")):
        page.keyboard.press(key)
        wait_for_text(page, "step", words)
    page.keyboard.press("y")
    wait_for_text(page, "step", "stop 4 of")
    page.keyboard.press("r")
    page.wait_for_function(
        "() => document.querySelector('[data-testid=undo]').innerText.includes('second measurement')"
    )
    assert sum(shot.counts for shot in bench.state.shots) == 2
    # While somebody types, keys are letters.
    tab(page, "1 Cell")
    text_box(page, "Operator").press_sequentially("sky r", delay=60)
    page.wait_for_timeout(300)
    assert len(bench.state.shots) == 3
    # A key is pressed once, also where a button has the focus.
    tab(page, "2 Measure")
    measure(page, 1)
    page.keyboard.press("Space")
    wait_for_text(page, "step", "stop 6 of")
    page.wait_for_timeout(400)
    assert len(bench.state.shots) == 5


@pytest.mark.parametrize(
    ("width", "height", "dark"), [(1366, 768, False), (1366, 768, True), (1920, 1080, False), (2560, 1440, True)]
)
def test_nothing_is_clipped_or_overlaps(chromium, dashboard, width, height, dark):  # noqa: F811
    page = visit(chromium, dashboard)
    page.set_viewport_size({"width": width, "height": height})
    if dark:
        tab(page, "View")
        page.get_by_label("Dark theme", exact=True).filter(visible=True).check()
        page.wait_for_function("() => document.documentElement.dataset.mantineColorScheme === 'dark'")
    tab(page, "1 Cell")
    for name in ("Targets", "Instrument and points", "Sweeps", "New session", "Sessions"):
        folder(page, name)
    stands_well(page, "1 Cell, all open")
    tab(page, "2 Measure")
    measure(page, 2)
    group(page, "Skip")
    wait_for_text(page, "sweeps", "1 skipped")
    stands_well(page, "2 Measure, begun")
    group(page, "Run all")
    wait_for_text(page, "step", "Nothing left to measure")
    tab(page, "3 Solve")
    press(page, "Solve")
    page.wait_for_selector("[data-testid=noise]")
    for name in page.evaluate("[...document.querySelectorAll('[role=tab]')].map(tab => tab.title)"):
        page.get_by_role("tab", name=name, exact=True).first.click()
        stands_well(page, name)
    assert page.problems == []
    page.close()


def test_a_table_of_long_spans_and_of_sliding_joints_fits(page):
    folder(page, "New session")
    choose(page, "Robot", "demo: SCARA, laser tracker")
    press(page, "Begin")
    wait_for_text(page, "cell-intro", "SCARA")
    tab(page, "2 Measure")
    wait_for_text(page, "sweeps", "220 mm")
    measure(page, 1)
    stands_well(page, "2 Measure")


def stands_well(page, where: str) -> None:
    """Nothing is wider than its place, nothing lies on something else, and the scene keeps its share."""
    wrong = page.evaluate(LAYOUT)
    for _ in range(50):
        if not wrong:
            break
        # Folders open slowly.
        page.wait_for_timeout(100)
        wrong = page.evaluate(LAYOUT)
    assert wrong == [], where
