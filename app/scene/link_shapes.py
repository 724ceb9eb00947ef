"""Shapes for any arm, made from nothing but its joint axes at zero.

A skeleton goes from the base through all axes: at each one it comes in at a *hub*, may go along the axis, and leaves
for the next hub by the shortest way. Joints become barrels about their axes (square sleeves where they slide), links
become tapered round tubes along the skeleton, the last one ends in a flange. Sizes shrink from the base to the tool.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from app.scene.solids import Solid, barrel, box, capsule, merged, tube
from core.geometry import Array, Line, common_normal, cross

PARALLEL_SINE = 0.1736
"""Axes within 10 degrees of parallel are taken as such: their common normal may lie anywhere."""
SHORTEST = 0.004
"""Pieces of skeleton shorter than this share of the reach are left out."""


@dataclass(frozen=True)
class Skeleton:
    """The line that an arm's shape follows, all joints at zero, in the frame of the axes."""

    base_m: Array
    """Where the arm stands on its floor, wall or ceiling, (3,)."""
    hubs_m: Array
    """Where each axis is met, (n, 3)."""
    leaves_m: Array
    """Where each axis is left for the next one, (n, 3); for the last one where the flange is."""
    tool_m: Array
    """The tool's point, or the middle of the flange, (3,)."""
    axes: tuple[Line, ...]
    sliding: np.ndarray

    @property
    def reach_m(self) -> float:
        """Length of the skeleton from the first hub to the tool."""
        ways = [self.leaves_m - self.hubs_m, np.diff(np.vstack([self.hubs_m, self.tool_m]), axis=0)]
        return float(max(sum(np.linalg.norm(w, axis=1).sum() for w in ways), 0.05))

    def radius_m(self, joint: int) -> float:
        """Radius of the barrel of a joint, 1..n (n + 1: of the flange); at the tool four tenths of that at the base."""
        share = (joint - 1) / max(len(self.axes), 1)
        return self.reach_m * float(0.078 * 0.4**share)


@dataclass(frozen=True)
class LinkShape:
    """One link, 0 (the base) to n (flange and tool), at rest, in the frame of the axes."""

    body: Solid
    joint: Solid
    """The barrel of the joint at its outer end."""


def skeleton(
    axes: tuple[Line, ...], sliding: np.ndarray, floor_m: float | None = None, tool_m: Array | None = None
) -> Skeleton:
    """The skeleton of an arm from its axes at zero.

    Args:
        axes: joint axes at zero displacement, n lines.
        sliding: which joints slide, boolean, (n,).
        floor_m: height of the floor; None: below the arm by a fitting distance. An arm whose first axis is far from
            upright gets a short base away from the rest of it, wherever the floor is.
        tool_m: the tool's point with all joints at zero, (3,); None: a short flange.

    Raises:
        ValueError: there are no axes, or not one flag for each.
    """
    if not axes or len(sliding) != len(axes):
        raise ValueError(f"an arm needs at least one axis and a flag for each, got {len(axes)} and {len(sliding)}")
    lines = _placed(axes, np.asarray(sliding, dtype=bool))
    hubs, leaves = [_first_hub(lines)], []
    for line, following in pairwise(lines):
        leave, meet = _way(line, following, hubs[-1])
        leaves.append(leave)
        hubs.append(meet)
    flange = _flange(lines[-1], hubs[-1], np.stack(hubs), tool_m)
    hubs_m, leaves_m = np.stack(hubs), np.stack([*leaves, flange])
    tool = flange if tool_m is None else np.asarray(tool_m, dtype=float)
    base = _base(lines[0], hubs_m, tool, floor_m)
    return Skeleton(base, hubs_m, leaves_m, tool, lines, np.asarray(sliding, dtype=bool))


def link_shapes(bones: Skeleton, swell_m: float = 0.0) -> tuple[LinkShape, ...]:
    """The shapes of links 0..n, n + 1 of them; ``swell_m`` is added to all radii, for a ghost around another arm."""
    n = len(bones.axes)
    radii = [bones.radius_m(joint) + swell_m for joint in range(1, n + 2)]
    shapes = [LinkShape(_base_body(bones, radii[0]), _joint(bones, 0, radii[0]))]
    for i in range(n - 1):
        shapes.append(LinkShape(_link_body(bones, i, radii), _joint(bones, i + 1, radii[i + 1])))
    return (*shapes, LinkShape(_tool_body(bones, radii[n]), merged([])))


def upright(bones: Skeleton) -> bool:
    """Whether the first axis stands upright, so that the arm stands on the floor (or hangs from the ceiling)."""
    return bool(abs(bones.axes[0].direction[2]) > 0.8)


def _placed(axes: tuple[Line, ...], sliding: np.ndarray) -> tuple[Line, ...]:
    """The axes, sliding ones moved to where they look natural: a slide has a direction and no place."""
    lines = list(axes)
    for i in np.flatnonzero(sliding)[::-1]:
        if i + 1 < len(lines):
            lines[i] = Line(lines[i + 1].point_m, lines[i].direction)
    return tuple(lines)


def _parallel(first: Line, second: Line) -> bool:
    return bool(np.linalg.norm(cross(first.direction, second.direction)) < PARALLEL_SINE)


def _first_hub(lines: tuple[Line, ...]) -> Array:
    """Where axis 1 is met: where the first later axis that is not parallel comes nearest."""
    for line in lines[1:]:
        if not _parallel(lines[0], line):
            return common_normal(lines[0], line)[0]
    return lines[0].foot_of(lines[-1].point_m)


def _way(line: Line, following: Line, hub: Array) -> tuple[Array, Array]:
    """Where to leave an axis that is met at a hub, and where the next one is met."""
    if _parallel(line, following):
        return hub, following.foot_of(hub)
    return common_normal(line, following)


def _flange(line: Line, hub: Array, hubs: Array, tool_m: Array | None) -> Array:
    """The end of the last link, on the last axis: towards the tool, else along the axis' positive sense."""
    size = max(float(np.linalg.norm(np.diff(hubs, axis=0), axis=1).sum()), 0.1)
    if tool_m is None:
        return hub + 0.07 * size * line.direction
    along = float((np.asarray(tool_m) - hub) @ line.direction)
    return hub + np.sign(along or 1.0) * np.clip(abs(along) * 0.6, 0.03 * size, 0.08 * size) * line.direction


def _base(line: Line, hubs: Array, tool: Array, floor_m: float | None) -> Array:
    """Where the arm stands: on the floor under the first hub, or a short way back along a first axis that lies."""
    size = float(np.linalg.norm(np.diff(np.vstack([hubs, tool]), axis=0), axis=1).sum())
    rise = line.direction * np.sign(line.direction[2] or 1.0)
    if rise[2] <= 0.8:
        away = (hubs.mean(axis=0) - hubs[0]) @ line.direction
        return hubs[0] - (np.sign(away) or 1.0) * 0.3 * size * line.direction
    height = 0.45 * size if floor_m is None else float(hubs[0][2] - floor_m)
    return hubs[0] - max(height, 0.2 * size) / rise[2] * rise


def _base_body(bones: Skeleton, radius: float) -> Solid:
    """Foot plate and column, up to the barrel of joint 1."""
    way = bones.hubs_m[0] - bones.base_m
    height = float(np.linalg.norm(way))
    up = way / height
    plate = min(0.35 * radius, 0.1 * height)
    top = max(height - 2.4 * radius, 0.3 * height)
    foot = tube(bones.base_m, bones.base_m + plate * up, 2.0 * radius, 2.0 * radius, 32)
    column = tube(bones.base_m + plate * up, bones.base_m + top * up, 1.5 * radius, 1.15 * radius, 32)
    return merged([foot, column])


def _joint(bones: Skeleton, i: int, radius: float) -> Solid:
    """The barrel of joint i + 1; of joint 1 the turntable below its hub."""
    line, hub = bones.axes[i], bones.hubs_m[i]
    if i == 0 and not bones.sliding[0]:
        way = bones.hubs_m[0] - bones.base_m
        up = way / np.linalg.norm(way)
        return barrel(hub - 1.75 * radius * up, line.direction, 1.32 * radius, 1.1 * radius)
    if bones.sliding[i]:
        return box(hub, line.direction, 3.0 * radius, 2.0 * radius)
    return barrel(hub, line.direction, radius, 2.5 * radius)


def _link_body(bones: Skeleton, i: int, radii: list[float]) -> Solid:
    """Link i + 1: from the barrel of joint i + 1, along its axis, across to the next barrel."""
    start, corner, end = bones.hubs_m[i], bones.leaves_m[i], bones.hubs_m[i + 1]
    inner, outer = 0.72 * radii[i], 0.72 * radii[i + 1]
    pieces = []
    if i == 0 and not bones.sliding[0]:
        up = (start - bones.base_m) / np.linalg.norm(start - bones.base_m)
        pieces.append(tube(start - 1.3 * radii[0] * up, start, 1.15 * radii[0], 0.9 * radii[0], 28))
    if bones.sliding[i]:
        pieces.append(_rail(bones, i, radii[i]))
    shortest = SHORTEST * bones.reach_m
    for a, b, r0, r1 in ((start, corner, inner, (inner + outer) / 2), (corner, end, (inner + outer) / 2, outer)):
        if np.linalg.norm(b - a) > shortest:
            pieces.append(capsule(a, b, r0, r1))
    return merged(pieces)


def _rail(bones: Skeleton, i: int, radius: float) -> Solid:
    return box(bones.hubs_m[i], bones.axes[i].direction, 0.5 * bones.reach_m, 1.1 * radius)


def _tool_body(bones: Skeleton, radius: float) -> Solid:
    """Neck and flange, then a slim rod with a tip to the tool's point."""
    hub, flange, tool = bones.hubs_m[-1], bones.leaves_m[-1], bones.tool_m
    way = flange - hub
    along = way / max(float(np.linalg.norm(way)), 1e-9)
    pieces = [
        tube(hub, flange, radius, radius),
        tube(flange, flange + 0.5 * radius * along, 1.5 * radius, 1.5 * radius),
    ]
    if bones.sliding[-1]:
        pieces.append(_rail(bones, len(bones.axes) - 1, radius))
    rest = tool - flange
    if np.linalg.norm(rest) > 0.6 * radius:
        pieces.append(tube(flange, tool, 0.45 * radius, 0.12 * radius))
    return merged(pieces)
