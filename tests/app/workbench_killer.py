"""Workbenches that are killed while they measure, undo, solve and export, and what the next one finds.

``python workbench_killer.py FOLDER ROUNDS SEED`` forks one child after the other on the same session. Each opens it as
the dashboard does, and does with its workbench what an operator does; a listener tells of every event, as the page
does. Prints a summary as JSON.
"""

import hashlib
import importlib
import json
import random
import sys
import threading
import time
from pathlib import Path

from app.exports import RESULTS
from app.measure_words import step_words, sweeps_table, undo_words
from app.pose_bench import PoseBench
from app.sweep_progress import sweep_progress
from app.workbench import Workbench
from core.calibration import Calibration
from core.errors import AxisUndefined
from core.session import Session
from core.session_archive import campaign_archive
from core.session_entries import encoded
from core.session_library import copy_session, free_path, list_sessions
from core.twin import irb_l6
from core.twin.demo import demo_events
from tests.app.killing import Kept, Pace, Summary, Tell, entries, examine, forked, until_killed

WANTED = ("measure", "undo", "solve", "export")
ROUNDS_A_FILE = 20
AT_FIRST_S = {"measure": 0.02, "undo": 0.005, "solve": 0.2, "export": 0.4}
OTHERS = {"measure": 6, "visit": 1, "again": 1, "extra": 1, "undo": 2, "redo": 2, "exclude": 2, "skip": 1, "reopen": 1}
"""What else is done, and how often."""
LAZY = ("app.report_html", "core.report", "xlsxwriter")
"""What exports import on demand; here all children have it from the start."""


def main() -> None:
    """Run the rounds; always ends with status 0, the summary tells what is wrong."""
    folder, rounds, seed = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    rng, summary, pace = random.Random(seed), Summary(), Pace(dict(AT_FIRST_S))
    for name in LAZY:
        importlib.import_module(name)
    first = folder / "first.trueaxis"
    begin(first)
    for number in range(rounds):
        path = folder / f"{number // ROUNDS_A_FILE}" / "demo.trueaxis"
        if number % ROUNDS_A_FILE == 0:
            path.parent.mkdir()
            copy_session(first, path)
            kept = Kept(entries(path), page_of(path))
        kept = one_round(path, number, rng, summary, pace, kept)
    print(json.dumps(summary.__dict__))


def begin(path: Path) -> None:
    """A session in which two sweeps were measured and solved, so that there is something to go on with."""
    with Session.create(path, demo_events(irb_l6.cell()), by="killer") as session:
        bench = Workbench(session)
        bench.runs.run(False)
        bench.runs.run(False)
        PoseBench(bench).plan(6)
        bench.solving.solve()


def one_round(path: Path, number: int, rng: random.Random, summary: Summary, pace: Pace, kept: Kept) -> Kept:
    """One workbench's life and what it leaves."""
    wanted, seed = WANTED[number % len(WANTED)], rng.randrange(10**6)
    while threading.active_count() > 1:
        time.sleep(0.001)
    child, reading = forked(lambda tell: live(path, wanted, random.Random(seed), tell))
    told = until_killed(child, reading, wanted, rng, pace, skip=rng.randrange(3))
    kept = examine(path, number, told, kept, page_of, summary, pace)
    for one in list_sessions(path.parent):
        if one.problem:
            summary.faults.append(f"round {number}: {one.path.name}: {one.problem}")
        elif one.path != path:
            summary.kinds["copy"] = summary.kinds.get("copy", 0) + 1
            one.path.unlink()
    return kept


def live(path: Path, wanted: str, rng: random.Random, tell: Tell) -> None:
    """A workbench's life: an operator who never rests."""
    session = Session.open(path)
    bench = Workbench(session, seed=rng.randrange(10**6))
    tell(f"page {shown(bench)}")
    known = len(session.entries)

    def drawn() -> None:
        nonlocal known
        new = bench.session.entries[known:]
        known += len(new)
        # In one piece, which no kill cuts in two.
        tell("\n".join([f"at {shown(bench)}", *(f"ack {encoded(entry).hex()}" for entry in new)]))

    bench.on_change(drawn)
    while True:
        others = rng.choices(tuple(OTHERS), tuple(OTHERS.values()), k=rng.randrange(3))
        for what in (*others, wanted):
            tell(f"begin {what}")
            start = time.monotonic()
            act(bench, what, rng, tell)
            tell(f"done {what} {time.monotonic() - start}")


def act(bench: Workbench, what: str, rng: random.Random, tell: Tell) -> None:
    """One thing that an operator does, by the same calls as the panels."""
    state = bench.state
    if what == "undo" and bench.decisions.undo_event() is not None:
        bench.decisions.undo()
    elif what == "redo" and state.undone:
        bench.decisions.redo()
    elif what == "exclude" and state.shots:
        bench.decisions.exclude(rng.choice(state.shots).id, "killed for it")
    elif what == "skip" and state.next_step is not None:
        bench.decisions.skip("sight was blocked")
    elif what == "again" and state.shots:
        again(bench, rng)
    elif what == "extra":
        home = state.plan.home
        bench.shooting.measure_extra(6, 1, home[5] + rng.uniform(-0.1, 0.1))
    elif what == "visit":
        poses = PoseBench(bench)
        poses.measure(poses.visit_of(rng.choice(poses.poses()), False))
    elif what == "solve":
        solve(bench)
    elif what == "export":
        export(bench, rng, tell)
    elif what == "reopen":
        path = bench.session.path
        bench.session.close()
        bench.switch(Session.open(path))
    elif state.next_step is not None:
        bench.shooting.measure()


def again(bench: Workbench, rng: random.Random) -> None:
    """Measure one of the last planned shots again."""
    planned = {step.key for step in bench.state.steps}
    numbers = [s.id for s in bench.state.shots if s.key in planned and s.superseded_by is None]
    bench.shooting.measure_again(rng.choice(numbers[-5:]))


def solve(bench: Workbench) -> Calibration | None:
    """Solve; where a sweep has only just begun, that is refused as on the page, and it is measured on instead."""
    try:
        return bench.solving.solve()
    except AxisUndefined:
        bench.shooting.measure()
        return None


def export(bench: Workbench, rng: random.Random, tell: Tell) -> None:
    """Make one of the files that the page offers; a copy of the session lies beside it, others go to the browser."""
    what = rng.choice((RESULTS[0], *RESULTS, "campaign", "copy", "copy"))
    if what == "copy":
        copy_session(bench.session.path, free_path(bench.session.path.parent, "copy"))
    elif what == "campaign":
        campaign_archive(bench.state, "demo")
    else:
        bench.solving.solve_again()
        found = bench.calibration or solve(bench)
        if found is not None:
            what.made(found)
    tell("exported")


def shown(bench: Workbench) -> str:
    """The next step, and a digest of all that the measuring panel shows of where the session stands."""
    expected, state = bench.known.expected(), bench.state
    words = step_words(state, bench.nominal, False, expected, bench.known.aims(expected))
    words += sweeps_table(sweep_progress(state), bench.nominal) + undo_words(bench.decisions.undo_event(), state)
    counting = [(shot.id, shot.counts) for shot in state.shots]
    digest = hashlib.sha256(f"{words} {counting} {len(state.solves)}".encode()).hexdigest()[:16]
    return f"{state.next_step and state.next_step.key} {len(state.shots)} shots {digest}"


def page_of(path: Path) -> str:
    """What a workbench shows of a session on the disk."""
    with Session.open(path, read_only=True) as session:
        return shown(Workbench(session))


if __name__ == "__main__":
    main()
