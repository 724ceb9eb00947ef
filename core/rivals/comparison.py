"""All methods on the same arm, with as many measured points and the same noise, judged on poses that none has seen.

A trial is one arm measured once in every way that the methods ask for: sweeps of single joints, as the paper's table 1,
or as many points in free poses. Each method calibrates, says what to command for the kept-out poses (figure 5), the arm
goes there, and the errors are what it missed by. Trials with other random numbers are averaged.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from time import perf_counter

import numpy as np

from core.calibrated_arm import CalibratedArm
from core.compensation import compensate
from core.errors import InputError, TrueaxisError
from core.geometry import Array, Line
from core.measurements import Campaign
from core.phi_convention import convention_of
from core.phi_model import from_axes, near
from core.rivals.observed import Drives
from core.rivals.problems import Repeatability
from core.rotations import vectors_of_rotations

PUBLISHED_MM = (47.00, 1.40)
PUBLISHED_RAD = (0.05, 0.01)
"""Mean errors before and after calibration as Sultan and Wager measured them on the real arm (figures 9 and 10)."""

SINGLE_TRIAL = 0.1
"""Share by which errors have to differ to count as different where there is one trial alone."""


class Data(StrEnum):
    """What a method was given."""

    NONE = "nothing"
    SWEEPS = "sweeps"
    """Of single joints."""
    POINTS = "free points"
    """One target in each of many free poses."""
    POSES = "free poses"
    """Three targets in each of a third as many free poses."""


@dataclass(frozen=True, eq=False)
class Trial:
    """One arm, measured in every way; what it really is, is known."""

    sweeps: Campaign
    points: Campaign
    poses: Campaign
    commanded: Array
    """Near which the arm takes the kept-out poses, (k, n)."""
    wanted: Array
    """The kept-out poses of the tool, in the instrument's frame, (k, 4, 4)."""
    execute: Callable[[Array], Array]
    """Where commands (k, n) really bring the tool on one visit, in the instrument's frame, (k, 4, 4)."""
    axes: tuple[Line, ...]
    """The true joint axes at rest, in the instrument's frame."""
    base: Array
    """From the robot's base to the instrument's frame, as the true axes have it, (4, 4)."""
    told: Repeatability
    """What the methods that cannot find it out are told of the arm's repeatability."""

    def campaign(self, data: Data) -> Campaign:
        """What a method is given.

        Raises:
            InputError: it is given nothing.
        """
        if data is Data.NONE:
            raise InputError("a method that calibrates nothing has no campaign")
        return {Data.SWEEPS: self.sweeps, Data.POINTS: self.points, Data.POSES: self.poses}[data]


@dataclass(frozen=True)
class Found:
    """What a method made of a trial."""

    arm: CalibratedArm
    remark: str = ""
    """How it went, in a sentence."""


@dataclass(frozen=True)
class Method:
    """A way to calibrate."""

    name: str
    source: str
    data: Data
    drives: Drives
    calibrate: Callable[[Trial], Found]
    own: bool = False
    """Whether it is this project's, or the paper's."""


@dataclass(frozen=True)
class ErrorSizes:
    """Sizes of errors over all kept-out poses of all trials, m or rad."""

    mean: float
    rms: float = np.nan
    p95: float = np.nan
    max: float = np.nan
    mean_std: float = np.nan
    """Standard error of the mean, from its scatter over trials."""

    @staticmethod
    def of(sizes: Array) -> "ErrorSizes":
        """Of sizes (trials, poses)."""
        trials = sizes.mean(axis=1)
        spread = float(trials.std(ddof=1) / np.sqrt(len(trials))) if len(trials) > 1 else np.nan
        return ErrorSizes(
            float(sizes.mean()),
            float(np.sqrt(np.mean(sizes**2))),
            float(np.percentile(sizes, 95)),
            float(sizes.max()),
            spread,
        )


@dataclass(frozen=True)
class MethodRow:
    """One line of the comparison."""

    name: str
    source: str
    data: Data
    drives: Drives
    position_m: ErrorSizes
    orientation_rad: ErrorSizes
    length_error_m: float = np.nan
    """Root mean square error of the free lengths a, b of the phi-model."""
    angle_error_rad: float = np.nan
    """Of its free angles alpha, theta."""
    seconds: float = np.nan
    """Median time of one calibration."""
    points: int = 0
    """Measured points."""
    own: bool = False
    note: str = ""
    """What the first trial showed of the method's own workings."""
    failed: int = 0
    """Trials in which the method found no arm, or not one that reaches the kept-out poses; they are not averaged."""

    @property
    def label(self) -> str:
        """The method with what tells it from its like."""
        return f"{self.name}, drives {self.drives}" if self.data is not Data.NONE else self.name


@dataclass(frozen=True)
class Reference:
    """What errors have to be read against."""

    name: str
    position_m: float
    orientation_rad: float
    """Mean errors."""
    note: str
    bounds: bool = False
    """Whether it is the Cramer-Rao bound of the sweeps."""


@dataclass(frozen=True)
class Comparison:
    """The table."""

    title: str
    trials: int
    poses: int
    """Kept-out poses of each trial."""
    rows: tuple[MethodRow, ...]
    references: tuple[Reference, ...]
    notes: tuple[str, ...]

    def __post_init__(self) -> None:
        if self.trials < 1 or not self.rows:
            raise InputError(f"a comparison needs trials and methods, got {self.trials} and {len(self.rows)}")


@dataclass(frozen=True)
class _Outcome:
    """One method in one trial."""

    position_m: Array
    orientation_rad: Array
    parameter_errors: Array
    """Of the free lengths, then of the free angles, root mean square, (2,)."""
    seconds: float
    remark: str


def compare(
    trials: Sequence[Callable[[], Trial]],
    methods: Sequence[Method],
    title: str,
    references: tuple[Reference, ...] = (),
    notes: tuple[str, ...] = (),
    progress: Callable[[int], None] = lambda done: None,
) -> Comparison:
    """Let every method calibrate every trial.

    Args:
        trials: makers of trials, one at a time, so that they need not all be in memory.
        progress: told how many trials are done.
    """
    outcomes: list[list[_Outcome | None]] = [[] for _ in methods]
    counts = [0] * len(methods)
    poses = 0
    for done, make in enumerate(trials):
        progress(done)
        trial = make()
        poses = len(trial.wanted)
        for k, method in enumerate(methods):
            outcomes[k].append(_judged(method, trial))
            counts[k] = _points(trial, method.data)
    rows = tuple(
        _row(method, each, count) for method, each, count in zip(methods, outcomes, counts, strict=True) if any(each)
    )
    lost = tuple(
        f"{method.name}, drives {method.drives}: found no arm in any trial."
        for method, each in zip(methods, outcomes, strict=True)
        if not any(each)
    )
    return Comparison(title, len(trials), poses, rows, references, (*notes, *lost))


def _judged(method: Method, trial: Trial) -> _Outcome | None:
    """None where the method fails or its arm does not reach the kept-out poses."""
    begun = perf_counter()
    try:
        found = method.calibrate(trial)
        seconds = perf_counter() - begun
        ready = compensate(found.arm, trial.wanted, trial.commanded, "instrument")
        errors = _parameter_errors(found.arm, trial)
    except TrueaxisError:
        return None
    if not ready.ok.all():
        return None
    there = trial.execute(ready.commanded)
    turn = vectors_of_rotations(there[:, :3, :3] @ np.swapaxes(trial.wanted[:, :3, :3], 1, 2))
    shift = there[:, :3, 3] - trial.wanted[:, :3, 3]
    return _Outcome(np.linalg.norm(shift, axis=1), np.linalg.norm(turn, axis=1), errors, seconds, found.remark)


def _parameter_errors(arm: CalibratedArm, trial: Trial) -> Array:
    """Root mean square errors of the free lengths and angles of the phi-model, (2,)."""
    convention = convention_of(arm.nominal)
    _, found = from_axes(arm.drives.axes, convention)
    # Where the rule uses a point of an axis, the truth takes the one that the estimate uses.
    lines = [Line(t.foot_of(a.point_m), t.direction) for t, a in zip(trial.axes, arm.drives.axes, strict=True)]
    true = near(from_axes(tuple(lines), convention)[1], found)
    error, free = found.parameters - true.parameters, convention.free
    return np.array([np.sqrt(np.mean(error[:, k][free[:, k]] ** 2)) for k in (slice(0, 2), slice(2, 4))])


def _points(trial: Trial, data: Data) -> int:
    if data is Data.NONE:
        return 0
    table = trial.campaign(data).measurements
    return int((table.seen & ~table.check & (table.target >= 0)).sum())


def _row(method: Method, outcomes: list[_Outcome | None], points: int) -> MethodRow:
    good = [one for one in outcomes if one is not None]
    lengths, angles = np.sqrt(np.mean([one.parameter_errors**2 for one in good], axis=0))
    return MethodRow(
        name=method.name,
        source=method.source,
        data=method.data,
        drives=method.drives,
        position_m=ErrorSizes.of(np.array([one.position_m for one in good])),
        orientation_rad=ErrorSizes.of(np.array([one.orientation_rad for one in good])),
        length_error_m=float(lengths),
        angle_error_rad=float(angles),
        seconds=float(np.median([one.seconds for one in good])),
        points=points,
        own=method.own,
        note=good[0].remark,
        failed=len(outcomes) - len(good),
    )


def smaller(one: ErrorSizes, other: ErrorSizes) -> bool:
    """Whether a mean is smaller than another by more than two standard errors of the difference.

    Where a single trial tells no standard error, by more than a tenth.
    """
    slack = 2 * float(np.hypot(one.mean_std, other.mean_std))
    return one.mean < other.mean - (slack if np.isfinite(slack) else SINGLE_TRIAL * other.mean)
