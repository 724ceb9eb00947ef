"""What can happen in a session: one record a kind of event, checked against its schema before it is kept.

Everything is SI (m, rad, s, kg) but temperatures (deg C). An event says what a person decided or an instrument saw;
what follows from it is for the fold of all events (``core.session_state``). ``Undo`` and ``Redo`` are events too.
"""

import re
from typing import Annotated, ClassVar, Literal

import msgspec
from msgspec import Meta

from core.errors import InputError
from core.input_files import shown
from core.session_plan import PlannedSweep, StepKey
from core.session_poses import MOST_POSES
from core.session_values import Line, Number, Numbers, Point, PositiveInt, SomeNumbers, Text, UpperTriangle

LONGEST_EVENT_BYTES = 8_000_000
Verdict = Literal["kept", "doubtful", "excluded"]


class SessionError(InputError):
    """A session file or an event cannot be used."""


class Event(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind"):
    """Base of all events."""

    undoable: ClassVar[bool] = True
    """Whether an operator's undo takes it back; what merely took place cannot be."""

    @property
    def bears_on_solution(self) -> bool:
        """Whether a solution from before it may be out of date."""
        return self.undoable


class Created(Event, frozen=True, tag="created"):
    """The session begins."""

    undoable = False
    software: Line
    """Version of trueaxis."""


class Opened(Event, frozen=True, tag="opened"):
    """A program opened the file for writing."""

    undoable = False
    software: Line


class Closed(Event, frozen=True, tag="closed"):
    """The program closed the file in good order."""

    undoable = False


class Copied(Event, frozen=True, tag="copied"):
    """This file is a copy, made in good order, of another session file."""

    undoable = False
    source: Line


class Titled(Event, frozen=True, tag="titled"):
    """What the session is called."""

    title: Line


class OperatorNamed(Event, frozen=True, tag="operator"):
    """Who measures."""

    name: Line


class RobotChosen(Event, frozen=True, tag="robot"):
    """The nominal robot, as the text of a robot.toml."""

    toml: str
    files: dict[Line, str] = {}
    """Texts of the files that it names (a URDF), by name."""


class TargetEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A target and the link that it rides on; see ``core.measurements.Target``."""

    name: Line
    link: Annotated[int, Meta(ge=0, le=100)]
    point_m: Point | None = None
    sigma_m: Annotated[float, Meta(ge=0, le=1e12)] = 0.0


class TargetsNamed(Event, frozen=True, tag="targets"):
    """All targets of the session."""

    targets: Annotated[tuple[TargetEntry, ...], Meta(min_length=1, max_length=1000)]


class InstrumentChosen(Event, frozen=True, tag="instrument"):
    """What is measured with; see ``core.measurements.Instrument``."""

    instrument: Literal["theodolite-pair", "total-station", "laser-tracker", "other"]
    sigma_m: Annotated[float, Meta(gt=0, le=1e12)] | None = None
    """Promised standard deviation of one coordinate."""
    description: dict[Line, Text] = {}
    """Model, serial number, last calibration, ..."""
    turn_sigma_rad: Annotated[float, Meta(gt=0, le=1e12)] | None = None
    """Promised standard deviation of each component of a 6-D target's turn."""


class Planned(Event, frozen=True, tag="plan"):
    """The sweeps to be made, in their order."""

    sweeps: Annotated[tuple[PlannedSweep, ...], Meta(max_length=1000)]
    home: Numbers | None = None
    """Commands at the arm's marks, about which everything is measured, (n,); None: zero."""
    joint_values: Literal["commanded", "goal", "readback"] = "commanded"


class PosesPlanned(Event, frozen=True, tag="poses"):
    """The poses at which the arm is to be verified; see ``core.session_poses``."""

    bears_on_solution = False

    wanted: Annotated[tuple[Numbers, ...], Meta(max_length=MOST_POSES)]
    targets: Annotated[tuple[Line, ...], Meta(max_length=100)]


class Fact(Event, frozen=True, tag="fact"):
    """Something worth keeping with the data: a serial number, a place, the payload; an empty value takes it away."""

    key: Line
    value: Text


class Setting(Event, frozen=True, tag="setting"):
    """A choice of the program's user, such as a tolerance; None takes it away."""

    key: Line
    value: Line | Number | bool | None

    @property
    def bears_on_solution(self) -> bool:
        """Limits judge a solution, they do not change it."""
        return not self.key.startswith("limit_")


class ShotTaken(Event, frozen=True, tag="shot"):
    """One measured point, or a move at which nothing was measured, with all that belongs to it."""

    target: Line
    """Empty for a move."""
    commanded: Numbers
    """Commanded displacements, rad or m, (n,)."""
    point_m: Point | None
    """In the instrument's frame; None: not seen."""
    covariance_m2: UpperTriangle | None = None
    """xx, xy, xz, yy, yz, zz; None: the instrument's own sigma."""
    phase: Literal["sweep", "pose", "move"] = "sweep"
    joint: Annotated[int, Meta(ge=0, le=100)] = 0
    sweep: Annotated[int, Meta(ge=0, le=1_000_000)] = 0
    step: Annotated[int, Meta(ge=-1, le=1_000_000)] = -1
    pose: Annotated[int, Meta(ge=-1, le=1_000_000)] = -1
    approach: Annotated[tuple[Literal[-1, 0, 1], ...], Meta(max_length=100)] = ()
    """Sense in which each joint reached its place, (n,); empty: unknown."""
    check: bool = False
    """A validation point, never to be fitted."""
    record: PositiveInt | None = None
    """Its number in the campaign that it was imported from; None: the next free one."""
    replaces: PositiveInt | None = None
    """The shot (by its event's number) that this one measures again."""
    angles_rad: Numbers | None = None
    """What the instrument read, if it reads angles: hz and v of each station."""
    time_s: Number | None = None
    temperature_c: Number | None = None
    arm_temperature_c: Number | None = None
    payload_kg: Number | None = None
    speed: Numbers | None = None
    torque_nm: SomeNumbers | None = None
    readback: SomeNumbers | None = None
    wanted: SomeNumbers | None = None
    """Of a compensated pose: commands by which the nominal arm would take it, (n,)."""
    target_quaternion: tuple[Number, Number, Number, Number] | None = None
    simulated_point_m: Point | None = None

    @property
    def bears_on_solution(self) -> bool:
        """Test poses are kept from every fit."""
        return self.phase != "pose"


class Judged(Event, frozen=True, tag="judged"):
    """Shots are kept, held doubtful, or left out; leaving out takes a reason."""

    shots: Annotated[tuple[PositiveInt, ...], Meta(min_length=1, max_length=100_000)]
    verdict: Verdict
    reason: Line = ""


class OfStep(Event, frozen=True):
    """Base of what is said of one planned step."""

    joint: PositiveInt
    sweep: PositiveInt
    step: Annotated[int, Meta(ge=0, le=1_000_000)]
    sense: Literal[-1, 1]
    target: Line

    @property
    def key(self) -> StepKey:
        return self.joint, self.sweep, self.step, self.sense, self.target


class Skipped(OfStep, frozen=True, tag="skipped"):
    """A planned step is not made; measuring it later is still allowed."""

    reason: Line = ""


class WentTo(OfStep, frozen=True, tag="went_to"):
    """The operator goes on from another step of the plan; if it was skipped, it no longer is."""

    undoable = False


class CheckShot(Event, frozen=True, tag="check"):
    """One of the repeated shots by which the instrument is checked."""

    check: PositiveInt
    """Which check it belongs to, 1, 2, ..."""
    target: Line
    point_m: Point
    covariance_m2: UpperTriangle | None = None
    angles_rad: Numbers | None = None
    time_s: Number | None = None
    temperature_c: Number | None = None


class Solved(Event, frozen=True, tag="solved"):
    """A calibration was computed; only what identifies it is kept, for it can be computed again."""

    undoable = False
    digest: Line
    """SHA-256 of the result."""
    shots: Annotated[int, Meta(ge=0)]
    """How many shots went into it."""
    software: Line
    figures: dict[Line, Line | Number] = {}
    """Its main numbers, for comparing with the next one."""


class NoteWritten(Event, frozen=True, tag="note"):
    """A remark, about a shot or the whole session."""

    text: Text
    shot: PositiveInt | None = None


class Failed(Event, frozen=True, tag="failed"):
    """An instrument or a robot did not do what it was asked for."""

    undoable = False
    sentence: Text


class Undo(Event, frozen=True, tag="undo"):
    """The event of this number no longer counts."""

    undoable = False
    event: PositiveInt


class Redo(Event, frozen=True, tag="redo"):
    """The event of this number counts again."""

    undoable = False
    event: PositiveInt


AnyEvent = (
    Created | Opened | Closed | Copied | Titled | OperatorNamed | RobotChosen | TargetsNamed | InstrumentChosen
    | Planned | PosesPlanned | Fact | Setting | ShotTaken | Judged | Skipped | WentTo | CheckShot | Solved | NoteWritten
    | Failed | Undo | Redo
)  # fmt: skip
_WORDS = (
    (re.compile("str matching regex .*", re.DOTALL), "a text without control characters, on one line if it is a name"),
    (re.compile(r"str of length <= (\d+)"), r"a text of at most \1 characters"),
    (re.compile(r"\bstr\b"), "a text"),
    (re.compile(r"\bint\b"), "a whole number"),
    (re.compile(r"\bfloat\b"), "a number"),
    (re.compile(r"\bnull\b"), "nothing"),
)
"""What the checker of schemas says, in words for people."""
_MESSAGE = re.compile(r"(.*?)(?: - at `\$\.?(.*)`)?", re.DOTALL)


def kind_of(event: Event) -> str:
    """The word by which a kind of event is kept."""
    return str(type(event).__struct_config__.tag)


def checked(event: Event) -> AnyEvent:
    """The same event with plain numbers, every value checked; arrays may be given where numbers are listed.

    Raises:
        SessionError: a value is of the wrong type, no finite number, or beyond its bounds; the sentence says where.
    """
    if not isinstance(event, Event):
        raise SessionError(f"{shown(event)} is not an event of a session")
    plain: object = None
    try:
        plain = msgspec.to_builtins(event, enc_hook=_listed, builtin_types=(bytes, bytearray))
        return msgspec.convert(plain, AnyEvent)
    except (msgspec.ValidationError, TypeError, ValueError, RecursionError, OverflowError) as wrong:
        raise SessionError(_sentence(kind_of(event), str(wrong), plain)) from None


def _listed(value: object) -> object:
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{shown(value)} is no plain value")


def _sentence(kind: str, message: str, plain: object) -> str:
    expected, place = _MESSAGE.fullmatch(message).groups()
    words = expected[:1].lower() + expected[1:].replace("`", "")
    for pattern, better in _WORDS:
        words = pattern.sub(better, words)
    if not place:
        return f"event {kind!r}: {words}"
    for key in re.findall(r"[^.\[\]]+", place):
        try:
            plain = plain[int(key)] if isinstance(plain, list | tuple) else plain[key]
        except (LookupError, TypeError, ValueError):
            return f"event {kind!r}, {place}: {words}"
    return f"event {kind!r}, {place} = {shown(plain)}: {words}"
