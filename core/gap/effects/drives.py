"""What a drive makes of its command: zero offset, ratio, once a turn, many times a turn, four-bar, another's motion."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from core.gap.doings import Doings
from core.gap.effects.candidate import ANGLE, Candidate, Column, drive, motors, unit
from core.gap.result import Place
from core.gap.sim import Part, Slot
from core.geometry import Array

FINEST_ORDER_STEP, MOST_ORDER = 0.5, 40.0
HARMONIC_DRIVE_ORDERS = (50.0, 80.0, 100.0, 120.0, 160.0, 200.0, 240.0)
MOST_TURNS = 60.0
"""Of a spindle over the span of a joint that slides."""
SQUARE_AT_RAD = np.deg2rad([45.0, 60.0, 75.0, 90.0, 105.0, 120.0, 135.0])
"""Angle of the crank to the ground bar in the middle of the joint's span."""
OF_TIMES = {1: "", 2: "_of_twice"}
FLATTEST = 0.12
"""A four-bar nearer its dead point than this sine is not a candidate."""


def zero_offsets(doings: Doings) -> list[Candidate]:
    return [_drive("zero_offset", j, f"offset_{unit(doings, j)}", lambda x: np.ones_like(x)) for j in _turned(doings)]


def ratios(doings: Doings) -> list[Candidate]:
    return [_drive("ratio", j, "error_1", lambda x: x) for j in motors(doings)]


def eccentricities(doings: Doings) -> list[Candidate]:
    out = []
    for j in motors(doings):
        orders = _spindle_orders(doings, j) if doings.seen.chain.sliding[j] else [1.0]
        out += [_harmonic("eccentricity", doings, j, order, len(orders)) for order in orders]
    return out


def meshes(doings: Doings) -> list[Candidate]:
    out = []
    for j in motors(doings):
        sliding = doings.seen.chain.sliding[j]
        orders = _spindle_orders(doings, j) if sliding else mesh_orders(doings, j)
        out += [_harmonic("mesh", doings, j, order, len(orders)) for order in orders]
    return out


def mesh_orders(doings: Doings, joint: int) -> list[float]:
    """Orders that are looked at: as fine as the joint's span can tell apart, as high as its stops can show."""
    grid = np.arange(2.0, MOST_ORDER + 0.01, order_step(doings, joint))
    ratio = doings.seen.chain.joints[joint].drive_ratio
    known = HARMONIC_DRIVE_ORDERS if ratio is None else (abs(ratio), 2 * abs(ratio))
    return [float(order) for order in (*grid, *known) if order > 1.5]


def order_step(doings: Doings, joint: int) -> float:
    """How far apart orders are looked at, times a turn (rad a metre where the joint slides)."""
    span = max(float(doings.seen.span[joint]), 1e-6)
    return 0.8 * np.pi / span if doings.seen.chain.sliding[joint] else max(FINEST_ORDER_STEP, np.pi / (2.5 * span))


def order_of(candidate: Candidate) -> float | None:
    """The order of a periodic error, times a turn (rad a metre where the joint slides); None: nothing was chosen."""
    fixed = dict(candidate.fixed)
    return 2 * np.pi / fixed["lead_m"] if "lead_m" in fixed else fixed.get("order_1")


def periodic(candidate: Candidate, doings: Doings, order: float) -> list[Candidate]:
    """The same periodic error with another order; of a mesh also with its double, as teeth with unlike flanks make it.

    What comes once a turn of a spindle and what comes several times cannot be told apart where its lead is not known.
    """
    joint = candidate.place.joint - 1
    effects = ("eccentricity", "mesh") if doings.seen.chain.sliding[joint] else (candidate.place.effect,)
    return [
        _harmonic(effect, doings, joint, order, candidate.choices, doubled)
        for effect in effects
        for doubled in (False, True)
        if effect == "mesh" or not doubled
    ]


def linkages(doings: Doings) -> list[Candidate]:
    """A parallelogram whose four lengths are not quite equal in pairs, its crank square to the ground bar near home.

    Closing the loop to first order: r sin(u) d = (ground - coupler) + (difference of the cranks) cos(u).
    """
    out = []
    for j in _turned(doings):
        x = doings.active[:, j]
        middle = (x.min() + x.max()) / 2
        angles = [a - middle for a in SQUARE_AT_RAD if np.sin(a + np.ptp(x) / 2 * np.array([-1, 1])).min() > FLATTEST]
        out += [_linkage(j, float(a), len(angles)) for a in angles]
    return out


def couplings(doings: Doings) -> list[Candidate]:
    """Every motor could move every joint; a neighbour's is the usual case."""
    chain = doings.seen.chain
    reach = doings.seen.link.max()
    return [
        _coupling(i, j, unit(doings, i), unit(doings, j))
        for i in motors(doings)
        for j in range(chain.joint_count)
        if i != j and j < reach
    ]


def _turned(doings: Doings) -> list[int]:
    return [j for j in motors(doings) if not doings.seen.chain.sliding[j]]


def _drive(effect: str, joint: int, name: str, feature: Callable[[Array], Array]) -> Candidate:
    def columns(doings: Doings) -> list[Column]:
        return [drive(doings, joint, feature(doings.active[:, joint]))]

    return Candidate(Place(effect, joint=joint + 1), "", (name,), columns, reference=(ANGLE,))


def _harmonic(effect: str, doings: Doings, joint: int, order: float, choices: int, doubled: bool = False) -> Candidate:
    times = (1, 2) if doubled else (1,)

    def columns(doings: Doings) -> list[Column]:
        x = order * doings.active[:, joint]
        return [drive(doings, joint, wave(k * x)) for k in times for wave in (np.sin, np.cos)]

    of = unit(doings, joint)
    fixed: tuple[tuple[str, float], ...] = ()
    if of == "m":
        fixed = (("lead_m", 2 * np.pi / order),)
    elif effect == "mesh":
        fixed = (("order_1", order),)
    atom = f"{order:.4g} times a turn" if of == "rad" else f"every {2e3 * np.pi / order:.4g} mm"
    if doubled:
        atom += ", with its double"
    names = tuple(f"{wave}{OF_TIMES[k]}_{of}" for k in times for wave in ("sine", "cosine"))
    reference = tuple(ANGLE / k**2 for k in times for _ in range(2))
    waves = order if of == "rad" else order * float(doings.seen.span[joint]) / (2 * np.pi)
    return Candidate(Place(effect, joint=joint + 1), atom, names, columns, choices, reference, fixed, waves)


def _spindle_orders(doings: Doings, joint: int) -> list[float]:
    step = order_step(doings, joint)
    most = 2 * np.pi * MOST_TURNS / max(float(doings.seen.span[joint]), 1e-6)
    return [float(order) for order in np.arange(step, most + step, step)]


def _linkage(joint: int, square_at: float, choices: int) -> Candidate:
    def columns(doings: Doings) -> list[Column]:
        crank = doings.active[:, joint] + square_at
        sine = np.maximum(np.sin(crank), FLATTEST)
        return [
            drive(doings, joint, 1 / sine),
            drive(doings, joint, np.cos(crank) / sine),
            drive(doings, joint, np.ones_like(sine)),
        ]

    names = ("bars_difference_rad", "cranks_difference_rad", "offset_rad")
    atom = f"crank at {np.rad2deg(square_at):.0f} deg where the joint is at zero"
    fixed = (("crank_at_zero_rad", square_at),)
    return Candidate(Place("linkage", joint=joint + 1), atom, names, columns, choices, (ANGLE,) * 3, fixed)


def _coupling(source: int, joint: int, source_unit: str, own_unit: str) -> Candidate:
    def columns(doings: Doings) -> list[Column]:
        return [[(Slot(Part.JOINT, joint), doings.active[:, source])]]

    name = "gain_1" if source_unit == own_unit else f"gain_{own_unit}_per_{source_unit}"
    return Candidate(Place("coupling", joint=joint + 1, source=source + 1), "", (name,), columns, reference=(ANGLE,))


def saw(x: Array, step: float | Array, phase: float | Array) -> Array:
    """What rounding to whole steps does to x."""
    return step * teeth(x / step - phase)


def teeth(steps: Array) -> Array:
    """What rounding does to a number of steps."""
    return np.rint(steps) - steps


@dataclass(frozen=True, eq=False)
class EncoderSteps(Candidate):
    """Steps of encoders of sizes that have been found."""

    steps: dict[int, tuple[float, float]] = field(default_factory=dict)
    """Size and phase (a share of a step) by joint, from 0."""


def quantisation(doings: Doings, steps: dict[int, tuple[float, float]]) -> EncoderSteps:
    """Displacements rounded to whole steps, of one joint or of several."""

    def columns(doings: Doings) -> list[Column]:
        return [[(Slot(Part.DRIVE, j), saw(doings.active[:, j], *one)) for j, one in steps.items()]]

    fixed = tuple((f"step_of_joint_{j + 1}_{unit(doings, j)}", one[0]) for j, one in steps.items())
    said = ", ".join(f"{one[0]:.8g} {unit(doings, j)} from {one[1]:.3f} of one" for j, one in steps.items())
    joint = next(iter(steps)) + 1 if len(steps) == 1 else None
    return EncoderSteps(
        Place("quantisation", joint=joint), f"steps of {said}", ("share_1",), columns, 200, (1.0,), fixed, steps=steps
    )


def latencies(doings: Doings) -> list[Candidate]:
    """An error along the speed, of one motor or of all by one delay."""
    speed = doings.speed
    if speed is None:
        return []
    moving = [j for j in motors(doings) if np.ptp(speed[:, j]) > 0]
    return [_latency(j, [j]) for j in moving] + ([_latency(None, moving)] if len(moving) > 1 else [])


def readings(doings: Doings) -> list[Candidate]:
    """Values read back beside the commanded ones, of one joint or of all."""
    if doings.logged("readback") is None:
        return []
    moving = motors(doings)
    return [_read_back(j, [j]) for j in moving] + [_read_back(None, moving)]


def _latency(joint: int | None, joints: list[int]) -> Candidate:
    def columns(doings: Doings) -> list[Column]:
        speed = np.zeros_like(doings.active) if doings.speed is None else doings.speed
        return [[(Slot(Part.DRIVE, j), -speed[:, j]) for j in joints]]

    place = Place("latency", joint=None if joint is None else joint + 1)
    return Candidate(place, "along the speed", ("delay_s",), columns, 1, (1e-3,))


def _read_back(joint: int | None, joints: list[int]) -> Candidate:
    def columns(doings: Doings) -> list[Column]:
        readback = doings.logged("readback")
        away = np.zeros_like(doings.active) if readback is None else readback - _commanded(doings)
        return [[(Slot(Part.JOINT, j), away[:, j]) for j in joints]]

    place = Place("latency", joint=None if joint is None else joint + 1)
    return Candidate(place, "as read back", ("share_1",), columns, 1, (1.0,))


def _commanded(doings: Doings) -> Array:
    return doings.seen.campaign.measurements.commanded[doings.seen.rows]
