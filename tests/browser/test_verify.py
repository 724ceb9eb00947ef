"""Verifying the demo cell's arm in a real browser: command, measure, compare, before compensation and after it."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from test_dashboard import choose, chromium, folder, group, press, started, tab, visit, wait_for_text  # noqa: F401

from core.pose_visits import pose_visits
from core.session_store import SUFFIX

PROJECT = """p => { const m = __viserMutable, top = m.nodeRefFromName['/pose_frames'];
  const v = m.camera.position.clone().set(...p).applyMatrix4(top.matrixWorld).project(m.camera);
  const r = m.canvas.getBoundingClientRect();
  return [r.left + (v.x + 1) / 2 * r.width, r.top + (1 - v.y) / 2 * r.height] }"""
PLACE = "name => { const p = __viserMutable.nodeRefFromName[name].position; return [p.x, p.y, p.z] }"
INKS = """() => [...document.querySelectorAll('.js-plotly-plot')].filter(p => p.offsetParent !== null)
  .map(p => p._fullLayout.font.color)"""
NODE = "name => !!__viserMutable.nodeRefFromName[name]"
TRACES = """() => [...document.querySelectorAll('.js-plotly-plot')].filter(p => p.offsetParent !== null)
  .map(p => p._fullData.filter(t => t.mode === 'markers').map(t => [t.name, [...t.y].length]))"""


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """A session in which table 1 was measured."""
    path = tmp_path_factory.mktemp("measured") / f"demo{SUFFIX}"
    running = started(path)
    running.bench.runs.run(True)
    running.stop()
    return path


@pytest.fixture
def dashboard(measured, tmp_path):
    path = tmp_path / f"demo{SUFFIX}"
    path.write_bytes(measured.read_bytes())
    running = started(path)
    yield running
    running.stop()


@pytest.fixture
def page(chromium, dashboard):  # noqa: F811
    one = visit(chromium, dashboard)
    yield one
    assert one.problems == []
    one.close()


def solve(page) -> None:
    tab(page, "3 Solve")
    press(page, "Solve")
    page.wait_for_selector("[data-testid=noise]")
    tab(page, "Verify")


def send(page, path: Path) -> None:
    """Send a file by the button for poses."""
    with page.expect_file_chooser() as waiting:
        press(page, "Compensate a CSV file")
    waiting.value.set_files(path)


def table(page) -> list[list[str]]:
    """Cells of the table of poses."""
    rows = page.locator("[data-testid=pose-table] tr").all()
    return [row.locator("th,td").all_inner_texts() for row in rows]


def test_the_tab_comes_with_the_solution_and_the_loop_is_closed(page, dashboard):
    bench, poses = dashboard.bench, dashboard.verify._poses
    assert page.get_by_role("tab", name="Verify").count() == 0
    solve(page)
    labels = page.get_by_role("tab").all_inner_texts()
    assert labels.index("3 Solve") < labels.index("Verify") < labels.index("Compensate") < labels.index("4 Export")
    wait_for_text(page, "verify-step", "Pose 1 of 12, nominal command")
    command = page.get_by_test_id("pose-command").inner_text()
    sent = [float(v) for v in re.findall(r"= (-?[\d.]+)°", command)]
    np.testing.assert_allclose(np.deg2rad(sent), bench.state.poses.wanted[0], atol=1e-6)

    press(page, "Measure pose")
    wait_for_text(page, "verify-step", "Pose 2 of 12")
    assert [v.number for v in pose_visits(bench.state)] == [0]
    wait_for_text(page, "verify-summary", "nominal")
    group(page, "Run all poses")
    wait_for_text(page, "verify-step", "Nothing left to measure")
    loop, _ = poses.loop()
    assert (loop.nominal.count, loop.compensated.count) == (12, 12)
    summary = page.get_by_test_id("verify-summary").inner_text()
    for attempts in (loop.nominal, loop.compensated):
        assert f"{attempts.errors.position.mean * 1e3:.2f}"[:4] in summary
    assert page.get_by_test_id("better").inner_text() == f"{loop.improvement_position:.1f}"

    tab(page, "Poses")
    page.locator(".js-plotly-plot svg.main-svg").filter(visible=True).first.wait_for()
    page.wait_for_function(f"() => ({TRACES})().length === 2")
    assert page.evaluate(TRACES) == [[["nominal command", 12], ["compensated command", 12]]] * 2
    shown = table(page)
    assert len(shown) == 13
    for row, before in zip(shown[1:], loop.nominal.errors.position.value, strict=True):
        assert float(row[1].split(" ")[0]) == pytest.approx(before * 1e3, abs=0.06)


def test_a_pose_is_chosen_by_its_row_and_by_a_click_in_3d(page, dashboard):
    solve(page)
    dashboard.verify._poses.run()
    tab(page, "Poses")
    wait_for_text(page, "pose-table", "before")
    page.locator("[data-testid=pose-table] tr").nth(3).click()
    page.wait_for_function(NODE, arg="/pose_frames/before/wanted")
    assert dashboard.verify.verify._chosen == 3
    assert "now" in (page.locator("[data-testid=pose-table] tr").nth(3).get_attribute("class") or "")
    loop, _ = dashboard.verify._poses.loop()
    shown = page.evaluate(PLACE, "/pose_frames/after/reached")
    np.testing.assert_allclose(shown, loop.found.measured.pose[loop.compensated.row[2], :3, 3], atol=1e-5)
    page.get_by_label("Shots", exact=True).filter(visible=True).click()
    # The flight has brought pose 3 to the middle of the picture; a click there chooses it anew.
    dashboard.verify.verify._choose(None, None)
    page.wait_for_function(f"name => !({NODE})(name)", arg="/pose_frames/before/wanted")
    page.wait_for_timeout(800)
    box = page.locator("canvas[data-engine]").bounding_box()
    x, y = page.evaluate(PROJECT, loop.nominal.errors.predicted[2, :3, 3].tolist())
    assert box["x"] < x < box["x"] + box["width"]
    page.mouse.move(x, y)
    page.wait_for_timeout(300)
    page.mouse.click(x, y)
    page.wait_for_function(NODE, arg="/pose_frames/before/wanted")
    assert dashboard.verify.verify._chosen == 3


def test_before_and_after_are_switched_in_3d(page, dashboard):
    solve(page)
    dashboard.verify._poses.run()
    page.wait_for_function(NODE, arg="/pose_errors/after/arrows")
    assert page.evaluate(NODE, "/pose_errors/before/arrows")
    for chosen, gone, there in (("after", "before", "after"), ("before", "after", "before")):
        choose(page, "Errors", chosen)
        page.wait_for_function(f"name => !({NODE})(name)", arg=f"/pose_errors/{gone}/arrows")
        page.wait_for_function(NODE, arg=f"/pose_errors/{there}/arrows")


def test_plots_of_tabs_that_come_late_can_be_read_on_a_dark_page(page, dashboard):
    tab(page, "View")
    page.get_by_label("Dark theme", exact=True).filter(visible=True).check()
    page.wait_for_function("() => document.documentElement.dataset.mantineColorScheme === 'dark'")
    solve(page)
    dashboard.verify._poses.run()
    tab(page, "Poses")
    page.wait_for_function(f"() => ({TRACES})().length === 2")
    inks = page.evaluate(INKS)
    assert len(inks) == 2
    assert all(min(bytes.fromhex(ink.lstrip("#"))) > 0xA0 for ink in inks), inks


def test_limits_give_a_verdict_and_undo_takes_shots_back(page, dashboard):
    solve(page)
    dashboard.verify._poses.run()
    wait_for_text(page, "verify-summary", "Set limits below")
    box = page.get_by_label("Position [mm]", exact=True)
    box.fill("5")
    page.wait_for_timeout(300)
    press(page, "Keep limits")
    wait_for_text(page, "pose-verdict", "pass: compensated commands")
    tab(page, "Poses")
    wait_for_text(page, "pose-table", "pass")
    before = len(dashboard.bench.state.shots)
    group(page, "Undo")
    page.wait_for_function("() => !document.querySelector('[data-testid=pose-verdict]')")
    for _ in range(3):
        dashboard.bench.decisions.undo()
    wait_for_text(page, "verify-step", "Pose 12 of 12, compensated command")
    assert len(dashboard.bench.state.shots) == before - 3


def test_a_watcher_may_not_measure_and_v_measures(chromium, page, dashboard):  # noqa: F811
    solve(page)
    watcher = visit(chromium, dashboard)
    try:
        tab(watcher, "Verify")
        press(watcher, "Measure pose")
        watcher.get_by_role("alert").filter(has_text="Another browser holds").wait_for()
        assert pose_visits(dashboard.bench.state) == ()
        page.locator("canvas[data-engine]").click(position={"x": 250, "y": 30})
        page.keyboard.press("v")
        wait_for_text(watcher, "verify-step", "Pose 2 of 12")
    finally:
        watcher.close()


def test_a_new_session_takes_the_tab_away(page, dashboard):
    solve(page)
    press(page, "Measure pose")
    wait_for_text(page, "verify-step", "Pose 2 of 12")
    tab(page, "1 Cell")
    folder(page, "New session")
    press(page, "Begin")
    page.get_by_role("tab", name="Verify").wait_for(state="detached")
    page.get_by_role("tab", name="Poses").wait_for(state="detached")
    assert dashboard.bench.calibration is None


def test_poses_are_compensated_from_the_example_to_the_file(page, dashboard):
    solve(page)
    assert page.get_by_role("tab", name="Commands").count() == 0
    tab(page, "Compensate")
    press(page, "Compensate")
    page.get_by_role("alert").filter(has_text="No poses are pasted").wait_for()
    press(page, "Fill in test poses")
    page.wait_for_function(
        "() => [...document.querySelectorAll('textarea')].some(t => t.value.startsWith('pose,x_mm'))"
    )
    page.wait_for_timeout(200)
    press(page, "Compensate")
    wait_for_text(page, "compensated-count", "12 of 12 poses")
    tab(page, "Commands")
    last = dashboard.verify._compensated.last
    rows = page.locator("[data-testid=compensated-table] table").first.locator("tr").all()
    assert len(rows) == 13
    cells = rows[5].locator("td").all_inner_texts()
    assert float(cells[4]) == pytest.approx(np.rad2deg(last.found.commanded[4, 0]), abs=6e-4)
    with page.expect_download() as waiting:
        press(page, "Commands (CSV)")
    sent = waiting.value
    assert re.fullmatch(r"\d{4}-\d\d-\d\d_\d{6}_trueaxis_commands\.csv", sent.suggested_filename)
    assert Path(sent.path()).read_text(encoding="utf-8") == last.csv


def test_a_file_of_poses_is_sent_and_a_wrong_one_is_named(page, dashboard, tmp_path):
    solve(page)
    tab(page, "Compensate")
    good, wrong = tmp_path / "poses.csv", tmp_path / "<b>wrong.csv"
    good.write_text(dashboard.verify._compensated.test_poses_csv(), encoding="utf-8")
    wrong.write_text("x_mm,y_mm,z_mm\n1,2,3\n", encoding="utf-8")
    send(page, wrong)
    page.get_by_role("alert").filter(has_text="no orientation, expected columns qw").wait_for()
    send(page, good)
    wait_for_text(page, "compensated-count", "12 of 12 poses")


def test_methods_are_compared_on_demand_while_the_page_goes_on(page, dashboard):
    solve(page)
    assert page.get_by_role("tab", name="Methods").count() == 0
    tab(page, "Compare")
    box = page.get_by_label("Trials", exact=True)
    box.fill("1")
    page.wait_for_timeout(300)
    press(page, "Compare")
    wait_for_text(page, "compare-progress", "Trial 1 of 1")
    tab(page, "Verify")
    press(page, "Measure pose")
    wait_for_text(page, "verify-step", "Pose 2 of 12")
    page.get_by_role("tab", name="Methods").wait_for(timeout=180_000)
    found = dashboard.verify._compared.found
    tab(page, "Methods")
    wait_for_text(page, "compare-table", "paper, after")
    assert page.locator("[data-testid=compare-table] tr").count() == len(found.rows) + len(found.references) + 2
    tab(page, "Compare")
    wait_for_text(page, "compare-verdict", "1 trial, 12 kept-out poses each")


def test_the_verification_is_taken_as_files(page, dashboard):
    solve(page)
    press(page, "Verification (JSON)")
    page.get_by_role("alert").filter(has_text="Measure a pose to see its error").wait_for()
    dashboard.verify._poses.run()
    wait_for_text(page, "verify-summary", "compensated")
    for label, ending in (("Verification (HTML)", "html"), ("Verification (JSON)", "json")):
        with page.expect_download() as waiting:
            press(page, label)
        sent = waiting.value
        assert re.fullmatch(rf"\d{{4}}-\d\d-\d\d_\d{{6}}_trueaxis_verification\.{ending}", sent.suggested_filename)
        content = Path(sent.path()).read_text(encoding="utf-8")
        if ending == "json":
            loop, _ = dashboard.verify._poses.loop()
            told = json.loads(content)["compensation"]
            assert told["improvement_position"] == pytest.approx(loop.improvement_position)
        else:
            assert "Compensated commands" in content
