"""Sums over all points of products of columns: everything the search needs, however many points there were."""

from dataclasses import dataclass

import numpy as np

from core.gap.design import Design
from core.gap.whitening import Whitening
from core.geometry import Array


@dataclass(frozen=True, eq=False)
class Gram:
    """Whitened columns X and residual y: X'X, X'y, y'y."""

    square: Array
    """(p, p)"""
    pull: Array
    """(p,)"""
    total: float
    count: int
    """Residual components with weight, 3 a point."""
    null_pulls: Array
    """X'e for draws of noise, (p, draws)."""


def gram(design: Design, residual_m: Array, white: Whitening, draws: int, seed: int) -> Gram:
    """Sums over all points, chunk by chunk.

    Args:
        residual_m: real minus sim, (m, 3).
        draws: how many draws of noise of the same weights are summed beside the residual.
        seed: of the draws.
    """
    p, m = design.count, design.sim.seen.count
    square, pull, nulls, total = np.zeros((p, p)), np.zeros(p), np.zeros((p, draws)), 0.0
    rng = np.random.default_rng(seed)
    previous: Array | None = None
    for rows in design.chunks():
        block = design.block(rows)
        x = white.rows(block, rows.start, previous).reshape(-1, p)
        before = residual_m[rows.start - 1 : rows.start] if rows.start else None
        y = white.rows(residual_m[rows], rows.start, before).ravel()
        e = rng.standard_normal((rows.stop - rows.start, 3, draws)) * (white.weight[rows] > 0)[:, None, None]
        square += x.T @ x
        pull += x.T @ y
        nulls += x.T @ e.reshape(-1, draws)
        total += float(y @ y)
        previous = block[-1:]
    count = 3 * int(np.count_nonzero(white.weight[:m]))
    return Gram(square, pull, total, count, nulls)
