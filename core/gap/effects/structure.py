"""What is built otherwise than drawn, or moves as it should not: geometry, axes that wobble, links that grow."""

from collections.abc import Callable

import numpy as np

from core.gap.doings import Doings
from core.gap.effects.candidate import ANGLE, LENGTH, Candidate, Column, motors
from core.gap.result import Place
from core.gap.sim import Part, Slot
from core.geometry import Array

LINK_NAMES = ("turn_about_x_rad", "turn_about_y_rad", "shift_along_x_m", "shift_along_y_m", "shift_along_z_m")
LINK_AXES = (0, 1, 3, 4, 5)
"""A turn about z is the zero offset of the joint."""
Law = Callable[[Doings], Array]
"""A rise of temperature at every point, K, or how warm something is, 0..1, (m,)."""
THIRD = 0.3
"""How much less an axis wobbles three times a turn."""
WARM_UP_SHARES = (0.1, 0.3, 1.0)
"""Time constants of warming up, as shares of the whole time."""


def geometries(doings: Doings) -> list[Candidate]:
    """Frame i carries joint i to joint i+1; what lies behind the last joint belongs to the targets."""
    last = min(doings.seen.joint_count, int(doings.seen.link.max()))
    return [_geometry(i) for i in range(last - 1)]


def geometry_slots(doings: Doings) -> list[Slot]:
    """All small changes of geometry, zero offsets of turning joints among them."""
    last = min(doings.seen.joint_count, int(doings.seen.link.max()))
    slots = [Slot(Part.BEYOND, i, k) for i in range(last - 1) for k in LINK_AXES]
    return slots + [Slot(Part.JOINT, j) for j in range(last) if not doings.seen.chain.sliding[j]]


def wobbles(doings: Doings) -> list[Candidate]:
    """The axis tilts or shifts up to three times a turn as the joint turns; a guide is not straight along its way."""
    out = []
    for j in motors(doings):
        # What lies along a guide is the drive's, what turns about an axis as well.
        tilts, shifts = ((0, 1, 2), (3, 4)) if doings.seen.chain.sliding[j] else ((0, 1), (3, 4, 5))
        ways = ((tilts, "tilts"), (shifts, "shifts"), ((*tilts, *shifts), "tilts and shifts"))
        out += [_wobble(doings, j, axes, atom) for axes, atom in ways]
    return out


def thermals(doings: Doings) -> list[Candidate]:
    """Links grow with a logged temperature, or as something does that warms up."""
    out = []
    laws = _warmings(doings)
    lengths = np.linalg.norm(doings.seen.chain.link_transforms[:, :3, 3], axis=1)
    links = [i for i in range(min(doings.seen.joint_count, int(doings.seen.link.max()))) if lengths[i] > 0.01]
    for name, law in laws:
        for which in [*([i] for i in links), links]:
            out.append(_thermal(which, len(which) > 1 or len(links) == 1, name, law, len(laws)))
    return out


def _geometry(link: int) -> Candidate:
    def columns(doings: Doings) -> list[Column]:
        return [[(Slot(Part.BEYOND, link, k), np.ones(doings.count))] for k in LINK_AXES]

    reference = (ANGLE, ANGLE, LENGTH, LENGTH, LENGTH)
    return Candidate(Place("geometry", frame=link + 1), "", LINK_NAMES, columns, 1, reference)


def _wobble(doings: Doings, joint: int, axes: tuple[int, ...], atom: str) -> Candidate:
    orders, per_unit, middle = {1: "", 2: "_of_twice", 3: "_of_three_times"}, 1.0, 0.0
    if doings.seen.chain.sliding[joint]:
        # Half waves of what was travelled are smooth functions with any ends.
        x = doings.active[:, joint]
        per_unit, middle = np.pi / float(np.ptp(x)), float(x.min() + x.max()) / 2

    def columns(doings: Doings) -> list[Column]:
        x = per_unit * (doings.active[:, joint] - middle)
        waves = [wave(order * x) for order in orders for wave in (np.sin, np.cos)]
        return [[(Slot(Part.AXIS, joint, k), wave)] for k in axes for wave in waves]

    waves = [f"{wave}{times}" for times in orders.values() for wave in ("sine", "cosine")]
    names = tuple(
        f"{'tilt_about' if k < 3 else 'shift_along'}_{'xyz'[k % 3]}_{wave}_{'rad' if k < 3 else 'm'}"
        for k in axes
        for wave in waves
    )
    share = [1.0 if order < 3 else THIRD for order in orders for _ in range(2)]
    reference = tuple((ANGLE if k < 3 else LENGTH) * part for k in axes for part in share)
    return Candidate(Place("axis_wobble", joint=joint + 1), atom, names, columns, 3, reference)


def _warmings(doings: Doings) -> list[tuple[str, Law]]:
    """Temperatures above the first one, or what time since the start makes of itself."""
    out = []
    for column, name in (("arm_temperature_c", "arm"), ("temperature_c", "air")):
        logged = doings.logged(column)
        if logged is not None and np.ptp(logged) > 0.05:
            out.append((f"with the temperature of the {name}", _above(column, float(logged[0]))))
    elapsed = doings.elapsed_s
    if elapsed is not None and np.ptp(elapsed) > 0:
        whole = float(np.ptp(elapsed))
        out += [(f"warming up over {share * whole / 60:.3g} min", _warming(share * whole)) for share in WARM_UP_SHARES]
    return out


def _above(column: str, first: float) -> Law:
    def rise(doings: Doings) -> Array:
        logged = doings.logged(column)
        return np.zeros(doings.count) if logged is None else logged - first

    return rise


def _warming(constant_s: float) -> Law:
    def rise(doings: Doings) -> Array:
        elapsed = doings.elapsed_s
        return np.zeros(doings.count) if elapsed is None else 1.0 - np.exp(-elapsed / constant_s)

    return rise


def _thermal(links: list[int], everywhere: bool, law_name: str, law: Law, laws: int) -> Candidate:
    def columns(doings: Doings) -> list[Column]:
        rise = law(doings)
        steps = doings.seen.chain.link_transforms[:, :3, 3]
        one = [[(Slot(Part.BEYOND, i, 3 + c), rise * steps[i, c]) for c in range(3) if steps[i, c]] for i in links]
        together = [term for column in one for term in column]
        return [together, *one] if everywhere and len(links) > 1 else one

    per = "per_k" if law_name.startswith("with") else "when_warm_1"
    names = tuple(f"growth_of_link_{i + 1}_{per}" for i in links)
    if everywhere and len(links) > 1:
        names = (f"growth_of_all_{per}", *names)
    size = 1e-5 if law_name.startswith("with") else 1e-4
    reference = (size, *(0.5 * size,) * (len(names) - 1))
    place = Place("thermal", joint=None if everywhere else links[0] + 1)
    return Candidate(place, law_name, names, columns, laws, reference)
