"""Writers that are killed at random moments, and what is left of their sessions.

``python session_killer.py FOLDER ROUNDS SEED`` forks one writer after the other. Each opens the session, measures,
judges, undoes, redoes, solves and exports, and tells every event through a pipe once it was taken. It is killed
(SIGKILL) a moment after some event; then everything that it told has to be there. Prints a summary as JSON.
"""

import json
import os
import random
import select
import signal
import sqlite3
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

from core.campaign_files import read_campaign
from core.instruments import MeasureRequest
from core.pose_visits import next_number
from core.session import Session
from core.session_campaign import export_campaign
from core.session_entries import encoded
from core.session_events import Judged, SessionError, Solved
from core.session_library import copy_session
from core.session_shots import senses, shot_at, shot_of_pose
from core.twin import irb_l6
from core.twin.demo import demo_events
from core.twin.instrument import DemoInstrument, DemoRobot

ROUNDS_A_FILE = 20
MOST_EVENTS = 14
LONGEST_WAIT_S = 0.02
"""A writer dies so long at most after it told of so many events at most: machines differ in speed."""
PATIENCE_S = 20.0
CUT_OFF = "being written when the program was cut off"


@dataclass
class Summary:
    """What happened in all rounds."""

    rounds: int = 0
    killed: int = 0
    acknowledged: int = 0
    kinds: dict[str, int] = field(default_factory=dict)
    cut_off: int = 0
    """Events that were being written in the moment of the kill."""
    copies: int = 0
    campaigns: int = 0
    faults: list[str] = field(default_factory=list)


def main() -> None:
    """Run the rounds; always ends with status 0, the summary tells what is wrong."""
    folder, rounds, seed = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    rng, summary = random.Random(seed), Summary()
    known: dict[int, bytes] = {}
    for number in range(rounds):
        path = folder / f"{number // ROUNDS_A_FILE}.trueaxis"
        if number % ROUNDS_A_FILE == 0:
            Session.create(path, demo_events(irb_l6.cell()), by="killer").close()
            known = _entries(path)
        one_round(folder, path, number, rng, summary, known)
    print(json.dumps(summary.__dict__))


def one_round(folder: Path, path: Path, number: int, rng: random.Random, summary: Summary, known: dict) -> None:
    """One writer's life and what it leaves."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        try:
            write(folder, path, number, random.Random(rng.random()), writing)
        except BaseException as wrong:
            os.write(writing, b"died: " + repr(wrong).encode() + b"\n")
        finally:
            os._exit(1)
    os.close(writing)
    heard = _hear(reading, rng.randrange(MOST_EVENTS))
    time.sleep(rng.uniform(0.0, LONGEST_WAIT_S))
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    with os.fdopen(reading, "rb") as pipe:
        told = (heard + pipe.read()).split(b"\n")[:-1]
    summary.rounds += 1
    summary.killed += os.WIFSIGNALED(status)
    examine(folder, path, number, told, summary, known)


def _hear(reading: int, count: int) -> bytes:
    """What a writer tells until it has told of so many events."""
    heard, end = b"", time.monotonic() + PATIENCE_S
    while heard.count(b"\n") < count and time.monotonic() < end:
        if not select.select([reading], [], [], 0.1)[0]:
            continue
        data = os.read(reading, 1 << 16)
        if not data:
            break
        heard += data
    return heard


def write(folder: Path, path: Path, number: int, rng: random.Random, pipe: int) -> None:
    """A writer's life: everything that an operator may do, at random, until the end."""
    session = Session.open(path)
    told = len(session.entries)
    robot = DemoRobot(irb_l6.cell(), number)
    meter = DemoInstrument(irb_l6.cell(), robot, number, told)
    exported = 0
    while True:
        act(session, robot, meter, rng)
        for entry in session.entries[told:]:
            os.write(pipe, encoded(entry).hex().encode() + b"\n")
        told = len(session.entries)
        if rng.random() < 0.1 and any(shot.counts for shot in session.state.shots):
            exported += 1
            copy_session(path, folder / f"copy-{number}-{exported}.trueaxis")
            export_campaign(session.state, folder / f"campaign-{number}-{exported}")
        if rng.random() < 0.05:
            session.close()
            session = Session.open(path)


def act(session: Session, robot: DemoRobot, meter: DemoInstrument, rng: random.Random) -> None:
    """One thing that an operator does."""
    state, dice = session.state, rng.random()
    step = state.next_step
    if dice < 0.15 and state.undo_next is not None and len(state.shots) > 2:
        session.undo()
    elif dice < 0.25 and state.undone:
        session.redo()
    elif dice < 0.35 and state.shots:
        session.append(Judged((rng.choice(state.shots).id,), "excluded", "killed for it"))
    elif dice < 0.4:
        session.append(Solved("0" * 64, len(state.shots), "test", {"noise_mm": 0.2}))
    elif dice < 0.5:
        visit(session, robot, meter, rng)
    else:
        step = step or rng.choice(state.steps)
        robot.move_to(step.commanded, lambda: False)
        session.append(shot_at(step, meter.measure(MeasureRequest(step.target, step.commanded), lambda: False)))


def visit(session: Session, robot: DemoRobot, meter: DemoInstrument, rng: random.Random) -> None:
    """One shot at a test pose, by nominal or by other commands."""
    wanted, target = rng.choice(session.state.poses.wanted), rng.choice(session.state.poses.targets)
    commanded, before = (wanted[0] + rng.choice((0.0, 0.01)), *wanted[1:]), robot.commanded
    robot.move_to(commanded, lambda: False)
    seen = meter.measure(MeasureRequest(target, commanded), lambda: False)
    number, approach = next_number(session.state), senses(before, commanded)
    session.append(shot_of_pose(number, target, commanded, wanted, approach, seen))


def examine(folder: Path, path: Path, number: int, told: list[bytes], summary: Summary, known: dict) -> None:
    """Whether everything that was told is there, the file is sound, and the session goes on where it stood."""
    acknowledged = {}
    for line in told:
        if line.startswith(b"died"):
            summary.faults.append(f"round {number}: {line.decode()}")
            continue
        data = bytes.fromhex(line.decode())
        acknowledged[json.loads(data)["seq"]] = data
    found = _entries(path)
    for seq, data in (known | acknowledged).items():
        if found.get(seq) != data:
            summary.faults.append(f"round {number}: event {seq} was acknowledged and is not there")
    known.clear()
    known.update(found)
    summary.acknowledged += len(acknowledged)
    with Session.open(path) as session:
        strange = [warning for warning in session.state.warnings if CUT_OFF not in warning]
        summary.cut_off += len(session.state.warnings) - len(strange)
        if session.read_only or strange:
            summary.faults.append(f"round {number}: {session.why_read_only} {strange}")
        for entry in session.entries:
            summary.kinds[entry.kind] = summary.kinds.get(entry.kind, 0) + (entry.seq in acknowledged)
        _check_same_step(path, session, number, summary)
    known.update(_entries(path))
    connection = sqlite3.connect(path)
    if connection.execute("PRAGMA integrity_check").fetchone() != ("ok",):
        summary.faults.append(f"round {number}: SQLite finds the file damaged")
    connection.close()
    _examine_exports(folder, number, summary)


def _check_same_step(path: Path, session: Session, number: int, summary: Summary) -> None:
    """Read anew, the session stands at the same step with the same shots."""
    with Session.open(path, read_only=True) as other:
        same = other.state.position == session.state.position and other.state.shots == session.state.shots
    if not same:
        summary.faults.append(f"round {number}: another reader sees another state")


def _examine_exports(folder: Path, number: int, summary: Summary) -> None:
    for copy in folder.glob(f"copy-{number}-*.trueaxis"):
        try:
            with Session.open(copy, read_only=True) as session:
                summary.copies += 1
                if session.state.warnings:
                    summary.faults.append(f"{copy.name}: {session.state.warnings}")
        except SessionError as wrong:
            summary.faults.append(f"{copy.name}: {wrong}")
    for campaign in folder.glob(f"campaign-{number}-*"):
        if (campaign / "campaign.toml").exists():
            read_campaign(campaign)
            summary.campaigns += 1


def _entries(path: Path) -> dict[int, bytes]:
    """Every row of a session file as it is read by a program of its own kind, without opening it for writing."""
    with Session.open(path, read_only=True) as session:
        return {entry.seq: encoded(entry) for entry in session.entries}


if __name__ == "__main__":
    main()
