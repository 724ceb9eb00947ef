"""The points of a sweep made ready for a fit: checked, numbered, with their noise."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from core.errors import AxisUndefined, InputError
from core.geometry import Array


@dataclass(frozen=True)
class SweepPoints:
    """Points of one sweep and what is known of them; row k of everything is the k-th point."""

    point_m: Array
    """(k, 3)."""
    target: np.ndarray | None
    """Index 0..t-1 of the target of each point, (k,); None: all of one."""
    target_count: int
    stop: np.ndarray | None
    """Index of the standstill of each point, (k,), where points share one; None: each has its own."""
    sigma_m: Array | None
    """Standard deviation of one coordinate, (k,), or None where it is not stated."""
    covariance_m2: Array | None
    """Full covariances, (k, 3, 3), where they are not multiples of the unit matrix."""

    @property
    def count(self) -> int:
        return len(self.point_m)

    def target_index(self) -> np.ndarray:
        return np.zeros(self.count, dtype=int) if self.target is None else self.target

    def only(self, rows: np.ndarray | slice) -> "SweepPoints":
        """Some of the points; targets keep their numbers."""
        return SweepPoints(
            self.point_m[rows],
            None if self.target is None else self.target[rows],
            self.target_count,
            None if self.stop is None else np.unique(self.stop[rows], return_inverse=True)[1],
            None if self.sigma_m is None else self.sigma_m[rows],
            None if self.covariance_m2 is None else self.covariance_m2[rows],
        )


def sweep_points(
    points_m: ArrayLike,
    target: ArrayLike | None = None,
    stop: ArrayLike | None = None,
    sigma_m: ArrayLike | None = None,
    covariance_m2: ArrayLike | None = None,
) -> SweepPoints:
    """Check the points of a sweep and bring them into one form.

    Args:
        points_m: measured points, (k, 3).
        target: a number for the target of each point, (k,).
        stop: a number for the standstill of each point, (k,); points of one stop share the joint's displacement.
        sigma_m: standard deviation of one coordinate, one number or (k,).
        covariance_m2: covariance of each point, (k, 3, 3); beats ``sigma_m``.

    Raises:
        InputError: wrong shapes, numbers that are not finite, a standard deviation that is not positive.
    """
    points = np.ascontiguousarray(points_m, dtype=float)
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(f"points need the shape (k, 3), got {points.shape}")
    if not np.isfinite(points).all():
        row = int(np.flatnonzero(~np.isfinite(points).all(axis=1))[0])
        raise InputError(f"point {row + 1} is {points[row]}, expected three finite numbers")
    k = len(points)
    indices, count = _numbered(target, k, "target")
    stops, stop_count = _numbered(stop, k, "stop")
    if stop_count == k:
        stops = None
    sigma, covariance = _noise(sigma_m, covariance_m2, k)
    return SweepPoints(points, None if count <= 1 else indices, max(count, 1), stops, sigma, covariance)


def require_points(points: SweepPoints, unknown: int, equations_each: int, least: int) -> None:
    """Raise AxisUndefined where there are too few points for one equation more than unknowns."""
    if points.count < least or points.count * equations_each <= unknown:
        raise AxisUndefined(
            f"{points.count} points are too few to find a joint axis and check it, expected at least {least}"
        )


def _numbered(labels: ArrayLike | None, k: int, what: str) -> tuple[np.ndarray | None, int]:
    if labels is None:
        return None, k if what == "stop" else 1
    labels = np.asarray(labels)
    if labels.shape != (k,):
        raise InputError(f"{k} points need {k} {what} numbers, got an array of shape {labels.shape}")
    found, indices = np.unique(labels, return_inverse=True)
    return indices, len(found)


def _noise(sigma_m: ArrayLike | None, covariance_m2: ArrayLike | None, k: int) -> tuple[Array | None, Array | None]:
    if covariance_m2 is not None:
        covariance = np.asarray(covariance_m2, dtype=float)
        if covariance.shape != (k, 3, 3):
            raise InputError(f"{k} points need covariances of shape ({k}, 3, 3), got {covariance.shape}")
        variance = np.trace(covariance, axis1=1, axis2=2) / 3
        if np.abs(covariance - variance[:, None, None] * np.eye(3)).max(initial=0.0) <= 1e-9 * variance.max(
            initial=0.0
        ):
            return _positive(np.sqrt(variance)), None
        return _positive(np.sqrt(variance)), covariance
    if sigma_m is None:
        return None, None
    sigma = np.asarray(sigma_m, dtype=float)
    if sigma.ndim == 0:
        sigma = np.full(k, float(sigma))
    if sigma.shape != (k,):
        raise InputError(f"{k} points need one standard deviation or {k}, got an array of shape {sigma.shape}")
    return _positive(sigma), None


def _positive(sigma_m: Array) -> Array:
    if sigma_m.size and not (sigma_m.min() > 0 and sigma_m.max() < np.inf):
        bad = int(np.flatnonzero(~((sigma_m > 0) & np.isfinite(sigma_m)))[0])
        raise InputError(f"the standard deviation of point {bad + 1} is {sigma_m[bad]}, expected a number > 0")
    return sigma_m
