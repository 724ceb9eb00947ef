"""Two theodolites: rays, their intersection, and how uncertain the point is.

A station sees a point under two angles, the horizontal circle ``hz`` (clockwise from the instrument's y-axis, seen from
above) and the zenith angle ``v`` (0 straight up). The ray is, in the instrument's own axes,

    u = (sin v sin hz, sin v cos hz, cos v)

Two rays that pass each other give a first point midway between their closest points (the length of the gap is the
only check on a single point); weighted Gauss-Newton steps on the four angles give the point of least squares and
its covariance (Gaunt 1988, SLAC-PUB-4717). With both stations at range R and the rays crossing at gamma, the net radial
error is R sigma sqrt(2 / sin(gamma)^2 + 1/2).
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from core.errors import InputError
from core.geometry import Array, wrap_angle

PARALLEL_SINE = 1e-6
"""Rays that cross at a smaller angle (rad) fix no point."""
GAUSS_NEWTON_STEPS = 3


@dataclass(frozen=True)
class Theodolite:
    """One station."""

    position_m: Array
    """Where its axes meet, (3,)."""
    rotation: Array = field(default_factory=lambda: np.eye(3))
    """From the world's axes to the instrument's, (3, 3)."""
    sigma_hz_rad: float = 5e-6
    sigma_v_rad: float = 5e-6

    def __post_init__(self) -> None:
        position = np.asarray(self.position_m, dtype=float)
        rotation = np.asarray(self.rotation, dtype=float)
        if position.shape != (3,) or not np.isfinite(position).all():
            raise InputError(f"a station's position must be three finite numbers, got {self.position_m}")
        if rotation.shape != (3, 3) or not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-9):
            raise InputError("a station's rotation must be an orthogonal 3x3 matrix")
        if np.linalg.det(rotation) < 0:
            raise InputError("a station's rotation is left-handed, expected a right-handed one")
        for name in ("sigma_hz_rad", "sigma_v_rad"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise InputError(f"{name} must be a number above 0, got {getattr(self, name)}")
        object.__setattr__(self, "position_m", position)
        object.__setattr__(self, "rotation", rotation)

    def observe(self, points_m: ArrayLike) -> Array:
        """The angles hz in [0, 2 pi) and v under which points (m, 3) are seen, rad, (m, 2).

        Raises:
            InputError: a point stands straight above or below the station, where hz has no meaning.
        """
        angles, _ = self.observe_with_gradient(points_m)
        angles[:, 0] %= 2 * np.pi
        return angles

    def observe_with_gradient(self, points_m: ArrayLike) -> tuple[Array, Array]:
        """The angles hz in (-pi, pi] and v, (m, 2), and their derivative by the point, (m, 2, 3), rad/m.

        Raises:
            InputError: as for ``observe``.
        """
        x, y, z = ((np.atleast_2d(np.asarray(points_m, dtype=float)) - self.position_m) @ self.rotation.T).T
        level = np.hypot(x, y)
        square = level**2 + z**2
        overhead = np.flatnonzero(~(level > 1e-9 * np.sqrt(square)))
        if len(overhead):
            raise InputError(f"point {overhead[0]} stands straight above or below the station: hz has no meaning there")
        angles = np.stack([np.arctan2(x, y), np.arctan2(level, z)], axis=1)
        by_hz = np.stack([y, -x, np.zeros_like(x)], axis=1) / level[:, None] ** 2
        by_v = np.stack([x * z / level, y * z / level, -level], axis=1) / square[:, None]
        return angles, np.stack([by_hz, by_v], axis=1) @ self.rotation

    def rays(self, angles_rad: ArrayLike) -> Array:
        """Unit vectors in the world's axes towards what is seen under the angles (m, 2), shape (m, 3)."""
        hz, v = np.atleast_2d(np.asarray(angles_rad, dtype=float)).T
        u = np.stack([np.sin(v) * np.sin(hz), np.sin(v) * np.cos(hz), np.cos(v)], axis=1)
        return u @ self.rotation

    @property
    def weights(self) -> Array:
        """One over the variance of hz and of v, (2,)."""
        return np.array([self.sigma_hz_rad, self.sigma_v_rad]) ** -2.0


@dataclass(frozen=True)
class Intersection:
    """Points where the rays of two stations meet."""

    point_m: Array
    """(m, 3)"""
    covariance_m2: Array
    """(m, 3, 3)"""
    gap_m: Array
    """How far apart the two rays pass, (m,)."""


def intersect(first: Theodolite, second: Theodolite, seen_first: ArrayLike, seen_second: ArrayLike) -> Intersection:
    """The points that two stations see under angles (m, 2) each, by weighted least squares on the four angles.

    Raises:
        InputError: two rays are parallel, meet behind a station, or an angle is not a number; the message says
            which point (counted from 0).
    """
    one, two = np.atleast_2d(seen_first, seen_second)
    for angles in (one, two):
        unknown = np.flatnonzero(~np.isfinite(angles).all(axis=1))
        if len(unknown):
            raise InputError(f"the angles to point {unknown[0]} are {angles[unknown[0]]}, expected two finite numbers")
    point, gap = _closest_points(first, second, first.rays(one), second.rays(two))
    for _ in range(GAUSS_NEWTON_STEPS):
        normal, right = _normal_equations((first, second), (one, two), point)
        point = point + np.linalg.solve(normal, right[..., None])[..., 0]
    return Intersection(point, point_covariance((first, second), point), gap)


def point_covariance(stations: tuple[Theodolite, ...], points_m: ArrayLike) -> Array:
    """Covariance of points (m, 3) that stations fix by their angles, (J' W J)^-1, shape (m, 3, 3), m^2."""
    return np.linalg.inv(sum(_information(s, s.observe_with_gradient(points_m)[1]) for s in stations))


def _information(station: Theodolite, gradient: Array) -> Array:
    return np.einsum("mai,a,maj->mij", gradient, station.weights, gradient)


def _normal_equations(stations: tuple[Theodolite, ...], seen: tuple[Array, ...], point: Array) -> tuple[Array, Array]:
    normal, right = np.zeros((len(point), 3, 3)), np.zeros((len(point), 3))
    for station, angles in zip(stations, seen, strict=True):
        expected, gradient = station.observe_with_gradient(point)
        left_over = angles - expected
        left_over[:, 0] = wrap_angle(left_over[:, 0])
        normal += _information(station, gradient)
        right += np.einsum("mai,a,ma->mi", gradient, station.weights, left_over)
    return normal, right


def _closest_points(first: Theodolite, second: Theodolite, u1: Array, u2: Array) -> tuple[Array, Array]:
    """Midpoints of the shortest connections between rays, (m, 3), and their lengths, (m,)."""
    between = first.position_m - second.position_m
    b, d, e = np.sum(u1 * u2, axis=1), u1 @ between, u2 @ between
    square = np.sum(np.cross(u1, u2) ** 2, axis=1)
    parallel = np.flatnonzero(square < PARALLEL_SINE**2)
    if len(parallel):
        raise InputError(f"the two rays to point {parallel[0]} are parallel, so they fix no point")
    along_first, along_second = (b * e - d) / square, (e - b * d) / square
    behind = np.flatnonzero((along_first <= 0) | (along_second <= 0))
    if len(behind):
        k = behind[0]
        nearest = f"{along_first[k]:.3f} m and {along_second[k]:.3f} m"
        raise InputError(f"the two rays to point {k} come closest at {nearest} along them: behind a station")
    on_first = first.position_m + along_first[:, None] * u1
    on_second = second.position_m + along_second[:, None] * u2
    return (on_first + on_second) / 2, np.linalg.norm(on_first - on_second, axis=1)
