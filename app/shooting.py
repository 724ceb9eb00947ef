"""One shot after the other: the robot is sent, the instrument looks, and the shot is on the disk."""

import threading
from collections.abc import Callable

from app.rigged_session import RiggedSession
from core.instruments import MeasureRequest, Reading
from core.session_conditions import conditions_of
from core.session_events import CheckShot, Failed, SessionError, ShotTaken
from core.session_plan import Step
from core.session_shots import shot_at
from core.session_state import Shot

TIMEOUT_S = 30.0


class Shooting:
    """Takes the shots of a session; one measurement runs at a time."""

    def __init__(self, work: RiggedSession) -> None:
        self._work = work
        self._stop = threading.Event()

    def begin(self) -> None:
        """Forget what was stopped before."""
        self._stop.clear()

    @property
    def stopped(self) -> bool:
        """Whether somebody pressed stop since the last ``begin``."""
        return self._stop.is_set()

    def stop_after_shot(self) -> None:
        """Let the shot in progress be the last one."""
        self._stop.set()

    def stop(self) -> None:
        """Cancel the shot in progress."""
        self._stop.set()
        self._work.desk.cancel()

    def measure(self, by: str | None = None) -> Shot:
        """Send the robot to the next planned stop and measure it; when this returns the shot is on the disk.

        Raises:
            SessionError: nothing is left to measure, or the session is read-only.
            InstrumentFailed: robot or instrument did not do it; this is noted in the session too.
        """
        self.begin()
        return self.measure_next(by)

    def measure_next(self, by: str | None = None) -> Shot:
        """The same as a part of something that may have been stopped."""
        with self._work.alone:
            step = self._work.state.next_step
            if step is None:
                raise SessionError("every planned shot is done; solve, or plan more sweeps")
            shot = self._shoot(step, None, by)
        self._work.changed()
        return shot

    def measure_extra(self, joint: int, sweep: int, command: float, by: str | None = None) -> tuple[Shot, ...]:
        """Measure all targets of a sweep at a stop that is not planned.

        Args:
            command: of the swept joint, rad or m.

        Raises:
            InputError: there is no such sweep, or the command is beyond the joint's limits.
            InstrumentFailed: as for ``measure``.
        """
        self.begin()
        with self._work.alone:
            steps = self._work.state.extra_steps(joint, sweep, command)
            shots = tuple(self._shoot(step, None, by) for step in steps)
        self._work.changed()
        return shots

    def measure_again(self, number: int, by: str | None = None) -> Shot:
        """Measure the stop of a shot again; the old shot is kept and no longer counts.

        Raises:
            SessionError: there is no such shot in the plan.
            InstrumentFailed: as for ``measure``.
        """
        self.begin()
        with self._work.alone:
            state = self._work.state
            old = state.shot(number)
            step = next((s for s in state.steps if old is not None and s.key == old.key), None)
            if old is None or step is None:
                raise SessionError(f"shot {number} belongs to no planned stop, so that it cannot be measured again")
            shot = self._shoot(step, number, by)
        self._work.changed()
        return shot

    def check_instrument(self, target: str, shots: int, by: str | None = None) -> None:
        """Shoot one target several times while the arm stands still; every shot is on the disk at once."""
        work = self._work
        number = len(work.state.checks) + 1
        with work.alone:
            for _ in range(shots):
                seen = work.desk.measure(MeasureRequest(target, work.rig.driver.commanded), TIMEOUT_S)
                work.session.append(_check_shot(number, target, seen), by)
        work.changed()

    def take(
        self,
        commanded: tuple[float, ...],
        start: tuple[float, ...] | None,
        target: str,
        shot_of: Callable[[Reading], ShotTaken],
        by: str | None = None,
    ) -> Shot:
        """Send the robot somewhere and measure a target there; when this returns the shot is on the disk.

        Args:
            commanded: where to, rad or m, (n,).
            start: where to go before that; None: straight on.
            target: what to aim at.
            shot_of: makes the event of what the instrument saw.
            by: who asked; None: the session's operator.

        Raises:
            SessionError: the session is read-only.
            InstrumentFailed: robot or instrument did not do it; this is noted in the session too.
        """
        with self._work.alone:
            shot = self._take(commanded, start, target, shot_of, by)
        self._work.changed()
        return shot

    def _shoot(self, step: Step, replaces: int | None, by: str | None) -> Shot:
        conditions = conditions_of(self._work.state)

        def shot_of(reading: Reading) -> ShotTaken:
            return shot_at(step, conditions.noted(reading), conditions.payload_kg, replaces)

        return self._take(step.commanded, step.start, step.target, shot_of, by)

    def _take(
        self,
        commanded: tuple[float, ...],
        start: tuple[float, ...] | None,
        target: str,
        shot_of: Callable[[Reading], ShotTaken],
        by: str | None,
    ) -> Shot:
        session, robot = self._work.session, self._work.rig.driver
        try:
            if start is not None:
                robot.move_to(start, self._stop.is_set)
            robot.move_to(commanded, lambda: False)
            reading = self._work.desk.measure(MeasureRequest(target, commanded), TIMEOUT_S)
        except Exception as wrong:
            session.append(Failed(str(wrong) or type(wrong).__name__), by)
            raise
        return session.append(shot_of(reading), by).shots[-1]


def _check_shot(number: int, target: str, seen: Reading) -> CheckShot:
    return CheckShot(number, target, seen.point_m, seen.covariance_m2, seen.angles_rad, seen.time_s, seen.temperature_c)
