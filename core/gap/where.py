"""Where real and sim part: by joint, by direction, by region."""

import numpy as np

from core.gap.evidence import Evidence
from core.gap.folds import regions
from core.gap.problem import Problem
from core.gap.result import Where
from core.gap.sim import Sim
from core.geometry import Array, cross


def where(sim: Sim, left_m: Array, problem: Problem, evidence: Evidence, gap: bool) -> Where:
    """Shares of the gap.

    Args:
        left_m: real minus placed sim, (m, 3).
        gap: whether there is one: without it nothing lies anywhere.
    """
    sentence, rows = _worst_region(sim, left_m)
    return Where(
        by_joint=_by_joint(problem, evidence, sim.seen.joint_count) if gap else np.zeros(sim.seen.joint_count),
        sweep_directions=_sweep_directions(sim, left_m),
        pose_directions=_shares(left_m[sim.seen.posed]) if sim.seen.posed.any() else None,
        worst_region=sentence if gap else "",
        worst_rows=rows,
    )


def _by_joint(problem: Problem, evidence: Evidence, joints: int) -> Array:
    """What errors of any shape at each joint could account for."""
    of = np.array([c.place.joint or (c.place.frame or 0) for c in problem.candidates])
    share = np.zeros(joints)
    for joint in range(1, joints + 1):
        members = np.flatnonzero(of == joint)
        if len(members):
            share[joint - 1] = max(float(evidence.gains(members).evidence.max()), 0.0)
    return share / share.sum() if share.sum() > 0 else share


def _shares(vectors: Array) -> Array:
    square = np.mean(vectors**2, axis=0)
    return square / max(float(square.sum()), 1e-300)


def _sweep_directions(sim: Sim, left_m: Array) -> Array | None:
    """Along the axis of the joint that moves, away from it, around it."""
    rows = np.flatnonzero(sim.seen.swept & (sim.seen.joint > 0))
    if not len(rows):
        return None
    part = sim.part(rows)
    after, _ = part.frames
    frame = after[np.arange(len(rows)), part.seen.joint - 1]
    axis = frame[:, :3, 2]
    arm = part.seen.point_m - frame[:, :3, 3]
    radial = arm - np.sum(arm * axis, axis=1)[:, None] * axis
    radial /= np.maximum(np.linalg.norm(radial, axis=1), 1e-12)[:, None]
    around = cross(axis, radial)
    left = left_m[rows]
    return _shares(np.stack([np.sum(left * d, axis=1) for d in (axis, radial, around)], axis=1))


def _worst_region(sim: Sim, left_m: Array) -> tuple[str, np.ndarray]:
    seen = sim.seen
    region = regions(seen.active, seen.span, max(2, min(12, seen.count // 20)))
    square = np.sum(left_m**2, axis=1)
    counts = np.bincount(region)
    means = np.bincount(region, square) / np.maximum(counts, 1)
    means[counts < min(5, counts.max())] = 0.0
    worst = int(np.argmax(means))
    rows = np.flatnonzero(region == worst)
    most = np.argmax(np.abs(seen.active[rows].mean(axis=0) - seen.active.mean(axis=0)) / np.maximum(seen.span, 1e-9))
    low, high = seen.net[rows, most].min(), seen.net[rows, most].max()
    factor, unit = (1e3, "mm") if seen.chain.sliding[most] else (180 / np.pi, "deg")
    return (
        f"The largest errors, {1e3 * np.sqrt(means[worst]):.3g} mm rms over {len(rows)} points, lie where joint "
        f"{most + 1} stands between {low * factor:.0f} and {high * factor:.0f} {unit}.",
        rows,
    )
