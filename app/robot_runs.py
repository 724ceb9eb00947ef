"""Sweeps that are left to the robot: one shot after the other until done, stopped or paused."""

from collections.abc import Callable

from app.rigged_session import RiggedSession
from app.shooting import Shooting
from core.errors import InputError
from core.instruments import MeasurementCancelled
from core.session_plan import Step


class RobotRuns:
    """The run in progress, or the one that was paused."""

    def __init__(self, work: RiggedSession, shooting: Shooting) -> None:
        self._work, self._shooting = work, shooting
        self.running: bool | None = None
        """While the robot runs: whether it does the whole plan, or this sweep."""
        self.paused: bool | None = None
        """The same of a run that was paused; None: none was."""

    def run(self, whole_plan: bool, by: str | None = None, progress: Callable[[int, int], None] | None = None) -> int:
        """Let the robot do this sweep, or all of them, until done, stopped or paused; the number of shots taken.

        Raises:
            InputError: nothing moves this robot but a person.
        """
        if not self._work.rig.moves_itself:
            raise InputError("this robot is moved by hand, expected one sweep after the other from you")
        self._shooting.begin()
        self.running, self.paused = whole_plan, None
        try:
            return self._run(whole_plan, by, progress)
        finally:
            self.running = None
            self._work.changed()

    def stop(self) -> None:
        """Stop a run, and cancel the shot in progress."""
        self.paused = None
        self._shooting.stop()

    def pause(self) -> None:
        """End a run after the shot in progress; ``paused`` tells what to go on with."""
        if self.running is not None:
            self.paused = self.running
            self._shooting.stop_after_shot()

    def _run(self, whole_plan: bool, by: str | None, progress: Callable[[int, int], None] | None) -> int:
        first = self._work.state.next_step
        taken, total = 0, self._left(first, whole_plan)
        while not self._shooting.stopped:
            step = self._work.state.next_step
            if step is None or (not whole_plan and first is not None and step.sweep_key != first.sweep_key):
                break
            try:
                self._shooting.measure_next(by)
            except MeasurementCancelled:
                break
            taken += 1
            if progress is not None:
                progress(taken, max(total, taken))
        return taken

    def _left(self, first: Step | None, whole_plan: bool) -> int:
        state = self._work.state
        closed = state.done | state.skipped.keys()
        left = [step for step in state.steps if step.key not in closed]
        return sum(whole_plan or (first is not None and step.sweep_key == first.sweep_key) for step in left)
