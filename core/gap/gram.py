"""Sums over all points of products of columns: everything the search needs, however many points there were."""

from dataclasses import dataclass

import numpy as np

from core.gap.design import Design
from core.gap.products import OfColumns, Products
from core.gap.whitening import Whitening
from core.geometry import Array


@dataclass(frozen=True, eq=False)
class Gram:
    """Whitened columns X and residual y: X'X, X'y, y'y."""

    square: Products
    pull: Array
    """(p,)"""
    total: float
    count: int
    """Residual components with weight, 3 a point."""
    null_pulls: Array
    """X'e for draws of noise, (p, draws)."""


def whitened(design: Design, white: Whitening) -> Array:
    """X', (p, 3 m): all of x of the points, then all of y, then all of z."""
    fields = white.apart(design.fields())
    columns = design.spread(np.ascontiguousarray(fields.transpose(2, 1, 0)))
    white.unlink(columns)
    return columns.reshape(design.count, -1)


def gram(columns: Array, slices: tuple[slice, ...], residual_m: Array, white: Whitening, draws: int, seed: int) -> Gram:
    """Sums over all points.

    Args:
        columns: X', (p, 3 m), as ``whitened`` gives it.
        slices: columns of each group.
        residual_m: real minus sim, (m, 3).
        draws: how many draws of noise of the same weights are summed beside the residual.
        seed: of the draws.
    """
    m = len(residual_m)
    y = white.rows(residual_m).T.ravel()
    noise = np.random.default_rng(seed).standard_normal((m, 3, draws)) * (white.weight > 0)[:, None, None]
    nulls = columns @ noise.transpose(1, 0, 2).reshape(3 * m, draws)
    count = 3 * int(np.count_nonzero(white.weight))
    return Gram(OfColumns(columns, slices), columns @ y, float(y @ y), count, nulls)
