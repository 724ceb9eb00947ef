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


def list_sessions(folder: Path | str) -> tuple[SessionSummary, ...]:
    """The sessions in a folder, the last changed one first; damaged ones too, with what is wrong with them.

    Raises:
        SessionError: the folder is missing or cannot be read.
    """
    folder = Path(folder)
    try:
        paths = sorted(path for path in folder.iterdir() if path.name.endswith(SUFFIX) and path.name[0] != ".")
    except OSError as wrong:
        raise SessionError(f"{folder} cannot be listed: {wrong.strerror}, expected a folder of sessions") from None
    found = [_summary(path) for path in paths]
    return tuple(sorted(found, key=lambda summary: summary.changed_utc, reverse=True))


def search(folder: Path | str, words: str) -> tuple[SessionSummary, ...]:
    """The sessions in a folder that hold all these words in title, names, facts or notes, in any case.

    Raises:
        SessionError: as for ``list_sessions``.
    """
    asked = words.casefold().split()
    return tuple(
        summary for summary in list_sessions(folder) if all(word in "\n".join(summary.texts) for word in asked)
    )


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


def _summary(path: Path) -> SessionSummary:
    try:
        contents = read_contents(path, writer_of(path) is not None)
    except InputError as wrong:
        return SessionSummary(path, title=path.name, texts=(path.name.casefold(),), problem=str(wrong))
    state = Timeline(contents.entries, contents.warnings).state
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


def _one_line(name: str) -> str:
    return name if name.isprintable() and len(name) <= 200 else shown(name)
