"""What a session is now: the records that its events add up to.

Nothing here is stored; ``core.session_fold`` makes it from the events, one after the other.
"""

from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from types import MappingProxyType

import numpy as np

from core.errors import InputError
from core.measurements import SWEEP, Instrument, Target
from core.robot import Robot
from core.session_events import CheckShot, NoteWritten, ShotTaken, Solved, Verdict
from core.session_plan import Plan, Step, StepKey, check_plan, extra_step, steps_of
from core.session_poses import PosePlan
from core.session_robot import robot_of_texts

NOTHING: Mapping = MappingProxyType({})


@dataclass(frozen=True)
class Shot:
    """One measured point and what became of it."""

    id: int
    """Number of its event."""
    utc: str
    by: str
    record: int
    """Its number in a campaign."""
    taken: ShotTaken
    """What was commanded and seen."""
    verdict: Verdict = "kept"
    reason: str = ""
    judged_by: str = ""
    superseded_by: int | None = None
    """The shot that measured it again."""

    @property
    def counts(self) -> bool:
        """Whether a calibration uses it."""
        return self.verdict != "excluded" and self.superseded_by is None

    @property
    def key(self) -> StepKey | None:
        """The planned step that it could belong to; None outside sweeps."""
        taken = self.taken
        if taken.phase != SWEEP:
            return None
        sense = taken.approach[taken.joint - 1] if len(taken.approach) >= taken.joint else 0
        return taken.joint, taken.sweep, taken.step, sense or 1, taken.target


@dataclass(frozen=True)
class Check:
    """Repeated shots at one target that nobody moved."""

    number: int
    target: str
    shots: tuple[CheckShot, ...]

    @property
    def net_radial_m(self) -> float | None:
        """Standard deviation of the distance from the mean point; None for fewer than two shots."""
        points = np.array([shot.point_m for shot in self.shots])
        if len(points) < 2:
            return None
        return float(np.sqrt(np.sum((points - points.mean(axis=0)) ** 2) / (len(points) - 1)))


@dataclass(frozen=True)
class Solve:
    """That a calibration was computed, when and by whom."""

    id: int
    utc: str
    by: str
    solved: Solved


@dataclass(frozen=True)
class Note:
    """A remark."""

    id: int
    utc: str
    by: str
    note: NoteWritten


@dataclass(frozen=True)
class Failure:
    """That an instrument or a robot did not do what it was asked for."""

    id: int
    utc: str
    sentence: str


@dataclass(frozen=True)
class State:
    """Everything that a session says now."""

    title: str = ""
    operator: str = ""
    created_utc: str = ""
    changed_utc: str = ""
    software: tuple[str, ...] = ()
    """Versions of trueaxis that wrote to it, the first one first."""
    robot_toml: str = ""
    robot_files: tuple[tuple[str, str], ...] = ()
    """Names and texts of the files that robot.toml names."""
    targets: tuple[Target, ...] = ()
    instrument: Instrument = field(default_factory=Instrument)
    plan: Plan = field(default_factory=Plan)
    poses: PosePlan = field(default_factory=PosePlan)
    """At which the arm is verified."""
    shots: tuple[Shot, ...] = ()
    """By growing id; excluded and superseded ones too."""
    next_record: int = 1
    checks: tuple[Check, ...] = ()
    skipped: Mapping[StepKey, str] = field(default_factory=lambda: NOTHING)
    """Skipped steps and the reasons."""
    cursor: StepKey | None = None
    """The step that was done last, or that the operator went to."""
    facts: Mapping[str, str] = field(default_factory=lambda: NOTHING)
    settings: Mapping[str, str | float | bool] = field(default_factory=lambda: NOTHING)
    solves: tuple[Solve, ...] = ()
    notes: tuple[Note, ...] = ()
    failures: tuple[Failure, ...] = ()
    undo_next: int | None = None
    """The event that an undo would take back."""
    undone: tuple[int, ...] = ()
    """Events taken back; a redo brings back the last one."""
    warnings: tuple[str, ...] = ()
    """What of the file is not intact."""

    @cached_property
    def robot(self) -> Robot | None:
        """The nominal robot; None: not chosen yet.

        Raises:
            RobotError: its description cannot be read.
        """
        return robot_of_texts(self.robot_toml, self.robot_files) if self.robot_toml else None

    @cached_property
    def target_links(self) -> dict[str, int]:
        """The link of each target, by name."""
        return {target.name: target.link for target in self.targets}

    @property
    def steps(self) -> tuple[Step, ...]:
        """Every shot that is planned, in order; none while the plan and the robot do not fit."""
        return _steps(self.robot_toml, self.robot_files, self.targets, self.plan) if self.robot_toml else ()

    @cached_property
    def done(self) -> frozenset[StepKey]:
        """Planned steps, and others, of which there is a measured point."""
        seen = (s.key for s in self.shots if s.superseded_by is None and s.taken.point_m is not None)
        return frozenset(key for key in seen if key is not None)

    @cached_property
    def position(self) -> int | None:
        """Place in ``steps`` of the next one to do: at or after the cursor, else the first open one; None: all done."""
        steps = self.steps
        closed = self.done | self.skipped.keys()
        still_open = [k for k, step in enumerate(steps) if step.key not in closed]
        if not still_open:
            return None
        start = next((k for k, step in enumerate(steps) if step.key == self.cursor), 0)
        return next((k for k in still_open if k >= start), still_open[0])

    @property
    def next_step(self) -> Step | None:
        """The next step to do; None: all done, or nothing planned."""
        return None if self.position is None else self.steps[self.position]

    def extra_steps(self, joint: int, sweep: int, command: float) -> tuple[Step, ...]:
        """A stop beside the plan of one of its sweeps, one step a target.

        Args:
            command: of the swept joint, rad or m.

        Raises:
            InputError: there is no such sweep, or the command is beyond the joint's limits.
        """
        row = next((row for row in self.plan.sweeps if (row.joint, row.sweep) == (joint, sweep)), None)
        if row is None or self.robot is None:
            raise InputError(f"joint {joint}, sweep {sweep} is not planned, expected a sweep of the plan")
        taken = [s.taken.step for s in self.shots if (s.taken.joint, s.taken.sweep) == (joint, sweep)]
        number = max([row.stops - 1, *taken]) + 1
        return tuple(extra_step(self.robot, self.plan, row, command, number, target) for target in row.targets)

    def shot(self, number: int) -> Shot | None:
        """The shot with this id."""
        place = self.place_of(number)
        return None if place is None else self.shots[place]

    def place_of(self, number: int) -> int | None:
        """The place in ``shots`` of the shot with this id."""
        place = bisect_left(self.shots, number, key=lambda shot: shot.id)
        return place if place < len(self.shots) and self.shots[place].id == number else None


@lru_cache(maxsize=8)
def _steps(toml: str, files: tuple[tuple[str, str], ...], targets: tuple[Target, ...], plan: Plan) -> tuple[Step, ...]:
    try:
        robot = robot_of_texts(toml, files)
        check_plan(robot, {target.name: target.link for target in targets}, plan)
    except InputError:
        return ()
    return steps_of(robot, plan)
