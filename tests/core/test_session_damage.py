"""A damaged session opens with what is intact and says what is not; never a traceback."""

import random
import shutil
import sqlite3
from pathlib import Path

import pytest
from session_scenes import busy_session, demo_session, take

from core.errors import InputError
from core.session import Session
from core.session_entries import decoded, encoded
from core.session_events import Closed, Copied, NoteWritten, Opened, Titled
from core.session_library import copy_session, list_sessions
from core.session_store import SCHEMA

MUTATIONS = 2100
FILING = (Opened, Closed, Copied)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A session that was closed in good order."""
    path = tmp_path / "a.trueaxis"
    busy_session(path).close()
    return path


@pytest.fixture
def cut_off(tmp_path: Path) -> Path:
    """A session whose program was cut off: part of it stands in the journal alone."""
    session = busy_session(tmp_path / "open.trueaxis")
    folder = tmp_path / "cut"
    folder.mkdir()
    for suffix in ("", "-wal"):
        shutil.copy(tmp_path / f"open.trueaxis{suffix}", folder / f"a.trueaxis{suffix}")
    session.close()
    return folder / "a.trueaxis"


def rows(path: Path) -> dict[int, bytes]:
    with Session.open(path, read_only=True) as session:
        return {entry.seq: encoded(entry) for entry in session.entries}


def decisions(path: Path) -> dict[int, bytes]:
    return {seq: row for seq, row in rows(path).items() if not isinstance(decoded(row).event, FILING)}


def rewrite(path: Path, seq: int, payload: object) -> None:
    """Change a row behind the back of the triggers."""
    connection = sqlite3.connect(path)
    connection.execute("DROP TRIGGER unchangeable")
    connection.execute("UPDATE events SET entry = ? WHERE seq = ?", (payload, seq))
    connection.execute(SCHEMA[1])
    connection.commit()
    connection.close()


@pytest.mark.parametrize(
    "payload", ["{", "", "[]", b"\xff\xfe", 5, '{"crc":"00000000","size":"0000002",}}', "x" * 100_000]
)
def test_a_bad_row_is_left_out_and_named(path: Path, payload: object) -> None:
    with Session.open(path, read_only=True) as session:
        lost = session.state.shots[4]
    rewrite(path, lost.id, payload)
    with Session.open(path) as session:
        assert not session.read_only
        assert len(session.state.shots) == 11
        assert session.state.shot(lost.id) is None
        (warning,) = session.state.warnings
        assert warning.startswith(f"event {lost.id} is damaged and left out")
        session.append(Titled("goes on"))
    assert "is damaged" in list_sessions(path.parent)[0].problem


def test_a_changed_number_in_a_row_is_noticed(path: Path) -> None:
    data = rows(path)[12].decode()
    digit = data.index('"point_m":[') + 14
    rewrite(path, 12, data[:digit] + ("1" if data[digit] != "1" else "2") + data[digit + 1 :])
    with Session.open(path) as session:
        assert session.state.warnings == ("event 12 is damaged and left out: its check sum does not fit",)


def test_a_session_without_its_robot_still_shows_its_shots(path: Path) -> None:
    rewrite(path, 3, "gone")
    with Session.open(path) as session:
        assert session.state.robot is None
        assert session.state.steps == ()
        assert len(session.state.shots) == 12


def test_a_missing_row_is_named(path: Path) -> None:
    connection = sqlite3.connect(path)
    connection.execute("DROP TRIGGER undeletable")
    connection.execute("DELETE FROM events WHERE seq IN (14, 15, 18)")
    connection.execute(SCHEMA[2])
    connection.commit()
    connection.close()
    with Session.open(path) as session:
        assert session.state.warnings == ("events 14 to 15 are missing", "event 18 is missing")
        session.undo()


def test_a_missing_journal_is_told(cut_off: Path) -> None:
    cut_off.with_name("a.trueaxis-wal").unlink()
    with Session.open(cut_off) as session:
        assert session.state.robot is not None
        assert session.state.shots == ()
        assert "its journal a.trueaxis-wal is missing" in session.state.warnings[0]
        assert not session.read_only
    with Session.open(cut_off) as again:
        assert again.state.warnings == ()


def test_most_stands_in_the_file_itself_even_without_its_journal(tmp_path: Path) -> None:
    with demo_session(tmp_path / "a.trueaxis") as session:
        take(session, 129)
        shutil.copy(session.path, tmp_path / "b.trueaxis")
    with Session.open(tmp_path / "b.trueaxis") as other:
        assert 29 <= len(other.state.shots) < 129
        assert "is missing" in other.state.warnings[0]


def test_a_flipped_bit_in_the_journal_loses_no_other_event(cut_off: Path) -> None:
    whole, journal = rows(cut_off), cut_off.with_name("a.trueaxis-wal")
    data = bytearray(journal.read_bytes())
    # In the checksum of an early frame: SQLite would ignore everything from there on.
    data[32 + 16] ^= 1
    journal.write_bytes(data)
    with Session.open(cut_off) as session:
        assert "stood behind damage in the journal" in session.state.warnings[0]
        assert not session.read_only
        session.append(Titled("goes on"))
    again = rows(cut_off)
    assert all(again[seq] == row for seq, row in whole.items())


def test_what_was_never_committed_is_not_taken_over(cut_off: Path) -> None:
    """A program may be killed when an event is written to the journal, and its commit is not."""
    whole, journal = rows(cut_off), cut_off.with_name("a.trueaxis-wal")
    data = bytearray(journal.read_bytes())
    page = int.from_bytes(data[8:12], "big")
    last = len(data) - page - 24
    assert any(data[last + 4 : last + 8])
    data[last + 4 : last + 8] = bytes(4)
    journal.write_bytes(data)
    with Session.open(cut_off) as session:
        assert session.state.warnings == ()
        assert len(session.entries) == len(whole)  # The last one is gone, "opened" is new.
        assert session.entries[-1].kind == "opened"


def test_a_damaged_last_frame_gives_its_event_if_that_is_intact(cut_off: Path) -> None:
    whole, journal = rows(cut_off), cut_off.with_name("a.trueaxis-wal")
    data = bytearray(journal.read_bytes())
    data[-int.from_bytes(data[8:12], "big") - 1] ^= 1
    journal.write_bytes(data)
    with Session.open(cut_off) as session:
        assert "was being written when the program was cut off, and was taken over" in session.state.warnings[0]
        assert {entry.seq: encoded(entry) for entry in session.entries[:-1]} == whole


def test_half_of_what_belongs_together_is_left_out(tmp_path: Path) -> None:
    """Events that were appended together, and their last page did not reach the journal."""
    with demo_session(tmp_path / "a.trueaxis") as session:
        before = session.entries
        session.append_all([NoteWritten(f"{number} " + "x" * 3000) for number in range(20)])
        for suffix in ("", "-wal"):
            shutil.copy(tmp_path / f"a.trueaxis{suffix}", tmp_path / f"b.trueaxis{suffix}")
    journal = tmp_path / "b.trueaxis-wal"
    journal.write_bytes(journal.read_bytes()[:-8000])
    with Session.open(tmp_path / "b.trueaxis") as other:
        assert other.entries[:-1] == before
        assert "were being written when the program was cut off, and are left out" in other.state.warnings[0]


@pytest.mark.parametrize("share", [0.5, 0.8])
def test_a_truncated_file_gives_what_is_left(path: Path, share: float) -> None:
    whole, data = rows(path), path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    with Session.open(path) as session:
        assert session.read_only
        assert "save a copy" in session.why_read_only
        assert "the file is damaged" in session.state.warnings[0]
        assert all(encoded(entry) == whole[entry.seq] for entry in session.entries)
        assert len(session.entries) > (len(whole) * share) / 3


def test_a_file_cut_within_its_last_page_says_which_events_are_lost(path: Path) -> None:
    whole, data = rows(path), path.read_bytes()
    path.write_bytes(data[:-200])
    with Session.open(path) as session:
        kept = {entry.seq: encoded(entry) for entry in session.entries}
        lost = set(whole) - set(kept)
        assert lost
        assert all(str(seq) in " ".join(session.state.warnings) for seq in lost)
        assert all(kept[seq] == whole[seq] for seq in set(whole) & set(kept))


def test_a_copy_of_a_damaged_session_can_be_continued(path: Path, tmp_path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[0:16] = bytes(16)
    path.write_bytes(data)
    with Session.open(path) as damaged:
        assert damaged.read_only
        assert len(damaged.state.shots) == 12
    copy_session(path, tmp_path / "b.trueaxis")
    with Session.open(tmp_path / "b.trueaxis") as session:
        assert not session.read_only
        assert session.state.shots == damaged.state.shots
        assert session.state.warnings == ()
        session.append(Titled("goes on"))


def mutated(data: bytes, rng: random.Random) -> bytes:
    """The bytes of a file after an accident."""
    out, accident = bytearray(data), rng.randrange(7)
    place = rng.randrange(len(out))
    if accident == 0:
        return bytes(out[:place])
    if accident == 1:
        for _ in range(rng.randint(1, 3)):
            out[rng.randrange(len(out))] ^= 1 << rng.randrange(8)
    elif accident == 2:
        for _ in range(rng.randint(1, 200)):
            out[rng.randrange(len(out))] = rng.randrange(256)
    elif accident == 3:
        end = min(len(out), place + rng.choice([16, 512, 4096, 8192]))
        out[place:end] = bytes(end - place)
    elif accident == 4:
        for _ in range(3):
            out[rng.randrange(min(200, len(out)))] = rng.randrange(256)
    elif accident == 5:
        out[place:place] = rng.randbytes(rng.randint(1, 100))
    else:
        other = rng.randrange(len(out))
        out[place : place + 4096], out[other : other + 4096] = out[other : other + 4096], out[place : place + 4096]
    return bytes(out)


def examine(path: Path, whole: dict[int, bytes], read_only: bool) -> tuple[bool, bool]:
    """Open, use, close; whether anything is lost, and whether that was said."""
    with Session.open(path, read_only=read_only) as session:
        found = {entry.seq: encoded(entry) for entry in session.entries if not isinstance(entry.event, FILING)}
        assert all(whole.get(seq) == row for seq, row in found.items())
        warned, lost = bool(session.state.warnings), len(found) < len(whole)
        assert session.state.position is None or session.state.robot is not None
        if not session.read_only:
            count = len(session.entries)
            assert len(session.append(Titled("goes on")).shots) == len(session.state.shots)
            assert len(session.entries) == count + 1
    return lost, warned


@pytest.mark.slow
def test_thousands_of_mutated_files(path: Path, cut_off: Path, tmp_path: Path) -> None:
    rng, outcomes = random.Random(20260301), {"refused": 0, "lost": 0, "whole": 0}
    sentences: list[str] = []
    journal_path = cut_off.with_name("a.trueaxis-wal")
    closed, half, journal = path.read_bytes(), cut_off.read_bytes(), journal_path.read_bytes()
    files = [path, cut_off]
    whole = [
        {seq: row for seq, row in rows(file).items() if b'"opened"' not in row and b'"closed"' not in row}
        for file in files
    ]
    folder = tmp_path / "mutants"
    folder.mkdir()
    mutant = folder / "m.trueaxis"
    for number in range(MUTATIONS):
        for left in folder.iterdir():
            left.unlink()
        kind = number % 3
        mutant.write_bytes((mutated(closed, rng), mutated(half, rng), half)[kind])
        if kind:
            mutant.with_name("m.trueaxis-wal").write_bytes(mutated(journal, rng) if kind == 2 else journal)
        try:
            lost, warned = examine(mutant, whole[kind > 0], read_only=rng.random() < 0.5)
        except InputError as wrong:
            outcomes["refused"] += 1
            sentences.append(str(wrong))
            continue
        # The end of a journal may go unnoticed: it looks as if the program had been cut off earlier.
        assert warned or not lost or kind == 2
        outcomes["lost" if lost else "whole"] += 1
    assert not [sentence for sentence in sentences if len(sentence.splitlines()) > 1]
    assert outcomes["lost"] > MUTATIONS / 10
    assert outcomes["whole"] > MUTATIONS / 10
    assert outcomes["refused"] < MUTATIONS / 10
