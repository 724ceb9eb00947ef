"""What the noise really is: its scale from repeats, its tails and its memory from what a flexible fit leaves."""

from dataclasses import dataclass

import numpy as np
from scipy.special import gammaln

from core.gap.doings import Doings
from core.geometry import Array

MEDIAN_OF_SQUARE = 0.4549364231195724
"""Of a normal variable with variance 1."""
FEWEST_PAIRS = 8
NEAR_RECORDS = 0.12
"""Repeats farther apart than this share of all records are not noise alone."""
TAILS = (2.5, 3.0, 4.0, 5.0, 7.0, 10.0, 20.0, np.inf)
HEAVY = 9.0
"""Tails below so many degrees of freedom are weighted down."""
CLIP = 3.0
OUTLYING = 6.5
"""Standard deviations a point may be off along its worst coordinate before it is left out."""


@dataclass(frozen=True)
class Repeats:
    """Scatter of repeated points."""

    variance: float
    """Of a whitened coordinate: 1 if the stated noise is right."""
    pairs: int
    lag: float
    """Mean distance of a pair in points."""

    @property
    def freedom(self) -> float:
        return 3.0 * self.pairs


def repeats(doings: Doings, whitened: Array, usable: np.ndarray, near: bool) -> Repeats | None:
    """Scatter of points that were reached in the same way more than once; None: too few.

    Where too few were reached in the same sense, any sense will do.

    Args:
        whitened: residuals in units of the stated noise, (m, 3).
        usable: which points may be asked, (m,).
        near: only repeats that follow soon: the residuals still hold what time does to the arm.
    """
    for strict in (True, False):
        first, second = _pairs(doings, np.flatnonzero(usable), near, strict and doings.past.complete)
        if len(first) >= FEWEST_PAIRS:
            difference = (whitened[second] - whitened[first]) / np.sqrt(2)
            return Repeats(robust_variance(difference), len(first), float(np.mean(second - first)))
    return None


def _pairs(doings: Doings, rows: np.ndarray, near: bool, strict: bool) -> tuple[np.ndarray, np.ndarray]:
    """Neighbours in time among points with the same commands, (k,) and (k,)."""
    seen = doings.seen
    keys = np.column_stack([np.round(seen.active[rows], 7), seen.target[rows], seen.payload_kg[rows]])
    if strict:
        keys = np.column_stack([keys, doings.sense[rows]])
    speed = doings.logged("speed")
    if speed is not None:
        keys = np.column_stack([keys, np.round(speed[rows], 6)])
    _, which = np.unique(keys, axis=0, return_inverse=True)
    order = np.lexsort((rows, which.ravel()))
    first, second = rows[order[:-1]], rows[order[1:]]
    pair = which.ravel()[order[:-1]] == which.ravel()[order[1:]]
    pair &= seen.standstill[first] != seen.standstill[second]
    if near:
        pair &= second - first <= max(20, NEAR_RECORDS * seen.count)
    return first[pair], second[pair]


def robust_variance(values: Array) -> float:
    """Variance from squares that are clipped at three times a first guess by the median, (k, ...)."""
    squares = np.ravel(values) ** 2
    guess = max(float(np.median(squares)) / MEDIAN_OF_SQUARE, 1e-300)
    for _ in range(5):
        guess = float(np.mean(np.minimum(squares, CLIP**2 * guess))) / CLIPPED_MEAN
    return guess


def _clipped_mean() -> float:
    x = np.linspace(-12, 12, 20001)
    weight = np.exp(-(x**2) / 2)
    return float(np.sum(np.minimum(x**2, CLIP**2) * weight) / np.sum(weight))


CLIPPED_MEAN = _clipped_mean()


def tail_degrees(standard: Array) -> float:
    """Degrees of freedom of the Student distribution that makes residuals (k, 3) most likely, scale free."""
    squares = np.sum(standard**2, axis=1)
    best, chosen = -np.inf, np.inf
    for nu in TAILS:
        scale = _student_scale(squares, nu)
        value = _student_likelihood(squares, nu, scale) + (2.0 if np.isinf(nu) else 0.0)
        if value > best:
            best, chosen = value, nu
    return chosen


def _student_scale(squares: Array, nu: float) -> float:
    scale = float(np.mean(squares)) / 3
    if np.isinf(nu):
        return scale
    for _ in range(25):
        scale = float(np.mean((nu + 3) / (nu + squares / scale) * squares)) / 3
    return scale


def _student_likelihood(squares: Array, nu: float, scale: float) -> float:
    k = len(squares)
    if np.isinf(nu):
        return -0.5 * (3 * k * np.log(2 * np.pi * scale) + np.sum(squares) / scale)
    constant = gammaln((nu + 3) / 2) - gammaln(nu / 2) - 1.5 * np.log(nu * np.pi * scale)
    return float(k * constant - (nu + 3) / 2 * np.sum(np.log1p(squares / (nu * scale))))


def student_weights(standard: Array, nu: float) -> Array:
    """Weights of points with standardised residuals (k, 3); 1 where tails are normal."""
    if nu >= HEAVY:
        return np.ones(len(standard))
    squares = np.sum(standard**2, axis=1) / _student_scale(np.sum(standard**2, axis=1), nu)
    return np.minimum((nu + 3) / (nu + squares), (nu + 3) / nu)


def memory(doings: Doings, standard: Array, usable: np.ndarray) -> float:
    """Correlation of neighbours in the order of measurement, 0 where it does not stand out.

    Neighbours on an arc are alike for other reasons too, so poses are asked where there are enough of them.
    """
    seen = doings.seen
    far = np.abs(np.diff(seen.active, axis=0)) / np.maximum(seen.span, 1e-9)
    pair = usable[1:] & usable[:-1] & (np.diff(seen.rows) <= 4)
    apart = pair & (far.max(axis=1) > 0.1)
    pair = apart if np.count_nonzero(apart) >= 40 else pair
    k = np.count_nonzero(pair)
    if k < 20:
        return 0.0
    clipped = np.clip(standard, -CLIP, CLIP)
    product = np.sum(clipped[1:][pair] * clipped[:-1][pair])
    square = 0.5 * (np.sum(clipped[1:][pair] ** 2) + np.sum(clipped[:-1][pair] ** 2))
    found = float(product / max(square, 1e-300))
    return float(np.clip(found, 0.0, 0.95)) if found > 0.05 + 3.5 / np.sqrt(3 * k) else 0.0
