"""A candidate: one effect at one place, as small motions that are linear in its unknown numbers."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from core.gap.doings import Doings
from core.gap.result import Place
from core.gap.sim import Part, Slot
from core.geometry import Array

ANGLE, LENGTH = 3e-4, 1.5e-4
"""What counts as one: motions of this size are taken as equally likely before any point is seen, rad and m."""

Term = tuple[Slot, Array]
Column = list[Term]
"""A column moves each slot by its feature times one unknown number."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """One effect at one place, with what is not linear in it (an order, a moment of time) already chosen."""

    place: Place
    atom: str
    """What was chosen, in words; empty: nothing had to be."""
    names: tuple[str, ...]
    """Of the unknown numbers, with their SI units: ``offset_rad``."""
    columns: Callable[[Doings], list[Column]]
    """The columns for any points of the arm: those of the campaign, or new ones."""
    choices: int = 1
    """How many candidates of the same effect and place there are: what choosing costs."""
    reference: tuple[float, ...] = ()
    """Sizes of the unknown numbers that are taken as equally likely; empty: ones."""
    fixed: tuple[tuple[str, float], ...] = ()
    """Numbers that were chosen rather than fitted, by name with unit."""
    waves: float = np.inf
    """Of a periodic error: its periods in a turn, or over the whole way of a joint that slides."""

    @property
    def named(self) -> bool:
        return not self.place.effect.startswith("?")

    @property
    def references(self) -> Array:
        return np.array(self.reference) if self.reference else np.ones(len(self.names))


def drive(doings: Doings, joint: int, feature: Array) -> Column:
    """A column that moves one motor."""
    return [(Slot(Part.DRIVE, joint), feature)]


def unit(doings: Doings, joint: int) -> str:
    """The unit of a joint's displacement: ``rad`` or ``m``."""
    return "m" if doings.seen.chain.sliding[joint] else "rad"


def motors(doings: Doings) -> list[int]:
    """Joints with a motor that moves at all, from 0."""
    return [j for j in driven(doings) if not doings.seen.still[j]]


def driven(doings: Doings) -> list[int]:
    """Joints with a motor, held ones too, from 0."""
    before = doings.seen.link.max() > np.arange(doings.seen.joint_count)
    return [int(j) for j in np.flatnonzero(doings.seen.chain.commanded & before)]
