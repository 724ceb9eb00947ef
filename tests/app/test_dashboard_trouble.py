"""A running dashboard in trouble, without a browser: full disks, damaged sessions, values that no page would send."""

import sqlite3
from collections.abc import Callable
from contextlib import contextmanager
from types import SimpleNamespace

import pytest

from app.dashboard import Dashboard
from app.uploads import LARGEST_BYTES, guard_uploads
from app.workbench import Workbench
from core.session import Session
from core.session_events import NoteWritten
from core.session_store import SUFFIX
from core.twin import irb_l6
from core.twin.demo import demo_events
from tests.core.no_room import no_file_may_grow_beyond

ODD = {
    str: ("", " ", "x" * 5000, "<script>", "\0", "\n" * 50, "1e999", "nan", "-1", "1 2 3", "../../etc/passwd"),
    float: (float("nan"), float("inf"), -1.0, 1e30, 0.5),
    int: (-1, 0, 10**30),
}
"""What a browser may send instead of what the page offers; viser casts it to the type of the input, no more."""
CRASHED = "This did not work"


class Told(list):
    """Sentences that the page told."""

    def __call__(self, client: object, sentence: str) -> None:
        self.append(sentence)


@pytest.fixture
def path(tmp_path):
    path = tmp_path / f"demo{SUFFIX}"
    Session.create(path, demo_events(irb_l6.cell()), by="A. Operator").close()
    return path


@contextmanager
def running(path, monkeypatch):
    dashboard = Dashboard(Workbench(Session.open(path)), port=0)
    told = Told()
    monkeypatch.setattr(dashboard, "say", told)
    try:
        yield dashboard, told
    finally:
        dashboard.stop()


def test_a_full_disk_is_told_nothing_is_lost_and_it_goes_on_when_there_is_room(path, monkeypatch):
    with running(path, monkeypatch) as (dashboard, told):
        for _ in range(3):
            dashboard.acquire.measure(None)
        dashboard.jobs.wait()
        # Until the journal is as large as the limit, so that not one more page fits.
        dashboard.bench.session.append(NoteWritten("x" * 9000))
        size = max(p.stat().st_size for p in path.parent.iterdir())
        with no_file_may_grow_beyond(size):
            for _ in range(4):
                dashboard.acquire.measure(None)
            dashboard.jobs.wait()
        assert told
        assert all("nothing was saved, and nothing before it is lost" in sentence for sentence in told)
        kept = len(dashboard.bench.state.shots)
        assert 3 <= kept < 7
        dashboard.acquire.measure(None)
        dashboard.jobs.wait()
        assert len(dashboard.bench.state.shots) == kept + 1
    with Session.open(path, read_only=True) as session:
        assert len(session.state.shots) == kept + 1


def test_what_is_intact_of_a_damaged_session_is_shown(path, monkeypatch):
    with sqlite3.connect(path) as connection:
        connection.execute("DROP TRIGGER undeletable")
        connection.execute("DROP TRIGGER unchangeable")
        connection.execute("DELETE FROM events WHERE seq = 3")
    connection.close()
    with running(path, monkeypatch) as (dashboard, told):
        assert dashboard.bench.nominal.name == "no robot"
        intro = dashboard.start._intro.content
        assert "event 3 is missing" in intro or "damaged" in intro
        for act in (dashboard.acquire.measure, dashboard.acquire.undo, dashboard.solve.solve, dashboard.acquire.skip):
            act(None)
        dashboard.jobs.wait()
        assert told
        assert not [sentence for sentence in told if sentence.startswith(CRASHED)]


def inputs(panel: object, seen: set[int] | None = None):
    """Every input of a panel, whatever object of the panel holds it."""
    seen = set() if seen is None else seen
    for value in list(vars(panel).values()):
        group = value.values() if isinstance(value, dict) else (value,)
        for one in group:
            if id(one) in seen:
                continue
            seen.add(id(one))
            if type(one).__module__.startswith("viser") and hasattr(getattr(one, "_impl", None), "update_cb"):
                if type(one).__name__ not in ("GuiHtmlHandle", "GuiProgressBarHandle"):
                    yield one
            elif type(one).__module__.startswith("app.panels"):
                yield from inputs(one, seen)


def press_all(panel: object) -> None:
    """Call back for every button and button group of a panel, as if somebody had pressed it."""
    for handle in inputs(panel):
        for callback in list(handle._impl.update_cb):
            callback(SimpleNamespace(client=None, client_id=None, target=handle))


@pytest.mark.parametrize("name", ["start", "check", "acquire", "solve"])
def test_values_that_no_page_would_send_get_a_sentence_and_change_nothing(path, monkeypatch, name):
    with running(path, monkeypatch) as (dashboard, told):
        panel = getattr(dashboard, name)
        handles = [handle for handle in inputs(panel) if not handle._impl.is_button]
        assert handles or name == "acquire"
        for round_ in range(max(map(len, ODD.values()))):
            for handle in handles:
                odd = ODD.get(type(handle._impl.value), ())
                if odd:
                    # As a browser's message does, past all checks of the handle.
                    handle._impl.value = odd[round_ % len(odd)]
            press_all(panel)
            dashboard.jobs.wait()
        assert not [sentence for sentence in told if sentence.startswith(CRASHED)]
        state = dashboard.bench.state
        assert state.robot.joint_count == 6
        assert [target.name for target in state.targets] == ["T1", "T2", "T3", "T4", "T5", "T6"]
        dashboard.bench.changed()


class Wire:
    """What of a server the guard looks at."""

    def __init__(self) -> None:
        self.handlers: dict[type, Callable] = {}

    def register_handler(self, kind: type, handler: Callable) -> None:
        self.handlers[kind] = handler

    def unregister_handler(self, kind: type, handler: Callable) -> None:
        self.handlers.pop(kind, None)


def test_files_that_are_too_large_or_not_as_announced_are_not_taken(path, monkeypatch):
    from viser import _messages

    with running(path, monkeypatch) as (dashboard, _):
        gui, wire = dashboard.server.gui, Wire()
        refused: list[str] = []
        told: list[object] = []
        browser = SimpleNamespace(gui=SimpleNamespace(_websock_interface=SimpleNamespace(queue_message=told.append)))
        server = SimpleNamespace(gui=gui, _websock_server=wire, get_clients=lambda: {1: browser})
        guard_uploads(server, lambda client: client == 1, lambda client, why: refused.append(why))
        start = wire.handlers[_messages.FileTransferStartUpload]
        part = wire.handlers[_messages.FileTransferPart]
        button = dashboard.start._new._upload._impl.uuid

        def announced(number: int, size: int, client: int = 1) -> None:
            start(client, _messages.FileTransferStartUpload(button, f"u{number}", "a.csv", "text/csv", 3, size))

        announced(1, LARGEST_BYTES + 1)
        # The browser's button is free again and its notice is gone.
        done, gone = told
        assert (done.transfer_uuid, done.transferred_bytes) == ("u1", done.total_bytes)
        assert gone == _messages.RemoveNotificationMessage("upload-u1")
        announced(2, -5)
        announced(3, 10, client=2)
        assert [("MB" in why, "seat" in why) for why in refused] == [(True, False), (True, False), (False, True)]
        for number in range(4, 9):
            announced(number, 10)
        assert "4 files are on their way" in refused[-1]
        assert len(gui._current_file_upload_states) == 4
        part(1, _messages.FileTransferPart(button, "u4", 0, b"x" * 11))
        assert "u4" not in gui._current_file_upload_states
        part(2, _messages.FileTransferPart(button, "u5", 0, b"x"))
        assert "u5" not in gui._current_file_upload_states
        part(1, _messages.FileTransferPart(button, "gone", 0, b"x"))
        assert "send it again" in refused[-1]
        gui._current_file_upload_states.clear()
