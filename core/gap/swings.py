"""A base that swings to and fro as time goes by, faster than smooth functions of time follow."""

from collections.abc import Callable

import numpy as np

from core.gap.effects.candidate import Candidate
from core.gap.effects.nameless import TIME_BUMPS, swing
from core.gap.sim import Part, Sim, Slot
from core.geometry import Array

SLOWEST, FASTEST, FINER = TIME_BUMPS / 4, 60.0, 5
"""Times to and fro during all of the measurements, and how many of them are tried between two whole ones."""
POINTS_A_SWING = 5.0
"""On average: fewer do not show it."""
MOST_POINTS = 2000
MOSTLY = 0.5
"""Of the residuals' squares: what explains less is somebody else's."""


def swings(sim: Sim, aim_m: Array, weight: Array) -> list[Candidate]:
    """The swing of the base that explains most of residuals, where it explains most of them; none otherwise.

    Args:
        aim_m: residuals, (m, 3).
        weight: of each point, 1/m^2, 0: left out, (m,).
    """
    rows = np.flatnonzero(weight > 0)
    rows = rows[:: -(-len(rows) // MOST_POINTS)]
    fastest = min(FASTEST, len(rows) / POINTS_A_SWING)
    tried = np.arange(SLOWEST, fastest, 1.0 / FINER)
    if not len(tried):
        return []
    explained = _explained(sim.part(rows), aim_m[rows], weight[rows])
    shares = [explained(times) for times in tried]
    best = int(np.argmax(shares))
    return [swing(float(tried[best]))] if shares[best] > MOSTLY else []


def _explained(sim: Sim, aim_m: Array, weight: Array) -> Callable[[float], float]:
    """The share of the residuals' squares that a swing explains beyond what a base that stands elsewhere does."""
    root = np.sqrt(weight)[:, None]
    fields = sim.fields([Slot(Part.BASE, 0, k) for k in range(6)]) * root[:, :, None]
    aim, time = (aim_m * root).ravel(), sim.seen.time

    def left(features: list[Array]) -> float:
        flat = np.concatenate([fields * one[:, None, None] for one in features], axis=2).reshape(len(aim), -1)
        square, pull = flat.T @ flat, flat.T @ aim
        ridge = 1e-9 * np.trace(square) * np.eye(len(square))
        return float(aim @ aim - pull @ np.linalg.solve(square + ridge, pull))

    one = np.ones_like(time)
    still = max(left([one]), 1e-300)
    return lambda times: 1 - left([one, np.sin(2 * np.pi * times * time), np.cos(2 * np.pi * times * time)]) / still
