"""The sim as a model whose every part may be a little off: where points go, and how they answer to small motions.

A point on link k, seen by the instrument, is

    p = s . B . N_1 M_1(g_1 + d_1) L_1 . N_2 M_2(g_2 + d_2) L_2 ... N_k M_k(g_k + d_k) L_k . (t + u)

with the joints' motions M_i and the constant link transforms of the nominal chain in between, and small motions that
an effect can make differ from point to point: d_i of a joint's displacement, N_i of an axis in the link before it,
L_i of the link behind it or of what that carries, u of a target on its link, B of the base, s of the instrument's unit
of length. Every effect is a rule that says how these small motions depend on what the arm does. Composed without
approximation they are the exact model; their first derivatives are the columns that the search looks through.
"""

from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property

import numpy as np

from core.gap.observations import Observations
from core.geometry import Array, apply, cross
from core.kinematics import link_frames


class Part(Enum):
    """What a small motion moves."""

    JOINT = "joint"
    """The displacement of joint ``index``, rad or m."""
    DRIVE = "drive"
    """The displacement that motor ``index`` makes: its own joint's, and what is passed on to the next one."""
    AXIS = "axis"
    """Axis ``index`` in the link before it: turn (0..2) and shift (3..5) in the frame before the joint moved."""
    LINK = "link"
    """Link ``index``: turn and shift in the frame that moves with joint ``index``."""
    BEYOND = "beyond"
    """What link ``index`` carries, as LINK: targets on the link itself stay, but on the farthest link they move."""
    TARGET = "target"
    """Target ``index`` on its link, shift (0..2)."""
    BASE = "base"
    """Everything, in the instrument's frame: turn about the middle of all points (0..2) and shift (3..5)."""
    SCALE = "scale"
    """All points, away from the middle, by a factor 1 + value."""
    DEPTH = "depth"
    """The same along the instrument's line of sight to the middle alone."""
    ROOM = "room"
    """A point by where it lies: along ``axis`` of the instrument's frame by value times the product ``index`` of two
    coordinates about the middle, m."""


PRODUCTS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
"""Pairs of coordinates whose products bend the space of the instrument."""


@dataclass(frozen=True)
class Slot:
    """One component of one small motion. Joints, links and targets count from 0."""

    part: Part
    index: int = 0
    axis: int = 0


@dataclass(frozen=True, eq=False)
class Sim:
    """A sim that has been placed: where its base stands, where its targets sit."""

    seen: Observations
    base: Array
    """From the chain's base to the instrument's frame, (4, 4)."""
    target_m: Array
    """Places of the targets on their links, (targets, 3)."""
    middle_m: Array
    """The middle of all points, instrument's frame, (3,)."""
    simulated_to_instrument: Array | None = None
    """Where another simulator's points are placed, (4, 4); None: as they are given."""

    def part(self, keep: np.ndarray) -> "Sim":
        """The same sim over some of the points."""
        return replace(self, seen=self.seen.part(keep))

    @property
    def passed_on(self) -> Array:
        """What a small motion of each motor does to each joint, (n motors, n joints)."""
        n = self.seen.joint_count
        out = np.eye(n)
        gains = self.seen.chain.coupling_gains
        out[np.arange(n - 1), np.arange(1, n)] = gains[1:]
        return out

    @cached_property
    def frames(self) -> tuple[Array, Array]:
        """Frames 1..n after and before each joint moved, in the instrument's frame, (m, n, 4, 4) twice."""
        seen = self.seen
        after = self.base @ link_frames(seen.chain, seen.net)[:, :-1]
        before = np.empty_like(after)
        before[:, 0] = self.base @ seen.chain.base_transform
        before[:, 1:] = after[:, :-1] @ seen.chain.link_transforms[:-1]
        return after, before

    def points_m(self) -> Array:
        """Where the sim has the points, (m, 3)."""
        if self.seen.simulated_m is not None:
            return self._placed_points()
        after, _ = self.frames
        return self._carried(after)

    def fields(self, slots: list[Slot]) -> Array:
        """Derivative of the points with respect to each small motion, (m, 3, slots)."""
        after, before = self.frames
        points = self._placed_points() if self.seen.simulated_m is not None else self._carried(after)
        out = np.zeros((len(points), 3, len(slots)))
        passed_on = self.passed_on
        for k, slot in enumerate(slots):
            if slot.part is Part.DRIVE:
                for joint in np.flatnonzero(passed_on[slot.index]):
                    out[:, :, k] += passed_on[slot.index, joint] * self._joint(int(joint), after, points)
            else:
                out[:, :, k] = self._field(slot, after, before, points)
        return out

    def moved_m(self, motions: dict[Slot, Array]) -> Array:
        """Where the points go with small motions of any size, composed without approximation, (m, 3).

        Args:
            motions: the value of each slot at every point, (m,), rad, m or 1.
        """
        if self.seen.simulated_m is not None:
            # Another simulator gives points, not a chain to compose: its points are moved as the chain's would be.
            slots = list(motions)
            shift = (
                np.einsum("mck,mk->mc", self.fields(slots), np.stack([motions[s] for s in slots], 1)) if slots else 0.0
            )
            return self.points_m() + shift
        chain, m = self.seen.chain, self.seen.count
        net = self.seen.net.copy()
        for slot, value in motions.items():
            if slot.part is Part.JOINT:
                net[:, slot.index] += value
            elif slot.part is Part.DRIVE:
                net += value[:, None] * self.passed_on[slot.index]
        local = self.target_m[self.seen.target].copy()
        for slot, value in motions.items():
            if slot.part is Part.TARGET:
                local[:, slot.axis] += np.where(self.seen.target == slot.index, value, 0.0)
        for i in range(chain.joint_count - 1, -1, -1):
            rides = self.seen.link > i
            moved = np.where(self._beyond(i)[:, None], _move(_twist(motions, Part.BEYOND, i, m), local), local)
            moved = _move(_twist(motions, Part.LINK, i, m), moved)
            moved = _joint_motion(net[:, i], bool(chain.sliding[i]), moved)
            moved = _move(_twist(motions, Part.AXIS, i, m), moved)
            before = chain.link_transforms[i - 1] if i else chain.base_transform
            moved = moved @ before[:3, :3].T + before[:3, 3]
            local = np.where(rides[:, None], moved, local)
        points = local @ self.base[:3, :3].T + self.base[:3, 3]
        points = _move(_twist(motions, Part.BASE, 0, m), points - self.middle_m) + self.middle_m
        out, scale = points, motions.get(Slot(Part.SCALE))
        if scale is not None:
            out = out + scale[:, None] * (points - self.middle_m)
        depth = motions.get(Slot(Part.DEPTH))
        if depth is not None:
            out = out + depth[:, None] * self._in_depth(points)
        for slot, value in motions.items():
            if slot.part is Part.ROOM:
                out = out + value[:, None] * self._bent(slot, points)
        return out

    def placed_fields(self, slots: list[Slot], motions: dict[Slot, Array]) -> Array:
        """Derivative of the moved points with respect to where base and targets are, (m, 3, slots).

        Points go with their targets as the moved links turn, which tells heights that parallel axes do not.
        """
        fields = self.fields(slots)
        if self.seen.simulated_m is not None:
            return fields
        moved = self.moved_m(motions)
        turned = [self._shifted(axis).moved_m(motions) - moved for axis in range(3)]
        for k, slot in enumerate(slots):
            if slot.part is Part.TARGET:
                fields[:, :, k] = np.where((self.seen.target == slot.index)[:, None], turned[slot.axis], 0.0)
            elif slot.part is Part.BASE and slot.axis < 3:
                fields[:, :, k] = cross(np.broadcast_to(np.eye(3)[slot.axis], moved.shape), moved - self.middle_m)
        return fields

    def _shifted(self, axis: int) -> "Sim":
        """The same sim with all targets one metre farther along an axis of their links: points go in proportion."""
        return replace(self, target_m=self.target_m + np.eye(3)[axis])

    def _in_depth(self, points: Array) -> Array:
        """How far points lie behind the middle along the line of sight, as vectors, (m, 3)."""
        sight = self.middle_m / max(float(np.linalg.norm(self.middle_m)), 1e-12)
        return ((points - self.middle_m) @ sight)[:, None] * sight

    def _placed_points(self) -> Array:
        placed = self.simulated_to_instrument
        return self.seen.simulated_m if placed is None else apply(placed, self.seen.simulated_m)

    def _carried(self, after: Array) -> Array:
        rows = np.arange(self.seen.count)
        frame = after[rows, self.seen.link - 1]
        local = self.target_m[self.seen.target]
        return (frame[:, :3, :3] @ local[:, :, None])[:, :, 0] + frame[:, :3, 3]

    def _joint(self, joint: int, after: Array, points: Array) -> Array:
        axis, origin = after[:, joint, :3, 2], after[:, joint, :3, 3]
        answer = axis if self.seen.chain.sliding[joint] else cross(axis, points - origin)
        return np.where((self.seen.link > joint)[:, None], answer, 0.0)

    def _field(self, slot: Slot, after: Array, before: Array, points: Array) -> Array:
        if slot.part is Part.JOINT:
            return self._joint(slot.index, after, points)
        if slot.part is Part.BASE:
            unit = np.broadcast_to(np.eye(3)[slot.axis % 3], points.shape)
            return cross(unit, points - self.middle_m) if slot.axis < 3 else unit
        if slot.part is Part.SCALE:
            return points - self.middle_m
        if slot.part is Part.DEPTH:
            return self._in_depth(points)
        if slot.part is Part.ROOM:
            return self._bent(slot, points)
        if slot.part is Part.TARGET:
            rows = np.arange(self.seen.count)
            unit = after[rows, self.seen.link - 1, :3, slot.axis]
            return np.where((self.seen.target == slot.index)[:, None], unit, 0.0)
        frame = (before if slot.part is Part.AXIS else after)[:, slot.index]
        unit = frame[:, :3, slot.axis % 3]
        answer = cross(unit, points - frame[:, :3, 3]) if slot.axis < 3 else unit
        rides = self._beyond(slot.index) if slot.part is Part.BEYOND else self.seen.link > slot.index
        return np.where(rides[:, None], answer, 0.0)

    def _bent(self, slot: Slot, points: Array) -> Array:
        first, second = PRODUCTS[slot.index]
        away = points - self.middle_m
        return (away[:, first] * away[:, second])[:, None] * np.eye(3)[slot.axis]

    def _beyond(self, index: int) -> np.ndarray:
        """Points that a link carries: on links behind it, or on itself where none of them has a target, (m,)."""
        farthest = max(target.link for target in self.seen.campaign.targets)
        return self.seen.link > (index if index + 1 == farthest else index + 1)


def _joint_motion(displacement: Array, sliding: bool, points: Array) -> Array:
    out = points.copy()
    if sliding:
        out[:, 2] += displacement
        return out
    cosine, sine = np.cos(displacement), np.sin(displacement)
    out[:, 0] = cosine * points[:, 0] - sine * points[:, 1]
    out[:, 1] = sine * points[:, 0] + cosine * points[:, 1]
    return out


def _twist(motions: dict[Slot, Array], part: Part, index: int, m: int) -> Array | None:
    """The six components of a small motion, (m, 6); None: it does not move."""
    mine = {slot.axis: value for slot, value in motions.items() if slot.part is part and slot.index == index}
    if not mine:
        return None
    out = np.zeros((m, 6))
    for axis, value in mine.items():
        out[:, axis] = value
    return out


def _move(twist: Array | None, points: Array) -> Array:
    """Points turned by a rotation vector and then shifted, (m, 3)."""
    if twist is None:
        return points
    vector = twist[:, :3]
    angle = np.sqrt(np.einsum("mi,mi->m", vector, vector))
    half = np.sinc(angle / (2 * np.pi))
    sine, versine = np.sinc(angle / np.pi)[:, None], (half**2 / 2)[:, None]
    first = cross(vector, points)
    return points + sine * first + versine * cross(vector, first) + twist[:, 3:]
