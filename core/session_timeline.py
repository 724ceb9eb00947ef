"""Undo and redo without limit, by events: which entries count now, and the state that they add up to.

    done     numbers of the entries that count, growing
    undone   numbers of those taken back, the last one on top; anything new that can be undone empties it

An undo names the entry that it takes back, so that the order can be followed even where entries are lost. States are
kept at every ``STRIDE``-th entry; an undo folds from the nearest one.
"""

from bisect import bisect_left, insort
from collections.abc import Iterable
from dataclasses import replace

from core.session_entries import Entry
from core.session_events import Event, Opened, Redo, SessionError, Undo
from core.session_fold import applied, folded
from core.session_state import State

STRIDE = 64


class Timeline:
    """All entries of a session, and the state now."""

    def __init__(self, entries: Iterable[Entry] = (), warnings: tuple[str, ...] = ()) -> None:
        self._entries: dict[int, Entry] = {}
        self._done: list[int] = []
        self._undone: list[int] = []
        for entry in entries:
            self._file(entry)
        self._marks = [State(warnings=warnings)]
        self.state = self._labelled(self._state_at(len(self._done)))

    @property
    def entries(self) -> tuple[Entry, ...]:
        """Every entry, taken back or not, in order."""
        return tuple(self._entries.values())

    @property
    def last(self) -> int:
        """The largest number so far; 0: nothing yet."""
        return next(reversed(self._entries), 0)

    def entry(self, seq: int) -> Entry:
        """The entry of a number.

        Raises:
            KeyError: there is none.
        """
        return self._entries[seq]

    @property
    def first_opened(self) -> int:
        """The number of the first entry by which a program opened the file; one beyond the last: there is none."""
        opened = (seq for seq, entry in self._entries.items() if isinstance(entry.event, Opened))
        return next(opened, self.last + 1)

    def decisions_since(self, seq: int) -> int:
        """How many entries after this one may change a solution, undo and redo of such among them."""
        count = 0
        for entry in reversed(self._entries.values()):
            if entry.seq <= seq:
                break
            count += self._bears_on_solution(entry.event)
        return count

    def _bears_on_solution(self, event: Event) -> bool:
        if not isinstance(event, Undo | Redo):
            return event.bears_on_solution
        meant = self._entries.get(event.event)
        return meant is None or meant.event.bears_on_solution

    def counts(self, seq: int) -> bool:
        """Whether an entry counts now."""
        place = bisect_left(self._done, seq)
        return place < len(self._done) and self._done[place] == seq

    def undo_event(self) -> Undo:
        """The event that takes back the last thing that can be.

        Raises:
            SessionError: there is nothing to undo.
        """
        if self.state.undo_next is None:
            raise SessionError("there is nothing to undo")
        return Undo(self.state.undo_next)

    def redo_event(self) -> Redo:
        """The event that brings back what was undone last.

        Raises:
            SessionError: there is nothing to redo.
        """
        if not self._undone:
            raise SessionError("there is nothing to redo")
        return Redo(self._undone[-1])

    def ahead(self, entry: Entry) -> State:
        """The state that an entry (not yet added) leads to, but for its undo and redo fields."""
        if isinstance(entry.event, Undo | Redo):
            return self.state
        return applied(self.state, entry)

    def add(self, entry: Entry, ahead: State | None = None) -> State:
        """Take in the next entry; the state after it."""
        before = len(self._done)
        place = self._file(entry)
        if place == before and len(self._done) == before + 1 and ahead is not None:
            self._mark(before, self.state)
            state = ahead
        else:
            del self._marks[place // STRIDE + 1 :]
            state = self._state_at(len(self._done))
        self.state = self._labelled(state)
        return self.state

    def _file(self, entry: Entry) -> int:
        """Put an entry where it belongs; the place in ``done`` from which on things changed."""
        self._entries[entry.seq] = entry
        event = entry.event
        if isinstance(event, Undo):
            return self._take_back(event.event)
        if isinstance(event, Redo):
            return self._bring_back(event.event)
        if event.undoable:
            self._undone.clear()
        self._done.append(entry.seq)
        return len(self._done) - 1

    def _take_back(self, seq: int) -> int:
        if not self.counts(seq) or not self._entries[seq].event.undoable:
            return len(self._done)
        place = bisect_left(self._done, seq)
        del self._done[place]
        self._undone.append(seq)
        return place

    def _bring_back(self, seq: int) -> int:
        if seq not in self._undone:
            return len(self._done)
        self._undone.remove(seq)
        insort(self._done, seq)
        return bisect_left(self._done, seq)

    def _state_at(self, count: int) -> State:
        """The state of the first ``count`` entries that count, from the nearest state that was kept."""
        mark = min(count // STRIDE, len(self._marks) - 1)
        state = self._marks[mark]
        for start in range(mark * STRIDE, count, STRIDE):
            part = self._done[start : min(start + STRIDE, count)]
            state = folded(state, (self._entries[seq] for seq in part))
            self._mark(start + len(part), state)
        return state

    def _mark(self, count: int, state: State) -> None:
        if count == len(self._marks) * STRIDE:
            self._marks.append(state)

    def _labelled(self, state: State) -> State:
        last = next((seq for seq in reversed(self._done) if self._entries[seq].event.undoable), None)
        return replace(state, undo_next=last, undone=tuple(self._undone))
