"""All answers of inverse kinematics at once, for arms of six turning joints whose axes allow it.

Three families, which hold nearly every industrial arm of six joints:

    parallel    axes 2, 3, 4 parallel, axes 5 and 6 meeting: the ASEA IRB L6, UR arms
    elbow       axes 2, 3 parallel, axes 4, 5, 6 meeting in a wrist: PUMA, most arms of ABB, FANUC, KUKA, Yaskawa
    shoulder    axes 1, 2 meeting, axes 4, 5, 6 meeting in a wrist, axis 3 anywhere

Each pose has up to eight answers: two ways for the shoulder, two for the elbow, two for the wrist. They are put
together from subproblems (``core/subproblems.py``, with the source). A calibrated arm is of a family only nearly: the
answers are those of the nearest arm that is, and starts for iteration (``core/pose_iteration.py``).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from core.driven_robot import DrivenRobot
from core.geometry import Array, Line, common_normal, invert, perpendicular_basis
from core.kinematics import forward
from core.subproblems import bring, dot, level, meet, reach, turned

PARALLEL_RAD = 0.06
"""Axes that differ by less are taken as parallel; others as crossing."""
MEETING = 0.03
"""Axes that pass each other by less than this share of the reach are taken to meet."""
EXACT = 1e-9
"""An arm that is off its family by less, in rad and shares of the reach, is of it."""
ROUGH = 4.0
"""How far answers may be off for each radian, or reach, by which the axes are off the family."""
ANSWERS = 8

Answers = Callable[[Array, Array], list[Array]]
"""A motion since zero, rotation (3, 3, m) and translation (3, m), -> six joints, each broadcast to (2, 2, 2, m)."""


@dataclass(frozen=True, eq=False)
class ClosedForm:
    """The family of an arm."""

    family: str
    """``parallel``, ``elbow`` or ``shoulder``."""
    slack_rad: float
    """About how far answers are off those of the arm itself; 0: not at all."""
    answers_of: Answers
    from_zero: Array
    """The inverse of the tool's pose when every displacement is zero, (4, 4)."""

    def answers(self, poses: Array) -> Array:
        """Displacements of all joints that bring the tool to poses.

        Args:
            poses: T_tool_to_base in the chain's base frame, (m, 4, 4).

        Returns:
            Eight rows a pose, (m, 8, 6), rad, some of which may be the same; those of a pose that cannot be reached
            come near it.
        """
        motion = poses @ self.from_zero
        rotation = np.ascontiguousarray(np.moveaxis(motion[:, :3, :3], 0, 2))
        joints = self.answers_of(rotation, np.ascontiguousarray(motion[:, :3, 3].T))
        out = np.empty((len(poses), ANSWERS, len(joints)))
        for i, joint in enumerate(joints):
            out[:, :, i] = np.broadcast_to(joint, (2, 2, 2, len(poses))).reshape(ANSWERS, -1).T
        return out


@lru_cache(maxsize=16)
def closed_form(robot: DrivenRobot) -> ClosedForm | None:
    """The family of an arm; None: it is of none of the three."""
    chain = robot.chain
    if chain.joint_count != 6 or chain.sliding.any() or len(robot.free) != 6:
        return None
    axes, size = chain.axes_at_zero(), robot.reach_m
    from_zero = invert(forward(chain, np.zeros((1, 6)))[0])
    for name, family in (("parallel", _parallel), ("elbow", _elbow), ("shoulder", _shoulder)):
        found = family(axes, size)
        if found is not None:
            off, answers = found
            return ClosedForm(name, 0.0 if off < EXACT else ROUGH * off, answers, from_zero)
    return None


def _parallel(axes: tuple[Line, ...], size: float) -> tuple[float, Answers] | None:
    common, meeting = _common_direction(axes[1:4]), _meeting_point(axes[4:6], size)
    if common is None or meeting is None or not (_cross(axes[0], axes[1]) and _cross(axes[3], axes[4])):
        return None
    h, signs, off = common
    centre, missed = meeting
    h_1, h_5, h_6 = axes[0].direction, axes[4].direction, axes[5].direction
    origins = [line.point_m for line in axes]
    upper, fore = _flat(h, origins[2] - origins[1]), _flat(h, origins[3] - origins[2])
    side = perpendicular_basis(h_6)[0]

    def answers(rotation: Array, translation: Array) -> list[Array]:
        seen = _moved(rotation, translation, centre) - origins[0][:, None]
        q_1 = -level(h, h_1, seen, dot(h, centre - origins[0]))
        seen, pointing = turned(h_1, -q_1, seen), turned(h_1, -q_1, _rotated(rotation, h_6))
        q_5 = level(h, h_5, h_6, dot(h, pointing))
        q_234 = bring(h, turned(h_5, q_5, h_6), pointing)
        to_side = turned(h_5, -q_5, turned(h, -q_234, turned(h_1, -q_1, _rotated(rotation, side))))
        hand = turned(h, q_234, centre - origins[3])
        goal = _flat(h, np.stack([seen[i] - (origins[1] - origins[0])[i] - hand[i] for i in range(3)]))
        q_2, q_3 = _two_links(h, upper, fore, goal)
        q_4 = q_234 - q_2 - q_3
        return [q_1, signs[0] * q_2, signs[1] * q_3, signs[2] * q_4, q_5, bring(h_6, side, to_side)]

    return max(off, missed / size), answers


def _elbow(axes: tuple[Line, ...], size: float) -> tuple[float, Answers] | None:
    common, wrist = _common_direction(axes[1:3]), _wrist(axes, size)
    if common is None or wrist is None or not _cross(axes[0], axes[1]):
        return None
    h, signs, off = common
    centre, missed, hand = wrist
    h_1, origins = axes[0].direction, [line.point_m for line in axes]
    upper, fore = _flat(h, origins[2] - origins[1]), _flat(h, centre - origins[2])

    def answers(rotation: Array, translation: Array) -> list[Array]:
        seen = _moved(rotation, translation, centre) - origins[0][:, None]
        q_1 = -level(h, h_1, seen, dot(h, centre - origins[0]))
        seen = turned(h_1, -q_1, seen)
        goal = _flat(h, np.stack([seen[i] - (origins[1] - origins[0])[i] for i in range(3)]))
        q_2, q_3 = _two_links(h, upper, fore, goal)

        def on_forearm(vector: Array) -> Array:
            return turned(h, -(q_2 + q_3), turned(h_1, -q_1, vector))

        return [q_1, signs[0] * q_2, signs[1] * q_3, *hand(rotation, on_forearm)]

    return max(off, missed / size), answers


def _shoulder(axes: tuple[Line, ...], size: float) -> tuple[float, Answers] | None:
    meeting, wrist = _meeting_point(axes[:2], size), _wrist(axes, size)
    if meeting is None or wrist is None:
        return None
    top, off = meeting
    centre, missed, hand = wrist
    h_1, h_2, h_3 = (line.direction for line in axes[:3])
    upper, fore = axes[2].point_m - top, centre - axes[2].point_m

    def answers(rotation: Array, translation: Array) -> list[Array]:
        seen = _moved(rotation, translation, centre) - top[:, None]
        q_3 = reach(h_3, fore, upper, dot(seen, seen))
        arm = np.stack([upper[i] + part for i, part in enumerate(turned(h_3, q_3, fore))])
        back_1, q_2 = meet(h_1, seen, h_2, arm)

        def on_forearm(vector: Array) -> Array:
            return turned(h_3, -q_3, turned(h_2, -q_2, turned(h_1, back_1, vector)))

        return [-back_1, q_2, q_3, *hand(rotation, on_forearm)]

    return max(off, missed) / size, answers


Hand = Callable[[Array, Callable[[Array], Array]], list[Array]]
"""Rotation, and what carries a vector of the base back onto the forearm -> joints 4, 5 and 6."""


def _wrist(axes: tuple[Line, ...], size: float) -> tuple[Array, float, Hand] | None:
    """Where the last three axes meet, by how much they miss it, and how they turn the hand."""
    meeting = _meeting_point(axes[3:6], size)
    if meeting is None:
        return None
    h_4, h_5, h_6 = (line.direction for line in axes[3:6])
    side = perpendicular_basis(h_6)[0]

    def hand(rotation: Array, on_forearm: Callable[[Array], Array]) -> list[Array]:
        pointing = on_forearm(_rotated(rotation, h_6))
        q_5 = level(h_4, h_5, h_6, dot(h_4, pointing))
        q_4 = bring(h_4, turned(h_5, q_5, h_6), pointing)
        to_side = turned(h_5, -q_5, turned(h_4, -q_4, on_forearm(_rotated(rotation, side))))
        return [q_4, q_5, bring(h_6, side, to_side)]

    return *meeting, hand


def _two_links(h: Array, upper: Array, fore: Array, goal: Array) -> tuple[Array, Array]:
    """Both ways in which two links, turning about parallel axes, end at a point of their plane."""
    q_3 = reach(h, fore, upper, dot(goal, goal))
    arm = np.stack([upper[i] + part for i, part in enumerate(turned(h, q_3, fore))])
    return bring(h, arm, goal), q_3


def _common_direction(lines: tuple[Line, ...]) -> tuple[Array, Array, float] | None:
    """The direction of parallel axes, the sense of each to it, and by how much they are off it; None: not parallel."""
    directions = np.array([line.direction for line in lines])
    signs = np.where(directions @ directions[0] < 0, -1.0, 1.0)
    mean = signs @ directions
    mean /= np.linalg.norm(mean)
    off = float(np.linalg.norm(np.cross(directions, mean), axis=1).max())
    return (mean, signs, off) if off < PARALLEL_RAD else None


def _meeting_point(lines: tuple[Line, ...], size: float) -> tuple[Array, float] | None:
    """The point nearest to axes that meet, each crossing the next, and how far they miss it; None: they do not."""
    if not all(_cross(first, second) for first, second in pairwise(lines)):
        return None
    feet = np.concatenate([common_normal(a, b) for a, b in pairwise(lines)])
    point = feet.mean(axis=0)
    missed = max(float(np.linalg.norm(line.foot_of(point) - point)) for line in lines)
    return (point, missed) if missed < MEETING * size else None


def _cross(first: Line, second: Line) -> bool:
    return float(np.linalg.norm(np.cross(first.direction, second.direction))) > PARALLEL_RAD


def _flat(h: Array, vector: Array) -> Array:
    """Without the part along a direction."""
    along = dot(h, vector)
    return np.stack([vector[i] - h[i] * along for i in range(3)])


def _rotated(rotation: Array, vector: Array) -> Array:
    return np.einsum("ijm,j->im", rotation, vector)


def _moved(rotation: Array, translation: Array, point: Array) -> Array:
    return _rotated(rotation, point) + translation
