"""A running dashboard on a disk that is full, and in a folder where nothing may be written: a sentence for everything
that is pressed, nothing lost, and it goes on once there is room."""

import os
import shutil
import sqlite3
import tempfile
from pathlib import Path
from types import SimpleNamespace

import pytest

from app.exports import RESULTS
from app.workbench import Workbench
from core.session import Session
from core.session_campaign import open_campaign
from core.session_entries import SESSION_FORMAT
from core.session_events import NoteWritten, SessionError
from core.session_store import SUFFIX
from core.twin import irb_l6
from core.twin.demo import demo_events
from tests.app.command_line import SAMPLES
from tests.app.test_dashboard_trouble import CRASHED, running
from tests.core.no_room import as_nobody, no_file_may_grow_beyond

NOBODY_IN_PARTICULAR = SimpleNamespace(client=None)


@pytest.fixture
def folder():
    """A folder that other users may enter."""
    folder = Path(tempfile.mkdtemp())
    folder.chmod(0o777)
    yield folder
    folder.chmod(0o777)
    shutil.rmtree(folder)


@pytest.fixture
def path(folder):
    """A session with two sweeps and a solution."""
    path = folder / f"demo{SUFFIX}"
    with Session.create(path, demo_events(irb_l6.cell()), by="A. Operator") as session:
        bench = Workbench(session)
        bench.runs.run(False)
        bench.runs.run(False)
        bench.decisions.undo()
        bench.solving.solve()
    return path


def press(dashboard, told) -> dict[str, list[str]]:
    """Do one thing of each kind; the sentences that each of them brought."""
    acquire, shelf, bench = dashboard.acquire, dashboard.start._shelf, dashboard.bench
    shelf._do.value, shelf._chosen.value = "Copy", bench.session.path.name

    def exclude() -> None:
        dashboard.ask(None, lambda client: bench.decisions.exclude(bench.state.shots[0].id, "a cloud"))

    acts = {
        "measure": lambda: acquire.measure(None),
        "measure again": lambda: acquire.measure_again(None),
        "run": lambda: acquire._start(None, False),
        "exclude": exclude,
        "undo": lambda: acquire.undo(None),
        "redo": lambda: acquire.redo(None),
        "check": lambda: dashboard.check._check(None),
        "solve": lambda: dashboard.solve.solve(None),
        "copy": lambda: shelf._act(NOBODY_IN_PARTICULAR),
    }
    sentences = {}
    for name, act in acts.items():
        told.clear()
        act()
        dashboard.jobs.wait()
        sentences[name] = list(told)
    return sentences


def export_all(dashboard, told) -> list[str]:
    """Send every file that needs no room but in the browser."""
    told.clear()
    for export in RESULTS:
        dashboard.export._send(NOBODY_IN_PARTICULAR, export)
    dashboard.jobs.wait()
    return list(told)


def test_on_a_full_disk_every_press_is_answered_and_what_was_measured_can_still_be_sent(path, monkeypatch):
    with running(path, monkeypatch) as (dashboard, told):
        dashboard.jobs.wait()
        bench = dashboard.bench
        bench.session.append(NoteWritten("x" * 9000))
        before = bench.session.entries, bench.state.shots
        journal = path.with_name(f"{path.name}-wal").stat().st_size
        with no_file_may_grow_beyond(journal):
            sentences = press(dashboard, told)
            assert export_all(dashboard, told) == []
        for name, said in sentences.items():
            # There is nothing to bring back as the undo before it was refused.
            words = {"redo": "nothing to redo", "copy": "cannot be written"}.get(name, "nothing was saved")
            assert said, name
            assert words in said[-1], (name, said)
            assert not any(sentence.startswith(CRASHED) for sentence in said), (name, said)
        assert (bench.session.entries, bench.state.shots) == before
        assert [p.name for p in path.parent.glob(f"*{SUFFIX}")] == [path.name]
        assert not any(press(dashboard, told).values())
    with Session.open(path, read_only=True) as session:
        assert session.entries[: len(before[0])] == before[0]
        assert session.state.warnings == ()


def test_in_a_read_only_folder_the_session_is_shown_and_sent_and_nothing_is_written(path, folder, monkeypatch):
    path.chmod(0o444)
    folder.chmod(0o555)
    kept = path.read_bytes()
    with as_nobody(), running(path, monkeypatch) as (dashboard, told):
        dashboard.jobs.wait()
        assert "Read-only" in dashboard.start._intro.content
        sentences = press(dashboard, told)
        assert {name: bool(said) for name, said in sentences.items()} == dict.fromkeys(sentences, True)
        for name, said in sentences.items():
            assert "cannot be written" in said[-1], (name, said)
        assert export_all(dashboard, told) == []
        assert len(dashboard.bench.state.shots) > 20
        assert dashboard.bench.calibration is not None
    assert path.read_bytes() == kept
    assert os.listdir(folder) == [path.name]


def test_a_session_of_a_newer_program_is_refused_and_the_one_at_hand_stays(path, monkeypatch):
    newer = path.with_name(f"newer{SUFFIX}")
    shutil.copy(path, newer)
    connection = sqlite3.connect(newer)
    connection.execute(f"PRAGMA user_version = {SESSION_FORMAT + 1}")
    connection.close()
    with running(path, monkeypatch) as (dashboard, told):
        shelf = dashboard.start._shelf
        shelf._do.value, shelf._chosen.value = "Open", newer.name
        shelf._act(NOBODY_IN_PARTICULAR)
        dashboard.jobs.wait()
        assert len(told) == 1
        assert "was written by a newer trueaxis" in told[0]
        assert "\n" not in told[0]
        assert dashboard.bench.session.path == path
        dashboard.acquire.measure(None)
        dashboard.jobs.wait()
        assert len(told) == 1


def test_a_campaign_that_finds_no_room_makes_no_session(tmp_path):
    with no_file_may_grow_beyond(4096), pytest.raises(SessionError, match=f"a{SUFFIX}: "):
        open_campaign(SAMPLES / "irb_l6", tmp_path / f"a{SUFFIX}")
    assert list(tmp_path.iterdir()) == []
