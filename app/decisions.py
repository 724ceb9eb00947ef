"""What the operator decides of the shots: skip, go to another sweep, exclude with a reason, undo and redo."""

from app.rigged_session import RiggedSession
from core.session_events import Event, Judged, SessionError, Skipped, WentTo


class Decisions:
    """Every decision is an event of the session; all of them can be taken back."""

    def __init__(self, work: RiggedSession) -> None:
        self._work = work

    def skip(self, reason: str, by: str | None = None) -> None:
        """Leave out the next planned shot."""
        step = self._work.state.next_step
        if step is None:
            raise SessionError("every planned shot is done; there is nothing to skip")
        joint, sweep, index, sense, target = step.key
        self._keep(Skipped(joint, sweep, index, sense, target, reason), by)

    def go_to(self, joint: int, sweep: int, by: str | None = None) -> None:
        """Go on with the first open shot of another sweep; one with skipped shots alone opens these again."""
        state = self._work.state
        steps = [s for s in state.steps if s.sweep_key == (joint, sweep) and s.key not in state.done]
        step = next((s for s in steps if s.key not in state.skipped), next(iter(steps), None))
        if step is None:
            raise SessionError(f"joint {joint}, sweep {sweep} is done; choose a sweep with open shots")
        self._keep(WentTo(*step.key), by)

    def exclude(self, number: int, reason: str, by: str | None = None) -> None:
        """Leave a shot out of every fit, with the reason; it is kept."""
        self._keep(Judged((number,), "excluded", reason), by)

    def include(self, number: int, by: str | None = None) -> None:
        """Let a shot count again."""
        self._keep(Judged((number,), "kept"), by)

    def undo(self, by: str | None = None) -> None:
        """Take back the last decision or shot, but never what the session began with.

        Raises:
            SessionError: there is nothing more to take back.
        """
        session = self._work.session
        if session.state.undo_next is not None and session.state.undo_next < session.began:
            raise SessionError("this is how the session began; there is nothing more to undo")
        session.undo(by)
        self._work.changed()

    def redo(self, by: str | None = None) -> None:
        """Bring back what was taken back last."""
        self._work.session.redo(by)
        self._work.changed()

    def undo_event(self) -> Event | None:
        """What an undo would take back; None: nothing."""
        session = self._work.session
        number = session.state.undo_next
        return None if number is None or number < session.began else session.event(number)

    def _keep(self, event: Event, by: str | None) -> None:
        self._work.session.append(event, by)
        self._work.changed()
