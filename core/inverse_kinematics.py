"""Which joint displacements bring the tool to a pose: every branch, or the one nearest to a given configuration.

Damped least squares (``core/pose_iteration.py``), thousands of poses at once, for any arm: parallel axes, slides,
joints driven by others, more or fewer joints than six. It starts from all answers in closed form where the arm, or one
very near to it, has them (``core/closed_form.py``), else from several configurations out of a table
(``core/pose_seeds.py``). What cannot be is said and never bent: a pose is

    solved          reached, within the limits of the commands
    beyond limits   reached by branches all of which break a limit
    singular        reached, but its joints are not determined: the Jacobian loses rank there
    unreachable     not reached from any start
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from core.closed_form import ClosedForm, closed_form
from core.driven_robot import LIMIT_SLACK, DrivenRobot
from core.errors import InputError
from core.geometry import Array
from core.pose_iteration import Approach, approach, chain_state, misfits, scaled_jacobian
from core.pose_seeds import EXHAUSTIVE, QUICK, THOROUGH, Effort, joint_distance, seed_table

SINGULAR = 1e-6
"""Smallest singular value of the scaled Jacobian at which a pose counts as singular: a micrometre or a microradian of
the tool is then a radian at some joint."""
LOOSE = 1e-3
"""Below this the joints may be moved far without moving the tool by much."""
SAME_RAD = 1e-3
"""Solutions that differ by less at every joint are one."""
SAME_BRANCH_RAD = 0.35
"""A solution this near to where it was looked for is taken for the nearest one, and no other is looked for."""
LAST_STEPS = 400
"""For poses that were almost reached: next to a singular pose the last steps are slow."""
ALMOST = 1e-4
PRESSED, PRESS_STEPS, INSIDE = 24, 24, 1e-7
"""From how many arrivals an arm with joints to spare is pressed into its limits, in how many steps, and how far inside
them a joint is held."""
PRESS_CHUNK = 256
CHUNK = 8192


class Outcome(StrEnum):
    """What became of a pose."""

    SOLVED = "solved"
    UNREACHABLE = "unreachable"
    BEYOND_LIMITS = "beyond limits"
    SINGULAR = "singular"


GRADES = (Outcome.SOLVED, Outcome.SINGULAR, Outcome.BEYOND_LIMITS, Outcome.UNREACHABLE)
"""From best to worst."""


@dataclass(frozen=True)
class Tolerance:
    """How far from a pose the tool may end; more than rounding only for arms that cannot take every pose."""

    position_m: float = 1e-9
    rotation_rad: float = 1e-9


@dataclass(frozen=True)
class JointSolutions:
    """One solution a pose."""

    outcome: np.ndarray
    """``Outcome`` of each pose, (m,)."""
    net: Array
    """Net displacements, rad or m; the best there are where the pose is not solved, (m, n)."""
    commanded: Array
    """The commands for them, (m, n)."""
    excess: Array
    """How far these are beyond the limits of the commands, rad or m, (m, n)."""
    position_error_m: Array
    """What is left to the pose, (m,)."""
    rotation_error_rad: Array
    """(m,)."""

    @property
    def solved(self) -> np.ndarray:
        """Boolean, (m,)."""
        return self.outcome == Outcome.SOLVED


@dataclass(frozen=True)
class Branches:
    """All solutions that were found, one row each."""

    pose: np.ndarray
    """The pose that each belongs to, 0.., ascending, (b,)."""
    net: Array
    """(b, n)."""
    commanded: Array
    """(b, n)."""
    excess: Array
    """How far the commands are beyond their limits, (b, n)."""
    smallest_singular: Array
    """Smallest singular value of the scaled Jacobian, (b,)."""

    @property
    def within_limits(self) -> np.ndarray:
        """Boolean, (b,)."""
        return ~self.excess.any(axis=1)


def inverse_kinematics(
    robot: DrivenRobot, poses: ArrayLike, near: ArrayLike | None = None, tolerance: Tolerance | None = None
) -> JointSolutions:
    """The solution of each pose nearest to a configuration.

    Args:
        robot: the chain and its drives.
        poses: T_tool_to_base in the chain's base frame, (m, 4, 4).
        near: net displacements. One configuration (n,): of all branches found within the limits the nearest one is
            taken. One for each pose (m, n): the search starts there, and a branch that passes close by is kept to, even
            where it is singular or breaks a limit. None: the middle of the limits.
        tolerance: how far from the pose the tool may end.

    Raises:
        InputError: the poses are not rigid motions, or ``near`` does not fit.
    """
    poses, (m, n) = _checked(poses), (len(poses), robot.chain.joint_count)
    tolerance = Tolerance() if tolerance is None else tolerance
    near = robot.middle if near is None else np.asarray(near, dtype=float)
    if near.shape not in ((n,), (m, n)) or not np.isfinite(near).all():
        raise InputError(f"the configuration to be near to needs {n} finite numbers a pose, got shape {near.shape}")
    search = _Search(robot, poses, np.broadcast_to(near, (m, n)), tolerance)
    form = closed_form(robot)
    if near.ndim == 2 or form is None:
        search.from_near(accept=near.ndim == 2)
    if form is not None:
        search.from_answers(form)
    for limited, effort in ((True, QUICK), (True, THOROUGH), (False, THOROUGH)):
        search.explore(limited, effort)
    search.press()
    search.finish()
    return search.solutions()


def all_branches(robot: DrivenRobot, poses: ArrayLike, effort: Effort = EXHAUSTIVE) -> Branches:
    """Every branch that can be found for poses (m, 4, 4), those beyond the limits too; whole turns are one branch.

    Raises:
        InputError: the poses are not rigid motions.
    """
    poses = _checked(poses)
    parts = [(np.empty(0, dtype=np.int64), np.empty((0, len(robot.free))))]
    for first in range(0, len(poses), CHUNK):
        chunk = poses[first : first + CHUNK]
        found = [_found(robot, chunk, limited, effort) for limited in (True, False)]
        found.append(_answered(robot, chunk))
        kept = _distinct(robot, *(np.concatenate(part) for part in zip(*found, strict=True)))
        parts.append((kept[0] + first, kept[1]))
    pose = np.concatenate([part[0] for part in parts])
    net = in_limits(robot, robot.net(np.concatenate([part[1] for part in parts])), robot.middle)
    commanded = robot.commands(net)
    return Branches(pose, net, commanded, robot.excess(commanded), smallest_singular(robot, net))


def smallest_singular(robot: DrivenRobot, net: Array) -> Array:
    """Smallest singular value of the Jacobian by the free displacements, positions in units of the reach, (m,)."""
    return np.linalg.svd(_by_free(robot, net), compute_uv=False)[:, -1] if len(net) else np.empty(0)


def is_singular(robot: DrivenRobot, net: Array, below: float = SINGULAR) -> np.ndarray:
    """Where the smallest singular value is below a bound, boolean (m,); quick where it is far above."""
    jacobian = _by_free(robot, net)
    suspect = np.ones(len(net), dtype=bool)
    if len(net) and jacobian.shape[1] == jacobian.shape[2]:
        # The determinant is the product of all singular values, none of which exceeds the matrix's own size.
        size = np.sqrt(np.einsum("mij,mij->m", jacobian, jacobian))
        suspect = np.abs(np.linalg.det(jacobian)) < below * size ** (jacobian.shape[1] - 1)
    out = np.zeros(len(net), dtype=bool)
    if suspect.any():
        out[suspect] = np.linalg.svd(jacobian[suspect], compute_uv=False)[:, -1] < below
    return out


def in_limits(robot: DrivenRobot, net: Array, near: Array) -> Array:
    """Net displacements (m, n) with turning joints turned by whole turns: near a configuration, then into limits."""
    whole = 2 * np.pi
    net = np.where(robot.turning, near + (net - near + np.pi) % whole - np.pi, net)
    low, high = robot.limits.T
    for i in np.flatnonzero(robot.turning & np.isfinite(robot.limits).any(axis=1)):
        # One joint at a time: the commands of the joint above may follow from this one's.
        command = robot.commands(net)[:, i]
        turns = np.ceil(np.maximum(command - high[i], 0.0) / whole) - np.ceil(np.maximum(low[i] - command, 0.0) / whole)
        back = command - whole * turns
        helps = (back >= low[i] - LIMIT_SLACK) & (back <= high[i] + LIMIT_SLACK)
        net[:, i] -= np.where(helps, whole * turns, 0.0)
    return net


class _Search:
    """The best solution of each pose so far: solved before singular before beyond limits before not reached."""

    def __init__(self, robot: DrivenRobot, poses: Array, near: Array, tolerance: Tolerance) -> None:
        self._robot, self._poses, self._near, self._tolerance = robot, poses, near, tolerance
        m = len(poses)
        self._net = near.copy()
        self._grade, self._cost = np.full(m, len(GRADES)), np.full(m, np.inf)
        self._settled = np.zeros(m, dtype=bool)
        self._almost_free, self._almost = near[:, robot.free], np.full(m, ALMOST)

    def from_near(self, accept: bool) -> None:
        """Start where the solution is looked for; ``accept``: what is found close by is taken at once."""
        self._start(np.arange(len(self._poses)), self._near[:, self._robot.free], QUICK.steps, QUICK.bent)
        slides, reach = self._robot.chain.sliding, self._robot.reach_m
        close = joint_distance(self._net, self._near, slides, reach) < SAME_BRANCH_RAD
        self._settled = (self._grade < GRADES.index(Outcome.UNREACHABLE)) & close & accept

    def from_answers(self, form: ClosedForm) -> None:
        """Start from answers in closed form: the most promising one of each pose, then all others that may be better.

        Where they are exact, they are all that there is: a pose that none of them solves is not looked for elsewhere,
        unless it is singular.
        """
        rows = np.flatnonzero(~self._settled)
        for first in range(0, len(rows), CHUNK):
            chunk = rows[first : first + CHUNK]
            order, away = self._ranked(chunk, form)
            self._start(chunk, order[:, 0], QUICK.steps, QUICK.bent)
            solved = self._grade[chunk] == 0
            rival = away[:, 1:].min(axis=1) < self._cost[chunk] + form.slack_rad
            self._settled[chunk] = solved & ~rival
            again = np.flatnonzero(~self._settled[chunk])
            others = order[again, 1:].reshape(-1, order.shape[2])
            self._start(np.repeat(chunk[again], order.shape[1] - 1), others, THOROUGH.steps, THOROUGH.bent)
            self._settled[chunk] = self._grade[chunk] == 0
            if form.slack_rad == 0:
                self._settled[chunk] |= (self._grade[chunk] > 1) & ~self._loose(chunk)

    def _ranked(self, rows: np.ndarray, form: ClosedForm) -> tuple[Array, Array]:
        """Answers for poses, the most promising first, (r, 8, n), and how far each is from where to look, (r, 8).

        An answer promises much if it leads to the pose, keeps the limits, and is near; others are infinitely far.
        """
        answers = form.answers(self._poses[rows])
        r, count, n = answers.shape
        each = np.repeat(rows, count)
        net = in_limits(self._robot, answers.reshape(-1, n), self._near[each])
        position, rotation = self._errors(each, net)
        missed = (position / self._robot.reach_m + rotation).reshape(r, count)
        excess = self._robot.excess(self._robot.commands(net)).sum(axis=1).reshape(r, count)
        away = np.linalg.norm(net - self._near[each], axis=1).reshape(r, count)
        allowed = form.slack_rad + ALMOST
        order = np.lexsort((away, excess > allowed, missed > allowed), axis=1)
        away = np.where((missed > allowed) | (excess > allowed), np.inf, away)
        net = net.reshape(r, count, n)
        return np.take_along_axis(net, order[..., None], axis=1), np.take_along_axis(away, order, axis=1)

    def _loose(self, rows: np.ndarray) -> np.ndarray:
        """Where the best so far leaves joints undetermined: answers in closed form are not all that there is."""
        return is_singular(self._robot, self._net[rows], LOOSE)

    def explore(self, limited: bool, effort: Effort) -> None:
        """Start from the configurations of a table, for all poses that need it."""
        hopeless = np.linalg.norm(self._poses[:, :3, 3] - self._robot.shoulder_m, axis=1) > self._robot.longest_m
        wanting = self._grade > (0 if limited else 1)
        rows = np.flatnonzero((wanting | (effort is QUICK)) & ~self._settled & ~hopeless)
        if len(rows) == 0:
            return
        table = seed_table(self._robot, limited)
        for first in range(0, len(rows), CHUNK):
            chunk = rows[first : first + CHUNK]
            starts, there = table.starts(self._poses[chunk], effort)
            pose, start = np.nonzero(there)
            self._start(chunk[pose], starts[pose, start], effort.steps, effort.bent)

    def press(self) -> None:
        """Arms with joints to spare: from beyond the limits back into them, keeping the pose.

        The configurations of one pose that keep the limits end, where they do not close upon themselves, with a joint
        at one of its limits. So every joint in turn is held at either of its limits, and the others take the pose.
        """
        rows = np.flatnonzero((self._grade == GRADES.index(Outcome.BEYOND_LIMITS)) & ~self._settled)
        if len(self._robot.free) <= 6:
            return
        for first in range(0, len(rows), PRESS_CHUNK):
            chunk = rows[first : first + PRESS_CHUNK]
            pose, free = _found(self._robot, self._poses[chunk], True, EXHAUSTIVE)
            kept = self._least_beyond(pose, free)
            for joint in range(len(self._robot.free)):
                for end in self._robot.limits[self._robot.free[joint]] + [INSIDE, -INSIDE]:
                    self._hold(chunk[pose[kept]], free[kept], joint, end)

    def _least_beyond(self, pose: np.ndarray, free: Array) -> np.ndarray:
        """Indices of a few arrivals of each pose: those that are least beyond the limits."""
        net = in_limits(self._robot, self._robot.net(free), self._robot.middle)
        beyond = self._robot.excess(self._robot.commands(net)).sum(axis=1)
        order = np.lexsort((beyond, pose))
        ranked = pose[order]
        first = np.searchsorted(ranked, ranked)
        return order[np.arange(len(order)) - first < PRESSED]

    def _hold(self, rows: np.ndarray, free: Array, joint: int, command: float) -> None:
        """Start poses that are not solved yet with one joint held at a command."""
        open_ones = self._grade[rows] > 0
        rows, free = rows[open_ones], free[open_ones]
        if len(rows) == 0 or not np.isfinite(command):
            return
        commanded = self._robot.commands(in_limits(self._robot, self._robot.net(free), self._robot.middle))
        commanded[:, self._robot.free[joint]] = command
        start = self._robot.drives.net(commanded)[:, self._robot.free]
        end = approach(self._robot, self._poses[rows], start, PRESS_STEPS, held=joint)
        self._start(rows[end.reached], end.free[end.reached], QUICK.steps, QUICK.bent)

    def finish(self) -> None:
        """Go on where a pose was almost reached and nothing better was found."""
        almost = np.flatnonzero((self._grade > 0) & (self._almost < ALMOST) & ~self._settled)
        self._start(almost, self._almost_free[almost], LAST_STEPS, True)

    def solutions(self) -> JointSolutions:
        commanded = self._robot.commands(self._net)
        errors = self._errors(np.arange(len(self._poses)), self._net)
        outcome = np.array(GRADES, dtype=object)[np.minimum(self._grade, len(GRADES) - 1)]
        return JointSolutions(outcome, self._net, commanded, self._robot.excess(commanded), *errors)

    def _start(self, rows: np.ndarray, free: Array, steps: int, bent: bool) -> None:
        """Start poses, each any number of times, and keep what is better than what was there."""
        if len(rows) == 0:
            return
        end = approach(self._robot, self._poses[rows], free, steps, bent)
        self._remember_almost(rows, end)
        net = in_limits(self._robot, self._robot.net(end.free), self._near[rows])
        grade, cost = self._graded(rows, net, end)
        best = _first_of_each(rows, np.lexsort((cost, grade, rows)))
        rows, net, grade, cost = rows[best], net[best], grade[best], cost[best]
        better = (grade < self._grade[rows]) | ((grade == self._grade[rows]) & (cost < self._cost[rows]))
        kept = rows[better]
        self._net[kept], self._grade[kept], self._cost[kept] = net[better], grade[better], cost[better]

    def _remember_almost(self, rows: np.ndarray, end: Approach) -> None:
        missed = np.where(end.reached, np.inf, end.misfit)
        best = _first_of_each(rows, np.lexsort((missed, rows)))
        nearer = best[missed[best] < self._almost[rows[best]]]
        self._almost[rows[nearer]], self._almost_free[rows[nearer]] = end.misfit[nearer], end.free[nearer]

    def _graded(self, rows: np.ndarray, net: Array, end: Approach) -> tuple[np.ndarray, Array]:
        """Index into GRADES, and what counts among equals, the smaller the better."""
        position, rotation = self._errors(rows, net)
        there = (position <= self._tolerance.position_m) & (rotation <= self._tolerance.rotation_rad)
        excess = self._robot.excess(self._robot.commands(net)).sum(axis=1)
        singular = np.zeros(len(rows), dtype=bool)
        singular[there] = is_singular(self._robot, net[there])
        grade = np.select([~there, excess > 0, singular], [3, 2, 1], 0)
        scale = np.where(self._robot.chain.sliding, self._robot.reach_m, 1.0)
        away = np.linalg.norm((net - self._near[rows]) / scale, axis=1)
        return grade, np.select([~there, excess > 0], [end.misfit, excess], away)

    def _errors(self, rows: np.ndarray, net: Array) -> tuple[Array, Array]:
        wanted = np.moveaxis(self._poses[rows], 0, 2)
        missing = misfits(self._robot, chain_state(self._robot, net), wanted)
        position, rotation = np.linalg.norm(missing[:3], axis=0), np.linalg.norm(missing[3:], axis=0)
        return position * self._robot.reach_m, rotation / self._robot.turn_weight


def _by_free(robot: DrivenRobot, net: Array) -> Array:
    """The scaled Jacobian by the free displacements, (m, 6, k)."""
    jacobian = np.moveaxis(scaled_jacobian(robot, chain_state(robot, net)), 2, 0)
    slopes = robot.slopes(net[:, robot.free])
    return np.ascontiguousarray(jacobian[:, :, robot.free] if slopes is None else jacobian @ slopes)


def _first_of_each(rows: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Of an order by rows the first of every row."""
    sorted_rows = rows[order]
    return order[np.concatenate([[True], sorted_rows[1:] != sorted_rows[:-1]])]


def _found(robot: DrivenRobot, poses: Array, limited: bool, effort: Effort) -> tuple[np.ndarray, Array]:
    """Index of the pose and free displacements of every start that arrived."""
    starts, there = seed_table(robot, limited).starts(poses, effort)
    pose, start = np.nonzero(there)
    end = approach(robot, poses[pose], starts[pose, start], effort.steps, effort.bent)
    return pose[end.reached], end.free[end.reached]


def _answered(robot: DrivenRobot, poses: Array) -> tuple[np.ndarray, Array]:
    """The same of all answers in closed form; nothing where the arm has none."""
    form = closed_form(robot)
    if form is None:
        return np.empty(0, dtype=np.int64), np.empty((0, len(robot.free)))
    answers = form.answers(poses)
    pose = np.repeat(np.arange(len(poses)), answers.shape[1])
    end = approach(robot, poses[pose], answers.reshape(len(pose), -1), THOROUGH.steps, THOROUGH.bent)
    return pose[end.reached], end.free[end.reached]


def _distinct(robot: DrivenRobot, pose: np.ndarray, free: Array) -> tuple[np.ndarray, Array]:
    """Solutions that differ, ordered by pose."""
    order = np.argsort(pose, kind="stable")
    pose, free = pose[order], free[order]
    slides = robot.chain.sliding[robot.free]
    keep = np.ones(len(pose), dtype=bool)
    for back in range(1, int(np.bincount(pose).max(initial=1))):
        same = pose[back:] == pose[:-back]
        twin = joint_distance(free[back:], free[:-back], slides, robot.reach_m) < SAME_RAD
        keep[back:] &= ~(same & twin)
    return pose[keep], free[keep]


def _checked(poses: ArrayLike) -> Array:
    """Poses as an array of rigid motions, (m, 4, 4)."""
    poses = np.asarray(poses, dtype=float)
    if poses.ndim != 3 or poses.shape[1:] != (4, 4) or not np.isfinite(poses).all():
        raise InputError(f"poses need finite numbers of the shape (m, 4, 4), got {poses.shape}")
    square = np.swapaxes(poses[:, :3, :3], 1, 2) @ poses[:, :3, :3]
    if not np.allclose(square, np.eye(3), rtol=0, atol=1e-9) or (np.linalg.det(poses[:, :3, :3]) < 0).any():
        raise InputError("the upper left 3x3 part of a pose is not a rotation")
    return poses
