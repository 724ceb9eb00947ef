"""Where a robot's base stands in the instrument's frame, from joint axes that were found so far.

Directions of axes fix the turn (Wahba's problem, by singular value decomposition: Markley 1988, J. Astronaut. Sci. 36),
their places the shift, by least squares over what each axis says square to itself. What the axes leave open is chosen
to move the base as little as possible, so that an arm can be drawn from the first axis on.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.geometry import Array, Line, transform

OPEN = np.sin(np.deg2rad(5.0)) ** 2
"""Spread of directions (eigenvalue) below which all axes count as parallel."""
FAINT = 1e-6
"""Weight of a base that is not turned at all, beside an axis."""


@dataclass(frozen=True)
class Placement:
    """A base in the instrument's frame."""

    base: Array
    """From the robot's base frame to the instrument's, (4, 4)."""
    settled: bool
    """Whether the axes fix it; else what they leave open was chosen."""


def place_base(nominal: Sequence[Line], found: Sequence[Line], sliding: Sequence[bool]) -> Placement:
    """The base that brings nominal axes onto those that were found.

    Args:
        nominal: axes in the robot's base frame, in the configuration in which each was measured, k lines.
        found: the same axes in the instrument's frame, in the same sense.
        sliding: which of them slide and so have no place, (k,).
    """
    if not nominal:
        return Placement(np.eye(4), False)
    start, end = (np.array([line.direction for line in lines]) for lines in (nominal, found))
    u, _, vt = np.linalg.svd(end.T @ start + FAINT * np.eye(3))
    rotation = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    turned = np.linalg.eigvalsh(start.T @ start)[1] > OPEN
    shift, shifted = _shift(rotation, nominal, found, np.asarray(sliding, dtype=bool))
    return Placement(transform(rotation, shift), bool(turned and shifted))


def _shift(rotation: Array, nominal: Sequence[Line], found: Sequence[Line], sliding: np.ndarray) -> tuple[Array, bool]:
    """The shift by the axes that turn, (3,), and whether they fix it: each tells of what is square to it."""
    turning = np.flatnonzero(~sliding)
    if len(turning) == 0:
        return np.zeros(3), False
    directions = np.array([found[k].direction for k in turning])
    gaps = np.array([found[k].point_m - rotation @ nominal[k].point_m for k in turning])
    square = np.eye(3) - directions[:, :, None] * directions[:, None, :]
    # From the first gap on, so that what stays open is where the points of the axes have it.
    rest = np.einsum("kij,kj->i", square, gaps - gaps[0])
    normal = square.sum(axis=0)
    return gaps[0] + np.linalg.pinv(normal, rcond=1e-3) @ rest, bool(np.linalg.eigvalsh(normal)[0] > OPEN)
