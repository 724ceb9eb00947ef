"""A session: a file of events, the state that they add up to, and the way to add one more.

    with Session.create(path, [Titled("IRB L6, as found")], by="A. Name") as session:
        session.append(ShotTaken(...))
        session.undo()
        session.state.next_step

When ``append`` returns, the event is on the disk. One process writes; all others read.
"""

import contextlib
from collections.abc import Iterable
from pathlib import Path
from threading import RLock
from typing import Self

from core.session_checks import check_event
from core.session_entries import Entry, new_entry
from core.session_events import AnyEvent, Closed, Copied, Created, Event, Opened, Redo, SessionError, Undo
from core.session_fold import applied
from core.session_lock import LockRefused, WriteLock, lock_for, writer_of
from core.session_reader import Contents, check_readable, read_after, read_contents
from core.session_state import State
from core.session_store import Writer, write_new
from core.session_timeline import Timeline
from core.version import VERSION

OWN_KINDS = (Created, Opened, Closed, Copied, Undo, Redo)
"""Events that the session itself writes."""


class Session:
    """An open session; it may be used from several threads."""

    def __init__(self, path: Path, contents: Contents, lock: WriteLock | None, why_read_only: str) -> None:
        """Not to be called: ``open`` and ``create`` are the ways in."""
        self.path = path
        self.why_read_only = why_read_only
        """Empty while the session can be written to."""
        self._timeline = Timeline(contents.entries, contents.warnings)
        self._lock, self._writer = lock, None
        self._guard = RLock()
        if lock is not None:
            self._start_writing(contents.unconfirmed)

    @classmethod
    def open(cls, path: Path | str, read_only: bool = False) -> Self:
        """Open a session file.

        If another process writes to it, its folder is read-only or its structure is damaged, it opens read-only and
        ``why_read_only`` tells the reason. What is not intact stands in ``state.warnings``.

        Raises:
            SessionError: the file is missing, no session, of a newer program, or nothing in it is intact.
        """
        path = Path(path)
        check_readable(path)
        lock, why, in_use = None, "it was opened for reading only", False
        if read_only:
            in_use = writer_of(path) is not None
        else:
            try:
                lock = lock_for(path)
            except LockRefused as refused:
                why, in_use = str(refused), refused.in_use
        try:
            contents = read_contents(path, in_use)
            if lock is not None and contents.broken:
                lock.release()
                lock, why = None, "it is damaged; save a copy to go on with it"
            return cls(path, contents, lock, "" if lock else why)
        except BaseException:
            if lock is not None:
                lock.release()
            raise

    @classmethod
    def create(cls, path: Path | str, events: Iterable[Event] = (), by: str = "") -> Self:
        """Make a session file with its first events and open it; the file appears whole or not at all.

        Raises:
            SessionError: there is such a file, or it cannot be written.
            InputError: an event cannot be.
        """
        path = Path(path)
        first = new_entry(1, Created(VERSION), by)
        entries, _ = _next_entries(applied(State(), first), 2, events, by)
        write_new(path, [first, *entries])
        return cls.open(path)

    @property
    def read_only(self) -> bool:
        return bool(self.why_read_only)

    @property
    def state(self) -> State:
        """What the session says now."""
        return self._timeline.state

    @property
    def entries(self) -> tuple[Entry, ...]:
        """Every event that ever was, with number, time and author."""
        with self._guard:
            return self._timeline.entries

    def event(self, seq: int) -> AnyEvent:
        """The event of a number.

        Raises:
            KeyError: there is none.
        """
        with self._guard:
            return self._timeline.entry(seq).event

    @property
    def began(self) -> int:
        """Number of the first event that is not what the session was made with."""
        with self._guard:
            return self._timeline.first_opened

    def decisions_since(self, seq: int) -> int:
        """How many shots and decisions (undo and redo are such) came after the event of this number."""
        with self._guard:
            return self._timeline.decisions_since(seq)

    def counts(self, seq: int) -> bool:
        """Whether the event of this number counts now, or was undone."""
        with self._guard:
            return self._timeline.counts(seq)

    def append(self, event: Event, by: str | None = None) -> State:
        """Add an event; when this returns it is on the disk.

        Args:
            by: who did it; None: the session's operator.

        Raises:
            SessionError: the session is read-only, or the disk refused; nothing is changed.
            InputError: the event cannot be; one sentence says why.
        """
        return self.append_all([event], by)

    def append_all(self, events: Iterable[Event], by: str | None = None) -> State:
        """Add events, all of them or none.

        Raises:
            SessionError, InputError: as for ``append``.
        """
        with self._guard:
            self._check_writable()
            author = self.state.operator if by is None else by
            entries, states = _next_entries(self.state, self._timeline.last + 1, events, author)
            self._write(entries)
            for entry, state in zip(entries, states, strict=True):
                self._timeline.add(entry, state)
            return self.state

    def undo(self, by: str | None = None) -> State:
        """Take back the last thing that counts and can be taken back.

        Raises:
            SessionError: there is nothing to undo, or as for ``append``.
        """
        with self._guard:
            return self._add_own(self._timeline.undo_event(), by)

    def redo(self, by: str | None = None) -> State:
        """Bring back what was undone last.

        Raises:
            SessionError: there is nothing to redo, or as for ``append``.
        """
        with self._guard:
            return self._add_own(self._timeline.redo_event(), by)

    def refresh(self) -> State:
        """Take in what another process has written since; for sessions that are open for reading.

        Raises:
            SessionError: the file cannot be read any more.
        """
        with self._guard:
            if self._writer is None:
                for entry in read_after(self.path, self._timeline.last):
                    self._timeline.add(entry)
            return self.state

    def close(self) -> None:
        """Let the file go, as one plain file; may be called again."""
        with self._guard:
            if self._writer is not None:
                with contextlib.suppress(SessionError):
                    self._add_own(Closed(), None)
                self._writer.close()
            if self._lock is not None:
                self._lock.release()
            self._writer = self._lock = None
            self.why_read_only = self.why_read_only or "it was closed"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *wrong: object) -> None:
        self.close()

    def _start_writing(self, unconfirmed: tuple[Entry, ...]) -> None:
        try:
            self._writer = Writer(self.path)
            self._write(unconfirmed)
            self._add_own(Opened(VERSION), None)
            # The file itself says from now on that it is open, even if its journal gets lost.
            self._writer.checkpoint()
        except SessionError as refused:
            self.why_read_only = str(refused)
            if self._writer is not None:
                self._writer.close()
            if self._lock is not None:
                self._lock.release()
            self._writer = self._lock = None

    def _add_own(self, event: Event, by: str | None) -> State:
        self._check_writable()
        author = self.state.operator if by is None else by
        entry = new_entry(self._timeline.last + 1, event, author)
        self._write([entry])
        return self._timeline.add(entry)

    def _check_writable(self) -> None:
        if self._writer is None or self.why_read_only:
            raise SessionError(f"{self.path} cannot be written to: {self.why_read_only}")

    def _write(self, entries: Iterable[Entry]) -> None:
        assert self._writer is not None
        self._writer.append(entries)


def _next_entries(state: State, seq: int, events: Iterable[Event], by: str) -> tuple[list[Entry], list[State]]:
    """Checked entries for events that follow each other, and the state after each."""
    entries: list[Entry] = []
    states: list[State] = []
    for event in events:
        if isinstance(event, OWN_KINDS):
            raise SessionError(f"{type(event).__name__} is written by the session itself")
        entry = new_entry(seq + len(entries), event, by)
        check_event(state, entry.event)
        state = applied(state, entry)
        entries.append(entry)
        states.append(state)
    return entries, states
