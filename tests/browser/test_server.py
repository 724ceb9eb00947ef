"""The program behind the page: killed, started again, locked out, and on another address."""

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from test_dashboard import READY, chromium, group, measure, press, tab, wait_for_text  # noqa: F401
from test_own_cell import alert

from core.session import Session
from core.session_store import SUFFIX

ROOT = Path(__file__).parents[2]


class Server:
    """``trueaxis serve`` as a process of its own."""

    def __init__(self, folder: Path, port: int, *arguments: str) -> None:
        command = [sys.executable, "-m", "app", "serve", "--port", str(port), "--sessions", str(folder), *arguments]
        environment = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
        self._run = subprocess.Popen(
            command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        self.said = self._run.stdout.readline()

    def kill(self) -> None:
        """At once, as when the power fails."""
        self._run.send_signal(signal.SIGKILL)
        self._run.communicate()

    def stop(self) -> str:
        """In good order; what it said on standard error."""
        self._run.send_signal(signal.SIGTERM)
        return self._run.communicate(timeout=20)[1]


@pytest.fixture
def port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def page(chromium):  # noqa: F811
    one = chromium.new_page(viewport={"width": 1440, "height": 860})
    one.set_default_timeout(30_000)
    yield one
    one.close()


def visit(page, port: int) -> None:
    page.goto(f"http://127.0.0.1:{port}/?fixedDpr=0.4")
    page.wait_for_function(READY)


def shots(folder: Path) -> int:
    with Session.open(folder / f"demo{SUFFIX}", read_only=True) as session:
        return len(session.state.shots)


def done(page) -> int:
    """Shots done, as the page's table has it."""
    cells = page.locator("[data-testid=table1] tr td:nth-child(6)").all_inner_texts()
    return sum(map(int, cells))


def test_a_killed_server_comes_back_where_it_was_and_the_page_with_it(page, port, tmp_path):
    first = Server(tmp_path, port)
    visit(page, port)
    tab(page, "2 Measure")
    group(page, "Run all")
    wait_for_text(page, "run", "The robot runs")
    page.wait_for_function("() => document.querySelector('[data-testid=step]').innerText.includes('Joint 5')")
    seen = done(page)
    first.kill()
    seen = max(seen, done(page))
    kept = shots(tmp_path)
    assert kept >= seen >= 17
    second = Server(tmp_path, port)
    try:
        # The page connects again by itself.
        page.get_by_test_id("cell").wait_for()
        tab(page, "2 Measure")
        page.wait_for_function(
            "n => [...document.querySelectorAll('[data-testid=table1] tr td:nth-child(6)')]"
            ".reduce((sum, cell) => sum + Number(cell.innerText), 0) === n",
            arg=kept,
        )
        measure(page, 1)
        assert shots(tmp_path) == kept + 1
    finally:
        second.stop()


def test_a_server_killed_after_solving_shows_the_solution_again(page, port, tmp_path):
    first = Server(tmp_path, port)
    visit(page, port)
    tab(page, "2 Measure")
    group(page, "Run all")
    wait_for_text(page, "step", "Nothing left to measure")
    tab(page, "3 Solve")
    press(page, "Solve")
    page.wait_for_selector("[data-testid=noise]")
    noise = page.get_by_test_id("noise").inner_text()
    first.kill()
    second = Server(tmp_path, port)
    try:
        page.get_by_test_id("cell").wait_for()
        tab(page, "3 Solve")
        page.wait_for_selector("[data-testid=noise]")
        assert page.get_by_test_id("noise").inner_text() == noise
        tab(page, "4 Export")
        wait_for_text(page, "export-intro", "The solution is up to date")
        with page.expect_download() as waiting:
            press(page, "Report (HTML)")
        assert Path(waiting.value.path()).stat().st_size > 100_000
    finally:
        second.stop()


def test_a_second_program_on_the_same_session_watches_and_says_who_writes(page, port, tmp_path):
    with Session.create(tmp_path / f"demo{SUFFIX}", _demo()) as session:
        server = Server(tmp_path, port)
        try:
            visit(page, port)
            wait_for_text(page, "cell-intro", "Read-only: process")
            tab(page, "2 Measure")
            press(page, "Measure")
            alert(page, "is writing to it")
            assert session.state.shots == ()
        finally:
            server.stop()


def _demo():
    from core.twin import irb_l6
    from core.twin.demo import demo_events

    return demo_events(irb_l6.cell())


def test_a_busy_port_is_an_error_and_another_address_warns(port, tmp_path):
    first = Server(tmp_path, port)
    try:
        (tmp_path / "other").mkdir()
        second = Server(tmp_path / "other", port)
        assert second.said == ""
        assert f"--port {port}" in second.stop()
        assert second._run.returncode == 2
    finally:
        assert first.stop() == ""
    third = Server(tmp_path, port, "--host", "0.0.0.0")
    time.sleep(0.3)
    assert "there is no password" in third.stop()


def test_a_campaign_folder_opens_as_a_session(page, port, tmp_path):
    server = Server(tmp_path, port, str(ROOT / "sample_data" / "irb_l6"))
    try:
        assert "irb_l6.trueaxis" in server.said
        visit(page, port)
        tab(page, "3 Solve")
        press(page, "Solve")
        page.wait_for_selector("[data-testid=noise]")
    finally:
        server.stop()
    with Session.open(tmp_path / f"irb_l6{SUFFIX}", read_only=True) as session:
        assert len(session.state.solves) == 1
