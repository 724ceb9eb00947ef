"""Where to start from: a table of configurations with the poses that they lead to, searched by pose.

Configurations that lead near a wanted pose lie on all the branches (elbow up or down, wrist flipped or not) that lead
to the pose itself. The nearest ones in pose are thinned in joint space, so that each branch is started from about once.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.spatial import cKDTree

from core.driven_robot import DrivenRobot
from core.geometry import Array
from core.pose_iteration import chain_state
from core.rotations import quaternions

TABLE_SIZE = 60_000


@dataclass(frozen=True)
class Effort:
    """How hard branches are looked for."""

    neighbours: int
    """Configurations out of the table."""
    starts: int
    """At most so many of them are started from."""
    apart_rad: float
    """Of those that differ by less than this at every joint one is taken."""
    steps: int
    """Steps from each."""
    bent: bool
    """Whether they follow the bend of the way."""


QUICK = Effort(32, 12, 0.5, 16, False)
THOROUGH = Effort(256, 48, 0.25, 60, True)
EXHAUSTIVE = Effort(256, 96, 0.1, 40, True)


@dataclass(frozen=True, eq=False)
class SeedTable:
    """Configurations of one arm, and a search tree over their poses."""

    free: Array
    """Net displacements of the joints with a motor, (s, k)."""
    turns: np.ndarray
    """The same numbers for quick comparison: angles within one turn, slides in units of the reach, (s, k)."""
    whole: np.ndarray
    """After how much each of them repeats, infinite for slides, (k,)."""
    reach_m: float
    tree: cKDTree
    """Over position in units of the reach and both quaternions of every pose: entry j belongs to row j mod s."""

    def starts(self, poses: Array, effort: Effort) -> tuple[Array, np.ndarray]:
        """Starts for poses (m, 4, 4): displacements (m, s, k), and which of them are there, boolean (m, s)."""
        count = min(effort.neighbours, len(self.free))
        keys = _keys(poses[:, :3, 3] / self.reach_m, quaternions(poses[:, :3, :3]))
        _, near = self.tree.query(keys, k=count, workers=-1)
        near = near.reshape(len(poses), count) % len(self.free)
        return self._thinned(near, effort)

    def _thinned(self, near: np.ndarray, effort: Effort) -> tuple[Array, np.ndarray]:
        """The first of the candidates (m, c), then always the next that is far from all that were taken."""
        m, most = len(near), effort.starts
        starts, there = np.zeros((m, most, self.free.shape[1])), np.zeros((m, most), dtype=bool)
        left, rows = np.ones(near.shape, dtype=bool), np.arange(m)
        turns = self.turns[near]
        for taken in range(most):
            chosen = np.argmax(left, axis=1)
            there[:, taken] = left[rows, chosen]
            starts[:, taken] = self.free[near[rows, chosen]]
            apart = np.abs(turns - turns[rows, chosen][:, None])
            left &= np.max(np.minimum(apart, self.whole - apart), axis=-1) > effort.apart_rad
        return starts, there


@lru_cache(maxsize=8)
def seed_table(robot: DrivenRobot, limited: bool) -> SeedTable:
    """The table of an arm: configurations within its limits, or all the way round."""
    rng = np.random.default_rng(20_000)
    low, high = _ranges(robot, limited)
    free = rng.uniform(low, high, (TABLE_SIZE, len(robot.free)))
    state = chain_state(robot, robot.net(free))
    rotation = np.transpose(state.columns, (2, 1, 0))
    rotations = quaternions(rotation)
    place = state.position.T / robot.reach_m
    keys = np.concatenate([_keys(place, rotations), _keys(place, -rotations)])
    slides = robot.chain.sliding[robot.free]
    turns = np.where(slides, free / robot.reach_m, free % (2 * np.pi)).astype(np.float32)
    whole = np.where(slides, np.inf, 2 * np.pi).astype(np.float32)
    return SeedTable(free, turns, whole, robot.reach_m, cKDTree(keys, balanced_tree=False))


def joint_distance(first: Array, second: Array, sliding: np.ndarray, reach_m: float) -> Array:
    """The largest difference of any joint, whole turns left out, a slide in units of the reach; (...,)."""
    apart = first - second
    turned = np.abs((apart + np.pi) % (2 * np.pi) - np.pi)
    return np.max(np.where(sliding, np.abs(apart) / reach_m, turned), axis=-1, initial=0.0)


def _keys(place: Array, rotations: Array) -> Array:
    # Twice the quaternion: its distance is then about the angle, so that a radian weighs as much as the reach.
    return np.concatenate([place, 2 * rotations], axis=1)


def _ranges(robot: DrivenRobot, limited: bool) -> tuple[Array, Array]:
    """Ranges of the joints with a motor: their limits, at most one turn; without limits a turn, the reach to slide."""
    limits, slides = robot.limits[robot.free], robot.chain.sliding[robot.free]
    half = np.where(slides, robot.reach_m, np.pi)
    middle = robot.middle[robot.free]
    finite = np.isfinite(limits).all(axis=1)
    own = np.where(finite, np.diff(np.where(np.isfinite(limits), limits, 0.0), axis=1)[:, 0] / 2, half)
    width = np.where(slides, own, np.minimum(own, half)) if limited else half
    return middle - width, middle + width
