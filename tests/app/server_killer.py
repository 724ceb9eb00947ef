"""Dashboards that are killed while they measure, undo, solve and export, and what the next one finds.

``python server_killer.py FOLDER ROUNDS SEED`` forks one dashboard after the other on the same session; each tells of an
event once its page was drawn with it. Prints a summary as JSON.
"""

import json
import random
import sys
import time
from pathlib import Path

from app.dashboard import Dashboard
from app.exports import RESULTS
from app.measure_words import step_words
from app.workbench import Workbench
from core.session import Session
from core.session_entries import encoded
from core.twin import irb_l6
from core.twin.demo import demo_events
from tests.app.killing import Kept, Pace, Summary, Tell, entries, examine, forked, until_killed

WANTED = ("measure", "undo", "solve", "export")
ROUNDS_A_FILE = 15
AT_FIRST_S = {"measure": 0.05, "undo": 0.05, "solve": 0.12, "export": 0.2}
WHAT, OFTEN = ("measure", "undo", "redo", "exclude", "solve", "export"), (6, 2, 1, 1, 3, 3)


def main() -> None:
    """Run the rounds; always ends with status 0, the summary tells what is wrong."""
    folder, rounds, seed = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    rng, summary, pace = random.Random(seed), Summary(), Pace(dict(AT_FIRST_S))
    for number in range(rounds):
        path = folder / f"{number // ROUNDS_A_FILE}.trueaxis"
        if number % ROUNDS_A_FILE == 0:
            begin(path)
            kept = Kept(entries(path), page_of(path))
        wanted = WANTED[number % len(WANTED)]
        child, reading = forked(lambda tell, path=path, number=number: live(path, random.Random(number), tell))
        told = until_killed(child, reading, wanted, rng, pace, skip=rng.randrange(3))
        kept = examine(path, number, told, kept, page_of, summary, pace)
    print(json.dumps(summary.__dict__))


def begin(path: Path) -> None:
    """A session in which two sweeps were measured, so that there is something to solve."""
    with Session.create(path, demo_events(irb_l6.cell()), by="killer") as session:
        bench = Workbench(session)
        bench.runs.run(False)
        bench.runs.run(False)


def live(path: Path, rng: random.Random, tell: Tell) -> None:
    """A dashboard's life: an operator who never rests."""
    session = Session.open(path)
    dashboard = Dashboard(Workbench(session, seed=rng.randrange(10**6)), port=0)
    tell(f"page {shown(dashboard)}")
    known = len(session.entries)

    def drawn() -> None:
        """Called after the page was drawn with what is new."""
        nonlocal known
        new = session.entries[known:]
        known += len(new)
        tell("\n".join([f"at {shown(dashboard)}", *(f"ack {encoded(entry).hex()}" for entry in new)]))

    dashboard.bench.on_change(drawn)
    while True:
        what = rng.choices(WHAT, OFTEN)[0]
        tell(f"begin {what}")
        start = time.monotonic()
        act(dashboard, what, rng, tell)
        dashboard.jobs.wait()
        tell(f"done {what} {time.monotonic() - start}")


def act(dashboard: Dashboard, what: str, rng: random.Random, tell: Tell) -> None:
    """Press something, as a browser would."""
    acquire, bench = dashboard.acquire, dashboard.bench
    if what == "export":
        if bench.calibration is None:
            dashboard.solve.solve(None)
        # The report takes the longest, so that a kill meets it.
        export = rng.choice((RESULTS[0], *RESULTS))
        dashboard.export._send(None, export)
        dashboard.ask(None, lambda client: tell("exported"), operator=False)
    elif what == "exclude" and bench.state.shots:
        number = rng.choice(bench.state.shots).id
        dashboard.ask(None, lambda client: bench.decisions.exclude(number, "killed for it"))
    else:
        {"measure": acquire.measure, "undo": acquire.undo, "redo": acquire.redo}.get(what, dashboard.solve.solve)(None)


def shown(dashboard: Dashboard) -> str:
    """What the page says of the step."""
    return dashboard.acquire._step.content.replace("\n", " ")


def page_of(path: Path) -> str:
    """What the page has to say of the step that the session is at."""
    with Session.open(path, read_only=True) as session:
        bench = Workbench(session)
        expected = bench.known.expected()
        words = step_words(session.state, bench.nominal, False, expected, bench.known.aims(expected))
    return words.replace("\n", " ")


if __name__ == "__main__":
    main()
