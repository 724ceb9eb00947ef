"""What is built otherwise than drawn, or moves as it should not: geometry, and axes that wobble."""

import numpy as np

from core.gap.doings import Doings
from core.gap.effects.candidate import ANGLE, LENGTH, Candidate, Column, motors
from core.gap.result import Place
from core.gap.sim import Part, Slot

LINK_NAMES = ("turn_about_x_rad", "turn_about_y_rad", "shift_along_x_m", "shift_along_y_m", "shift_along_z_m")
LINK_AXES = (0, 1, 3, 4, 5)
"""A turn about z is the zero offset of the joint."""
TURNING_ORDERS = {1: 1.0, 2: 1.0, 3: 0.3}
"""Waves a turn of an axis that wobbles, and how large each is expected to be."""
GUIDE_ORDERS = {1: 1.0, 2: 1.0, 3: 1.0, 4: 1.0, 5: 1.0}
"""Half waves over the way of a guide, the same. A guide has ends, which take more of them than a circle."""
OF_TIMES = {1: "", 2: "_of_twice", 3: "_of_three_times", 4: "_of_four_times", 5: "_of_five_times"}


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
        # What turns about an axis is the drive's; what lies along a guide as well, where it errs in no other way.
        tilts, shifts = ((0, 1, 2), (3, 4, 5)) if doings.seen.chain.sliding[j] else ((0, 1), (3, 4, 5))
        ways = ((tilts, "tilts"), (shifts, "shifts"), ((*tilts, *shifts), "tilts and shifts"))
        out += [_wobble(doings, j, axes, atom) for axes, atom in ways]
    return out


def _geometry(link: int) -> Candidate:
    def columns(doings: Doings) -> list[Column]:
        return [[(Slot(Part.BEYOND, link, k), np.ones(doings.count))] for k in LINK_AXES]

    reference = (ANGLE, ANGLE, LENGTH, LENGTH, LENGTH)
    return Candidate(Place("geometry", frame=link + 1), "", LINK_NAMES, columns, 1, reference)


def _wobble(doings: Doings, joint: int, axes: tuple[int, ...], atom: str) -> Candidate:
    orders, per_unit, middle = TURNING_ORDERS, 1.0, 0.0
    if doings.seen.chain.sliding[joint]:
        # Half waves of what was travelled are smooth functions with any ends.
        x = doings.active[:, joint]
        orders, per_unit, middle = GUIDE_ORDERS, np.pi / float(np.ptp(x)), float(x.min() + x.max()) / 2

    def columns(doings: Doings) -> list[Column]:
        x = per_unit * (doings.active[:, joint] - middle)
        waves = [wave(order * x) for order in orders for wave in (np.sin, np.cos)]
        return [[(Slot(Part.AXIS, joint, k), wave)] for k in axes for wave in waves]

    waves = [f"{wave}{OF_TIMES[order]}" for order in orders for wave in ("sine", "cosine")]
    names = tuple(
        f"{'tilt_about' if k < 3 else 'shift_along'}_{'xyz'[k % 3]}_{wave}_{'rad' if k < 3 else 'm'}"
        for k in axes
        for wave in waves
    )
    share = [part for part in orders.values() for _ in range(2)]
    reference = tuple((ANGLE if k < 3 else LENGTH) * part for k in axes for part in share)
    return Candidate(Place("axis_wobble", joint=joint + 1), atom, names, columns, 3, reference)
