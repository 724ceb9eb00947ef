"""Where the frames of the phi-model go: what is set once for an arm, from its nominal geometry.

Lines in space fix the parameters of a chain only after a base frame and the phi angles have been agreed. The rule
of section 4 of the paper (Y_1 along the common normal of axes 1 and 2) is used wherever that normal has a place of its
own. Where it has none, because the first axes are parallel or slide, the rule is completed as follows:

- The origin lies on the first turning axis, r. A first axis that slides has no place, so it is put there too.
- Its height on that axis is where the common normal to the nearest later axis that is not parallel meets it; if all are
  parallel, the foot of the point by which the axis of the next turning joint is given.
- Y_1 points from axis 1 to axis 2 where these are parallel and turn; along Z_1 x Z_k else, with k the first axis that
  is not parallel to axis 1.

What the rule leaves to agreement (its gauge) cannot be measured and carries no uncertainty.
"""

from dataclasses import dataclass, replace

import numpy as np

from core.errors import RobotError
from core.geometry import Array, Line, common_normal, cross, transform
from core.phi_transforms import link_to, link_transform, phi_transform
from core.robot import Robot

PARALLEL_SINE = np.sin(np.deg2rad(10.0))
"""Axes closer to parallel than this are treated as parallel by design: their common normal is ill defined."""


@dataclass(frozen=True)
class Convention:
    """Everything about the frames of an arm that is agreed and not measured."""

    phi_rad: Array
    """phi of frames 1..n-1, (n-1,)."""
    flips: Array
    """+1, or -1 where alpha is written with a negative sine, (n-1,)."""
    sliding: np.ndarray
    """Which joints slide, boolean, (n,)."""
    origin_joint: int
    """Index (0..) of the axis that carries the origin."""
    normal_joint: int | None
    """Index of the axis whose common normal fixes the origin's height; None: the foot of a given point."""
    height_joint: int
    """Index of the turning axis whose point fixes the origin's height where no common normal does."""
    heading_joint: int
    """Index of the axis that gives Y_1 its heading."""
    heading_is_offset: bool
    """True: Y_1 points to that axis (parallel axes); False: Y_1 = +-Z_1 x Z_k."""
    heading_sign: float
    """The sign of the cross product, as the nominal base frame has it."""

    @property
    def is_of_section_4(self) -> bool:
        """Whether axes 1 and 2 alone fix the base frame, by their common normal, as in section 4."""
        return self.origin_joint == 0 and self.normal_joint == 1 and not self.heading_is_offset

    @property
    def free(self) -> np.ndarray:
        """Which of a, b, alpha, theta of each frame are measured, boolean, (n-1, 4)."""
        free = np.ones((len(self.sliding) - 1, 4), dtype=bool)
        free[self.sliding[1:], :2] = False
        first_turning = self.origin_joint
        if first_turning > 0:
            free[first_turning - 1, :2] = False
        if len(free) and self.heading_joint == 1:
            # Y_1 = Z_phi lies along the normal: it meets axis 2 at a right angle, or goes through it.
            free[0, 1] = False
            free[0, 2] = self.heading_is_offset
        return free


def convention_for(
    lines: tuple[Line, ...],
    sliding: np.ndarray,
    phi_rad: Array | None = None,
    flips: Array | None = None,
    y_reference: Array | None = None,
) -> Convention:
    """Agree on frames for an arm from its nominal axes at rest.

    Args:
        lines: nominal axes of joints 1..n at zero displacement.
        sliding: which joints slide, boolean, (n,).
        phi_rad: phi angles of frames 1..n-1 if the owner has set them; phi_1 is pi/2 by the base-frame rule.
        flips: signs of sin(alpha) as the owner writes them, (n-1,); default +1.
        y_reference: the Y-axis of the owner's base frame, which settles the sign of Y_1.

    Raises:
        RobotError: fewer than two axes, or every joint slides: there is nothing to fix a frame to.
    """
    if len(lines) < 2:
        raise RobotError(f"a phi-model needs at least two joints, got {len(lines)}")
    if np.all(sliding):
        raise RobotError("an arm on which every joint slides has no axis with a place in space")
    origin = int(np.argmin(sliding))
    offset, heading = _heading(lines, sliding, origin)
    base_y = cross(lines[0].direction, lines[heading].direction)
    sign = 1.0
    if not offset and y_reference is not None and abs(base_y @ y_reference) > 1e-6:
        sign = float(np.sign(base_y @ y_reference))
    rule = Convention(
        phi_rad=np.full(len(lines) - 1, np.pi / 2),
        flips=np.ones(len(lines) - 1) if flips is None else np.asarray(flips, dtype=float),
        sliding=np.asarray(sliding, dtype=bool),
        origin_joint=origin,
        normal_joint=_first_not_parallel(lines, sliding, origin),
        height_joint=_next_turning(sliding, origin),
        heading_joint=heading,
        heading_is_offset=offset,
        heading_sign=sign,
    )
    if phi_rad is not None:
        return replace(rule, phi_rad=np.concatenate([[np.pi / 2], np.asarray(phi_rad, dtype=float)[1:]]))
    return _choose_phi(lines, rule)


def convention_of(robot: Robot) -> Convention:
    """The rule for the frames of a robot's phi-model, by its drawing.

    Raises:
        RobotError: as ``convention_for``.
    """
    return convention_for(robot.axes_at_zero(), robot.sliding, robot.phi_rad, y_reference=robot.base_transform[:3, 1])


def base_frame(lines: tuple[Line, ...], convention: Convention) -> Array:
    """T_base (4, 4): from frame 1 to the frame in which the axes are given."""
    z = lines[0].direction
    carrier = lines[convention.origin_joint]
    if convention.normal_joint is not None:
        origin, _ = common_normal(carrier, lines[convention.normal_joint])
    else:
        origin = carrier.foot_of(lines[convention.height_joint].point_m)
    heading = lines[convention.heading_joint]
    if convention.heading_is_offset:
        # To where that axis passes through the plane of the base, so that Z_phi meets it and b is zero.
        along = (origin - heading.point_m) @ z / (heading.direction @ z)
        y = heading.point_m + along * heading.direction - origin
    else:
        y = convention.heading_sign * cross(z, heading.direction)
    y = y / np.linalg.norm(y)
    return transform(np.stack([cross(y, z), y, z], axis=1), origin)


def _heading(lines: tuple[Line, ...], sliding: np.ndarray, origin: int) -> tuple[bool, int]:
    """Whether Y_1 points to an axis or along a cross product, and the index of that axis."""
    for k in range(1, len(lines)):
        sine = np.linalg.norm(cross(lines[0].direction, lines[k].direction))
        if sine > PARALLEL_SINE:
            return False, k
        if not sliding[0] and not sliding[k] and _offset(lines[0], lines[k]) > 1e-3:
            return True, k
    raise RobotError("all axes lie on one line: nothing gives the base frame a heading")


def _offset(first: Line, second: Line) -> float:
    return float(np.linalg.norm(cross(second.point_m - first.point_m, first.direction)))


def _first_not_parallel(lines: tuple[Line, ...], sliding: np.ndarray, origin: int) -> int | None:
    """The nearest later turning axis that is not parallel to the one that carries the origin."""
    for k in range(origin + 1, len(lines)):
        crossing = np.linalg.norm(cross(lines[origin].direction, lines[k].direction)) > PARALLEL_SINE
        if crossing and not sliding[k]:
            return k
    return None


def _next_turning(sliding: np.ndarray, origin: int) -> int:
    """The next turning joint after the one that carries the origin, or that one itself."""
    later = np.flatnonzero(~np.asarray(sliding)[origin + 1 :])
    return origin + 1 + int(later[0]) if len(later) else origin


def _choose_phi(lines: tuple[Line, ...], rule: Convention) -> Convention:
    """phi of frames 2..n-1, each 0 or pi/2, whichever keeps Z_phi further from parallel to the next axis."""
    frame, phi_rad = base_frame(lines, rule), rule.phi_rad.copy()
    for i, line in enumerate(lines[1:]):
        if i > 0:
            candidates = phi_transform(np.array([0.0, np.pi / 2]))
            sines = np.linalg.norm(cross((frame @ candidates)[:, :3, 2], line.direction), axis=1)
            phi_rad[i] = np.pi / 2 if sines[1] > sines[0] + 1e-6 else 0.0
        phi_frame = frame @ phi_transform(phi_rad[i])
        row = link_to(line, phi_frame, bool(rule.sliding[i + 1]), float(rule.flips[i]), i + 1)
        frame = phi_frame @ link_transform(*row)
    return replace(rule, phi_rad=phi_rad)
