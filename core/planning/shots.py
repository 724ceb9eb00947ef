"""Planned shots as the rows of a campaign in which nothing has been measured yet: points are NaN, moves included."""

import numpy as np

from core.geometry import Array
from core.measurements import MOVE, POSE, SWEEP, Measurements
from core.robot import Robot
from core.session_plan import Plan, PlannedSweep, steps_of


def sweep_rows(
    robot: Robot, sweeps: tuple[PlannedSweep, ...], names: tuple[str, ...], home: Array | None = None
) -> Measurements:
    """The rows of sweeps in their order; each pass begins with the move to where it starts.

    Args:
        names: the targets' names in the campaign's order.
        home: commands at the arm's marks, (n,), where sweeps are made that are held nowhere else.
    """
    plan = Plan(sweeps, None if home is None else tuple(float(v) for v in home))
    rows = []
    for step in steps_of(robot, plan):
        if step.start is not None:
            rows.append((MOVE, 0, 0, -1, -1, 0, step.start))
        rows.append((SWEEP, step.joint, step.sweep, step.step, names.index(step.target), step.sense, step.commanded))
    phase, joint, sweep, index, target, sense, commanded = zip(*rows, strict=True)
    approach = np.zeros((len(rows), robot.joint_count), dtype=int)
    approach[np.arange(len(rows)), np.maximum(np.array(joint) - 1, 0)] = sense
    return _unmeasured(
        phase=np.array(phase),
        joint=np.array(joint),
        sweep=np.array(sweep),
        step=np.array(index),
        pose=np.full(len(rows), -1),
        target=np.array(target),
        commanded=np.array(commanded),
        approach=approach,
    )


def pose_rows(commanded: Array, target: np.ndarray) -> Measurements:
    """The rows of free poses: every shot a standstill of its own, (m, n) commands and (m,) targets."""
    count = len(target)
    none = np.zeros(count, dtype=int)
    return _unmeasured(
        phase=np.full(count, POSE),
        joint=none,
        sweep=none.copy(),
        step=none - 1,
        pose=np.arange(count),
        target=np.asarray(target),
        commanded=np.asarray(commanded, dtype=float),
        approach=np.zeros(np.shape(commanded), dtype=int),
    )


def shot_count(table: Measurements) -> int:
    """How many targets are sighted."""
    return int(np.count_nonzero(table.target >= 0))


def _unmeasured(**columns: np.ndarray) -> Measurements:
    count = len(columns["target"])
    return Measurements(
        record=np.arange(1, count + 1),
        point_m=np.full((count, 3), np.nan),
        covariance_m2=np.full((count, 3, 3), np.nan),
        check=np.zeros(count, dtype=bool),
        **columns,
    )
