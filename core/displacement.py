"""How far a joint really moved: angles about a rotary axis (equations 6 and 7), distances along a sliding one (12).

Points are projected onto the plane normal to the axis; the signed angle between projections comes from the two-argument
arctangent and is unwrapped. With commands at hand it is unwrapped along them (transmission errors are far smaller than
half a turn), so sweeps of several turns in coarse steps are told apart; without, steps must stay below half a turn.

Positive is the sense of the axis' direction; displacement counts from the first stop.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from core.axes.result import AxisFit
from core.errors import InputError
from core.geometry import Array, wrap_angle


@dataclass(frozen=True)
class Displacements:
    """The actual displacement of a joint at each stop of a sweep, from its first stop."""

    value: Array
    """rad (m), (stops,); NaN at stops where no fitted point was seen."""
    std: Array
    """From the noise of the points alone, one stop against the others, (stops,)."""
    axis_effect: Array
    """Change of each value by tilts and shifts of the axis, in the order of AxisFit.covariance, (stops, 4 or 2)."""


def displacements(
    fit: AxisFit,
    points_m: ArrayLike,
    *,
    stop: ArrayLike | None = None,
    target: ArrayLike | None = None,
    commanded: ArrayLike | None = None,
) -> Displacements:
    """Turn points into displacements about or along an axis.

    Args:
        fit: the axis; its ``used`` tells which points count.
        points_m: the points of the sweep, (k, 3).
        stop: standstill of each point, 0.., (k,); default: each point its own.
        target: index of the target of each point, (k,); all must ride on the link that the joint moves.
        commanded: commanded displacement at each stop, (stops,).

    Raises:
        InputError: shapes that do not fit together.
    """
    points = np.asarray(points_m, dtype=float)
    k = len(points)
    stop = np.arange(k) if stop is None else np.asarray(stop)
    target = np.zeros(k, dtype=int) if target is None else np.unique(target, return_inverse=True)[1]
    if len(fit.used) != k or len(stop) != k or len(target) != k:
        raise InputError(f"{k} points need as many stops, targets and fitted points")
    command = None if commanded is None else np.asarray(commanded, dtype=float)
    # At the last stops other targets may have been seen alone, as while a sweep is being measured.
    count = int(stop.max()) + 1 if command is None else len(command)
    if count <= stop.max():
        raise InputError(f"stop {int(stop.max())} has no command, expected one for each stop from 0 on")
    readings, effect, weight = _readings(fit, points)
    if not fit.sliding:
        readings = _unwrapped(readings, stop, target, command)
    used = fit.used
    value = _two_way(readings[used], stop[used], target[used], weight[used], count)
    strength = np.bincount(stop[used], weight[used], count)
    seen = strength > 0
    share = np.zeros_like(weight)
    share[used] = weight[used] / strength[stop[used]]
    by_axis = np.stack([np.bincount(stop, share * column, count) for column in effect.T], axis=1)
    first = int(np.argmax(seen))
    with np.errstate(divide="ignore"):
        std = np.where(seen, 1.0 / np.sqrt(strength), np.nan)
    return Displacements(np.where(seen, value - value[first], np.nan), std, by_axis)


def _readings(fit: AxisFit, points: Array) -> tuple[Array, Array, Array]:
    """Raw angle or distance of each point, its change by tilts and shifts of the axis, and its weight."""
    x, y, z = np.vstack([fit.basis, fit.line.direction]) @ (points - fit.line.point_m).T
    if fit.sliding:
        return (
            z,
            np.stack([x, y], axis=1),
            np.full(len(points), 1.0 / fit.sigma_m**2) if fit.sigma_m > 0 else np.ones(len(points)),
        )
    square = np.maximum(x**2 + y**2, 1e-300)
    # A shift of the axis by e1 moves a point by -e1 in its frame; a tilt towards e1 by -z e1.
    shift_1, shift_2 = y / square, -x / square
    effect = np.stack([z * shift_1, z * shift_2, shift_1, shift_2], axis=1)
    weight = square / fit.sigma_m**2 if fit.sigma_m > 0 else square
    return np.arctan2(y, x), effect, weight


def _unwrapped(angle: Array, stop: np.ndarray, target: np.ndarray, command: Array | None) -> Array:
    if command is not None:
        guide = command[stop]
    else:
        guide = np.zeros_like(angle)
        for k in np.unique(target):
            mine = target == k
            guide[mine] = np.unwrap(angle[mine])
        return guide
    out = np.empty_like(angle)
    for k in np.unique(target):
        mine = target == k
        lag = angle[mine] - guide[mine]
        middle = np.angle(np.exp(1j * lag).sum())
        out[mine] = guide[mine] + middle + wrap_angle(lag - middle)
    return out


def _two_way(readings: Array, stop: np.ndarray, target: np.ndarray, weight: Array, count: int) -> Array:
    """Displacement of each stop when every target starts from an angle of its own, (count,)."""
    targets = int(target.max(initial=0)) + 1
    value = np.zeros(count)
    start = np.zeros(targets)
    strength = np.maximum(np.bincount(stop, weight, count), 1e-300)
    per_target = np.maximum(np.bincount(target, weight, targets), 1e-300)
    for _ in range(1 if targets == 1 else 200):
        value = np.bincount(stop, weight * (readings - start[target]), count) / strength
        new = np.bincount(target, weight * (readings - value[stop]), targets) / per_target
        if np.abs(new - start).max() < 1e-15:
            break
        start = new
    return value
