"""One session, one SQLite file: a table of events to which rows are only ever added.

Journal in WAL mode, ``synchronous=FULL``: when ``append`` returns, the event is on the disk. Triggers refuse to change
or delete a row. What stands in the rows is told in ``core.session_entries``; how a file is read, damaged ones too, in
``core.session_reader``.
"""

import contextlib
import os
import sqlite3
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from core.session_entries import SESSION_FORMAT, Entry, encoded
from core.session_events import LONGEST_EVENT_BYTES, SessionError

SUFFIX = ".trueaxis"
APPLICATION = 0x54724178
"""``TrAx``: SQLite's mark of what a file is."""
PATIENCE_S = 20.0
"""No honest file takes longer to read."""
TROUBLE = (sqlite3.Error, UnicodeDecodeError, MemoryError)
"""What Python's SQLite raises over a damaged file; its messages may quote bytes that are no text."""
SCHEMA = (
    "CREATE TABLE events (seq INTEGER PRIMARY KEY, entry TEXT NOT NULL)",
    "CREATE TRIGGER unchangeable BEFORE UPDATE ON events BEGIN SELECT RAISE(ABORT, 'events are never changed'); END",
    "CREATE TRIGGER undeletable BEFORE DELETE ON events BEGIN SELECT RAISE(ABORT, 'events are never deleted'); END",
)


class Writer:
    """An open session file to which events can be added."""

    def __init__(self, path: Path) -> None:
        """Open an existing file that has been read before.

        Raises:
            SessionError: it cannot be written to.
        """
        self._path = path
        with _told(path, "cannot be opened for writing"):
            self._connection = connect(path, "rw")
            self._connection.set_progress_handler(None, 0)
            self._connection.execute("PRAGMA journal_mode = WAL")
            self._connection.execute("PRAGMA synchronous = FULL")
            # Little is lost then if somebody takes the file alone away, without its journal.
            self._connection.execute("PRAGMA wal_autocheckpoint = 100")
            self._connection.execute(f"PRAGMA user_version = {SESSION_FORMAT}")

    def append(self, entries: Iterable[Entry]) -> None:
        """Add events, all or none; they are on the disk when this returns.

        Raises:
            SessionError: the disk is full, the file went read-only, or another program wrote to it meanwhile.
        """
        rows = [(entry.seq, encoded(entry).decode()) for entry in entries]
        with _told(self._path, "nothing was saved, and nothing before it is lost"), _transaction(self._connection):
            self._connection.executemany("INSERT INTO events VALUES (?, ?)", rows)

    def checkpoint(self) -> None:
        """Bring what the journal holds into the file, as far as readers allow."""
        with contextlib.suppress(*TROUBLE):
            self._connection.execute("PRAGMA wal_checkpoint(PASSIVE)")

    def close(self) -> None:
        """Bring everything into the one file and let it go."""
        with contextlib.suppress(*TROUBLE):
            self._connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
            # Back to one plain file; while others read it, it stays as it is.
            self._connection.execute("PRAGMA journal_mode = DELETE")
        with contextlib.suppress(*TROUBLE):
            self._connection.close()


def connect(path: Path, mode: str) -> sqlite3.Connection:
    """A connection to an existing file, ``ro`` or ``rw``, that trusts nothing in it.

    Raises:
        sqlite3.Error: it cannot be opened.
    """
    uri = f"{path.absolute().as_uri()}?mode={mode}"
    connection = sqlite3.connect(uri, uri=True, isolation_level=None, check_same_thread=False, timeout=5.0)
    connection.text_factory = bytes
    connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, 2 * LONGEST_EVENT_BYTES)
    connection.execute("PRAGMA trusted_schema = OFF")
    end = time.monotonic() + PATIENCE_S
    connection.set_progress_handler(lambda: time.monotonic() > end, 1_000_000)
    return connection


def write_new(path: Path, entries: Iterable[Entry]) -> None:
    """Make a session file that holds these entries; it appears whole or not at all.

    Raises:
        SessionError: there is such a file, or the folder cannot be written to.
    """
    with _new_database(path) as connection:
        for line in ("page_size = 8192", f"application_id = {APPLICATION}", f"user_version = {SESSION_FORMAT}"):
            connection.execute(f"PRAGMA {line}")
        # A journal on the disk is of no use to a file that nobody sees before it is complete.
        connection.execute("PRAGMA journal_mode = MEMORY")
        with _transaction(connection):
            for line in SCHEMA:
                connection.execute(line)
            rows = ((entry.seq, encoded(entry).decode()) for entry in entries)
            connection.executemany("INSERT INTO events VALUES (?, ?)", rows)


def copy_file(source: Path, path: Path, ending: Callable[[int], Entry]) -> None:
    """Copy an intact session file, also while it is being written to, to a new file; it appears whole or not at all.

    Args:
        ending: makes the entry that ends the copy, of the number of its last one.

    Raises:
        SessionError: the source cannot be read or the copy cannot be written.
    """
    with _told(source, "cannot be copied"), closing(connect(source, "ro")) as connection, _new_database(path) as copy:
        connection.backup(copy)
        copy.execute("PRAGMA journal_mode = DELETE")
        last = copy.execute("SELECT max(seq) FROM events").fetchone()[0]
        with _transaction(copy):
            entry = ending(last or 0)
            copy.execute("INSERT INTO events VALUES (?, ?)", (entry.seq, encoded(entry).decode()))


@contextmanager
def _new_database(path: Path) -> Iterator[sqlite3.Connection]:
    """A database that appears under its name when it is complete and on the disk; the name must be free."""
    if path.exists():
        raise SessionError(f"{path} is there already, expected the name of a new file")
    beside = path.with_name(f".{path.name}.{os.getpid()}.{time.monotonic_ns()}.part")
    try:
        with _told(path, "cannot be written"):
            with closing(sqlite3.connect(beside, isolation_level=None)) as connection:
                yield connection
            _to_disk(beside)
            _name(beside, path)
            _to_disk(path.parent)
    finally:
        for suffix in ("", "-journal", "-wal", "-shm"):
            with contextlib.suppress(OSError):
                beside.with_name(beside.name + suffix).unlink()


def _name(beside: Path, path: Path) -> None:
    try:
        os.link(beside, path)
    except FileExistsError:
        raise
    except OSError:
        # Some file systems know no links.
        os.rename(beside, path)


def _to_disk(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextmanager
def _transaction(connection: sqlite3.Connection) -> Iterator[None]:
    connection.execute("BEGIN IMMEDIATE")
    try:
        yield
        connection.execute("COMMIT")
    except BaseException:
        with contextlib.suppress(*TROUBLE):
            connection.execute("ROLLBACK")
        raise


@contextmanager
def _told(path: Path, what: str) -> Iterator[None]:
    """Say in a sentence what SQLite or the system refused."""
    try:
        yield
    except FileExistsError:
        raise SessionError(f"{path} is there already, expected the name of a new file") from None
    except sqlite3.IntegrityError:
        raise SessionError(f"{path}: another program wrote to this session meanwhile; {what}") from None
    except (*TROUBLE, OSError) as wrong:
        raise SessionError(f"{path}: {_reason(wrong)}; {what}") from None


def _reason(wrong: Exception) -> str:
    text = getattr(wrong, "strerror", None) or str(wrong)
    known = {
        "database or disk is full": "the disk is full",
        "No space left on device": "the disk is full",
        "attempt to write a readonly database": "the file is read-only",
        "unable to open database file": "the file or its folder cannot be written to",
        "disk I/O error": "the disk reported an error",
        "database is locked": "another program holds the file",
    }
    return known.get(text, text)
