"""Sessions for tests: on the demo cell, with shots that cost nothing."""

from pathlib import Path

from core.instruments import MeasureRequest, Reading
from core.session import Session
from core.session_events import Judged, NoteWritten, Skipped
from core.session_shots import shot_at
from core.twin import irb_l6
from core.twin.demo import demo_events
from core.twin.instrument import DemoInstrument, DemoRobot


def go_on() -> bool:
    """Nobody cancels."""
    return False


def demo_session(path: Path) -> Session:
    """A new session on the demo cell, nothing measured yet."""
    return Session.create(path, demo_events(irb_l6.cell()), by="A. Name")


def take(session: Session, count: int, reading: Reading | None = None) -> None:
    """Measure the next steps of the plan; with a reading, the same point every time."""
    cell = irb_l6.cell()
    robot = DemoRobot(cell, seed=7, visits_before=len(session.state.shots))
    meter = DemoInstrument(cell, robot, seed=7, shots_before=len(session.state.shots))
    for _ in range(count):
        step = session.state.next_step
        assert step is not None
        seen = reading
        if seen is None:
            robot.move_to(step.commanded, go_on)
            seen = meter.measure(MeasureRequest(step.target, step.commanded), go_on)
        session.append(shot_at(step, seen))


def busy_session(path: Path, shots: int = 12) -> Session:
    """A session in which a bit of everything happened."""
    session = demo_session(path)
    take(session, shots)
    session.append(Judged((session.state.shots[2].id,), "excluded", "somebody walked by"))
    session.append(NoteWritten("the floor shook", shot=session.state.shots[3].id))
    step = session.state.next_step
    session.append(Skipped(*step.key, reason="not seen from there"))
    session.undo()
    session.undo()
    session.redo()
    return session
