"""Whitening of correlated noise: the inverse of its covariance, in chunks as in one go, with points left out."""

from dataclasses import replace

import numpy as np
import pytest

from core.gap.whitening import Whitening, whitening
from core.geometry import Array


def covariances(rng: np.random.Generator, m: int) -> Array:
    root = rng.normal(size=(m, 3, 3)) * 1e-4
    return root @ np.swapaxes(root, 1, 2) + 1e-9 * np.eye(3)


def matrix(white: Whitening, m: int) -> Array:
    """The whitening as one matrix over all coordinates, (3m, 3m)."""
    unit = np.eye(3 * m).reshape(m, 3, 3 * m)
    return white.rows(unit).reshape(3 * m, 3 * m)


def noise_covariance(covariance: Array, correlation: float) -> Array:
    """Of points whose standardised noise follows on that of the point before, (3m, 3m)."""
    m = len(covariance)
    root = np.linalg.cholesky(covariance)
    lag = np.abs(np.subtract.outer(np.arange(m), np.arange(m)))
    return np.einsum("iab,jcb,ij->iajc", root, root, correlation**lag).reshape(3 * m, 3 * m)


@pytest.mark.parametrize("correlation", [0.0, 0.4, 0.9])
def test_white_is_white(correlation: float) -> None:
    m = 7
    covariance = covariances(np.random.default_rng(1), m)
    w = matrix(whitening(covariance, np.ones(m), correlation), m)
    np.testing.assert_allclose(w @ noise_covariance(covariance, correlation) @ w.T, np.eye(3 * m), atol=1e-10)


def test_an_autoregressive_series_becomes_white() -> None:
    m, correlation = 4000, 0.7
    rng = np.random.default_rng(2)
    covariance = covariances(rng, m)
    steps = rng.normal(size=(m, 3)) * np.sqrt(1 - correlation**2)
    series = np.empty((m, 3))
    series[0] = rng.normal(size=3)
    for k in range(1, m):
        series[k] = correlation * series[k - 1] + steps[k]
    noise = (np.linalg.cholesky(covariance) @ series[:, :, None])[:, :, 0]
    out = whitening(covariance, np.ones(m), correlation).rows(noise)
    assert out.var() == pytest.approx(1.0, abs=5 * np.sqrt(2 / (3 * m)))
    neighbours = np.mean(out[1:] * out[:-1], axis=0)
    assert np.abs(neighbours).max() < 4 / np.sqrt(m)


@pytest.mark.parametrize("correlation", [0.0, 0.6])
def test_columns_side_by_side_as_one_after_the_other(correlation: float) -> None:
    m = 20
    rng = np.random.default_rng(3)
    white = whitening(covariances(rng, m), np.where(rng.random(m) < 0.2, 0.0, rng.uniform(0.2, 1.0, m)), correlation)
    values = rng.normal(size=(m, 3, 4))
    columns = np.ascontiguousarray(white.apart(values).transpose(2, 1, 0))
    white.unlink(columns)
    np.testing.assert_allclose(columns.transpose(2, 1, 0), white.rows(values), atol=1e-12)


@pytest.mark.parametrize("correlation", [0.0, 0.7])
def test_points_left_out_have_no_say_and_their_neighbours_no_louder_one(correlation: float) -> None:
    m, weight = 6, np.array([1.0, 1, 0, 1, 1, 0])
    covariance = covariances(np.random.default_rng(4), m)
    w = matrix(whitening(covariance, weight, correlation), m)
    spread = np.diag(w @ noise_covariance(covariance, correlation) @ w.T).reshape(m, 3)
    np.testing.assert_allclose(spread, np.tile(weight[:, None], 3), atol=1e-10)
    left_out = np.repeat(weight == 0, 3)
    assert np.abs(w[:, left_out]).max() == 0
    assert np.abs(w[left_out]).max() == 0


def test_pieces_are_whitened_each_by_itself() -> None:
    m, piece = 9, np.array([0, 0, 1, 1, 1, 0, 0, 2, 2])
    covariance = covariances(np.random.default_rng(6), m)
    w = matrix(replace(whitening(covariance, np.ones(m), 0.8), piece=piece), m)
    runs = np.repeat(np.concatenate([[0], np.cumsum(np.diff(piece) != 0)]), 3)
    apart = runs[:, None] != runs
    assert np.abs(w[apart]).max() == 0
    together = np.where(apart, 0.0, noise_covariance(covariance, 0.8))
    np.testing.assert_allclose(w @ together @ w.T, np.eye(3 * m), atol=1e-10)


def test_weights_scale_squares() -> None:
    rng = np.random.default_rng(5)
    covariance, weight = covariances(rng, 5), rng.uniform(0.1, 1.0, 5)
    values = rng.normal(size=(5, 3))
    square = np.einsum("mi,mij,mj->m", values, np.linalg.inv(covariance), values)
    white = whitening(covariance, weight).rows(values)
    np.testing.assert_allclose(np.sum(white**2, axis=1), weight * square, rtol=1e-9)
