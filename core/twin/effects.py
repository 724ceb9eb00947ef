"""Faults that can be added to a simulated cell: their names, where they sit, how their size is written.

``NAME:PLACE:SIZE``, for example ``backlash:3:0.2deg``. Every fault of a drive changes what the joint's own motor makes
of its command (the active displacement, x, counted from home); motion that is passed on to the next joint follows
from what the joint really did, as section 3 of the paper has it. Faults add up.
"""

import re
from dataclasses import dataclass

from core.errors import InputError
from core.robot import Robot
from core.twin.effect_units import Quantity, quantities_text, read_size

JOINT, JOINT_OR_ALL, LINK_OR_ALL = "a joint", "a joint or 'all'", "a link or 'all'"
FRAME, COUPLING, NOWHERE = "a frame, or frame.parameter such as 2.alpha", "two joints such as 3-4", "'-'"
RECORD, TARGET = "a record", "a target, or target@record such as T1@80"
PARAMETERS = ("a", "b", "alpha", "theta")


@dataclass(frozen=True)
class EffectKind:
    """What can be said of one kind of fault."""

    name: str
    place: str
    quantities: tuple[Quantity, ...]
    unit: str
    """The unit of a size that is written without one."""
    sliding_unit: str
    """The same where the joint slides."""
    meaning: str


def _kind(name: str, place: str, sizes: str, unit: str, meaning: str, sliding_unit: str = "") -> EffectKind:
    return EffectKind(name, place, tuple(Quantity(s) for s in sizes.split()), unit, sliding_unit or unit, meaning)


CATALOGUE = (
    _kind("geometry", FRAME, "length angle", "mm", "the parameter (a if a length is given, theta if an angle) + size"),
    _kind("zero_offset", JOINT, "angle length", "deg", "x + size", "mm"),
    _kind("ratio", JOINT, "fraction", "1", "(1 + size) x"),
    _kind("eccentricity", JOINT, "angle length", "deg", "x + size (0.8 sin u + 0.6 cos u), u once a turn", "mm"),
    _kind("mesh", JOINT, "angle length", "deg", "x + size sin(9.5 u + 0.5)", "mm"),
    _kind("backlash", JOINT, "angle length", "deg", "x - size/2 sign(approach)", "mm"),
    _kind("compliance", JOINT, "compliance give", "urad/Nm", "x + size times the drive's gravity torque", "um/N"),
    _kind("coupling", COUPLING, "fraction", "1", "net of the second joint + size times x of the first"),
    _kind("axis_wobble", JOINT, "angle length", "deg", "the axis tilts or shifts by size (sin 2u, cos 2u - 1)", "mm"),
    _kind("latency", JOINT_OR_ALL, "time", "ms", "x - size times the speed"),
    _kind(
        "thermal", LINK_OR_ALL, "growth", "ppm/K", "lengths grow by size times the arm's temperature above its first"
    ),
    _kind("drift", NOWHERE, "rate", "mm/h", "all points + size times time, in one direction"),
    _kind(
        "base_shift", RECORD, "length angle", "mm", "from that record on the base is shifted, or turned about axis 1"
    ),
    _kind("target_slip", TARGET, "length", "mm", "from that record on the target sits elsewhere on its link"),
    _kind("scale", NOWHERE, "fraction", "ppm", "all points times 1 + size"),
    _kind(
        "hysteresis", JOINT, "angle length", "deg", "backlash that builds up over 5 deg (10 mm) after a reversal", "mm"
    ),
    _kind(
        "flexure", LINK_OR_ALL, "compliance", "urad/Nm", "the link bends at its middle by size times the load's moment"
    ),
    _kind(
        "payload", NOWHERE, "mass", "kg", "a mass at the tool that nobody knows of; the joints give by torque/stiffness"
    ),
    _kind("linkage", JOINT, "fraction", "%", "x through a parallelogram whose output crank is longer by size"),
    _kind("quantisation", JOINT_OR_ALL, "angle length", "deg", "x rounded to whole steps, size > 0", "mm"),
)
"""Every fault that can be added. u is x where the joint turns; a sliding joint's spindle makes a turn every 40 mm."""

KINDS = {kind.name: kind for kind in CATALOGUE}


@dataclass(frozen=True)
class Effect:
    """One fault. What does not apply to its kind is None."""

    name: str
    size: float
    """In SI units."""
    quantity: Quantity
    joint: int | None = None
    """The joint, link or frame, 1..; None: all, or none in particular. Of a coupling: the joint that follows."""
    source: int | None = None
    """Of a coupling: the joint that drives."""
    target: str | None = None
    record: int | None = None
    parameter: str | None = None
    """Of a frame: a, b, alpha or theta."""

    def joints(self, count: int) -> range:
        """Numbers of the joints or links that it acts on, of 1..count."""
        return range(1, count + 1) if self.joint is None else range(self.joint, self.joint + 1)


def parse_effect(text: str, robot: Robot | None = None) -> Effect:
    """The fault that ``NAME:PLACE:SIZE`` asks for; a size without a unit is in the kind's own.

    Args:
        robot: whose joints are meant; None: a joint is taken to turn and its number is checked later.

    Raises:
        InputError: the text is not of that form; the message says what is known.
    """
    parts = [part.strip() for part in text.split(":")]
    if len(parts) != 3:
        raise InputError(f"effect {text!r} has {len(parts)} parts, expected three: NAME:JOINT:SIZE")
    name, place, size = parts
    if name not in KINDS:
        raise InputError(f"effect {text!r}: there is no effect {name!r}; expected one of {', '.join(KINDS)}")
    kind = KINDS[name]
    where = _place(kind, place, text)
    value, quantity = read_size(size, _unit(kind, where.joint, robot), text)
    if quantity not in kind.quantities:
        raise InputError(
            f"effect {text!r}: the size of {name} must be {quantities_text(kind.quantities)}, got {size!r}"
        )
    if name == "quantisation" and value <= 0:
        raise InputError(f"effect {text!r}: a step must be greater than 0, got {size!r}")
    parameter = _frame_parameter(where.parameter, quantity, text) if kind.place == FRAME else None
    effect = Effect(name, value, quantity, where.joint, where.source, where.target, where.record, parameter)
    if robot is not None:
        check_effect(effect, robot)
    return effect


def check_effect(effect: Effect, robot: Robot) -> None:
    """Whether a robot has the joint that an effect names, and whether that joint moves as the size says.

    Raises:
        InputError: it has not.
    """
    kind, count = KINDS[effect.name], robot.joint_count
    last = count - 1 if kind.place == FRAME else count
    for number in (effect.joint, effect.source):
        if number is not None and not 1 <= number <= last:
            what = "frame" if kind.place == FRAME else "joint or link"
            raise InputError(f"effect {effect.name}: {robot.name} has no {what} {number}, expected 1..{last}")
    if kind.place not in (JOINT, JOINT_OR_ALL) or effect.joint is None or effect.name == "axis_wobble":
        return
    slides = robot.joints[effect.joint - 1].slides
    if effect.name == "linkage" and slides:
        raise InputError(f"effect linkage: joint {effect.joint} of {robot.name} slides, expected one that turns")
    wrong = (Quantity.ANGLE, Quantity.COMPLIANCE) if slides else (Quantity.LENGTH, Quantity.GIVE)
    if effect.quantity in wrong:
        how = f"slides, so its size is in {kind.sliding_unit}" if slides else f"turns, so its size is in {kind.unit}"
        raise InputError(f"effect {effect.name}: joint {effect.joint} of {robot.name} {how}")


def _unit(kind: EffectKind, joint: int | None, robot: Robot | None) -> str:
    """The unit of a size that is written without one."""
    known = robot is not None and joint is not None and 1 <= joint <= robot.joint_count
    return kind.sliding_unit if known and robot.joints[joint - 1].slides else kind.unit


@dataclass(frozen=True)
class _Place:
    joint: int | None = None
    source: int | None = None
    target: str | None = None
    record: int | None = None
    parameter: str | None = None


def _place(kind: EffectKind, place: str, text: str) -> _Place:
    patterns = {
        JOINT: r"(?P<joint>\d+)",
        JOINT_OR_ALL: r"(?P<joint>\d+)|all|-",
        LINK_OR_ALL: r"(?P<joint>\d+)|all|-",
        FRAME: r"(?P<joint>\d+)(\.(?P<parameter>a|b|alpha|theta))?",
        COUPLING: r"(?P<source>\d+)[->](?P<joint>\d+)",
        NOWHERE: r"-|all",
        RECORD: r"(?P<record>\d+)",
        TARGET: r"(?P<target>[^@]+)(@(?P<record>\d+))?",
    }
    found = re.fullmatch(patterns[kind.place], place)
    if found is None:
        raise InputError(f"effect {text!r}: {kind.name} needs {kind.place} in the middle, got {place!r}")
    said = found.groupdict()
    numbers = {key: int(said[key]) for key in ("joint", "source", "record") if said.get(key)}
    if numbers.get("source") == numbers.get("joint", 0):
        raise InputError(f"effect {text!r}: a coupling goes from one joint to another, got {place!r}")
    return _Place(**numbers, target=said.get("target"), parameter=said.get("parameter"))


def _frame_parameter(said: str | None, quantity: Quantity, text: str) -> str:
    if said is None:
        return "a" if quantity is Quantity.LENGTH else "theta"
    if (said in ("a", "b")) != (quantity is Quantity.LENGTH):
        raise InputError(f"effect {text!r}: {said} is {'a length' if said in ('a', 'b') else 'an angle'}")
    return said
