"""Reading a session file, whatever state it is in: everything that is intact, and sentences about what is not.

1. SQLite reads the rows; each tells by its check sum whether it is intact.
2. What stands in the journal beyond them, intact but not confirmed, is taken over.
3. Where SQLite cannot read the file, rows are asked for range by range, and entries are searched for in the
   bytes of file and journal.
"""

import sqlite3
import tempfile
from collections.abc import Iterable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from shutil import copyfile

from core.session_entries import SESSION_FORMAT, DamagedEntry, Entry, carved, decoded, newer
from core.session_events import Closed, Copied, Opened, SessionError
from core.session_journal import journal_parts
from core.session_store import APPLICATION, SCHEMA, TROUBLE, connect

LARGEST_FILE_BYTES = 1_000_000_000
MOST_SENTENCES = 20
LATEST_THINKABLE_FORMAT = 1000
JOURNALS = ("-wal", "-journal")
MOST_QUESTIONS = 20_000
"""To a damaged file."""


class DamagedFile(Exception):
    """SQLite reads the file, but it is not built like a session; the message says what is wrong."""


@dataclass(frozen=True)
class Contents:
    """What a session file holds."""

    entries: tuple[Entry, ...]
    """Those that are intact, by number."""
    unconfirmed: tuple[Entry, ...] = ()
    """Those among them that stand in the journal alone; whoever goes on writing has to write them again."""
    warnings: tuple[str, ...] = ()
    """What is not intact."""
    broken: bool = False
    """The file's structure is damaged: it must not be written to."""


def read_contents(path: Path, in_use: bool = False) -> Contents:
    """Everything that can be read of a session file.

    Args:
        in_use: another process is writing to it, so that an open end is as it should be.

    Raises:
        SessionError: the file is missing, unreadable, of a newer program, or nothing in it is intact.
    """
    check_readable(path)
    try:
        contents = _read(path)
    except (*TROUBLE, DamagedFile) as wrong:
        # SQLite's message may quote bytes of the file that are no text.
        unreadable = isinstance(wrong, UnicodeDecodeError)
        return _salvage(path, "its table of events cannot be read" if unreadable else " ".join(str(wrong).split()))
    return contents if in_use or contents.broken else _with_open_end(path, contents)


def read_after(path: Path, seq: int) -> tuple[Entry, ...]:
    """Entries that another process has added since.

    Raises:
        SessionError: the file cannot be read any more.
    """
    check_readable(path)
    try:
        with closing(connect(path, "ro")) as connection:
            return _rows(connection, path, seq).entries
    except TROUBLE as wrong:
        raise SessionError(f"{path} cannot be read: {wrong}") from None


def check_readable(path: Path) -> None:
    """Refuse what is no file of a sensible size.

    Raises:
        SessionError: it is missing, not a file, empty, huge, or may not be read.
    """
    try:
        if not path.is_file():
            raise SessionError(f"{path} is {'not a file' if path.exists() else 'missing'}, expected a session file")
        size = path.stat().st_size
        with path.open("rb"):
            pass
    except (OSError, ValueError) as wrong:
        raise SessionError(f"{path} cannot be read: {getattr(wrong, 'strerror', None) or wrong}") from None
    if size == 0:
        raise SessionError(f"{path} is empty (0 bytes), expected a session file")
    if size > LARGEST_FILE_BYTES:
        raise SessionError(f"{path} has {size / 1e6:.0f} MB, expected at most {LARGEST_FILE_BYTES / 1e6:.0f} MB")


def _read(path: Path) -> Contents:
    try:
        return _read_in_place(path)
    except sqlite3.OperationalError:
        # A file that was cut off is put right before it is read, which needs the right to write.
        with tempfile.TemporaryDirectory(prefix="trueaxis-") as folder:
            copy = Path(folder) / path.name
            for suffix in ("", *JOURNALS):
                beside = path.with_name(path.name + suffix)
                if beside.is_file():
                    copyfile(beside, copy.with_name(copy.name + suffix))
            return _read_in_place(copy, "rw")


def _read_in_place(path: Path, mode: str = "ro") -> Contents:
    with closing(connect(path, mode)) as connection:
        _check_is_session(connection, path)
        found = connection.execute("PRAGMA quick_check(1)").fetchone()[0]
        if found != b"ok":
            raise DamagedFile(found.decode(errors="replace"))
        return _rows(connection, path)


def _check_is_session(connection: sqlite3.Connection, path: Path) -> None:
    pragmas = ("application_id", "user_version")
    application, form = (connection.execute(f"PRAGMA {name}").fetchone()[0] for name in pragmas)
    if application != APPLICATION:
        raise DamagedFile("it does not say that it is a session")
    if form > LATEST_THINKABLE_FORMAT:
        raise DamagedFile("its format has no sensible number")
    if form > SESSION_FORMAT:
        raise SessionError(f"{path} {newer(form)}")
    schema = {row[0] for row in connection.execute("SELECT sql FROM sqlite_master")}
    if schema != {line.encode() for line in SCHEMA}:
        raise DamagedFile("its table of events is not as it was made")


def _rows(connection: sqlite3.Connection, path: Path, after: int = 0) -> Contents:
    entries, warnings = [], []
    expected = after + 1
    for seq, data in connection.execute("SELECT seq, entry FROM events WHERE seq > ? ORDER BY seq", (after,)):
        if seq > expected:
            warnings.append(_missing(expected, seq - 1))
        expected = seq + 1
        try:
            entries.append(_numbered(decoded(data), seq))
        except DamagedEntry as wrong:
            warnings.append(f"event {seq} is damaged and left out: {wrong}")
        except SessionError as wrong:
            raise SessionError(f"{path} {wrong}") from None
    return Contents(tuple(entries), warnings=_few(warnings))


def _with_open_end(path: Path, contents: Contents) -> Contents:
    """The same with what a program that was cut off left in the journal."""
    ends = [entry for entry in contents.entries if isinstance(entry.event, Opened | Closed | Copied)]
    last = contents.entries[-1].seq if contents.entries else 0
    journal = _journal_bytes(path)
    if not journal:
        if ends and isinstance(ends[-1].event, Opened):
            lost = (
                f"the session was cut off after {contents.entries[-1].utc} and its journal {_journal(path).name} is"
                " missing: what was measured last may be lost"
            )
            return Contents(contents.entries, warnings=(*contents.warnings, lost))
        return contents
    parts = journal_parts(journal)
    found, warnings = _after(parts.committed, last), list(contents.warnings)
    if found:
        warnings.append(f"{_counted(len(found))} at the end stood behind damage in the journal, and were taken over")
    half = _after(parts.unsure, found[-1].seq if found else last)
    if len(half) == 1:
        warnings.append(f"event {half[0].seq} was being written when the program was cut off, and was taken over")
        found += half
    elif half:
        warnings.append(f"{_counted(len(half))} were being written when the program was cut off, and are left out")
    return Contents((*contents.entries, *found), found, tuple(warnings))


def _after(journal: bytes, last: int) -> tuple[Entry, ...]:
    """Entries with larger numbers; a journal keeps older ones too."""
    found = {entry.seq: entry for entry in carved(journal) if entry.seq > last}
    return tuple(found[seq] for seq in sorted(found))


def _salvage(path: Path, reason: str) -> Contents:
    """Whatever is intact in a file that SQLite cannot make sense of."""
    found: dict[int, Entry] = {}
    for data in (path.read_bytes(), _journal_bytes(path)):
        found |= {entry.seq: entry for entry in carved(data)}
    if not found:
        raise SessionError(f"{path} is not a session of trueaxis, or nothing in it is intact ({reason})")
    found |= {entry.seq: entry for entry in _readable_rows(path, max(found) + 1000)}
    entries = tuple(found[seq] for seq in sorted(found))
    gaps, expected = [], 1
    for entry in entries:
        if entry.seq > expected:
            gaps.append(_missing(expected, entry.seq - 1))
        expected = entry.seq + 1
    told = f"the file is damaged ({reason}): of its events {len(entries)} are intact; save a copy to go on with them"
    if not isinstance(entries[-1].event, Closed | Copied):
        gaps.append(f"anything after event {entries[-1].seq} ({entries[-1].utc}) is lost")
    return Contents(entries, warnings=(told, *_few(gaps)), broken=True)


def _readable_rows(path: Path, last: int) -> list[Entry]:
    """Rows that SQLite still finds, asked for by ranges that are halved where it stumbles."""
    entries: list[Entry] = []
    ranges = [(1, last)]
    try:
        with closing(connect(path, "ro")) as connection:
            for _ in range(MOST_QUESTIONS):
                if not ranges:
                    break
                low, high = ranges.pop()
                try:
                    rows = connection.execute(
                        "SELECT seq, entry FROM events WHERE seq BETWEEN ? AND ?", (low, high)
                    ).fetchall()
                    entries += _intact(rows)
                except TROUBLE as wrong:
                    if "interrupted" in str(wrong) or "no such" in str(wrong):
                        break
                    middle = (low + high) // 2
                    ranges += [(low, middle), (middle + 1, high)] if low < high else []
    except TROUBLE:
        pass
    return entries


def _intact(rows: Iterable[tuple[object, object]]) -> list[Entry]:
    entries = []
    for seq, data in rows:
        try:
            entries.append(_numbered(decoded(data), seq))
        except (DamagedEntry, SessionError):
            continue
    return entries


def _numbered(entry: Entry, seq: object) -> Entry:
    if entry.seq != seq:
        raise DamagedEntry(f"it calls itself event {entry.seq}")
    return entry


def _journal(path: Path) -> Path:
    return path.with_name(path.name + JOURNALS[0])


def _journal_bytes(path: Path) -> bytes:
    try:
        return _journal(path).read_bytes()
    except OSError:
        return b""


def _counted(count: int) -> str:
    return "1 event" if count == 1 else f"{count} events"


def _missing(first: int, last: int) -> str:
    return f"event {first} is missing" if first == last else f"events {first} to {last} are missing"


def _few(sentences: list[str]) -> tuple[str, ...]:
    left = len(sentences) - MOST_SENTENCES
    return tuple(sentences) if left <= 0 else (*sentences[:MOST_SENTENCES], f"and {left} more places like these")
