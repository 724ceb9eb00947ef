"""Session files: one writer at a time, older and newer formats, no room, no right to write; list, search, copy."""

import shutil
import sqlite3
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from no_room import as_nobody, no_file_may_grow_beyond
from session_scenes import busy_session, demo_session, take

from core import session_entries, session_library, session_reader, session_store
from core.errors import InputError
from core.instruments import Reading
from core.session import Session
from core.session_campaign import export_campaign
from core.session_events import Fact, NoteWritten, OperatorNamed, SessionError, Titled
from core.session_library import copy_session, free_path, import_session, list_sessions, search

SEEN = Reading((1.0, 2.0, 3.0))
HOLD = """
import sys
from core.session import Session
session = Session.open(sys.argv[1])
print(session.why_read_only or "writing", flush=True)
sys.stdin.read()
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "a.trueaxis"
    busy_session(path).close()
    return path


@pytest.fixture
def open_folder() -> Iterator[Path]:
    """A folder that other users may enter."""
    folder = Path(tempfile.mkdtemp())
    folder.chmod(0o777)
    yield folder
    folder.chmod(0o777)
    shutil.rmtree(folder)


def note(number: int) -> str:
    return f"{number} " + "x" * 3000


def write_notes(session: Session, count: int) -> None:
    for number in range(count):
        session.append(NoteWritten(note(number)))


def read_only_folder(folder: Path) -> Path:
    path = folder / "a.trueaxis"
    busy_session(path).close()
    path.chmod(0o444)
    folder.chmod(0o555)
    return path


def test_a_second_process_reads_only_and_is_told_who_writes(path: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as other:
        assert other.stdout.readline() == "writing\n"
        with Session.open(path) as second:
            assert second.read_only
            assert f"process {other.pid} of " in second.why_read_only
            assert second.state.warnings == ()
            with pytest.raises(SessionError, match=f"cannot be written to: process {other.pid}"):
                second.append(Titled("mine"))
        other.kill()
    with Session.open(path) as third:
        assert not third.read_only
        third.append(Titled("mine"))


def test_the_same_process_gets_the_lock_once_too(path: Path) -> None:
    with Session.open(path) as first, Session.open(path) as second:
        assert (first.read_only, second.read_only) == (False, True)
    with Session.open(path) as third:
        assert not third.read_only


def test_a_lock_left_by_a_dead_process_holds_nobody(path: Path) -> None:
    path.with_name(path.name + ".lock").write_text('{"pid": 1, "user": "x", "host": "y", "since": "z"}')
    with Session.open(path) as session:
        assert not session.read_only


def test_two_writers_in_spite_of_the_lock_lose_nothing(path: Path) -> None:
    with Session.open(path) as first:
        path.with_name(path.name + ".lock").unlink()
        second = Session.open(path)
        second.append(Titled("second"))
        with pytest.raises(SessionError, match="another program wrote to this session meanwhile"):
            first.append(Titled("first"))
        second.close()
    with Session.open(path, read_only=True) as again:
        assert again.state.title == "second"


def test_a_read_only_folder_opens_for_reading(open_folder: Path) -> None:
    path = read_only_folder(open_folder)
    with as_nobody(), Session.open(path) as session:
        assert "cannot be written to" in session.why_read_only
        assert len(session.state.shots) == 12
        with pytest.raises(SessionError, match="cannot be written to"):
            session.append(Titled("x"))


def test_a_session_that_was_cut_off_opens_from_a_read_only_folder(open_folder: Path) -> None:
    path = open_folder / "a.trueaxis"
    session = busy_session(path)
    cut = open_folder / "cut"
    cut.mkdir()
    for suffix in ("", "-wal"):
        shutil.copy(path.with_name(path.name + suffix), cut / f"a.trueaxis{suffix}")
    session.close()
    cut.chmod(0o555)
    try:
        with as_nobody(), Session.open(cut / "a.trueaxis") as other:
            assert other.read_only
            assert other.state.shots == session.state.shots
            assert other.state.warnings == ()
    finally:
        cut.chmod(0o777)


def test_nothing_can_be_made_in_a_read_only_folder(open_folder: Path) -> None:
    path = read_only_folder(open_folder)
    with as_nobody():
        with pytest.raises(SessionError, match="cannot be written"):
            demo_session(open_folder / "b.trueaxis")
        with pytest.raises(SessionError, match="cannot be written"):
            copy_session(path, open_folder / "b.trueaxis")
        state = Session.open(path, read_only=True).state
        with pytest.raises(InputError, match="cannot be written"):
            export_campaign(state, open_folder / "campaign")
    assert [p.name for p in open_folder.iterdir()] == ["a.trueaxis"]


def test_a_full_disk_is_told_and_nothing_is_lost(path: Path) -> None:
    with Session.open(path) as session:
        pages = session._writer._connection.execute("PRAGMA page_count").fetchone()[0]
        session._writer._connection.execute(f"PRAGMA max_page_count = {pages}")
        before = len(session.entries)
        with pytest.raises(SessionError, match="the disk is full; nothing was saved, and nothing before it is lost"):
            write_notes(session, 1000)
        written = [entry.event.text for entry in session.entries[before:]]
        assert written == [note(k) for k in range(len(written))]
        with Session.open(path, read_only=True) as other:
            assert other.entries == session.entries
        session._writer._connection.execute("PRAGMA max_page_count = 1000000")
        session.append(Titled("room again"))
    with Session.open(path) as again:
        assert again.state.title == "room again"
        assert again.state.warnings == ()


def test_a_disk_that_fills_up_under_the_journal_is_told_too(path: Path) -> None:
    with Session.open(path) as session:
        journal = path.with_name(path.name + "-wal").stat().st_size
        with no_file_may_grow_beyond(journal + 50_000), pytest.raises(SessionError, match="nothing was saved"):
            write_notes(session, 1000)
        kept = session.entries
        session.append(Titled("room again"))
    with Session.open(path) as again:
        assert [entry.seq for entry in again.entries[: len(kept)]] == [entry.seq for entry in kept]
        assert again.state.title == "room again"
        assert again.state.warnings == ()


def test_a_disk_that_is_full_from_the_start_leaves_nothing_half_made(path: Path, tmp_path: Path) -> None:
    with no_file_may_grow_beyond(4096):
        with pytest.raises(SessionError, match=r"b\.trueaxis: "):
            demo_session(tmp_path / "b.trueaxis")
        with pytest.raises(SessionError, match=r"b\.trueaxis: "):
            copy_session(path, tmp_path / "b.trueaxis")
    assert [p.name for p in tmp_path.iterdir()] == ["a.trueaxis"]


def test_a_newer_file_is_refused_in_one_sentence(path: Path) -> None:
    connection = sqlite3.connect(path)
    now = session_entries.SESSION_FORMAT
    connection.execute(f"PRAGMA user_version = {now + 1}")
    connection.close()
    sentence = rf"newer trueaxis \(session format {now + 1}; this one reads up to {now}\)"
    for read_only in (True, False):
        with pytest.raises(SessionError, match=sentence) as told:
            Session.open(path, read_only=read_only)
        assert "\n" not in str(told.value)
    assert "newer trueaxis" in list_sessions(path.parent)[0].problem


def test_an_older_file_is_read_and_continued(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As if the next version called the title of a session its name."""

    def renamed(plain: dict) -> dict:
        if plain["kind"] == "titled":
            return {**plain, "title": plain["title"] + ", renamed"}
        return plain

    with Session.open(path, read_only=True) as before:
        shots = before.state.shots
    now = session_entries.SESSION_FORMAT
    for module in (session_entries, session_reader, session_store):
        monkeypatch.setattr(module, "SESSION_FORMAT", now + 1)
    monkeypatch.setitem(session_entries.MIGRATIONS, now, renamed)
    with Session.open(path) as session:
        assert session.state.title.endswith(", renamed")
        assert session.state.shots == shots
        session.append(Titled("new"))
    with Session.open(path) as again:
        assert again.state.title == "new"
        assert again.undo().title.endswith(", renamed")
    monkeypatch.undo()
    with pytest.raises(SessionError, match=f"session format {now + 1}"):
        Session.open(path)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"", "is empty"),
        (b"hello" * 1000, "not a session of trueaxis"),
        (b"SQLite format 3\0" + bytes(4080), "not a session of trueaxis"),
    ],
)
def test_what_is_no_session_is_refused(tmp_path: Path, content: bytes, sentence: str) -> None:
    path = tmp_path / "a.trueaxis"
    path.write_bytes(content)
    for read_only in (True, False):
        with pytest.raises(SessionError, match=sentence):
            Session.open(path, read_only=read_only)


def test_another_programs_database_is_refused_and_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "a.trueaxis"
    connection = sqlite3.connect(path)
    connection.execute("CREATE TABLE events (seq INTEGER PRIMARY KEY, entry TEXT NOT NULL)")
    connection.commit()
    connection.close()
    before = path.read_bytes()
    with pytest.raises(SessionError, match="it does not say that it is a session"):
        Session.open(path)
    assert path.read_bytes() == before


def test_a_view_that_never_ends_is_not_run(path: Path) -> None:
    connection = sqlite3.connect(path)
    connection.execute("DROP TABLE events")
    connection.execute(
        "CREATE VIEW events AS WITH RECURSIVE n(seq) AS (SELECT 1 UNION ALL SELECT seq + 1 FROM n)"
        " SELECT seq, 'x' AS entry FROM n"
    )
    connection.commit()
    connection.execute("VACUUM")
    connection.close()
    with pytest.raises(SessionError, match="nothing in it is intact"):
        Session.open(path)


def test_missing_files_and_folders_are_told(tmp_path: Path) -> None:
    for path in (tmp_path / "none.trueaxis", tmp_path, Path("a\0b")):
        with pytest.raises(SessionError, match=r"is missing|is not a file|cannot be read"):
            Session.open(path)
    with pytest.raises(SessionError, match="cannot be listed"):
        list_sessions(tmp_path / "none")
    assert list(tmp_path.iterdir()) == []


def test_a_session_is_never_made_over_another(path: Path) -> None:
    before = path.read_bytes()
    with pytest.raises(SessionError, match="is there already"):
        demo_session(path)
    with pytest.raises(SessionError, match="is there already"):
        copy_session(path, path)
    assert path.read_bytes() == before


def test_a_session_that_is_written_to_can_be_copied(tmp_path: Path) -> None:
    with demo_session(tmp_path / "a.trueaxis") as session:
        take(session, 3, SEEN)
        copy_session(session.path, tmp_path / "b.trueaxis")
        take(session, 2, SEEN)
        with Session.open(tmp_path / "b.trueaxis") as copy:
            assert copy.state.shots == session.state.shots[:3]
            assert copy.state.warnings == ()
            take(copy, 1, SEEN)
        assert len(session.state.shots) == 5


def test_imported_sessions_get_a_name_of_their_own(path: Path, tmp_path: Path) -> None:
    folder = tmp_path / "sessions"
    folder.mkdir()
    names = [import_session(path, folder).name for _ in range(3)]
    assert names == ["a.trueaxis", "a-2.trueaxis", "a-3.trueaxis"]
    with Session.open(folder / "a-3.trueaxis") as session, Session.open(path, read_only=True) as original:
        assert session.state.shots == original.state.shots


@pytest.mark.parametrize("title", ["../../etc/passwd", "", "....", "a/b\\c:d", "Prüfstand 3", "x" * 500, "\n"])
def test_file_names_from_titles_stay_in_the_folder(tmp_path: Path, title: str) -> None:
    path = free_path(tmp_path, title)
    assert path.parent == tmp_path
    path.touch()
    assert path.name[0] != "."


def test_sessions_are_listed_and_searched(tmp_path: Path) -> None:
    for name, title, who in (("a", "Old hall", "Ida"), ("b", "Old hall", "Jo"), ("c", "New hall", "Ida")):
        with demo_session(tmp_path / f"{name}.trueaxis") as session:
            session.append_all([Titled(title), OperatorNamed(who), Fact("serial", f"SN-{name}")])
            take(session, 2, SEEN)
    (tmp_path / "broken.trueaxis").write_bytes(b"nonsense")
    (tmp_path / "notes.txt").write_text("nothing")
    listed = list_sessions(tmp_path)
    assert [summary.path.stem for summary in listed] == ["c", "b", "a", "broken"]
    assert [summary.shots for summary in listed] == [2, 2, 2, 0]
    assert (listed[0].robot, listed[0].planned) == ("ASEA IRB L6", 129)
    assert "not a session" in listed[-1].problem

    def found(words: str) -> list[str]:
        return [summary.path.stem for summary in search(tmp_path, words)]

    assert found("old hall ida") == ["a"]
    assert found("IDA") == ["c", "a"]
    assert found("sn-b") == ["b"]
    assert found("brok") == ["broken"]
    assert found("nobody") == []


def test_a_shelf_reads_a_file_again_only_when_it_has_changed(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read = []

    def counted(one: Path, in_use: bool = False):
        read.append(one.name)
        return session_reader.read_contents(one, in_use)

    monkeypatch.setattr(session_library, "read_contents", counted)
    copy_session(path, path.with_name("b.trueaxis"))
    shelf, read[:] = session_library.Shelf(path.parent), []
    assert [one.path.name for one in shelf.summaries()] == [one.path.name for one in shelf.summaries()]
    assert sorted(read) == ["a.trueaxis", "b.trueaxis"]
    with Session.open(path) as session:
        session.append(Titled("found again"))
        assert [one.title for one in shelf.summaries("found")] == ["found again"]
        assert sorted(read) == ["a.trueaxis", "a.trueaxis", "b.trueaxis"]
        session.append(Titled("as it is now"))
        own = shelf.summaries("as it is now", (path, session.state))
        assert [one.title for one in own] == ["as it is now"]
    assert sorted(read) == ["a.trueaxis", "a.trueaxis", "b.trueaxis"]
