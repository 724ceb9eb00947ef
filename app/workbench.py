"""What the dashboard works on: one session, the cell it is measured in, and the last calibration.

Nothing here draws. Everything that an operator decides or an instrument sees goes into the session first; listeners are
told after it is on the disk. Any thread may call; one measurement runs at a time.
"""

import contextlib
import hashlib
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from app.ahead import SolveAhead
from app.rigs import key_of, rig_for
from core.base_placement import Placement
from core.by_hand import EnteredPoints
from core.calibration import Calibration
from core.calibration_json import calibration_to_json
from core.entered_shots import shots_of_file, shots_of_lines
from core.errors import InputError, TrueaxisError
from core.geometry import Array
from core.instruments import Desk, MeasurementCancelled, MeasureRequest, Reading, RobotDriver
from core.kinematics import nominal_net
from core.live_sweep import LiveSweep
from core.point_lines import entered_points
from core.robot import Robot
from core.session import Session
from core.session_campaign import to_campaign
from core.session_conditions import conditions_of
from core.session_events import CheckShot, Event, Failed, Judged, SessionError, ShotTaken, Skipped, Solved, WentTo
from core.session_live import (
    Expected,
    SweepSoFar,
    base_of,
    base_so_far,
    expected_place,
    sweep_so_far,
    tool_place_std_m,
)
from core.session_plan import PlannedSweep, Step
from core.session_shots import shot_at
from core.session_state import Shot, State
from core.solve_figures import figures_of
from core.twin.cell import Cell
from core.version import VERSION

TIMEOUT_S = 30.0


@dataclass(frozen=True)
class SweepProgress:
    """One row of the living table of sweeps."""

    planned: PlannedSweep
    done: int
    """Planned shots that were taken, those left out included."""
    skipped: int
    excluded: int
    """Shots that do not count, extra ones included."""
    extra: int
    """Shots beside the plan."""
    current: bool

    @property
    def left(self) -> int:
        """Shots still to do."""
        return max(self.planned.shots - self.done - self.skipped, 0)

    @property
    def finished(self) -> bool:
        return self.left == 0


class Workbench:
    """A session at work in its cell."""

    def __init__(self, session: Session, cell: Cell | None = None, seed: int = 1) -> None:
        """``cell`` is a simulated cell that the session may be of, beside the built-in ones."""
        self.session = session
        self._cell, self._seed = cell, seed
        self._set_up()
        self.calibration: Calibration | None = None
        self.previous: Calibration | None = None
        self._ahead = SolveAhead()
        self._listeners: list[Callable[[], None]] = []
        self._fitted: tuple[State | None, dict[tuple[int, int], SweepSoFar]] = (None, {})
        self._one_shot = threading.Lock()
        self._stop = threading.Event()
        self.running: bool | None = None
        """While the robot runs: whether it does the whole plan, or this sweep."""
        self.paused: bool | None = None
        """The same of a run that was paused; None: none was."""

    def _set_up(self) -> None:
        """Robot and instrument as the session has them now."""
        self._key = key_of(self.state, self._cell)
        self.rig = rig_for(self.state, self._seed, self._cell)
        self.desk = Desk(self.rig.meter)

    @property
    def cell(self) -> Cell | None:
        """What is simulated; None: the robot is a real one."""
        return self.rig.cell

    @property
    def robot(self) -> RobotDriver:
        """Who moves the robot."""
        return self.rig.driver

    @property
    def nominal(self) -> Robot:
        """The robot as designed."""
        return self.rig.robot

    @property
    def state(self) -> State:
        return self.session.state

    def on_change(self, listener: Callable[[], None]) -> None:
        """Be told, with no arguments, after anything changed."""
        self._listeners.append(listener)

    def changed(self) -> None:
        """Tell all listeners; robot and instrument are set up anew first if the session says otherwise than before."""
        if key_of(self.state, self._cell) != self._key:
            self._set_up()
        for listener in self._listeners:
            listener()

    def measure(self, by: str | None = None) -> Shot:
        """Send the robot to the next planned stop and measure it; when this returns the shot is on the disk.

        Raises:
            SessionError: nothing is left to measure, or the session is read-only.
            InstrumentFailed: robot or instrument did not do it; this is noted in the session too.
        """
        self._stop.clear()
        return self._measure(by)

    def measure_extra(self, joint: int, sweep: int, command: float, by: str | None = None) -> tuple[Shot, ...]:
        """Measure all targets of a sweep at a stop that is not planned.

        Args:
            command: of the swept joint, rad or m.

        Raises:
            InputError: there is no such sweep, or the command is beyond the joint's limits.
            InstrumentFailed: as for ``measure``.
        """
        self._stop.clear()
        with self._one_shot:
            steps = self.state.extra_steps(joint, sweep, command)
            shots = tuple(self._shoot(step, None, by) for step in steps)
        self.changed()
        return shots

    def enter(self, text: str, unit: str, by: str | None = None) -> int:
        """Take coordinates that were typed or pasted as the next shots of this sweep, all of them or none.

        Raises:
            InputError: a line is no point, or there are too many of them.
            SessionError: the session is read-only.
        """
        return self._enter(shots_of_lines(self.state, entered_points(text, unit), conditions_of(self.state)), by)

    def enter_file(self, path: Path, by: str | None = None) -> int:
        """Take the points of a CSV file as shots of this sweep, all of them or none.

        Raises:
            InputError: the file cannot be read, or its points do not belong to this sweep.
            SessionError: the session is read-only.
        """
        return self._enter(shots_of_file(self.state, path, conditions_of(self.state)), by)

    def lay_ready(self, text: str, unit: str) -> int:
        """Lay typed coordinates ready for whatever is measured next by hand; how many there are.

        Raises:
            InputError: a line is no point, or nobody measures by hand here.
        """
        meter = self.rig.meter
        if not isinstance(meter, EnteredPoints):
            raise InputError("the points of this cell are simulated, expected no coordinates by hand")
        points = entered_points(text, unit)
        meter.enter([Reading(point.point_m) for point in points])
        return len(points)

    def measure_again(self, number: int, by: str | None = None) -> Shot:
        """Measure the stop of a shot again; the old shot is kept and no longer counts.

        Raises:
            SessionError: there is no such shot in the plan.
            InstrumentFailed: as for ``measure``.
        """
        self._stop.clear()
        with self._one_shot:
            old = self.state.shot(number)
            step = next((s for s in self.state.steps if old is not None and s.key == old.key), None)
            if old is None or step is None:
                raise SessionError(f"shot {number} belongs to no planned stop, so that it cannot be measured again")
            shot = self._shoot(step, number, by)
        self.changed()
        return shot

    def stopped(self) -> bool:
        """Whether somebody pressed stop since the last run began."""
        return self._stop.is_set()

    def begin_run(self) -> None:
        """Forget what was stopped before."""
        self._stop.clear()

    def run(self, whole_plan: bool, by: str | None = None, progress: Callable[[int, int], None] | None = None) -> int:
        """Let the robot do this sweep, or all of them, until done, stopped or paused; the number of shots taken.

        Raises:
            InputError: nothing moves this robot but a person.
        """
        if not self.rig.moves_itself:
            raise InputError("this robot is moved by hand, expected one sweep after the other from you")
        self.begin_run()
        self.running, self.paused = whole_plan, None
        try:
            return self._run(whole_plan, by, progress)
        finally:
            self.running = None
            self.changed()

    def _run(self, whole_plan: bool, by: str | None, progress: Callable[[int, int], None] | None) -> int:
        first = self.state.next_step
        taken, total = 0, self._left(first, whole_plan)
        while not self._stop.is_set():
            step = self.state.next_step
            if step is None or (not whole_plan and first is not None and _sweep_of(step) != _sweep_of(first)):
                break
            try:
                self._measure(by)
            except MeasurementCancelled:
                break
            taken += 1
            if progress is not None:
                progress(taken, max(total, taken))
        return taken

    def stop(self) -> None:
        """Stop a run, and cancel the shot in progress."""
        self.paused = None
        self._stop.set()
        self.desk.cancel()

    def pause(self) -> None:
        """End a run after the shot in progress; ``paused`` tells what to go on with."""
        if self.running is not None:
            self.paused = self.running
            self._stop.set()

    def check_instrument(self, target: str, shots: int, by: str | None = None) -> None:
        """Shoot one target several times while the arm stands still; every shot is on the disk at once."""
        number = len(self.state.checks) + 1
        with self._one_shot:
            for _ in range(shots):
                reading = self.desk.measure(MeasureRequest(target, self.robot.commanded), TIMEOUT_S)
                self.session.append(
                    CheckShot(
                        number,
                        target,
                        reading.point_m,
                        reading.covariance_m2,
                        reading.angles_rad,
                        reading.time_s,
                        reading.temperature_c,
                    ),
                    by,
                )
        self.changed()

    def switch(self, session: Session) -> None:
        """Work on another session; the one at hand is closed."""
        with self._one_shot:
            old, self.session = self.session, session
            self._set_up()
            self.calibration = self.previous = None
            old.close()
        self.changed()

    def skip(self, reason: str, by: str | None = None) -> None:
        """Leave out the next planned shot."""
        step = self.state.next_step
        if step is None:
            raise SessionError("every planned shot is done; there is nothing to skip")
        joint, sweep, index, sense, target = step.key
        self.session.append(Skipped(joint, sweep, index, sense, target, reason), by)
        self.changed()

    def go_to(self, joint: int, sweep: int, by: str | None = None) -> None:
        """Go on with the first open shot of another sweep; one with skipped shots alone opens these again."""
        done, skipped = self.state.done, self.state.skipped.keys()
        steps = [s for s in self.state.steps if _sweep_of(s) == (joint, sweep) and s.key not in done]
        step = next((s for s in steps if s.key not in skipped), next(iter(steps), None))
        if step is None:
            raise SessionError(f"joint {joint}, sweep {sweep} is done; choose a sweep with open shots")
        self.session.append(WentTo(*step.key), by)
        self.changed()

    def exclude(self, number: int, reason: str, by: str | None = None) -> None:
        """Leave a shot out of every fit, with the reason; it is kept."""
        self.session.append(Judged((number,), "excluded", reason), by)
        self.changed()

    def include(self, number: int, by: str | None = None) -> None:
        """Let a shot count again."""
        self.session.append(Judged((number,), "kept"), by)
        self.changed()

    def undo(self, by: str | None = None) -> None:
        """Take back the last decision or shot, but never what the session began with.

        Raises:
            SessionError: there is nothing more to take back.
        """
        if self.state.undo_next is not None and self.state.undo_next < self.session.began:
            raise SessionError("this is how the session began; there is nothing more to undo")
        self.session.undo(by)
        self.changed()

    def redo(self, by: str | None = None) -> None:
        """Bring back what was taken back last."""
        self.session.redo(by)
        self.changed()

    def solve(self, by: str | None = None) -> Calibration:
        """Calibrate from the shots that count.

        Raises:
            TrueaxisError: the shots do not allow it; the sentence says why.
        """
        found = self._ahead.solution(to_campaign(self.state))
        digest = hashlib.sha256(calibration_to_json(found).encode()).hexdigest()
        self.session.append(Solved(digest, len(found.refinement.residuals.row), VERSION, figures_of(found)), by)
        self.previous, self.calibration = self.calibration, found
        self.changed()
        return found

    def solve_again(self) -> None:
        """Compute the last solution anew, as after a restart; nothing where shots or choices changed since.

        Raises:
            TrueaxisError: it cannot be computed any more.
        """
        if self.state.solves and self.calibration is None and not self.since_solved:
            self.calibration = self._ahead.solution(to_campaign(self.state))
            self.changed()

    def solve_ahead(self) -> None:
        """Compute the solution of what is there, so that it is at hand when it is asked for; nothing is decided."""
        with contextlib.suppress(TrueaxisError):
            self._ahead.prepare(to_campaign(self.state))

    @property
    def since_solved(self) -> int:
        """How many shots and decisions came after the last solution."""
        return self.session.decisions_since(self.state.solves[-1].id) if self.state.solves else 0

    def progress(self) -> tuple[SweepProgress, ...]:
        """All planned sweeps with what is done of them."""
        state = self.state
        current, steps = state.next_step, state.steps
        rows = []
        for planned in state.plan.sweeps:
            here = [s for s in state.shots if s.superseded_by is None and _of_sweep(s, planned.joint, planned.sweep)]
            keys = {s.key for s in steps if _sweep_of(s) == (planned.joint, planned.sweep)}
            rows.append(
                SweepProgress(
                    planned=planned,
                    done=len(keys & state.done),
                    skipped=len((keys - state.done) & state.skipped.keys()),
                    excluded=sum(1 for s in here if not s.counts),
                    extra=sum(1 for s in here if s.key not in keys),
                    current=current is not None and _sweep_of(current) == (planned.joint, planned.sweep),
                )
            )
        return tuple(rows)

    def live(self, joint: int, sweep: int) -> tuple[LiveSweep, tuple[Shot, ...]]:
        """The axis of a sweep so far, and the shots that it rests on."""
        so_far = self.so_far(joint, sweep)
        return so_far.live, so_far.shots

    def so_far(self, joint: int, sweep: int) -> SweepSoFar:
        """A sweep as far as it is measured; fitted once as long as nothing changes."""
        state = self.state
        if state is not self._fitted[0]:
            self._fitted = state, {}
        sweeps = self._fitted[1]
        if (joint, sweep) not in sweeps:
            sweeps[joint, sweep] = sweep_so_far(state, joint, sweep)
        return sweeps[joint, sweep]

    def tool_std_m(self, so_far: SweepSoFar) -> float | None:
        """How well the place of a sweep's axis is known at the tool, m; None: there is no axis or no tool yet."""
        return tool_place_std_m(self.state, so_far)

    def undo_event(self) -> Event | None:
        """What an undo would take back; None: nothing."""
        number = self.state.undo_next
        return None if number is None or number < self.session.began else self.session.event(number)

    def base(self) -> Placement:
        """Where the robot's base stands in the instrument's frame, as well as it is known."""
        if self.rig.base is not None:
            return Placement(self.rig.base, True)
        solved = None if self.calibration is None else base_of(self.calibration)
        return base_so_far(self.state, self.so_far) if solved is None else Placement(solved, True)

    def expected(self) -> Expected | None:
        """About where the target of the next shot will be; None: not known yet."""
        step, base = self.state.next_step, self.base()
        if step is None:
            return None
        so_far = self.so_far(step.joint, step.sweep)
        return expected_place(self.state, step, so_far, base.base if base.settled else None)

    @property
    def standing(self) -> tuple[float, ...]:
        """Commands at which the arm is drawn, (n,): where the robot was sent, or where a person has to send it next."""
        step = self.state.next_step
        return self.robot.commanded if self.rig.moves_itself or step is None else step.commanded

    def aims(self, expected: Expected | None) -> tuple[str, ...]:
        """How each theodolite is to be aimed at an expected place, in sentences; none for other instruments."""
        if expected is None or self.rig.theodolites is None:
            return ()
        names = (name for name, _ in self.rig.stations)
        angles = (np.rad2deg(station.observe(expected.point_m)[0]) for station in self.rig.theodolites)
        return tuple(f"{name}: hz {hz:.3f}°, v {v:.3f}°" for name, (hz, v) in zip(names, angles, strict=True))

    @property
    def centre(self) -> Array:
        """Commands at the arm's marks, or zeros, about which sweeps are made unless they are held elsewhere, (n,)."""
        home = self.state.plan.home
        return np.zeros(self.nominal.joint_count) if home is None else np.array(home)

    def nominal_net(self, commanded: tuple[float, ...] | Array) -> Array:
        """Net displacements from the marks that the nominal arm believes in, (n,)."""
        return nominal_net(self.nominal, np.array(commanded) - self.centre)[0]

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
        with self._one_shot:
            shot = self._take(commanded, start, target, shot_of, by)
        self.changed()
        return shot

    def _measure(self, by: str | None) -> Shot:
        with self._one_shot:
            step = self.state.next_step
            if step is None:
                raise SessionError("every planned shot is done; solve, or plan more sweeps")
            shot = self._shoot(step, None, by)
        self.changed()
        return shot

    def _shoot(self, step: Step, replaces: int | None, by: str | None) -> Shot:
        conditions = conditions_of(self.state)

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
        try:
            if start is not None:
                self.robot.move_to(start, self._stop.is_set)
            self.robot.move_to(commanded, lambda: False)
            reading = self.desk.measure(MeasureRequest(target, commanded), TIMEOUT_S)
        except Exception as wrong:
            self.session.append(Failed(str(wrong) or type(wrong).__name__), by)
            raise
        return self.session.append(shot_of(reading), by).shots[-1]

    def _enter(self, shots: list[ShotTaken], by: str | None) -> int:
        with self._one_shot:
            self.session.append_all(shots, by)
        self.changed()
        return len(shots)

    def _left(self, first: Step | None, whole_plan: bool) -> int:
        closed = self.state.done | self.state.skipped.keys()
        return sum(
            1
            for s in self.state.steps
            if s.key not in closed and (whole_plan or (first is not None and _sweep_of(s) == _sweep_of(first)))
        )


def _sweep_of(step: Step) -> tuple[int, int]:
    return step.joint, step.sweep


def _of_sweep(shot: Shot, joint: int, sweep: int) -> bool:
    return shot.taken.joint == joint and shot.taken.sweep == sweep
