"""A cell of one's own in a real browser: robots, points and campaigns from files, sessions sent and opened."""

import io
import re
import zipfile
from pathlib import Path

import numpy as np
import pytest
from test_dashboard import (  # noqa: F401
    READY,
    choose,
    chromium,
    fill,
    folder,
    group,
    measure,
    press,
    started,
    tab,
    until,
    visit,
    wait_for_text,
)

from app.rigs import Source
from core.calibration import calibrate
from core.instruments import MeasureRequest
from core.measurements import Instrument
from core.session import Session
from core.session_campaign import to_campaign
from core.session_store import SUFFIX
from core.twin.instrument import DemoInstrument, DemoRobot
from core.twin.own_robot import own_cell

SAMPLE = Path(__file__).parents[2] / "sample_data" / "irb_l6"
ROBOT = (
    """format = "trueaxis-robot/1"
name = "Three axes"
"""
    + "".join(f'[[joint]]\nkind = "revolute"\nlimits = {limits}\n' for limits in ([-160, 160], [-90, 90], [-170, -10]))
    + "".join(
        f"[[dh]]\ntheta_deg = 0\nd_mm = {d}\na_mm = {a}\nalpha_deg = {alpha}\n"
        for d, a, alpha in ((400, 50, -90), (0, 500, 0), (0, 400, 0))
    )
)
URDF = """<robot name="two"><link name="base"/><link name="upper"/><link name="tool"/>
<joint name="j1" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.4"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="j2" type="revolute"><parent link="upper"/><child link="tool"/><origin xyz="0.5 0 0"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" effort="1" velocity="1"/></joint></robot>"""


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


def send(page, name: str, content: bytes | str) -> None:
    """Send a file by the button under New session."""
    data = content if isinstance(content, bytes) else content.encode()
    file = {"name": name, "mimeType": "application/octet-stream", "buffer": data}
    page.locator("input[type=file]").first.set_input_files(file)


def begin(page, points: str | None = None) -> None:
    if points is not None:
        choose(page, "Points are", points)
    press(page, "Begin")


def text_box(page, label: str):
    """The box of a text, which has no accessible name of its own."""
    row = page.locator("div.mantine-Flex-root", has=page.locator("label", has_text=re.compile(f"^{label}$")))
    return row.filter(visible=True).first.locator("input:not([type=hidden])")


def typed(page, lines: str) -> None:
    """Type coordinates where they are measured, and wait until the page has understood them."""
    page.locator("textarea").filter(visible=True).first.fill(lines)
    wait_for_text(page, "entered", "understood")
    page.wait_for_timeout(100)


def alert(page, words: str) -> None:
    page.get_by_role("alert").filter(has_text=words).first.wait_for()


def readings(state, count: int) -> str:
    """What an instrument would show at the next steps, as an operator would copy it from its display."""
    cell = own_cell(state.robot, state.targets, Instrument("laser-tracker", 2e-5), None, 4)
    robot = DemoRobot(cell, 4, visits_before=len(state.shots))
    meter = DemoInstrument(cell, robot, 4, shots_before=len(state.shots))
    lines = []
    for step in state.steps[state.position : state.position + count]:
        robot.move_to(step.commanded, lambda: False)
        point = meter.measure(MeasureRequest(step.target, step.commanded), lambda: False).point_m
        lines.append(" ".join(f"{v * 1e3:.4f}" for v in point))
    return "\n".join(lines)


def test_a_robot_from_a_file_is_measured_by_hand_and_solved(page, dashboard):
    folder(page, "New session")
    send(page, "robot.toml", ROBOT)
    wait_for_text(page, "tray", "Three axes, 3 joints")
    begin(page)
    wait_for_text(page, "cell-intro", "Three axes: a real robot")
    bench = dashboard.bench
    assert bench.rig.source is Source.BY_HAND
    assert page.evaluate(
        "!!__viserMutable.nodeRefFromName['/arm/link3'] && !__viserMutable.nodeRefFromName['/arm/link4']"
    )
    tab(page, "2 Measure")
    wait_for_text(page, "step", "Joint 3: stop 1 of 16, target T1")
    wait_for_text(page, "step", "Send the robot to")

    press(page, "Measure")
    alert(page, "no coordinates were entered")
    page.locator("textarea").filter(visible=True).first.fill("1 2")
    wait_for_text(page, "entered", "line 1: '1 2', expected three numbers")

    typed(page, readings(bench.state, 1))
    press(page, "Measure")
    wait_for_text(page, "step", "stop 2 of 16")
    typed(page, readings(bench.state, 14))
    press(page, "Measure")
    wait_for_text(page, "step", "stop 16 of 16")
    good = readings(bench.state, 1)
    typed(page, "1 2 3")
    press(page, "Measure")
    wait_for_text(page, "verdict", "measure again")
    page.locator("[data-say^='shot-']", has_text="✖ record 16").click()
    wait_for_text(page, "shot", "Record 16, joint 3, stop 16, target T1: chosen")
    typed(page, good)
    group(page, "Measure again")
    page.wait_for_function("() => !document.querySelector('[data-testid=sweeps]').innerText.includes('✖')")
    wait_for_text(page, "step", "Joint 2: stop 1")
    wait_for_text(page, "verdict", "If you stop now: direction of axis 3 known to")
    for joint in (2, 1):
        typed(page, readings(bench.state, 16))
        press(page, "Measure")
        wait_for_text(page, "step", "Nothing left" if joint == 1 else "Joint 1")
    assert (len(bench.state.shots), sum(shot.counts for shot in bench.state.shots)) == (49, 48)
    assert bench.known.base().settled
    tab(page, "3 Solve")
    press(page, "Solve")
    page.wait_for_selector("[data-testid=noise]")
    found = calibrate(to_campaign(bench.state))
    assert page.get_by_test_id("noise").inner_text() == f"{found.estimate.noise_m * 1e3:.3f} mm"
    assert found.not_swept == ()


def test_a_simulated_arm_of_the_own_robot_runs_by_itself(page, dashboard):
    folder(page, "New session")
    send(page, "two.urdf", URDF)
    wait_for_text(page, "tray", "two, 2 joints")
    begin(page, "simulated, for practice")
    wait_for_text(page, "cell-intro", "simulated arm of this robot")
    tab(page, "2 Measure")
    group(page, "Run all")
    wait_for_text(page, "step", "Nothing left to measure")
    assert dashboard.bench.rig.source is Source.SIMULATED
    assert len(dashboard.bench.state.shots) == 32


def test_targets_instrument_and_sweeps_are_the_operators(page, dashboard):
    folder(page, "New session")
    send(page, "robot.toml", ROBOT)
    wait_for_text(page, "tray", "press Begin")
    begin(page)
    wait_for_text(page, "cell-intro", "Three axes")
    state = lambda: dashboard.bench.state  # noqa: E731
    folder(page, "Targets")
    fill(page, text_box(page, "Name"), "P2", dashboard.start._targets._name)
    group(page, "Add or change")
    wait_for_text(page, "target-list", "P2")
    assert state().target_links == {"T1": 3, "P2": 1}
    folder(page, "Instrument and points")
    choose(page, "Kind", "total-station")
    press(page, "Keep the instrument")
    wait_for_text(page, "cell", "total station")
    assert state().instrument.kind == "total-station"
    folder(page, "Sweeps")
    press(page, "Suggest all")
    suggested = {3: ("T1",), 2: ("T1",), 1: ("T1",)}
    until(page, lambda: {row.joint: row.targets for row in state().plan.sweeps} == suggested)


def test_points_of_a_sweep_come_from_a_csv_file(page, dashboard):
    folder(page, "New session")
    send(page, "robot.toml", ROBOT)
    wait_for_text(page, "tray", "press Begin")
    begin(page)
    wait_for_text(page, "cell-intro", "Three axes")
    tab(page, "2 Measure")
    wait_for_text(page, "step", "Joint 3")
    state = dashboard.bench.state
    steps, lines = state.steps[:16], readings(state, 16).splitlines()
    rows = [f"{np.rad2deg(s.commanded[2]):.4f},{line.replace(' ', ',')}" for s, line in zip(steps, lines, strict=True)]
    button = page.get_by_role("button", name="Points of this sweep from a CSV file")

    def send_points(text: str) -> None:
        with page.expect_file_chooser() as chooser:
            button.click()
        file = {"name": "points.csv", "mimeType": "text/csv", "buffer": text.encode()}
        chooser.value.set_files(file)

    send_points("q_deg,x_mm,y_mm,z_mm\n88,1,2,3\n")
    alert(page, "nearest open stop")
    assert dashboard.bench.state.shots == ()
    send_points("q_deg,x_mm,y_mm,z_mm\n" + "\n".join(rows))
    wait_for_text(page, "step", "Joint 2: stop 1")
    assert len(dashboard.bench.state.shots) == 16


@pytest.mark.parametrize("way", ["zip", "files"])
def test_a_campaign_opens_as_a_session(page, dashboard, way):
    names = ("measurements.csv", "campaign.toml", "robot.toml")
    folder(page, "New session")
    if way == "zip":
        data = io.BytesIO()
        with zipfile.ZipFile(data, "w") as archive:
            for name in names:
                archive.write(SAMPLE / name, f"irb_l6/{name}")
        send(page, "irb_l6.zip", data.getvalue())
    else:
        for name in names:
            send(page, name, (SAMPLE / name).read_bytes())
            wait_for_text(page, "tray", name)
        press(page, "Open the campaign")
    wait_for_text(page, "cell-intro", "you move it")
    assert len(dashboard.bench.state.shots) > 129
    tab(page, "3 Solve")
    press(page, "Solve")
    page.wait_for_selector("[data-testid=noise]")
    assert dashboard.bench.calibration.not_swept == ()


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("robot.exe", b"MZ", "of no use here"),
        ("robot.toml", b"format = 3", "robot.toml"),
        ("odd.zip", b"PK but not really", "cannot be unpacked"),
        ("odd" + SUFFIX, b"nothing" * 100, "not a session of trueaxis"),
        ("<img src=x onerror=window.hacked=1>.toml", b"x = <", "not valid TOML"),
    ],
)
def test_a_file_that_is_no_use_is_refused_in_a_sentence(page, dashboard, name, content, words):
    before = dashboard.bench.session.path
    folder(page, "New session")
    send(page, name, content)
    alert(page, words)
    assert dashboard.bench.session.path == before
    assert page.evaluate("window.hacked") is None


def test_a_file_from_a_watcher_is_refused_and_its_button_can_be_pressed_again(chromium, page, dashboard):  # noqa: F811
    watcher = visit(chromium, dashboard)
    try:
        folder(watcher, "New session")
        send(watcher, "robot.toml", ROBOT)
        alert(watcher, "Another browser holds the operator's seat")
        watcher.get_by_role("alert").filter(has_text="Uploading").wait_for(state="detached")
        upload = watcher.get_by_role("button", name="Files of a robot, campaign or session")
        assert upload.is_enabled()
        assert dashboard.start._new._tray.files == ()
    finally:
        watcher.close()


def test_a_session_is_found_copied_sent_and_opened_again(page, dashboard, tmp_path):
    tab(page, "2 Measure")
    measure(page, 2)
    tab(page, "1 Cell")
    folder(page, "Sessions")
    wait_for_text(page, "session-list", "ASEA IRB L6")
    group(page, "Copy")
    page.wait_for_function("() => document.querySelectorAll('[data-testid=session-list] tr').length === 3")
    wait_for_text(page, "session-list", "2/129")
    chosen, own = dashboard.start._shelf._chosen, dashboard.bench.session.path.name
    assert chosen.value == own
    page.locator("[data-testid=session-list] tr:not(.now)[data-say]").click()
    until(page, lambda: chosen.value != own)
    page.locator("[data-testid=session-list] tr.now").click()
    until(page, lambda: chosen.value == own)
    with page.expect_download() as waiting:
        press(page, "Session as one file")
    sent = Path(waiting.value.path()).read_bytes()
    (tmp_path / "elsewhere").mkdir()
    kept = tmp_path / "elsewhere" / f"sent{SUFFIX}"
    kept.write_bytes(sent)
    with Session.open(kept, read_only=True) as copy:
        assert len(copy.state.shots) == 2
    with page.expect_download() as waiting:
        press(page, "Campaign folder (ZIP)")
    names = zipfile.ZipFile(waiting.value.path()).namelist()
    assert {Path(name).name for name in names} == {"campaign.toml", "robot.toml", "measurements.csv"}
    measure_first = dashboard.bench.session.path
    folder(page, "New session")
    send(page, f"sent{SUFFIX}", sent)
    page.wait_for_function("() => document.querySelector('[data-testid=cell]').innerText.includes('sent')")
    assert dashboard.bench.session.path != measure_first
    assert len(dashboard.bench.state.shots) == 2


def test_a_dark_page_stays_dark_when_another_robot_is_drawn(page, dashboard):
    tab(page, "View")
    page.get_by_label("Dark theme", exact=True).filter(visible=True).check()
    page.wait_for_function("() => document.documentElement.dataset.mantineColorScheme === 'dark'")
    tab(page, "1 Cell")
    folder(page, "New session")
    send(page, "robot.toml", ROBOT)
    wait_for_text(page, "tray", "press Begin")
    begin(page)
    wait_for_text(page, "cell-intro", "Three axes")
    assert page.evaluate("document.documentElement.dataset.mantineColorScheme") == "dark"
    tab(page, "View")
    assert page.get_by_label("Dark theme", exact=True).filter(visible=True).is_checked()
