"""Rotations as quaternions and as turns about fixed axes: there and back, next to right angles and half turns too."""

import numpy as np
import pytest
from random_arms import random_rotation

from core.geometry import rotation_about
from core.rotations import quaternions, rotations_of_quaternions, rotations_of_turns, turns_of_rotations

X, Y, Z = np.eye(3)
SPECIAL = [
    np.eye(3),
    np.diag([1.0, -1.0, -1.0]),
    np.diag([-1.0, 1.0, -1.0]),
    np.diag([-1.0, -1.0, 1.0]),
    *(rotation_about(Y, sign * (np.pi / 2 + shift)) for sign in (1, -1) for shift in (0.0, 1e-16, 1e-12, 1e-8, -1e-5)),
    *(rotation_about(Z, 0.7) @ rotation_about(Y, np.pi / 2 + s) @ rotation_about(X, -0.4) for s in (0.0, 1e-13, 1e-9)),
]


def samples() -> np.ndarray:
    return np.stack([*SPECIAL, *(random_rotation(np.random.default_rng(k)) for k in range(200))])


def test_quaternions_there_and_back() -> None:
    q = quaternions(samples())
    np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1.0, rtol=0, atol=1e-15)
    np.testing.assert_allclose(rotations_of_quaternions(q), samples(), rtol=0, atol=1e-14)
    np.testing.assert_allclose(rotations_of_quaternions(-3 * q), samples(), rtol=0, atol=1e-14)


def test_quaternions_have_the_scalar_first() -> None:
    np.testing.assert_allclose(rotations_of_quaternions([[np.cos(0.2), 0, 0, np.sin(0.2)]])[0], rotation_about(Z, 0.4))


def test_turns_there_and_back() -> None:
    np.testing.assert_allclose(rotations_of_turns(turns_of_rotations(samples())), samples(), rtol=0, atol=3e-15)


def test_turns_are_made_about_fixed_axes_x_first() -> None:
    expected = rotation_about(Z, 0.3) @ rotation_about(Y, -0.2) @ rotation_about(X, 0.5)
    np.testing.assert_allclose(rotations_of_turns([[0.5, -0.2, 0.3]])[0], expected, rtol=0, atol=1e-15)
    np.testing.assert_allclose(turns_of_rotations(expected[None])[0], [0.5, -0.2, 0.3], rtol=0, atol=1e-14)


@pytest.mark.parametrize("count", [0, 1])
def test_any_number_of_rotations(count: int) -> None:
    rotation = np.broadcast_to(np.eye(3), (count, 3, 3))
    assert quaternions(rotation).shape == (count, 4)
    assert turns_of_rotations(rotation).shape == (count, 3)
    assert rotations_of_turns(np.zeros((count, 3))).shape == (count, 3, 3)
