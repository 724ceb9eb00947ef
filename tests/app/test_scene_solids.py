"""Solid shapes: closed, facing outwards, of the volume that geometry asks for."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.scene.points import cage
from app.scene.solids import (
    Solid,
    arrow,
    ball,
    barrel,
    box,
    capsule,
    lathe,
    merged,
    octahedron,
    ring,
    tube,
    volume_m3,
)

TURN = 18 / 2 * np.sin(2 * np.pi / 18)
"""Area of the polygon of 18 corners in a circle of radius 1."""

SOLIDS = {
    "tube": (tube([0, 1, 0], [0, 1, 2], 0.1, 0.1), TURN * 0.01 * 2, 1e-9),
    "cone": (tube([1, 0, 0], [2, 1, 0], 0.1, 0.0), TURN * 0.01 * np.sqrt(2) / 3, 1e-9),
    "barrel": (barrel([0, 0, 1], [1, 0, 0], 0.1, 0.3), np.pi * 0.01 * 0.3, 0.06),
    "capsule": (capsule([0, 0, 0], [1, 0, 0], 0.1, 0.1), np.pi * 0.01 + 4 / 3 * np.pi * 1e-3, 0.05),
    "ball": (ball([3, 0, 0], 0.1, 24), 4 / 3 * np.pi * 1e-3, 0.05),
    "octahedron": (octahedron(0.1), 4 / 3 * 1e-3, 1e-9),
    "ring": (ring([0, 0, 1], [0, 1, 0], 0.1, 0.01), 2 * np.pi**2 * 0.1 * 0.005**2, 0.2),
    "box": (box([0, 0, 1], [0, 1, 0], 2.0, 0.1), 0.02, 1e-9),
    "cage": (cage(0.1), 3 * 2 * np.pi**2 * 0.1 * 0.011**2, 0.25),
}


@pytest.mark.parametrize("name", SOLIDS)
def test_volume(name: str) -> None:
    solid, volume, share = SOLIDS[name]
    assert volume_m3(solid) == pytest.approx(volume, rel=share)


@pytest.mark.parametrize("name", SOLIDS)
def test_closed_and_without_empty_triangles(name: str) -> None:
    solid = SOLIDS[name][0]
    _, corner = np.unique(np.round(solid.vertices_m, 9), axis=0, return_inverse=True)
    faces = corner.ravel()[solid.faces]
    edges = Counter((int(a), int(b)) for f in faces for a, b in zip(f, np.roll(f, -1), strict=True))
    assert all(len(set(f)) == 3 for f in faces)
    assert all(edges[b, a] == count for (a, b), count in edges.items())


@given(st.floats(1e-6, 10.0), st.floats(1e-4, 0.1))
def test_an_arrow_is_as_long_as_asked_and_never_thicker_than_long(length: float, radius: float) -> None:
    solid = arrow([1, 2, 3], [1, 2, 3 + length], radius)
    low, high = solid.vertices_m.min(axis=0), solid.vertices_m.max(axis=0)
    assert high[2] - low[2] == pytest.approx(length, rel=1e-6)
    assert max(high[:2] - low[:2]) <= 0.4 * length
    assert max(high[:2] - low[:2]) <= 5.3 * radius


def test_an_arrow_of_no_length_is_nothing() -> None:
    assert len(arrow([1, 2, 3], [1, 2, 3], 0.01).faces) == 0


def test_merged_solids_keep_their_faces() -> None:
    one, two = ball([0, 0, 0], 0.1), box([5, 0, 0], [1, 0, 0], 1, 1)
    both = merged([one, two])
    assert volume_m3(both) == pytest.approx(volume_m3(one) + volume_m3(two))
    assert np.array_equal(both.vertices_m[both.faces[len(one.faces) :]], two.vertices_m[two.faces])
    assert merged([]).faces.shape == (0, 3)


def test_about_moves_the_origin() -> None:
    assert np.allclose(ball([1, 2, 3], 0.1).about([1, 2, 3]).vertices_m, ball([0, 0, 0], 0.1).vertices_m)


@pytest.mark.parametrize(
    ("vertices", "faces"),
    [
        (np.zeros((3, 2)), np.zeros((1, 3), int)),
        (np.full((3, 3), np.nan), np.zeros((1, 3), int)),
        (np.zeros((3, 3)), np.array([[0, 1, 3]])),
        (np.zeros((3, 3)), np.array([[0, 1]])),
    ],
)
def test_what_is_not_a_solid_is_refused(vertices: np.ndarray, faces: np.ndarray) -> None:
    with pytest.raises(ValueError, match="solid"):
        Solid(vertices, faces)


def test_a_tube_needs_two_points() -> None:
    with pytest.raises(ValueError, match="two points"):
        tube([1, 1, 1], [1, 1, 1], 0.1, 0.1)


def test_a_lathe_puts_rings_where_the_profile_says() -> None:
    solid = lathe([0, 0, 1], [0, 0, 1], [(0.0, 0.3), (2.0, 0.1)], 12)
    radius = np.hypot(*solid.vertices_m[:, :2].T)
    assert np.allclose(radius[np.isclose(solid.vertices_m[:, 2], 1.0)], 0.3)
    assert np.allclose(radius[np.isclose(solid.vertices_m[:, 2], 3.0)], 0.1)
