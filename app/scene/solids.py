"""Solid shapes as triangles: tubes, balls, rings, boxes, arrows. Pure numpy; metres.

Vertices on an edge that should look sharp are there twice, because a browser smooths what shares a vertex.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from core.geometry import Array, cross, perpendicular_basis

SEGMENTS = 18
"""Of a full turn: round enough at the size of an arm on a screen, and light to draw."""


@dataclass(frozen=True)
class Solid:
    """A surface of triangles, counter-clockwise seen from outside."""

    vertices_m: Array
    """(v, 3)"""
    faces: np.ndarray
    """Indices of vertices, (f, 3), integer."""

    def __post_init__(self) -> None:
        if self.vertices_m.ndim != 2 or self.vertices_m.shape[1] != 3 or not np.isfinite(self.vertices_m).all():
            raise ValueError(f"a solid needs finite vertices of shape (v, 3), got {self.vertices_m.shape}")
        if self.faces.ndim != 2 or self.faces.shape[1] != 3:
            raise ValueError(f"a solid needs faces of shape (f, 3), got {self.faces.shape}")
        if len(self.faces) and not 0 <= self.faces.min() <= self.faces.max() < len(self.vertices_m):
            raise ValueError("a face of a solid names a vertex that is not there")

    def about(self, origin_m: ArrayLike) -> "Solid":
        """The same with coordinates counted from another origin."""
        return Solid(self.vertices_m - np.asarray(origin_m, dtype=float), self.faces)


def merged(solids: list[Solid] | tuple[Solid, ...]) -> Solid:
    """Several solids as one; none at all gives an empty one."""
    if not solids:
        return Solid(np.zeros((0, 3)), np.zeros((0, 3), dtype=int))
    starts = np.cumsum([0, *(len(s.vertices_m) for s in solids[:-1])])
    faces = [s.faces + start for s, start in zip(solids, starts, strict=True)]
    return Solid(np.concatenate([s.vertices_m for s in solids]), np.concatenate(faces))


def lathe(start_m: ArrayLike, direction: ArrayLike, profile: ArrayLike, segments: int = SEGMENTS) -> Solid:
    """A surface of revolution about a line.

    Args:
        start_m: a point on the line, (3,).
        direction: unit vector along it, (3,).
        profile: way along the line and radius of every ring, (k, 2), metres, so that what is left of the way from one
            ring to the next is inside; two rings at the same place make a sharp edge.
        segments: of a full turn.
    """
    along, radius = np.asarray(profile, dtype=float).T
    e1, e2 = perpendicular_basis(direction)
    angle = np.arange(segments) * (2 * np.pi / segments)
    circle = np.cos(angle)[:, None] * e1 + np.sin(angle)[:, None] * e2
    centres = np.asarray(start_m, dtype=float) + along[:, None] * np.asarray(direction, dtype=float)
    vertices = (centres[:, None] + radius[:, None, None] * circle).reshape(-1, 3)
    return Solid(vertices, _strips(along, radius, segments))


def _strips(along: Array, radius: Array, segments: int) -> np.ndarray:
    """Triangles between consecutive rings of equally many vertices, without those that have no area."""
    here = np.arange(segments)
    beside = (here + 1) % segments
    rings = np.arange(len(along) - 1)
    apart = (np.diff(along) != 0) | (np.diff(radius) != 0)
    low = (rings * segments)[:, None]
    a, b, c, d = low + here, low + beside, low + segments + here, low + segments + beside
    from_wide, to_wide = (radius[:-1] > 1e-12) & apart, (radius[1:] > 1e-12) & apart
    first, second = np.stack(np.broadcast_arrays(a, b, d), axis=-1), np.stack(np.broadcast_arrays(a, d, c), axis=-1)
    return np.concatenate([first[from_wide], second[to_wide]]).reshape(-1, 3)


def tube(
    start_m: ArrayLike, end_m: ArrayLike, start_radius_m: float, end_radius_m: float, segments: int = SEGMENTS
) -> Solid:
    """A cylinder or cone with flat ends and sharp edges, from one point to another that is not the same."""
    start, length, direction = _way(start_m, end_m)
    profile = [
        (0.0, 0.0),
        (0.0, start_radius_m),
        (0.0, start_radius_m),
        (length, end_radius_m),
        (length, end_radius_m),
        (length, 0.0),
    ]
    return lathe(start, direction, profile, segments)


def barrel(centre_m: ArrayLike, direction: ArrayLike, radius_m: float, length_m: float) -> Solid:
    """A cylinder about its centre with bevelled edges."""
    bevel, half = 0.16 * radius_m, length_m / 2
    side = [(-half, radius_m - bevel), (-half + bevel, radius_m), (half - bevel, radius_m), (half, radius_m - bevel)]
    doubled = [ring for ring in side for _ in range(2)]
    profile = [(-half, 0.0), *doubled, (half, 0.0)]
    return lathe(centre_m, direction, profile, 28)


def capsule(start_m: ArrayLike, end_m: ArrayLike, start_radius_m: float, end_radius_m: float) -> Solid:
    """A tapered tube with round ends, from one point to another that is not the same."""
    start, length, direction = _way(start_m, end_m)
    arc = np.linspace(0.0, np.pi / 2, 5)
    head = np.stack([-start_radius_m * np.cos(arc), start_radius_m * np.sin(arc)], axis=1)
    tail = np.stack([length + end_radius_m * np.sin(arc), end_radius_m * np.cos(arc)], axis=1)
    return lathe(start, direction, np.concatenate([head, tail]))


def ball(centre_m: ArrayLike, radius_m: float, segments: int = 12) -> Solid:
    """A sphere."""
    arc = np.linspace(0.0, np.pi, segments // 2 + 1)
    profile = np.stack([-radius_m * np.cos(arc), radius_m * np.sin(arc)], axis=1)
    return lathe(centre_m, [0.0, 0.0, 1.0], profile, segments)


def octahedron(radius_m: float) -> Solid:
    """Eight flat faces about the origin: a diamond."""
    corners = radius_m * np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float)
    around = [(0, 2), (2, 1), (1, 3), (3, 0)]
    faces = np.array([[a, b, 4] for a, b in around] + [[b, a, 5] for a, b in around])
    return _flat(corners, faces)


def ring(centre_m: ArrayLike, normal: ArrayLike, radius_m: float, thickness_m: float, segments: int = 28) -> Solid:
    """A torus about a centre."""
    angle = np.linspace(0.0, 2 * np.pi, 7)
    profile = np.stack([thickness_m / 2 * np.sin(angle), radius_m + thickness_m / 2 * np.cos(angle)], axis=1)
    return lathe(centre_m, normal, profile, segments)


def box(centre_m: ArrayLike, along: ArrayLike, length_m: float, width_m: float) -> Solid:
    """A square bar about its centre, with flat sides."""
    e1, e2 = perpendicular_basis(along)
    axes = np.stack([np.asarray(along) * length_m, e1 * width_m, e2 * width_m]) / 2
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))])
    return _flat(np.asarray(centre_m, dtype=float) + signs @ axes, faces)


def arrow(start_m: ArrayLike, end_m: ArrayLike, radius_m: float, segments: int = 10) -> Solid:
    """An arrow of a given shaft; where it is short, shaft and head shrink with it. Too short a way gives nothing."""
    start, end = np.asarray(start_m, dtype=float), np.asarray(end_m, dtype=float)
    length = float(np.linalg.norm(end - start))
    if length < 1e-9:
        return merged([])
    radius = min(radius_m, 0.06 * length)
    neck = length - min(7.0 * radius, 0.45 * length)
    profile = [
        (0.0, 0.0),
        (0.0, radius),
        (0.0, radius),
        (neck, radius),
        (neck, radius),
        (neck, 2.6 * radius),
        (neck, 2.6 * radius),
        (length, 0.0),
    ]
    return lathe(start, (end - start) / length, profile, segments)


def volume_m3(solid: Solid) -> float:
    """Volume that a closed solid encloses, m^3; negative where its faces look inward."""
    a, b, c = np.swapaxes(solid.vertices_m[solid.faces], 0, 1)
    return float(np.sum(a * cross(b, c)) / 6.0)


def _way(start_m: ArrayLike, end_m: ArrayLike) -> tuple[Array, float, Array]:
    start, end = np.asarray(start_m, dtype=float), np.asarray(end_m, dtype=float)
    length = float(np.linalg.norm(end - start))
    if length < 1e-9:
        raise ValueError(f"a shape needs two points that differ, got {start} twice")
    return start, length, (end - start) / length


def _flat(corners: Array, faces: np.ndarray) -> Solid:
    return Solid(corners[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3))
