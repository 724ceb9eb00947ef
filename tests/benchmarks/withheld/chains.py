"""Where the points of an arm are when everything about it may be a little off: the package's own kinematics."""

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from tests.benchmarks.withheld.rigid import Array, moved, turn_z


@dataclass(frozen=True)
class Chain:
    """Axes along z, one after the other: T = M_1 C_1 M_2 C_2 ... M_n C_n."""

    sliding: tuple[bool, ...]
    links: Array
    """C_i, from frame i+1 to frame i, (n, 4, 4), m; the last leads to the frame in which targets are given."""

    @property
    def count(self) -> int:
        return len(self.sliding)


@dataclass(frozen=True)
class Disturbance:
    """What differs from the nominal arm at each of m rows; absent: nothing does."""

    turn: Array | None = None
    """Added to the joints' displacements, rad or m, (m, n)."""
    axis: Array | None = None
    """Motion of each joint's axis before the joint moves, in its own frame, (m, n, 6): turn, shift."""
    link: Array | None = None
    """Motion of each link's far end, in the frame there, (m, n, 6)."""
    target: Array | None = None
    """Shift of the seen target on its link, m, (m, 3)."""
    base: Array | None = None
    """Motion of the base in the instrument's frame, (m, 6)."""
    stretch: Array | None = None
    """Shift of the measured point by the instrument itself, m, (m, 3)."""

    def __add__(self, other: "Disturbance") -> "Disturbance":
        return Disturbance(*(_sum(getattr(self, f.name), getattr(other, f.name)) for f in fields(self)))


def _sum(a: Array | None, b: Array | None) -> Array | None:
    if a is None or b is None:
        return b if a is None else a
    return a + b


@dataclass(frozen=True)
class Stand:
    """Frames of a chain at many rows, in the base's frame."""

    chain: Chain
    rotation: Array
    """Frame of each joint after it moved, (m, n, 3, 3)."""
    origin: Array
    """(m, n, 3)."""
    end_rotation: Array
    """Far end of each link, that is frame i+1 before joint i+1 moves, (m, n, 3, 3)."""
    end_origin: Array

    @cached_property
    def axis(self) -> Array:
        """Directions of the joint axes, (m, n, 3)."""
        return self.rotation[..., 2]


def stand(chain: Chain, q: Array, off: Disturbance | None = None) -> Stand:
    """All frames for displacements (m, n), rad or m."""
    off = off or Disturbance()
    m = len(q)
    g = q if off.turn is None else q + off.turn
    rotation, origin = np.broadcast_to(np.eye(3), (m, 3, 3)), np.zeros((m, 3))
    frames = []
    for i, slides in enumerate(chain.sliding):
        if off.axis is not None:
            rotation, origin = moved(rotation, origin, off.axis[:, i])
        if slides:
            origin = origin + rotation[:, :, 2] * g[:, i, None]
        else:
            rotation = rotation @ turn_z(g[:, i])
        joint = rotation, origin
        origin = origin + rotation @ chain.links[i, :3, 3]
        rotation = rotation @ chain.links[i, :3, :3]
        if off.link is not None:
            rotation, origin = moved(rotation, origin, off.link[:, i])
        frames.append((*joint, rotation, origin))
    return Stand(chain, *(np.stack(part, axis=1) for part in zip(*frames, strict=True)))


def seen_points(chain: Chain, q: Array, place: Array, base: Array, off: Disturbance | None = None) -> Array:
    """Points in the instrument's frame, (m, 3), m.

    Args:
        q: displacements, (m, n).
        place: place of the target of each row in the last frame, (m, 3).
        base: from the base to the instrument, (4, 4).
        off: what is wrong.
    """
    off = off or Disturbance()
    at = stand(chain, q, off)
    local = place if off.target is None else place + off.target
    point = at.end_origin[:, -1] + np.einsum("mij,mj->mi", at.end_rotation[:, -1], local)
    point = point @ base[:3, :3].T + base[:3, 3]
    if off.base is not None:
        # About the base's own foot, so that a turn does not swing the arm about the instrument.
        foot = base[:3, 3]
        rotation, origin = moved(np.broadcast_to(np.eye(3), (len(q), 3, 3)), np.zeros((len(q), 3)), off.base)
        point = foot + origin + np.einsum("mij,mj->mi", rotation, point - foot)
    return point if off.stretch is None else point + off.stretch
