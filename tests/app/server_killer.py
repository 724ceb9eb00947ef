"""Dashboards that are killed while they measure, undo, solve and export, and what the next one finds.

``python server_killer.py FOLDER ROUNDS SEED`` forks one dashboard after the other on the same session. Each tells
through a pipe what step its page shows at first, what it is about to do, and every event once the page was drawn with
it. It is killed (SIGKILL) a random moment after it said that it measures, solves or exports. Prints a summary as JSON.
"""

import json
import os
import random
import select
import signal
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

from app.dashboard import Dashboard
from app.exports import RESULTS
from app.measure_words import step_words
from app.workbench import Workbench
from core.session import Session
from core.session_entries import encoded
from core.twin import irb_l6
from core.twin.demo import demo_events

ROUNDS_A_FILE = 15
LONGEST_S = {"measure": 0.05, "solve": 0.12, "export": 0.2}
"""How long after the word the kill comes at most: a solution takes some 0.1 s, a report some 0.4 s."""
PATIENCE_S = 60.0
CUT_OFF = "being written when the program was cut off"


@dataclass
class Summary:
    """What happened in all rounds."""

    rounds: int = 0
    killed: int = 0
    acknowledged: int = 0
    during: dict[str, int] = field(default_factory=dict)
    """How many kills came while it did what."""
    files: int = 0
    """Exports that were made whole."""
    faults: list[str] = field(default_factory=list)


def main() -> None:
    """Run the rounds; always ends with status 0, the summary tells what is wrong."""
    folder, rounds, seed = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    rng, summary = random.Random(seed), Summary()
    known: dict[int, bytes] = {}
    for number in range(rounds):
        path = folder / f"{number // ROUNDS_A_FILE}.trueaxis"
        if number % ROUNDS_A_FILE == 0:
            begin(path)
            known = entries(path)
        one_round(path, number, rng, summary, known)
    print(json.dumps(summary.__dict__))


def begin(path: Path) -> None:
    """A session in which two sweeps were measured, so that there is something to solve."""
    with Session.create(path, demo_events(irb_l6.cell()), by="killer") as session:
        bench = Workbench(session)
        bench.runs.run(False)
        bench.runs.run(False)


def one_round(path: Path, number: int, rng: random.Random, summary: Summary, known: dict[int, bytes]) -> None:
    """One dashboard's life and what it leaves."""
    expected = page_of(path)
    wanted = ("measure", "solve", "export")[number % 3]
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        try:
            live(path, random.Random(number), writing)
        except BaseException as wrong:
            os.write(writing, f"died {wrong!r}\n".encode())
        finally:
            os._exit(1)
    os.close(writing)
    told = until_killed(child, reading, wanted, rng)
    summary.rounds += 1
    summary.killed += any(line == f"killed {wanted}" for line in told)
    examine(path, number, told, expected, summary, known)


def until_killed(child: int, reading: int, wanted: str, rng: random.Random) -> list[str]:
    """What a dashboard told until it was killed, a random moment after it began the second thing of a kind."""
    heard, seen, end = b"", 0, time.monotonic() + PATIENCE_S
    skip, deadline = rng.randrange(3), None
    status = "patience"
    while time.monotonic() < end:
        left = 0.5 if deadline is None else max(deadline - time.monotonic(), 0.0)
        ready, _, _ = select.select([reading], [], [], left)
        if deadline is not None and time.monotonic() >= deadline:
            status = wanted
            break
        data = os.read(reading, 1 << 20) if ready else b""
        if ready and not data:
            break
        heard += data
        now = heard.count(f"begin {wanted}\n".encode())
        if now > seen and deadline is None:
            seen = now
            if seen > skip:
                deadline = time.monotonic() + rng.uniform(0.0, LONGEST_S[wanted])
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    with os.fdopen(reading, "rb") as pipe:
        heard += pipe.read()
    return [*heard.decode().split("\n")[:-1], f"killed {status}"]


def live(path: Path, rng: random.Random, pipe: int) -> None:
    """A dashboard's life: an operator who never rests."""

    def tell(line: str) -> None:
        os.write(pipe, f"{line}\n".encode())

    session = Session.open(path)
    bench = Workbench(session, seed=rng.randrange(10**6))
    dashboard = Dashboard(bench, port=0)
    tell("page " + dashboard.acquire._step.content.replace("\n", " "))
    known = len(session.entries)

    def drawn() -> None:
        """Called after the page was drawn with what is new."""
        nonlocal known
        for entry in session.entries[known:]:
            tell("ack " + encoded(entry).hex())
        known = len(session.entries)

    bench.on_change(drawn)
    while True:
        what = rng.choices(("measure", "undo", "redo", "exclude", "solve", "export"), (6, 2, 1, 1, 3, 3))[0]
        tell(f"begin {what}")
        act(dashboard, what, rng, tell)
        dashboard.jobs.wait()


def act(dashboard: Dashboard, what: str, rng: random.Random, tell) -> None:
    """Press something, as a browser would."""
    acquire, bench = dashboard.acquire, dashboard.bench
    if what == "export":
        bench.calibration or dashboard.solve.solve(None)
        # The report takes the longest, so that a kill meets it.
        export = rng.choice((RESULTS[0], *RESULTS))
        dashboard.export._send(None, export)
        dashboard.ask(None, lambda client: tell("exported"), operator=False)
    elif what == "exclude" and bench.state.shots:
        number = rng.choice(bench.state.shots).id
        dashboard.ask(None, lambda client: bench.decisions.exclude(number, "killed for it"))
    else:
        {"measure": acquire.measure, "undo": acquire.undo, "redo": acquire.redo}.get(what, dashboard.solve.solve)(None)


def examine(path: Path, number: int, told: list[str], expected: str, summary: Summary, known: dict[int, bytes]) -> None:
    """Whether the page began where the session stood, all that it showed is kept, and the session goes on."""
    acknowledged, doing = {}, ""
    for line in told:
        word, _, rest = line.partition(" ")
        if word == "died":
            summary.faults.append(f"round {number}: {rest}")
        elif word == "page" and rest != expected:
            summary.faults.append(f"round {number}: the page began with {rest[:200]}, expected {expected[:200]}")
        elif word == "ack":
            data = bytes.fromhex(rest)
            acknowledged[json.loads(data)["seq"]] = data
        elif word == "begin":
            doing = rest
        elif word == "exported":
            summary.files += 1
        elif word == "killed":
            summary.during[doing] = summary.during.get(doing, 0) + 1
    found = entries(path)
    for seq, data in (known | acknowledged).items():
        if found.get(seq) != data:
            summary.faults.append(f"round {number}: event {seq} was shown and is not there")
    known.clear()
    known.update(found)
    summary.acknowledged += len(acknowledged)
    with Session.open(path) as session:
        if session.read_only:
            summary.faults.append(f"round {number}: read-only, {session.why_read_only}")
        strange = [warning for warning in session.state.warnings if CUT_OFF not in warning]
        if strange:
            summary.faults.append(f"round {number}: {strange}")
    known.update(entries(path))


def page_of(path: Path) -> str:
    """What the page has to say of the step that the session is at."""
    with Session.open(path, read_only=True) as session:
        bench = Workbench(session)
        expected = bench.known.expected()
        words = step_words(session.state, bench.nominal, False, expected, bench.known.aims(expected))
    return words.replace("\n", " ")


def entries(path: Path) -> dict[int, bytes]:
    """Everything in a session as it stands on the disk, without opening it for writing."""
    with Session.open(path, read_only=True) as session:
        return {entry.seq: encoded(entry) for entry in session.entries}


if __name__ == "__main__":
    main()
