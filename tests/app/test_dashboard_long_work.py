"""A running dashboard, without a browser, at long work: neither Measure nor Solve waits for it."""

import time
from types import SimpleNamespace

import pytest

from app.dashboard import Dashboard
from app.workbench import Workbench
from core.session import Session
from core.session_store import SUFFIX
from core.twin import irb_l6
from core.twin.demo import demo_events

PATIENCE_S = 60.0


@pytest.fixture
def dashboard(tmp_path):
    session = Session.create(tmp_path / f"demo{SUFFIX}", demo_events(irb_l6.cell()), by="A. Operator")
    bench = Workbench(session)
    bench.runs.run(True)
    bench.decisions.undo()
    running = Dashboard(bench, port=0)
    yield running
    running.stop()


def until(there) -> None:
    end = time.monotonic() + PATIENCE_S
    while not there():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_measuring_and_solving_do_not_wait_for_a_diagnosis_and_stop_ends_it(dashboard):
    panel, bench = dashboard.gap.panel, dashboard.bench
    panel._diagnose(SimpleNamespace(client=None))
    dashboard.jobs.wait()
    assert panel._bar.visible
    assert panel._stop.visible
    until(lambda: panel._bar.value > 0)
    shots = len(bench.state.shots)
    dashboard.acquire.measure(None)
    dashboard.solve.solve(None)
    dashboard.jobs.wait()
    assert len(bench.state.shots) == shots + 1
    assert bench.calibration is not None
    assert dashboard.gap._gaps.running
    assert panel._bar.visible
    dashboard.gap._gaps.stop()
    until(lambda: not panel._bar.visible)
    assert not panel._stop.visible
    assert dashboard.gap._gaps.found is None


def test_solving_does_not_wait_for_the_robot_to_finish_and_the_solution_is_of_all_shots_before_it(tmp_path):
    session = Session.create(tmp_path / f"run{SUFFIX}", demo_events(irb_l6.cell()), by="A. Operator")
    dashboard = Dashboard(Workbench(session), port=0)
    bench = dashboard.bench
    bench.robot._seconds = 0.02
    try:
        dashboard.acquire._start(None, True)
        until(lambda: len(bench.state.shots) > 20)
        dashboard.solve.solve(None)
        assert bench.calibration is not None
        assert bench.runs.running
        (entry,) = [entry for entry in session.entries if entry.kind == "solved"]
        before = [one for one in session.entries if one.kind == "shot" and one.seq < entry.seq]
        assert entry.event.shots == len(before)
        assert bench.calibration.campaign.measurements.count == len(before)
        until(lambda: len(bench.state.shots) > len(before) + 3)
        assert bench.solving.since_solved >= 3
        dashboard.acquire.stop(None)
        dashboard.jobs.wait()
        assert bench.runs.running is None
    finally:
        dashboard.stop()


def test_what_waits_for_the_robot_says_so(tmp_path):
    """Nothing looks worse than a button that does nothing; what does not wait says nothing."""
    session = Session.create(tmp_path / f"run{SUFFIX}", demo_events(irb_l6.cell()), by="A. Operator")
    dashboard = Dashboard(Workbench(session), port=0)
    told, done = [], []
    client = SimpleNamespace(client_id=1, add_notification=lambda title, *args, **kwargs: told.append(title))
    try:
        dashboard.seat.may = lambda client_id: True
        dashboard.ask(SimpleNamespace(client=client), lambda one: done.append("idle"))
        dashboard.jobs.wait()
        assert (told, done) == ([], ["idle"])
        dashboard.bench.robot._seconds = 0.02
        dashboard.acquire._start(None, True)
        until(lambda: dashboard.bench.runs.running is not None)
        dashboard.ask(SimpleNamespace(client=client), lambda one: done.append("at once"), at_once=True)
        assert (told, done) == ([], ["idle", "at once"])
        dashboard.ask(SimpleNamespace(client=client), lambda one: done.append("later"))
        assert told == ["The robot is at work"]
        assert "later" not in done
        dashboard.acquire.stop(None)
        dashboard.jobs.wait()
        assert done[-1] == "later"
    finally:
        dashboard.stop()


def test_a_diagnosis_ends_with_its_tab(dashboard):
    dashboard.gap.panel._diagnose(SimpleNamespace(client=None))
    dashboard.jobs.wait()
    for _ in range(120):
        dashboard.bench.session.undo()
    dashboard.bench.changed()
    assert not dashboard.gap._tab.there
    until(lambda: not dashboard.gap._gaps.running)
