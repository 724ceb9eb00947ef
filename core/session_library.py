"""Session files in a folder: list, search, copy, import, export."""

import re
from dataclasses import dataclass
from pathlib import Path

from core.errors import InputError
from core.input_files import shown
from core.session_entries import new_entry
from core.session_events import Copied, SessionError
from core.session_lock import writer_of
from core.session_reader import read_contents
from core.session_state import State
from core.session_store import SUFFIX, copy_file, write_new
from core.session_timeline import Timeline


@dataclass(frozen=True)
class SessionSummary:
    """What a list of sessions shows of one."""

    path: Path
    title: str = ""
    operator: str = ""
    robot: str = ""
    created_utc: str = ""
    changed_utc: str = ""
    shots: int = 0
    """Those that count."""
    planned: int = 0
    texts: tuple[str, ...] = ()
    """All that can be searched for."""
    problem: str = ""
    """Why it cannot be opened, or what of it is not intact; empty: nothing is wrong."""


class Shelf:
    """The sessions in a folder, each file read anew only when it has changed."""

    def __init__(self, folder: Path | str) -> None:
        self.folder = Path(folder)
        self._known: dict[Path, tuple[tuple, SessionSummary]] = {}

    def summaries(self, words: str = "", own: tuple[Path, State] | None = None) -> tuple[SessionSummary, ...]:
        """The sessions that hold all these words, the last changed one first; damaged ones too, and what is wrong.

        Args:
            words: to be found in title, names, facts or notes, in any case; empty: all sessions.
            own: path and state of a session that is open here, and so need not be read.

        Raises:
            SessionError: the folder is missing or cannot be read.
        """
        found = [
            summary_of(*own) if own is not None and path == own[0] else self._summary(path) for path in self._paths()
        ]
        asked = words.casefold().split()
        wanted = [one for one in found if all(word in "\n".join(one.texts) for word in asked)]
        return tuple(sorted(wanted, key=lambda summary: summary.changed_utc, reverse=True))

    def _paths(self) -> list[Path]:
        try:
            return sorted(p for p in self.folder.iterdir() if p.name.endswith(SUFFIX) and p.name[0] != ".")
        except OSError as wrong:
            raise SessionError(
                f"{self.folder} cannot be listed: {wrong.strerror}, expected a folder of sessions"
            ) from None

    def _summary(self, path: Path) -> SessionSummary:
        key = tuple(_stamp(path.with_name(path.name + suffix)) for suffix in ("", "-wal", ".lock"))
        known = self._known.get(path)
        if known is None or known[0] != key:
            self._known[path] = known = key, _read_summary(path)
        return known[1]


def list_sessions(folder: Path | str) -> tuple[SessionSummary, ...]:
    """The sessions in a folder, the last changed one first; damaged ones too, with what is wrong with them.

    Raises:
        SessionError: the folder is missing or cannot be read.
    """
    return Shelf(folder).summaries()


def search(folder: Path | str, words: str) -> tuple[SessionSummary, ...]:
    """The sessions in a folder that hold all these words in title, names, facts or notes, in any case.

    Raises:
        SessionError: as for ``list_sessions``.
    """
    return Shelf(folder).summaries(words)


def copy_session(source: Path | str, path: Path | str) -> None:
    """Copy a session to a new file, also while it is being written to; of a damaged one, what is intact.

    Raises:
        SessionError: the source cannot be read, or there is such a file, or it cannot be written.
    """
    source, path = Path(source), Path(path)
    contents = read_contents(source, writer_of(source) is not None)
    last = contents.entries[-1].seq
    if contents.broken or contents.unconfirmed:
        write_new(path, [*contents.entries, new_entry(last + 1, Copied(_one_line(source.name)), "")])
    else:
        copy_file(source, path, lambda last: new_entry(last + 1, Copied(_one_line(source.name)), ""))


def import_session(source: Path | str, folder: Path | str) -> Path:
    """Copy somebody's session file into a folder, under its own name or the next free one; the new path.

    Raises:
        SessionError: as for ``copy_session``.
    """
    source = Path(source)
    path = free_path(folder, source.name.removesuffix(SUFFIX))
    copy_session(source, path)
    return path


def free_path(folder: Path | str, title: str) -> Path:
    """A path for a new session: the title's letters and digits, and a number if there is such a file."""
    stem = re.sub(r"[^\w.-]+", "-", title).strip("-.")[:80] or "session"
    number = 1
    while True:
        path = Path(folder) / f"{stem}{'' if number == 1 else f'-{number}'}{SUFFIX}"
        if not path.exists():
            return path
        number += 1


def summary_of(path: Path, state: State) -> SessionSummary:
    """What a list shows of a session in this state."""
    try:
        robot = state.robot.name if state.robot is not None else ""
    except InputError:
        robot = ""
    facts = (f"{key} {value}" for key, value in state.facts.items())
    notes = (note.note.text for note in state.notes)
    targets = (target.name for target in state.targets)
    texts = (path.name, state.title, state.operator, robot, *facts, *targets, *notes)
    return SessionSummary(
        path=path,
        title=state.title or path.name.removesuffix(SUFFIX),
        operator=state.operator,
        robot=robot,
        created_utc=state.created_utc,
        changed_utc=state.changed_utc,
        shots=sum(shot.counts and shot.taken.point_m is not None for shot in state.shots),
        planned=sum(row.shots for row in state.plan.sweeps),
        texts=tuple(text.casefold() for text in texts),
        problem="; ".join(state.warnings),
    )


def _read_summary(path: Path) -> SessionSummary:
    try:
        contents = read_contents(path, writer_of(path) is not None)
    except InputError as wrong:
        return SessionSummary(path, title=path.name, texts=(path.name.casefold(),), problem=str(wrong))
    return summary_of(path, Timeline(contents.entries, contents.warnings).state)


def _stamp(path: Path) -> tuple[int, int]:
    """Size and time of change of a file; zeros where there is none."""
    try:
        status = path.stat()
    except OSError:
        return 0, 0
    return status.st_size, status.st_mtime_ns


def _one_line(name: str) -> str:
    return name if name.isprintable() and len(name) <= 200 else shown(name)
