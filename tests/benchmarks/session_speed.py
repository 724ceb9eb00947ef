"""How long a session of 5,000 shots takes to open, to undo in, to grow by one shot, to be listed, and to be drawn.

Run by ``python -m tests.benchmarks sessions``.
"""

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from app.dashboard import Dashboard
from app.workbench import Workbench
from core.instruments import MeasureRequest
from core.session import Session
from core.session_campaign import to_campaign
from core.session_events import Event, Judged, Planned, ShotTaken
from core.session_library import copy_session, list_sessions
from core.session_plan import PlannedSweep
from core.session_shots import shot_at
from core.twin import irb_l6
from core.twin.demo import demo_events
from core.twin.instrument import DemoInstrument, DemoRobot
from tests.benchmarks.clock import median_s
from tests.benchmarks.tables import markdown

SHOTS = 5000
REPEATS = 9


def big_session(path: Path, shots: int = SHOTS) -> None:
    """A session on the demo cell with so many shots of joint 6, every tenth of them held doubtful at once."""
    first = [event for event in demo_events(irb_l6.cell()) if not isinstance(event, Planned)]
    sweep = PlannedSweep(joint=6, sweep=1, low=-0.4, high=0.4, stops=shots, targets=("T1",))
    plan = Planned((sweep,), irb_l6.cell().home)
    with Session.create(path, [*first, plan], by="benchmark") as session:
        session.append_all(_shots(session))
        session.append(Judged(tuple(shot.id for shot in session.state.shots[::10]), "doubtful"))


def report() -> str:
    """Median times as a table in Markdown."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "big.trueaxis"
        big_session(path)
        rows = _rows(path)
        size = path.stat().st_size / 1e6
    rows = [[what, f"{1e3 * seconds:.1f} ms"] for what, seconds in rows]
    return markdown((f"{SHOTS} shots, {size:.1f} MB", "median"), rows)


def _shots(session: Session) -> list[Event]:
    """A shot at every step of the plan; the instrument looks at one in a hundred, which is enough for a clock."""
    robot = DemoRobot(irb_l6.cell(), seed=1)
    meter = DemoInstrument(irb_l6.cell(), robot, seed=1)
    events: list[Event] = []
    for number, step in enumerate(session.state.steps):
        if number % 100 == 0:
            robot.move_to(step.commanded, lambda: False)
            reading = meter.measure(MeasureRequest(step.target, step.commanded), lambda: False)
        events.append(shot_at(step, reading))
    return events


def _rows(path: Path) -> list[tuple[str, float]]:
    rows = [("open for reading", median_s(lambda: Session.open(path, read_only=True).close(), REPEATS))]
    rows.append(("open for writing and close", median_s(lambda: Session.open(path).close(), REPEATS)))
    rows.append(("list", median_s(lambda: list_sessions(path.parent), REPEATS)))
    with Session.open(path) as session:
        shot = session.state.shots[-1].taken
        rows.append(("append one shot", median_s(lambda: session.append(shot), 4 * REPEATS)))
        rows.append(("undo", median_s(session.undo, 2 * REPEATS)))
        rows.append(("redo", median_s(session.redo, REPEATS)))
        rows.append(("undo, then a new shot", median_s(_both(session, shot), REPEATS)))
        rows.append(("next step", median_s(lambda: _position(session), REPEATS)))
        rows.append(("as a campaign", median_s(lambda: to_campaign(session.state), REPEATS)))
    rows += _page(path)
    names = iter(range(1000))
    rows.append(("copy", median_s(lambda: copy_session(path, path.with_name(f"{next(names)}.copy")), REPEATS)))
    return rows


def _page(path: Path) -> list[tuple[str, float]]:
    """The same with the whole page drawn anew each time, as the server does it; what a browser takes is not in it."""
    start = time.perf_counter()
    dashboard = Dashboard(Workbench(Session.open(path)), port=0)
    opened = time.perf_counter() - start
    try:
        decisions = dashboard.bench.decisions
        return [
            ("open the dashboard", opened),
            ("undo, page drawn", median_s(decisions.undo, 2 * REPEATS)),
            ("redo, page drawn", median_s(decisions.redo, REPEATS)),
        ]
    finally:
        dashboard.stop()


def _both(session: Session, shot: ShotTaken) -> Callable[[], None]:
    def work() -> None:
        session.undo()
        session.append(shot)

    return work


def _position(session: Session) -> int | None:
    session.state.__dict__.pop("position", None)
    session.state.__dict__.pop("done", None)
    return session.state.position
