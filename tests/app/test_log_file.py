"""What goes wrong is a sentence on the page and a trace in the log, wherever it goes wrong."""

import logging
import time
from types import SimpleNamespace

import pytest

from app.dashboard import Dashboard
from app.log_file import LARGEST_BYTES, keep_log
from app.workbench import Workbench
from core.session import Session
from core.session_store import SUFFIX
from core.twin import irb_l6
from core.twin.demo import demo_events
from tests.core.no_room import as_nobody, no_file_may_grow_beyond

LOG = logging.getLogger("trueaxis")


@pytest.fixture(autouse=True)
def as_before():
    handlers, level, propagate = LOG.handlers, LOG.level, LOG.propagate
    yield
    for handler in LOG.handlers:
        handler.close()
    LOG.handlers, LOG.propagate = handlers, propagate
    LOG.setLevel(level)


def fail() -> None:
    try:
        raise ZeroDivisionError("by nought")
    except ZeroDivisionError:
        LOG.exception("a job failed")


def test_a_trace_is_in_the_file_with_its_time_and_on_the_terminal(tmp_path, capsys):
    path = keep_log(tmp_path)
    LOG.info("refused: a sentence")
    fail()
    text = path.read_text()
    assert "INFO refused: a sentence" in text
    assert text.startswith(time.strftime("%Y-%m-%dT", time.gmtime()))
    assert "ZeroDivisionError: by nought" in text
    said = capsys.readouterr().err
    assert "ZeroDivisionError: by nought" in said
    assert "refused" not in said


def test_the_file_does_not_grow_without_end(tmp_path):
    keep_log(tmp_path)
    for _ in range(40):
        LOG.info("x" * 100_000)
    assert sum(p.stat().st_size for p in tmp_path.iterdir()) < 3.2 * LARGEST_BYTES


def test_without_room_or_right_to_write_there_is_the_terminal(tmp_path, capsys):
    path = keep_log(tmp_path)
    with no_file_may_grow_beyond(0):
        fail()
    said = capsys.readouterr().err
    assert said.count("a job failed") == 1
    assert "Logging error" not in said
    assert path.stat().st_size == 0
    with as_nobody():
        assert keep_log(tmp_path / "nowhere") is None
        fail()
    assert "by nought" in capsys.readouterr().err


def test_a_callback_that_fails_past_the_queue_is_told_to_its_browser_alone(tmp_path, monkeypatch, caplog):
    session = Session.create(tmp_path / f"demo{SUFFIX}", demo_events(irb_l6.cell()), by="A. Operator")
    dashboard = Dashboard(Workbench(session), port=0)
    told = []
    monkeypatch.setattr(dashboard, "say", lambda client, sentence: told.append((client, sentence)))
    try:
        submit = dashboard.server.gui._thread_executor.submit
        submit(lambda event: 1 / 0, SimpleNamespace(client="mine")).result()
        submit(lambda: 1 / 0).result()
    finally:
        dashboard.stop()
    ((client, sentence),) = told
    assert client == "mine"
    assert "ZeroDivisionError" in sentence
    assert "Nothing was lost" in sentence
    assert caplog.text.count("Traceback") == 2
