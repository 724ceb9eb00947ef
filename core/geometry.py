"""Rigid motions and lines in space, vectorised over leading dimensions.

Rotations are right-handed and turn vectors: ``rotation @ vector``. A transform ``T_a_to_b`` is a 4x4
matrix that carries coordinates in frame a into coordinates in frame b. Lengths are metres.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Line:
    """A directed line in space: the axis of a joint."""

    point_m: Array
    """A point on the line, shape (3,)."""
    direction: Array
    """Unit vector in the positive sense of motion, shape (3,)."""

    def __post_init__(self) -> None:
        point = np.asarray(self.point_m, dtype=float)
        direction = np.asarray(self.direction, dtype=float)
        if point.shape != (3,) or direction.shape != (3,):
            raise ValueError(
                f"a line needs a point and a direction of shape (3,), got {point.shape} and {direction.shape}"
            )
        length = np.sqrt(direction @ direction)
        if not np.isfinite(length) or length == 0 or not np.isfinite(point).all():
            raise ValueError(
                f"a line needs a finite point and a direction that is not zero, got {point} and {direction}"
            )
        object.__setattr__(self, "point_m", point)
        object.__setattr__(self, "direction", direction / length)

    def foot_of(self, point_m: ArrayLike) -> Array:
        """The point of the line nearest to a point, shape (3,)."""
        return self.point_m + self.direction * ((np.asarray(point_m) - self.point_m) @ self.direction)

    def moved(self, transform: Array) -> "Line":
        """The line carried along by a 4x4 rigid motion."""
        return Line(transform[:3, :3] @ self.point_m + transform[:3, 3], transform[:3, :3] @ self.direction)


def cross(a: Array, b: Array) -> Array:
    """Cross products of vectors of shape (..., 3); several times faster than numpy's for few vectors."""
    a0, a1, a2 = a[..., 0], a[..., 1], a[..., 2]
    b0, b1, b2 = b[..., 0], b[..., 1], b[..., 2]
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    out[..., 0] = a1 * b2 - a2 * b1
    out[..., 1] = a2 * b0 - a0 * b2
    out[..., 2] = a0 * b1 - a1 * b0
    return out


def skew(vector: ArrayLike) -> Array:
    """The matrix of the cross product: ``skew(a) @ b == a x b``; shape (..., 3, 3)."""
    v = np.asarray(vector, dtype=float)
    out = np.zeros((*v.shape[:-1], 3, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = v[..., 2], -v[..., 1], v[..., 0]
    return out


def rotation_about(direction: ArrayLike, angle_rad: ArrayLike) -> Array:
    """Rotation by an angle about a unit vector (Rodrigues), shape (..., 3, 3) for angles of shape (...)."""
    d = np.asarray(direction, dtype=float)
    angle = np.asarray(angle_rad, dtype=float)[..., None, None]
    k = skew(d)
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * (k @ k)


def transform(rotation: ArrayLike, translation_m: ArrayLike) -> Array:
    """A 4x4 rigid motion from a rotation and a translation."""
    out = np.eye(4)
    out[:3, :3] = rotation
    out[:3, 3] = translation_m
    return out


def invert(transform_a_to_b: Array) -> Array:
    """The inverse of rigid motions, shape (..., 4, 4), without a general matrix inversion."""
    out = np.zeros_like(transform_a_to_b)
    rotation_back = np.swapaxes(transform_a_to_b[..., :3, :3], -1, -2)
    out[..., :3, :3] = rotation_back
    out[..., :3, 3] = -(rotation_back @ transform_a_to_b[..., :3, 3:])[..., 0]
    out[..., 3, 3] = 1.0
    return out


def apply(transform_a_to_b: Array, points_m: ArrayLike) -> Array:
    """Points of shape (..., 3) carried from frame a into frame b."""
    points = np.asarray(points_m, dtype=float)
    return (transform_a_to_b[..., :3, :3] @ points[..., None])[..., 0] + transform_a_to_b[..., :3, 3]


def joint_motion(line: Line, displacement: ArrayLike, sliding: bool) -> Array:
    """The rigid motion of a joint: a turn (rad) about its axis or a slide (m) along it; (..., 4, 4)."""
    displacement = np.asarray(displacement, dtype=float)
    out = np.zeros((*displacement.shape, 4, 4))
    out[..., 3, 3] = 1.0
    if sliding:
        out[..., :3, :3] = np.eye(3)
        out[..., :3, 3] = displacement[..., None] * line.direction
        return out
    rotation = rotation_about(line.direction, displacement)
    out[..., :3, :3] = rotation
    out[..., :3, 3] = line.point_m - rotation @ line.point_m
    return out


def perpendicular_basis(direction: ArrayLike) -> tuple[Array, Array]:
    """Two unit vectors e1, e2 with e1 x e2 = direction (a unit vector).

    The construction is smooth in the direction but for one point (Duff et al. 2017, JCGT 6(1)).
    """
    x, y, z = np.asarray(direction, dtype=float)
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    return np.array([1.0 + sign * x * x * a, sign * b, -sign * x]), np.array([b, sign + y * y * a, -y])


def angle_between(u: ArrayLike, v: ArrayLike) -> float:
    """The angle in [0, pi] between two vectors, accurate near 0 and pi."""
    u, v = np.asarray(u, dtype=float), np.asarray(v, dtype=float)
    return float(np.arctan2(np.linalg.norm(cross(u, v)), u @ v))


def wrap_angle(angle_rad: ArrayLike) -> Array:
    """Angles brought into [-pi, pi)."""
    return (np.asarray(angle_rad, dtype=float) + np.pi) % (2 * np.pi) - np.pi


def common_normal(first: Line, second: Line) -> tuple[Array, Array]:
    """The feet of the common normal on two lines that are not parallel, each of shape (3,).

    Raises:
        ValueError: the lines are parallel, so that the normal has no place.
    """
    normal = cross(first.direction, second.direction)
    square = normal @ normal
    if square < 1e-24:
        raise ValueError("parallel lines have no common normal of their own")
    between = second.point_m - first.point_m
    along_first = cross(between, second.direction) @ normal / square
    along_second = cross(between, first.direction) @ normal / square
    return first.point_m + along_first * first.direction, second.point_m + along_second * second.direction


def line_distance(first: Line, second: Line) -> float:
    """The shortest distance between two lines, in metres."""
    between = second.point_m - first.point_m
    normal = cross(first.direction, second.direction)
    sine = np.linalg.norm(normal)
    if sine < 1e-9:
        return float(np.linalg.norm(cross(between, first.direction)))
    return float(abs(between @ normal) / sine)


def rigid_fit(points_a_m: ArrayLike, points_b_m: ArrayLike, weights: ArrayLike | None = None) -> Array:
    """The rigid motion that carries points a best onto points b, shape (4, 4).

    Weighted least squares by singular value decomposition (Arun 1987, doi 10.1109/TPAMI.1987.4767965), with
    the guard against reflections of Umeyama (1991, doi 10.1109/34.88573).
    """
    a, b = np.asarray(points_a_m, dtype=float), np.asarray(points_b_m, dtype=float)
    w = np.full(len(a), 1.0 / len(a)) if weights is None else np.asarray(weights) / np.sum(weights)
    mean_a, mean_b = w @ a, w @ b
    u, _, vt = np.linalg.svd((b - mean_b).T @ ((a - mean_a) * w[:, None]))
    rotation = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    return transform(rotation, mean_b - rotation @ mean_a)
