"""How long an arc must become before it defines an axis, told while it is still too short.

Along its chord s an arc of radius R bends by y = s^2 / 2R. Its axis is told from that bend: with k points of noise
sigma spread evenly over the angle t, y has the spread 0.298 R t^2 / 8, so that both the tilt of the axis about the
chord [rad] and the relative error of the radius come to

    u(t) = sigma / (sqrt(k - 4) * 0.298 * R t^2 / 8)

An axis is claimed once u < 1/3 (``core.axes.likelihood``). R comes from the chord and the commanded angle, which serves
this estimate only; sigma from the scatter about a parabola, or from what the instrument states if that is more.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from core.geometry import Array

CLAIMED = 1 / 3
SPREAD = np.sqrt(1 / 5 - 1 / 9)
"""Standard deviation of x^2 for x spread evenly over -1..1."""
LEAST_POINTS = 4
MOST_POINTS = 1000


@dataclass(frozen=True)
class ArcNeeded:
    """What an arc that is too short for an axis lacks."""

    span_rad: float
    """So far."""
    needed_rad: float
    """About how long it has to be, at the spacing so far."""
    more_shots: int
    """How many more shots that is."""


def arc_needed(points_m: ArrayLike, commanded: ArrayLike, sigma_m: float | None = None) -> ArcNeeded | None:
    """What an arc lacks; None where that cannot be told: fewer than four points, or they do not move.

    Args:
        points_m: shots of one target, in order, (k, 3).
        commanded: commanded displacement of the swept joint at each, rad, (k,).
        sigma_m: stated standard deviation of one coordinate; None: not stated.
    """
    points, angle = np.asarray(points_m, dtype=float), np.asarray(commanded, dtype=float)
    count, span = len(points), float(np.ptp(angle)) if len(angle) else 0.0
    if count < LEAST_POINTS or not 0 < span < np.pi:
        return None
    noise = max(_scatter(points, angle), sigma_m or 0.0)
    chord = float(np.linalg.norm(points[np.argmax(angle)] - points[np.argmin(angle)]))
    if chord <= 3 * noise:
        return None
    radius, step = chord / (2 * np.sin(span / 2)), span / (count - 1)
    for more in range(1, MOST_POINTS):
        k = count + more
        bend = SPREAD * radius * ((k - 1) * step) ** 2 / 8
        if noise < CLAIMED * np.sqrt(max(k - 4, 0)) * bend:
            return ArcNeeded(span, (k - 1) * step, more)
    return None


def _scatter(points_m: Array, angle: Array) -> float:
    """Standard deviation of one coordinate about a parabola in the commanded angle."""
    x = (angle - angle.mean()) / np.ptp(angle)
    design = np.stack([np.ones_like(x), x, x**2], axis=1)
    rest = points_m - design @ np.linalg.lstsq(design, points_m, rcond=None)[0]
    return float(np.sqrt(np.sum(rest**2) / max(3 * (len(x) - 3), 1)))
