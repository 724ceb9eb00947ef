"""Poses from points: exact without noise, as uncertain as they say with it, and refused where points are on a line."""

import numpy as np
import pytest
from random_arms import random_motion

from core.geometry import Array
from core.rigid_pose import PointSets, can_be_placed, fit_body, fit_poses, moved
from core.rotations import rotations_of_vectors, vectors_of_rotations

BODY = np.array([[0.15, 0.02, 0.0], [-0.12, 0.05, 0.03], [0.0, -0.18, -0.02], [0.05, 0.1, 0.2]])


def sets(
    poses: Array, body: Array, covariance: Array | None = None, rng: np.random.Generator | None = None
) -> PointSets:
    points = moved(poses, body)
    shape = (*points.shape, 3)
    spread = np.broadcast_to(1e-8 * np.eye(3) if covariance is None else covariance, shape)
    if rng is not None:
        points = points + np.einsum("kjab,kjb->kja", np.linalg.cholesky(spread), rng.normal(size=points.shape))
    return PointSets(points, spread, np.ones(points.shape[:2], dtype=bool))


def poses(count: int, seed: int = 0) -> Array:
    rng = np.random.default_rng(seed)
    return np.stack([random_motion(rng) for _ in range(count)])


@pytest.mark.parametrize("count", [3, 4])
def test_without_noise_the_poses_are_exact(count: int) -> None:
    true, body = poses(50), BODY[:count]
    found = fit_poses(body, sets(true, body))
    np.testing.assert_allclose(found.transform, true, rtol=0, atol=1e-12)
    assert found.chi_square.max() < 1e-12
    assert set(found.degrees_of_freedom) == {3 * count - 6}


def test_the_covariance_is_that_of_the_errors() -> None:
    rng = np.random.default_rng(1)
    skewed = np.diag([1e-4, 4e-4, 2e-4]) ** 2 + 1e-8 * np.ones((3, 3))
    true = np.repeat(poses(1), 4000, axis=0)
    found = fit_poses(BODY, sets(true, BODY, skewed, rng))
    turned = vectors_of_rotations(found.transform[:, :3, :3] @ np.swapaxes(true[:, :3, :3], 1, 2))
    errors = np.concatenate([found.transform[:, :3, 3] - true[:, :3, 3], turned], axis=1)
    scores = np.einsum("ki,kij,kj->k", errors, np.linalg.inv(found.covariance), errors)
    # Means of 4000 chi-square numbers with 6 degrees of freedom: standard deviation 0.055, and 0.057 with 6 again.
    assert scores.mean() == pytest.approx(6.0, abs=0.25)
    assert found.chi_square.mean() == pytest.approx(6.0, abs=0.25)
    np.testing.assert_allclose(np.cov(errors.T), found.covariance[0], atol=0.1 * np.abs(found.covariance[0]).max())


def test_weights_make_the_exact_points_count() -> None:
    covariance = np.stack([np.eye(3) * s**2 for s in (1e-6, 1e-6, 1e-6, 1e-2)])[None]
    true = poses(1)
    points = sets(true, BODY, covariance)
    spoiled = points.point_m.copy()
    spoiled[0, 3] += 0.02
    found = fit_poses(BODY, PointSets(spoiled, points.covariance_m2, points.seen))
    np.testing.assert_allclose(found.transform, true, rtol=0, atol=1e-8)


def test_a_mirrored_fit_is_never_given() -> None:
    flat = np.array([[0.1, 0, 0], [-0.05, 0.1, 0], [-0.05, -0.1, 0]])
    found = fit_poses(flat, sets(poses(100, 3), flat, np.eye(3) * 1e-6, np.random.default_rng(2)))
    np.testing.assert_allclose(np.linalg.det(found.transform[:, :3, :3]), 1.0)


def test_points_that_were_not_seen_do_not_count() -> None:
    true = poses(3)
    points = sets(true, BODY)
    hidden, seen = points.point_m.copy(), points.seen.copy()
    hidden[0, 2], seen[0, 2] = np.nan, False
    hidden[1, 0], seen[1, 0] = 1e6, False
    found = fit_poses(BODY, PointSets(hidden, points.covariance_m2, seen))
    np.testing.assert_allclose(found.transform, true, rtol=0, atol=1e-12)
    assert found.degrees_of_freedom.tolist() == [3, 3, 6]
    assert np.isnan(found.residual_m[0, 2]).all()


def test_the_shape_is_found_from_the_poses() -> None:
    rng = np.random.default_rng(5)
    true = poses(12, 7)
    exact = sets(true, BODY)
    start = BODY + rng.normal(size=BODY.shape) * 0.01
    distances = lambda body: np.linalg.norm(body[:, None] - body[None], axis=2)  # noqa: E731
    np.testing.assert_allclose(distances(fit_body(start, exact)), distances(BODY), rtol=0, atol=1e-8)
    noisy = fit_body(start, sets(true, BODY, np.eye(3) * 1e-8, rng))
    assert np.abs(distances(noisy) - distances(BODY)).max() < 4 * 1e-4 * np.sqrt(2 / 12)


def test_the_shape_is_found_though_no_pose_shows_all_of_it() -> None:
    true = poses(8, 2)
    points = sets(true, BODY)
    seen = points.seen.copy()
    seen[np.arange(8), np.arange(8) % 4] = False
    body = fit_body(
        BODY + 0.003 * np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0]]),
        PointSets(points.point_m, points.covariance_m2, seen),
    )
    found = fit_poses(body, PointSets(points.point_m, points.covariance_m2, seen))
    assert np.nanmax(np.abs(found.residual_m)) < 1e-7


def test_points_on_a_line_do_not_fix_a_pose() -> None:
    line = np.array([[0, 0, 0], [0.1, 0.1, 0], [0.2, 0.2, 1e-4], [0, 0.3, 0]])
    seen = np.array([[1, 1, 1, 0], [1, 1, 1, 1], [1, 0, 1, 1], [1, 1, 0, 0], [0, 0, 0, 0]], dtype=bool)
    assert can_be_placed(line, seen).tolist() == [False, True, True, False, False]


def test_rotation_vectors_there_and_back() -> None:
    rng = np.random.default_rng(4)
    vectors = rng.normal(size=(200, 3))
    vectors *= (rng.uniform(0, np.pi, 200) / np.linalg.norm(vectors, axis=1))[:, None]
    vectors[:3] = [[0, 0, 0], [1e-12, 0, 0], [0, np.pi, 0]]
    np.testing.assert_allclose(vectors_of_rotations(rotations_of_vectors(vectors)), vectors, rtol=0, atol=1e-12)
