"""Verifying on the workbench: test poses are commanded, measured and compared, before compensation and after it.

Nothing here draws. Every shot is an event of the session; what follows from them is computed when it is asked for.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from app.workbench import Workbench
from core.calibrated_arm import CalibratedArm, calibrated_arm
from core.calibration import Calibration
from core.compensation import Compensation, compensate
from core.errors import InputError, TrueaxisError
from core.instruments import Reading
from core.inverse_kinematics import Tolerance
from core.kinematics import forward, nominal_net
from core.measurements import POSE
from core.pose_loop import PoseLoop, pose_loop
from core.pose_visits import PoseVisit, last_complete, next_number, pose_visits
from core.session import Session
from core.session_campaign import to_campaign
from core.session_events import PosesPlanned, SessionError, Setting, ShotTaken
from core.session_poses import PosePlan, new_poses
from core.session_shots import senses, shot_of_pose
from core.session_state import State
from core.verification import Limits, verify

LIMITS = {"limit_pose_mm": "position", "limit_pose_mrad": "orientation"}
"""Keys of the session's settings for the limits of pose errors; 0: no limit."""
LARGEST_LIMIT = 1e4
FEW_JOINTS = Tolerance(1e-6, 0.02)
"""How far an arm of fewer than six motors may turn away from a pose that it cannot take exactly."""


@dataclass(frozen=True)
class TestPose:
    """One wanted pose, and what was done about it."""

    __test__ = False
    number: int
    """1.. in the order of the plan; poses that were visited and are not planned come after."""
    wanted: tuple[float, ...]
    """Commands of the nominal arm."""
    compensated: tuple[float, ...] | None
    """What to send instead; None: there is no solution yet, or the arm cannot."""
    refusal: str
    """Why there is no compensated command although there is a solution; else empty."""
    nominal_visit: PoseVisit | None
    """The last complete one by the nominal commands."""
    compensated_visit: PoseVisit | None
    outdated: bool
    """Whether the compensated visit was commanded by another solution than the present one."""


@dataclass(frozen=True)
class NextVisit:
    """What to do next."""

    pose: TestPose
    compensated: bool
    targets: tuple[str, ...]
    """Still to be shot."""

    @property
    def commanded(self) -> tuple[float, ...]:
        """What to send to the robot."""
        sent = self.pose.compensated if self.compensated else self.pose.wanted
        assert sent is not None
        return sent


class PoseBench:
    """Test poses of the session that the workbench is at."""

    def __init__(self, bench: Workbench) -> None:
        self._bench = bench
        self._standing: tuple[Session, int] | None = None
        self._arm: tuple[Calibration, CalibratedArm] | None = None
        self._commands: tuple[CalibratedArm, tuple, Compensation] | None = None
        self._loop: tuple[tuple, PoseLoop | None, str] | None = None

    @property
    def state(self) -> State:
        return self._bench.state

    @property
    def arm(self) -> CalibratedArm | None:
        """The calibrated arm of the last solution; None: not solved, or a joint is missing."""
        found = self._bench.calibration
        if found is None or found.estimate.geometry is None or found.convention is None:
            return None
        if self._arm is None or self._arm[0] is not found:
            self._arm = found, calibrated_arm(found)
        return self._arm[1]

    @property
    def limits(self) -> Limits:
        """The operator's limits of pose errors."""
        values = [float(self.state.settings.get(key, 0.0) or 0.0) * 1e-3 for key in LIMITS]
        return Limits(*(value if value > 0 else None for value in values))

    def keep_limits(self, values: dict[str, float], by: str | None = None) -> None:
        """Write limits into the session, mm and mrad by their keys; 0: none.

        Raises:
            InputError: a limit is no number from 0 to 10000.
        """
        for key, value in values.items():
            if not (isinstance(value, int | float) and np.isfinite(value) and 0 <= value <= LARGEST_LIMIT):
                raise InputError(f"the limit of the {LIMITS[key]} is {value!r}, expected a number from 0 to 10000")
        before = self.state.settings
        changed = [Setting(key, float(v)) for key, v in values.items() if float(v) != before.get(key, 0.0)]
        if changed:
            self._bench.session.append_all(changed, by)
        self._bench.changed()

    def plan(self, count: int, by: str | None = None) -> None:
        """Plan new poses at random within the swept ranges, seen by all targets on the last link.

        Raises:
            InputError: there is no sweep, or no target on the last link, or too many poses are asked for.
        """
        state, robot = self.state, self._bench.nominal
        targets = state.poses.targets or tuple(t.name for t in state.targets if t.link == robot.joint_count)
        seed = 1 + sum(1 for entry in self._bench.session.entries if isinstance(entry.event, PosesPlanned))
        self._bench.session.append(PosesPlanned(new_poses(robot, state.plan, count, seed), targets), by)
        self._bench.changed()

    def poses(self) -> tuple[TestPose, ...]:
        """All wanted poses, planned or visited."""
        visits = pose_visits(self.state)
        plan = self._all_wanted(visits)
        sent = self._compensated(plan.wanted)
        return tuple(self._pose(k, wanted, visits, plan, sent) for k, wanted in enumerate(plan.wanted))

    def next_visit(self, compensated: bool | None = None) -> NextVisit | None:
        """The first open visit; None: all are made, or cannot be.

        Args:
            compensated: by which commands; None: by the nominal ones first, then by the compensated ones.
        """
        ways = (False, True) if compensated is None else (compensated,)
        poses = self.poses()
        for way in ways:
            for pose in poses:
                done = pose.compensated_visit if way else pose.nominal_visit
                if done is None and (pose.compensated is not None or not way):
                    return self.visit_of(pose, way)
        return None

    def visit_of(self, pose: TestPose, compensated: bool) -> NextVisit:
        """A visit of one pose: the rest of the one that the robot stands in, or a new one of all targets."""
        if compensated and pose.compensated is None:
            raise SessionError(pose.refusal or "there is no solution yet: solve, then send compensated commands")
        visit = NextVisit(pose, compensated, self._targets())
        standing = self._visit_in_progress(visit.commanded)
        if standing is None:
            return visit
        return NextVisit(pose, compensated, tuple(t for t in visit.targets if t not in standing.seen))

    def measure(self, visit: NextVisit, by: str | None = None) -> None:
        """Go to a pose and measure its targets there; every shot is on the disk at once.

        Raises:
            SessionError: the session is read-only, or there is no target on the last link.
            InstrumentFailed: robot or instrument did not do it; shots that were taken are kept.
        """
        self._bench.shooting.begin()
        self._measure(visit, by)

    def measure_entered(self, visit: NextVisit, text: str, unit: str, by: str | None = None) -> None:
        """The same with coordinates that a person typed in, one line x y z a target in the order of the visit.

        Raises:
            InputError: a line is no point, or there are not as many as targets; nothing is kept.
            SessionError, InstrumentFailed: as for ``measure``.
        """
        count = self._bench.typed.lay_ready(text, unit)
        if count != len(visit.targets):
            self._bench.typed.lay_ready("", unit)
            names = ", ".join(visit.targets)
            raise InputError(f"{count} points were entered, expected {len(visit.targets)}, one line each: {names}")
        self.measure(visit, by)

    def run(
        self,
        compensated: bool | None = None,
        by: str | None = None,
        progress: Callable[[int, int], None] | None = None,
    ) -> int:
        """Let the demo robot make every open visit, until done or stopped; how many were made."""
        self._bench.shooting.begin()
        made, total = 0, self._open(compensated)
        while not self._bench.shooting.stopped and (visit := self.next_visit(compensated)) is not None:
            self._measure(visit, by)
            made += 1
            if progress is not None:
                progress(made, max(total, made))
        return made

    def loop(self) -> tuple[PoseLoop | None, str]:
        """What came of the poses by the present solution; without one, a sentence that says why."""
        left, state = self._unfinished(), self.state
        # What is still being shot would be judged by too few targets for a moment.
        if left is not None:
            state = replace(state, shots=tuple(s for s in state.shots if s.taken.pose != left.number))
        shots = tuple(s.id for s in state.shots if s.counts and s.taken.phase == POSE)
        key = id(self._bench.calibration), self._bench.session.path, shots, self.limits, state.targets
        if self._loop is None or self._loop[0] != key:
            self._loop = key, *self._compared(state)
        return self._loop[1], self._loop[2]

    def _measure(self, visit: NextVisit, by: str | None) -> None:
        if not visit.targets:
            raise SessionError("there is no target on the last link to measure the poses by")
        sent, before, start = visit.commanded, self._bench.robot.commanded, None
        standing = self._visit_in_progress(sent)
        if standing is not None:
            number, approach = standing.number, standing.shots[0].taken.approach
        else:
            # A pose is visited anew by coming from elsewhere.
            start = tuple(float(v) for v in self._bench.centre) if before == sent else None
            number, approach = next_number(self.state), senses(start or before, sent)
        for target in visit.targets:
            if self._bench.shooting.stopped:
                return
            self._standing = self._bench.session, number
            self._bench.shooting.take(sent, start, target, _shot_of(visit, number, target, approach), by)
            start = None

    def _compared(self, state: State) -> tuple[PoseLoop | None, str]:
        arm = self.arm
        if arm is None:
            return None, "Solve with a sweep of every joint to see the errors."
        if not pose_visits(state):
            return None, "Measure a pose to see its error."
        try:
            return pose_loop(verify(to_campaign(state), arm, self.limits)), ""
        except TrueaxisError as wrong:
            return None, f"{str(wrong)[:1].upper()}{str(wrong)[1:]}."

    def _all_wanted(self, visits: tuple[PoseVisit, ...]) -> PosePlan:
        plan = self.state.poses
        more: list[tuple[float, ...]] = []
        for visit in visits:
            if not any(visit.wants(wanted) for wanted in (*plan.wanted, *more)):
                more.append(visit.wanted)
        return PosePlan((*plan.wanted, *more), self._targets())

    def _targets(self) -> tuple[str, ...]:
        n = self._bench.nominal.joint_count
        return self.state.poses.targets or tuple(t.name for t in self.state.targets if t.link == n)

    def _compensated(self, wanted: tuple[tuple[float, ...], ...]) -> Compensation | None:
        arm = self.arm
        if arm is None or not wanted:
            return None
        if self._commands is None or self._commands[0] is not arm or self._commands[1] != wanted:
            commands = np.array(wanted)
            poses = forward(arm.nominal, nominal_net(arm.nominal, commands))
            tolerance = None if arm.nominal.commanded.sum() >= 6 else FEW_JOINTS
            self._commands = arm, wanted, compensate(arm, poses, commands, tolerance=tolerance)
        return self._commands[2]

    def _pose(
        self,
        k: int,
        wanted: tuple[float, ...],
        visits: tuple[PoseVisit, ...],
        plan: PosePlan,
        sent: Compensation | None,
    ) -> TestPose:
        command = None if sent is None or not sent.ok[k] else tuple(float(v) for v in sent.commanded[k])
        after = last_complete(visits, wanted, True, plan.targets)
        return TestPose(
            number=k + 1,
            wanted=wanted,
            compensated=command,
            refusal="" if sent is None or sent.ok[k] else f"pose {k + 1} cannot be compensated: {sent.status[k]}",
            nominal_visit=last_complete(visits, wanted, False, plan.targets),
            compensated_visit=after,
            outdated=after is not None
            and command is not None
            and bool(np.abs(np.subtract(after.commanded, command)).max() > 1e-6),
        )

    def _unfinished(self) -> PoseVisit | None:
        """The visit that the robot stands in, if not all of it was shot."""
        if self._standing is None or self._standing[0] is not self._bench.session:
            return None
        visit = next((v for v in pose_visits(self.state) if v.number == self._standing[1]), None)
        if visit is None or frozenset(self._targets()) <= visit.seen:
            return None
        return visit if self._bench.robot.commanded == visit.commanded else None

    def _visit_in_progress(self, commanded: tuple[float, ...]) -> PoseVisit | None:
        """The unfinished visit, if it is of these commands; None: a new one begins."""
        visit = self._unfinished()
        return visit if visit is not None and visit.commanded == commanded else None

    def _open(self, compensated: bool | None) -> int:
        poses = self.poses()
        before = sum(1 for p in poses if p.nominal_visit is None) if not compensated else 0
        after = sum(1 for p in poses if p.compensated is not None and p.compensated_visit is None)
        return before + (after if compensated is not False else 0)


def _shot_of(visit: NextVisit, number: int, target: str, approach: tuple[int, ...]) -> Callable[[Reading], ShotTaken]:
    """Makes the event of a shot out of what the instrument saw."""

    def shot(reading: Reading) -> ShotTaken:
        return shot_of_pose(number, target, visit.commanded, visit.pose.wanted, approach, reading)

    return shot
