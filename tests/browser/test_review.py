"""Reviewing a solution in a real browser: what is clicked is shown where it is, and points are excluded by a click."""

import time

import numpy as np
import pytest

from app.dashboard import Dashboard
from app.scene.cameras import UP, Camera, fly_to
from app.scene.colours import HIGHLIGHT
from app.spots import spot_of
from app.workbench import Workbench
from core.arm import carry
from core.session import Session
from core.session_store import SUFFIX
from core.twin import irb_l6
from core.twin.demo import demo_events
from tests.browser.test_dashboard import chromium, group, press, tab, visit, wait_for_text  # noqa: F401

MIDDLE = """() => { const r = __viserMutable.canvas.getBoundingClientRect();
  return [r.left + r.width / 2, r.top + r.height / 2] }"""
POINTS = """() => { let n = 0; __viserMutable.nodeRefFromName['/points/kept']?.traverse(o => {
  n = Math.max(n, o.instancesCount ?? 0) }); return n }"""
PLOT = "() => [...document.querySelectorAll('.js-plotly-plot')].find(p => p.offsetParent)?.layout.title.text ?? ''"
SEEN_AT = """([name, place]) => { const m = __viserMutable, o = m.nodeRefFromName[name];
  o.updateWorldMatrix(true, false);
  const v = o.position.clone().set(...place).applyMatrix4(o.matrixWorld).project(m.camera);
  return [v.x, v.y] }"""
OPEN = "() => [...document.querySelectorAll('[role=tab][aria-selected=true]')].map(tab => tab.title)"
BACK = """before => JSON.parse(before).every((value, k) =>
  Math.abs(value - __viserMutable.nodeRefFromName['/arm/link6'].matrixWorld.elements[k]) < 1e-6)"""
ARM = "() => JSON.stringify(__viserMutable.nodeRefFromName['/arm/link6'].matrixWorld.elements)"


@pytest.fixture(scope="module")
def dashboard(tmp_path_factory):
    cell = irb_l6.cell()
    path = tmp_path_factory.mktemp("review") / f"demo{SUFFIX}"
    running = Dashboard(Workbench(Session.create(path, demo_events(cell), by="A. Operator"), cell))
    running.bench.runs.run(True)
    running.bench.solving.solve()
    yield running
    running.stop()


@pytest.fixture
def page(chromium, dashboard):  # noqa: F811
    one = visit(chromium, dashboard)
    yield one
    assert one.problems == []
    one.close()


def until(condition, seconds: float = 30.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.05)


def client_of(dashboard: Dashboard):
    return max(dashboard.server.get_clients().items())[1]


def stands_at(client, camera: Camera) -> bool:
    return bool(np.allclose(client.camera.position, camera.fitting(client.camera.aspect).position_m, atol=1e-3))


def colour_of(dashboard: Dashboard, node: str) -> tuple[int, ...]:
    return tuple(dashboard.server.scene.get_handle_by_name(node).color)


def choose(page, option: str) -> None:
    page.get_by_label("Show", exact=True).filter(visible=True).click()
    page.get_by_role("option", name=option).click()


def test_a_row_of_table_2_is_flown_to_and_lit(page, dashboard):
    tab(page, "Geometry")
    page.locator("[data-say='2-a_m']").click()
    until(lambda: dashboard.cell._diagnosis is not None)
    until(lambda: stands_at(client_of(dashboard), dashboard.cell._diagnosis.camera(2, "a_m")))
    assert colour_of(dashboard, "/diagnosis/dimensions/2_a_m") == HIGHLIGHT
    assert colour_of(dashboard, "/diagnosis/dimensions/2_b_m") != HIGHLIGHT
    page.locator("[data-say='2-b_m']").focus()
    page.keyboard.press("Enter")
    until(lambda: colour_of(dashboard, "/diagnosis/dimensions/2_b_m") == HIGHLIGHT)
    page.keyboard.press("Enter")
    until(lambda: colour_of(dashboard, "/diagnosis/dimensions/2_b_m") != HIGHLIGHT)
    until(lambda: stands_at(client_of(dashboard), dashboard.cell._diagnosis.overview()))


def test_a_finding_about_a_drive_shows_its_axis(page, dashboard):
    tab(page, "3 Solve")
    finding = next(f for f in dashboard.bench.calibration.findings if f.joint == 5)
    page.locator(f"[data-say='{spot_of(finding).word}']").first.click()
    until(lambda: colour_of(dashboard, "/axes/5/arrow") == HIGHLIGHT)
    camera = next(c for c in dashboard.cell.cameras() if c.name == "Joint 5")
    until(lambda: stands_at(client_of(dashboard), camera))
    assert not dashboard.cell._diagnosis or not dashboard.cell._diagnosis.visible


def test_who_watches_flies_but_changes_nothing_for_others(chromium, page, dashboard):  # noqa: F811
    dashboard.view.light(spot_of(next(f for f in dashboard.bench.calibration.findings if f.joint == 2)))
    watcher = visit(chromium, dashboard)
    try:
        wait_for_text(watcher, "seat", "You are watching")
        mine = client_of(dashboard)
        tab(watcher, "3 Solve")
        watcher.locator("[data-testid=findings] [data-say='5']").first.click()
        until(lambda: stands_at(mine, next(c for c in dashboard.cell.cameras() if c.name == "Joint 5")))
        assert colour_of(dashboard, "/axes/2/arrow") == HIGHLIGHT
        assert colour_of(dashboard, "/axes/5/arrow") != HIGHLIGHT
        tab(watcher, "View")
        watcher.get_by_label("Nominal arm as a ghost", exact=True).click()
        watcher.get_by_role("alert").filter(has_text="Another browser holds").wait_for()
        until(lambda: not dashboard.view._ghost.value)
        assert not dashboard.cell.ghost.visible
    finally:
        watcher.close()


def test_residuals_over_time_and_what_the_drives_do(page, dashboard):
    tab(page, "Residuals")
    page.wait_for_function(f"() => ({PLOT})().includes('Joint 6, sweep 1')")
    choose(page, "all sweeps over time")
    page.wait_for_function(f"() => ({PLOT})().includes('over time')")
    wait_for_text(page, "residuals", "129 points")
    choose(page, "joint 6, sweep 1")
    wait_for_text(page, "residuals", "17 points")
    tab(page, "Drives")
    wait_for_text(page, "drives", "Why:")
    tab(page, "Axes")
    page.wait_for_function(f"() => ({PLOT})().includes('How well')")


def test_a_tab_that_was_closed_shows_the_new_solution_when_it_is_opened(page, dashboard):
    tab(page, "Drives")
    page.wait_for_function(f"() => ({PLOT})().includes('Joint 1')")
    tab(page, "This sweep")
    shot = dashboard.bench.state.shots[3]
    dashboard.bench.decisions.exclude(shot.id, "a test")
    found = dashboard.bench.solving.solve()
    # Nobody asked through the page, so that the worker did not think ahead.
    tab(page, "Residuals")
    wait_for_text(page, "residuals", "16 points")
    assert dashboard.results.drawn is found
    dashboard.bench.decisions.include(shot.id)
    dashboard.bench.solving.solve()


def click_in_3d(page, dashboard, point) -> None:
    """Click a point as an operator does who has come close to it."""
    for view in (dashboard.cell.arm, dashboard.cell.ghost, dashboard.cell._axes, dashboard.cell.stations):
        view.visible = False
    fly_to(client_of(dashboard), Camera("close", point + np.array([0.15, 0.12, 0.08]), point, UP), 0.0)
    page.wait_for_timeout(1200)
    middle = page.evaluate(MIDDLE)
    page.mouse.move(*middle)
    page.wait_for_timeout(400)
    page.mouse.click(*middle)
    for view in (dashboard.cell.arm, dashboard.cell._axes, dashboard.cell.stations):
        view.visible = True


def choose_reason(page) -> None:
    page.get_by_label("Reason", exact=True).filter(visible=True).click()
    page.get_by_role("option", name="target was bumped").click()
    page.wait_for_timeout(200)


def test_a_point_is_chosen_by_a_click_excluded_and_brought_back(page, dashboard):
    bench = dashboard.bench
    again = bench.shooting.measure_again(bench.state.shots[40].id)
    kept = sum(shot.counts for shot in bench.state.shots)
    page.wait_for_function(f"() => ({POINTS})() === {kept}")
    tab(page, "2 Measure")
    click_in_3d(page, dashboard, np.array(again.taken.point_m))
    wait_for_text(page, "shot", f"Record {again.record}")
    assert open_tabs(page)[0] == "2 Measure"
    choose_reason(page)
    press(page, "Exclude")
    until(lambda: bench.state.shot(again.id).verdict == "excluded")
    page.wait_for_function(f"() => ({POINTS})() === {kept - 1}")
    press(page, "Undo")
    until(lambda: bench.state.shot(again.id).verdict == "kept")
    page.wait_for_function(f"() => ({POINTS})() === {kept}")
    dashboard.cell.choose(None)


def test_leaving_a_clicked_point_out_shows_what_that_changes_and_undo_brings_it_back(page, dashboard):
    bench = dashboard.bench
    before = bench.solving.solve()
    shot = next(s for s in bench.state.shots if s.counts and s.taken.joint == 2)
    tab(page, "View")
    click_in_3d(page, dashboard, np.array(shot.taken.point_m))
    wait_for_text(page, "chosen", f"Record {shot.record}")
    assert open_tabs(page)[0] == "3 Solve"
    assert dashboard.server.scene.get_handle_by_name("/points/chosen/name").text == f"record {shot.record}"
    press(page, "Exclude and solve again")
    page.get_by_role("alert").filter(has_text="for a reason").wait_for()
    assert bench.state.shot(shot.id).verdict == "kept"
    choose_reason(page)
    press(page, "Exclude and solve again")
    wait_for_text(page, "effect", f"Record {shot.record} left out: what changed")
    wait_for_text(page, "chosen", "Excluded: target was bumped")
    used = [int(found.refinement.residuals.used.sum()) for found in (before, bench.calibration)]
    assert used[1] == used[0] - 1
    wait_for_text(page, "effect", f"points used: {used[0]} → {used[1]}")
    noise = page.get_by_test_id("effect").inner_text()
    assert f"→ {bench.calibration.estimate.noise_m * 1e3:.3f} mm" in noise or "noise" not in noise
    press(page, "Undo and solve again")
    wait_for_text(page, "effect", "taken back")
    wait_for_text(page, "effect", f"points used: {used[1]} → {used[0]}")
    assert bench.state.shot(shot.id).verdict == "kept"
    assert bench.calibration.estimate.noise_m == pytest.approx(before.estimate.noise_m, rel=1e-9)
    click_in_3d(page, dashboard, np.array(shot.taken.point_m))
    page.wait_for_function("() => !document.querySelector('[data-testid=chosen]')?.offsetParent")
    assert dashboard.cell.chosen is None


def test_a_slider_moves_the_arm_and_a_button_brings_it_back(page, dashboard):
    tab(page, "View")
    group(page, "Pose that is drawn")
    page.wait_for_timeout(300)
    at_first = page.evaluate(ARM)
    page.get_by_role("slider").filter(visible=True).last.focus()
    for _ in range(5):
        page.keyboard.press("ArrowRight")
        page.wait_for_timeout(80)
    page.wait_for_function(f"before => ({ARM})() !== before", arg=at_first)
    moved = dashboard.cell.commanded[5] - dashboard.bench.robot.commanded[5]
    assert moved == pytest.approx(np.deg2rad(0.5), abs=np.deg2rad(0.06))
    press(page, "Back to the robot's pose")
    page.wait_for_function(BACK, arg=at_first)


def open_tabs(page) -> list[str]:
    page.wait_for_timeout(400)
    return page.evaluate(OPEN)


def test_a_step_brings_its_results_forward_and_a_later_choice_stays(page):
    for step, result in (("2 Measure", "This sweep"), ("3 Solve", "Residuals"), ("Verify", "Poses"), ("Gap", "Gap")):
        page.get_by_role("tab", name=step, exact=True).first.click()
        assert open_tabs(page) == [step, result]
    tab(page, "Axes")
    assert open_tabs(page) == ["Gap", "Axes"]
    tab(page, "3 Solve")
    press(page, "Solve")
    assert open_tabs(page) == ["3 Solve", "Axes"]
    tab(page, "Compensate")
    assert open_tabs(page) == ["Compensate", "Axes"]
    press(page, "Fill in test poses")
    page.wait_for_timeout(500)
    press(page, "Compensate")
    page.get_by_role("tab", name="Commands", exact=True).wait_for()
    assert open_tabs(page) == ["Compensate", "Commands"]


def test_a_view_can_be_asked_for_again_and_all_labels_of_axes_are_in_it(page, dashboard):
    tab(page, "View")
    arm = next(c for c in dashboard.cell.cameras() if c.name == "Arm")
    for _ in range(2):
        group(page, "All")
        until(lambda: not stands_at(client_of(dashboard), arm))
        group(page, "Arm")
        until(lambda: stands_at(client_of(dashboard), arm))
    page.wait_for_timeout(300)
    for joint in range(1, 7):
        label = dashboard.server.scene.get_handle_by_name(f"/axes/{joint}/label")
        seen = page.evaluate(SEEN_AT, [f"/axes/{joint}", [float(x) for x in label.position]])
        assert np.abs(seen).max() < 0.95, joint


def test_the_first_view_is_fitted_to_the_picture(page, dashboard):
    arm = next(c for c in dashboard.cell.cameras() if c.name == "Arm")
    assert client_of(dashboard).camera.aspect < 0.7
    until(lambda: stands_at(client_of(dashboard), arm))


def test_differences_are_told_apart_on_a_small_screen(page, dashboard):
    page.set_viewport_size({"width": 1366, "height": 768})
    tab(page, "Geometry")
    for _ in range(2):
        page.locator("[data-say='2-b_m']").last.click()
        page.wait_for_timeout(1500)
    client, drawn = client_of(dashboard), dashboard.cell._diagnosis
    until(lambda: stands_at(client, drawn.overview()))
    assert not dashboard.cell.points.visible
    page.wait_for_timeout(500)
    width, height = page.evaluate("() => [__viserMutable.canvas.clientWidth, __viserMutable.canvas.clientHeight]")
    boxes = []
    for label in (one for one in drawn._labels.values() if one.visible):
        x, y = page.evaluate(SEEN_AT, ["/diagnosis", [float(v) for v in label.position]])
        half = 3.3 * len(label.text)
        boxes.append(((x + 1) / 2 * width, (1 - y) / 2 * height, half, label.text))
    assert len(boxes) >= 4
    for k, (x, y, half, text) in enumerate(boxes):
        assert half < x < width - half, text
        assert 10 < y < height - 10, text
        assert all(abs(x - u) > half + other or abs(y - v) > 18 for u, v, other, _ in boxes[:k]), text
    tab(page, "View")
    wait_for_text(page, "legend", "axes as designed")
    page.get_by_label("Geometry against design", exact=True).filter(visible=True).uncheck()
    until(lambda: dashboard.cell.points.visible)
    wait_for_text(page, "legend", "Radial residual")


def test_the_arm_is_drawn_as_calibrated_and_its_ghost_as_designed(dashboard):
    found, cell = dashboard.bench.calibration, dashboard.cell
    shot = max((s for s in dashboard.bench.state.shots if s.counts), key=lambda s: abs(s.taken.commanded[4]))
    cell.follow(shot.taken.commanded)
    target = next(k for k, t in enumerate(found.campaign.targets) if t.name == shot.taken.target)
    link, at_rest = found.campaign.targets[target].link, found.refinement.rest_points_m[target]

    def off_mm(view) -> float:
        seen = carry(view.axes, view.sliding, view.net[None], np.array([link]), at_rest[None])[0]
        return 1e3 * float(np.linalg.norm(seen - shot.taken.point_m))

    assert off_mm(cell.arm) < 2.0 < off_mm(cell.ghost)
    assert np.allclose(cell.arm.axes[2].direction, found.estimate.arm.axes[2].direction, atol=1e-3)
    cell.follow_robot()
