"""Plane, then circle, in closed form: the classic way to a rotary axis, and the start of the better ones.

Source: circle-point analysis as Stone (Kinematic Modeling, Identification, and Control of Robotic Manipulators, Kluwer
1987) does it: the plane of least squares gives the direction, a circle fitted in that plane (Kasa, IEEE Trans. Instrum.
Meas. 25, 1976, doi 10.1109/TIM.1976.6312298) gives the place. With several targets, planes are parallel and circles
share their centre. Kasa's circle is drawn inwards by noise on short arcs; ``debias`` takes the noise that the plane
shows off the normal equations, which removes the effect to first order.
"""

from dataclasses import dataclass

import numpy as np

from core.axes.points import SweepPoints
from core.errors import AxisUndefined
from core.geometry import Array, cross

LEAST_EXTENT = 3.0
"""Points that extend less far along their path than this times their noise show no path."""
FEW_POINTS = 12.0
"""What is asked on top of few points, over the degrees of freedom of their scatter."""
SIGNIFICANT_BEND = 3.0
"""An arc counts as bent where its curvature is that many standard deviations."""


@dataclass(frozen=True)
class PlaneCircle:
    """An axis in closed form, and how flat and how curved the points are."""

    point_m: Array
    direction: Array
    spread_m: Array
    """Root mean square extent of the arcs: across the plane, along the sagitta, along the chord, (3,)."""


def plane_circle(points: SweepPoints, debias: bool = True) -> PlaneCircle:
    """The axis by plane and circle fits of all points, each point with equal weight.

    Raises:
        AxisUndefined: the points are all at one place, or on one straight line.
    """
    centred, weight = _about_target_means(points)
    values, vectors = np.linalg.eigh(centred.T @ centred)
    spread = np.sqrt(np.maximum(values, 0.0) / points.count)
    check_extent(spread, points)
    direction, in_plane = vectors[:, 0], vectors[:, 1:]
    noise = values[0] / max(points.count - points.target_count - 2, 1) * weight if debias else 0.0
    noise = min(noise, 0.5 * values[1])
    return PlaneCircle(_centre(points, centred, direction, in_plane, noise), direction, spread)


def arc_start(points: SweepPoints) -> PlaneCircle:
    """The axis from the curvature of the longest arc: for arcs so short that no plane stands out of the noise.

    Raises AxisUndefined where the arc is not bent significantly.

    Along its chord s an arc is ``p0 + t s + n s^2 / 2R``; the second-order coefficient gives both the direction of the
    centre and the radius, and the axis is normal to chord and sagitta.
    """
    target = points.target_index()
    longest = max(range(points.target_count), key=lambda k: np.ptp(points.point_m[target == k], axis=0).sum())
    arc = points.point_m[target == longest]
    middle = arc.mean(axis=0)
    chord = np.linalg.svd(arc - middle, full_matrices=False)[2][0]
    s = (arc - middle) @ chord
    coefficients = np.linalg.lstsq(np.stack([np.ones_like(s), s, s**2 / 2], axis=1), arc - middle, rcond=None)[0]
    bend = coefficients[2] - chord * (chord @ coefficients[2])
    curvature = np.linalg.norm(bend)
    if curvature < SIGNIFICANT_BEND * _bend_noise(arc - middle, chord, s, coefficients):
        raise AxisUndefined("the points cannot be told from a straight line; expected a longer arc or less noise")
    direction = cross(chord, bend / curvature)
    centred, _ = _about_target_means(points)
    spread = np.sqrt(np.mean((centred @ np.stack([direction, bend / curvature, chord], axis=1)) ** 2, axis=0))
    return PlaneCircle(middle + bend / curvature**2, direction, spread)


def _bend_noise(arc: Array, chord: Array, s: Array, coefficients: Array) -> float:
    """Standard deviation of one component of the second-order coefficient, by the scatter about the parabola."""
    design = np.stack([np.ones_like(s), s, s**2 / 2], axis=1)
    scatter = arc - design @ coefficients
    scatter = scatter - np.outer(scatter @ chord, chord)
    variance = float(np.sum(scatter**2)) / max(2 * len(s) - 6, 1)
    return float(np.sqrt(variance * np.linalg.inv(design.T @ design)[2, 2]))


def check_extent(spread_m: Array, points: SweepPoints) -> None:
    """Raise AxisUndefined where points stay at one place within their noise, or are collinear to rounding.

    Args:
        spread_m: root mean square extents: the least (noise alone), the middle one, and along the path, (3,).
        points: the points, with their stated noise.
    """
    reach = float(np.abs(points.point_m[0]).max(initial=1e-3))
    stated = 0.0 if points.sigma_m is None else float(np.sqrt(np.mean(points.sigma_m**2)))
    # The least extent of few points is small by luck; the fewer they are, the more is asked of the path.
    by_scatter = (LEAST_EXTENT + FEW_POINTS / max(points.count - points.target_count - 2, 1)) * spread_m[0]
    if spread_m[2] <= max(by_scatter, LEAST_EXTENT * stated, 1e-12 * reach):
        raise AxisUndefined(
            f"all points stay within {2 * spread_m[2] * 1e3:.2g} mm of one place, no more than their noise: the joint "
            "did not move, or the target sits on the axis; expected points along an arc"
        )
    if spread_m[1] <= 1e-7 * spread_m[2]:
        raise AxisUndefined("the points lie on one straight line: no joint axis can be told from them")


def _about_target_means(points: SweepPoints) -> tuple[Array, float]:
    """Points about the mean of their target, and the share of degrees of freedom that this leaves."""
    if points.target is None:
        return points.point_m - points.point_m.mean(axis=0), float(points.count - 1)
    counts = np.bincount(points.target, minlength=points.target_count)
    means = np.stack([np.bincount(points.target, c, points.target_count) for c in points.point_m.T], axis=1)
    means = means / np.maximum(counts, 1)[:, None]
    return points.point_m - means[points.target], float(points.count - points.target_count)


def _centre(points: SweepPoints, centred: Array, direction: Array, in_plane: Array, noise: float) -> Array:
    """The common centre of circles in parallel planes: |p|^2 = 2 p.c + constant of the target."""
    origin = points.point_m.mean(axis=0)
    flat = (points.point_m - origin) @ in_plane
    square = np.einsum("ij,ij->i", flat, flat)
    flat_centred = centred @ in_plane
    # The constants of the targets drop out against columns that are centred target by target.
    matrix = flat_centred.T @ flat_centred - noise * np.eye(2)
    return origin + in_plane @ np.linalg.solve(2.0 * matrix, flat_centred.T @ square)
