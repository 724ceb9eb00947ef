"""Programs that are forked, told on through a pipe, killed (SIGKILL) at a random moment, and what they leave.

A child tells lines: ``page`` and what it shows of the step at first, ``begin`` and ``done`` of each thing that it does,
``ack`` with an event once whoever watches was shown it, and ``at`` with what it shows of the step after that.
"""

import os
import random
import select
import signal
import sqlite3
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from core.session import Session
from core.session_entries import decoded, encoded

PATIENCE_S = 60.0
CUT_OFF = "being written when the program was cut off"
OPENING = ("opened", "closed")
"""Kinds of events that decide nothing."""
Tell = Callable[[str], None]


@dataclass
class Summary:
    """What happened in all rounds."""

    rounds: int = 0
    killed: int = 0
    acknowledged: int = 0
    during: dict[str, int] = field(default_factory=dict)
    """How many kills came while the child did what."""
    kinds: dict[str, int] = field(default_factory=dict)
    """Of acknowledged events."""
    unheard: int = 0
    """Events that were on the disk in the moment of the kill, and not yet shown."""
    files: int = 0
    """Exports that were made whole."""
    faults: list[str] = field(default_factory=list)


@dataclass
class Kept:
    """What a session must hold, and show, when it is opened next."""

    entries: dict[int, bytes]
    page: str


@dataclass
class Pace:
    """How long each thing took last, s, so that a kill meets it whatever the machine."""

    seconds: dict[str, float]


def forked(live: Callable[[Tell], None]) -> tuple[int, int]:
    """Let a child live; its number, and the pipe through which it tells."""
    reading, writing = os.pipe()
    child = os.fork()
    if child:
        os.close(writing)
        return child, reading
    os.close(reading)

    def tell(line: str) -> None:
        os.write(writing, f"{line}\n".encode())

    try:
        live(tell)
    except BaseException:
        tell("died " + traceback.format_exc().replace("\n", " "))
    finally:
        os._exit(1)


def until_killed(child: int, reading: int, wanted: str, rng: random.Random, pace: Pace, skip: int) -> list[str]:
    """What a child told until it was killed, a random moment after it began a thing of a kind.

    Args:
        skip: so many things of that kind are let pass before.
    """
    heard, end, deadline = b"", time.monotonic() + PATIENCE_S, None
    begun = f"begin {wanted}\n".encode()
    while deadline is None and time.monotonic() < end:
        data = os.read(reading, 1 << 20) if select.select([reading], [], [], 0.5)[0] else None
        if data == b"":
            break
        heard += data or b""
        if heard.count(begun) > skip:
            deadline = time.monotonic() + rng.uniform(0.0, pace.seconds[wanted])
            time.sleep(max(deadline - time.monotonic(), 0.0))
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    with os.fdopen(reading, "rb") as pipe:
        heard += pipe.read()
    met = deadline is not None and os.WIFSIGNALED(status)
    return [*heard.decode().split("\n")[:-1], f"killed {wanted if met else 'nothing'}"]


def examine(
    path: Path,
    number: int,
    told: list[str],
    kept: Kept,
    page_of: Callable[[Path], str],
    summary: Summary,
    pace: Pace,
) -> Kept:
    """Whether the child began where the session stood, all that it showed is kept, and the session goes on there."""

    def fault(sentence: str) -> None:
        summary.faults.append(f"round {number}: {sentence}")

    acknowledged, page = _heard(told, kept, summary, pace, fault)
    found = entries(path)
    for seq, data in (kept.entries | acknowledged).items():
        if found.get(seq) != data:
            fault(f"event {seq} was shown and is not there")
    more = [decoded(data).kind for seq, data in found.items() if seq not in kept.entries and seq not in acknowledged]
    unheard = [kind for kind in more if kind not in OPENING]
    summary.rounds += 1
    summary.acknowledged += len(acknowledged)
    summary.unheard += len(unheard)
    for data in acknowledged.values():
        kind = decoded(data).kind
        summary.kinds[kind] = summary.kinds.get(kind, 0) + 1
    if len(unheard) > 1:
        fault(f"{unheard} were written before anybody was told of one of them")
    now = page_of(path)
    if not unheard and now != page:
        fault(f"the session stands at {now[:300]}, shown was {page[:300]}")
    _check_file(path, fault)
    return Kept(entries(path), now)


def _heard(
    told: list[str], kept: Kept, summary: Summary, pace: Pace, fault: Callable[[str], None]
) -> tuple[dict[int, bytes], str]:
    """The events that a child acknowledged, and what it showed last."""
    acknowledged, page, doing = {}, kept.page, ""
    for line in told:
        word, _, rest = line.partition(" ")
        if word == "died":
            fault(rest)
        elif word == "page" and rest != kept.page:
            fault(f"it began at {rest[:300]}, expected {kept.page[:300]}")
        elif word == "ack":
            data = bytes.fromhex(rest)
            acknowledged[decoded(data).seq] = data
        elif word == "at":
            page = rest
        elif word == "begin":
            doing = rest
        elif word == "done":
            what, _, seconds = rest.partition(" ")
            pace.seconds[what] = float(seconds)
        elif word == "exported":
            summary.files += 1
        elif word == "killed":
            summary.killed += rest != "nothing"
            summary.during[doing] = summary.during.get(doing, 0) + 1
    return acknowledged, page


def _check_file(path: Path, fault: Callable[[str], None]) -> None:
    """Whether the file is sound, and can be gone on with."""
    with Session.open(path) as session:
        if session.read_only:
            fault(f"read-only, {session.why_read_only}")
        strange = [warning for warning in session.state.warnings if CUT_OFF not in warning]
        if strange:
            fault(str(strange))
    connection = sqlite3.connect(path)
    if connection.execute("PRAGMA integrity_check").fetchone() != ("ok",):
        fault("SQLite finds the file damaged")
    connection.close()


def entries(path: Path) -> dict[int, bytes]:
    """Everything in a session as it stands on the disk, without opening it for writing."""
    with Session.open(path, read_only=True) as session:
        return {entry.seq: encoded(entry) for entry in session.entries}
