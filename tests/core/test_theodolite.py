"""Theodolites: rays, intersection, covariance."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.errors import InputError
from core.geometry import rotation_about
from core.theodolite import Theodolite, intersect, point_covariance

ARCSECOND = np.pi / 180 / 3600
SIGMA = 2 * ARCSECOND


def tilted(position: list[float], angle: float) -> Theodolite:
    axis = np.array([0.6, 0.64, 0.48])
    return Theodolite(np.array(position), rotation_about(axis / np.linalg.norm(axis), angle), SIGMA, 1.5 * SIGMA)


def symmetric(reach_m: float, gamma: float, sigma: float) -> tuple[Theodolite, Theodolite]:
    """Two stations at one range from the origin, their rays crossing at gamma."""
    half = gamma / 2
    left = reach_m * np.array([-np.sin(half), -np.cos(half), 0.0])
    right = left * [-1, 1, 1]
    return Theodolite(left, np.eye(3), sigma, sigma), Theodolite(right, np.eye(3), sigma, sigma)


coordinate = st.floats(-1.5, 1.5)


@settings(max_examples=50, deadline=None)
@given(st.tuples(coordinate, coordinate, coordinate), st.floats(-3, 3), st.floats(-3, 3))
def test_what_two_stations_see_gives_the_point_back(point, turn_one, turn_two):
    one, two = tilted([-3.0, 0.1, 0.2], turn_one), tilted([0.3, -3.5, -0.4], turn_two)
    points = np.array([point, [0.1, 0.2, 0.3]])
    met = intersect(one, two, one.observe(points), two.observe(points))
    np.testing.assert_allclose(met.point_m, points, atol=1e-12)
    np.testing.assert_allclose(met.gap_m, 0, atol=1e-12)


def test_hz_runs_clockwise_from_y_and_v_down_from_the_zenith():
    level = Theodolite(np.array([1.0, 2.0, 3.0]))
    seen = level.observe(level.position_m + np.array([[0, 2, 0], [2, 0, 0], [0, -2, 0], [-2, 0, 0], [1, 0, 1]]))
    np.testing.assert_allclose(seen[:, 0], np.deg2rad([0, 90, 180, 270, 90]), atol=1e-15)
    np.testing.assert_allclose(seen[:, 1], np.deg2rad([90, 90, 90, 90, 45]), atol=1e-15)


def test_the_measured_world_is_not_a_mirror_image():
    one, two = symmetric(3.0, np.pi / 2, SIGMA)
    corner = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
    seen = intersect(one, two, one.observe(corner), two.observe(corner)).point_m
    assert np.linalg.det(seen[1:] - seen[0]) == pytest.approx(1e-3)


def test_gradient_matches_finite_differences():
    station, points = tilted([-3.0, 0.1, 0.2], 1.1), np.array([[0.2, 0.5, -0.7], [1.0, -1.0, 0.4]])
    _, gradient = station.observe_with_gradient(points)
    for k, step in enumerate(np.eye(3) * 1e-6):
        numeric = (station.observe(points + step) - station.observe(points - step)) / 2e-6
        np.testing.assert_allclose(gradient[:, :, k], numeric, atol=1e-8)


def test_stated_covariance_is_what_noise_makes():
    one, two = tilted([-3.0, 0.1, 0.2], 0.4), tilted([0.3, -4.5, -0.4], -0.8)
    point = np.array([0.4, 0.3, 0.6])
    rng = np.random.default_rng(1)
    many = np.repeat(point[None], 20000, axis=0)
    noisy = [s.observe(many) + rng.normal(size=(20000, 2)) * [s.sigma_hz_rad, s.sigma_v_rad] for s in (one, two)]
    spread = np.cov(intersect(one, two, *noisy).point_m.T)
    stated = intersect(one, two, one.observe(point), two.observe(point)).covariance_m2[0]
    root = np.linalg.inv(np.linalg.cholesky(stated))
    np.testing.assert_allclose(root @ spread @ root.T, np.eye(3), atol=0.04)


@pytest.mark.parametrize(
    ("sigma_arcsec", "reach_m", "printed_mm"),
    [(0.5, 3, 0.012), (1, 4, 0.031), (2, 5, 0.077), (5, 5, 0.192), (5, 6, 0.230), (2, 3, 0.046)],
)
def test_net_radial_error_of_rays_that_cross_squarely(sigma_arcsec, reach_m, printed_mm):
    """A published table for two stations at equal range and a right angle between the rays."""
    stations = symmetric(reach_m, np.pi / 2, sigma_arcsec * ARCSECOND)
    net = np.sqrt(np.trace(point_covariance(stations, np.zeros((1, 3)))[0]))
    assert net * 1e3 == pytest.approx(printed_mm, abs=0.0006)


@pytest.mark.parametrize("gamma_deg", [40, 60, 90, 120])
def test_error_along_across_and_up(gamma_deg):
    gamma, reach = np.deg2rad(gamma_deg), 4.0
    covariance = point_covariance(symmetric(reach, gamma, SIGMA), np.zeros((1, 3)))[0]
    across, along = 1 / np.cos(gamma / 2), 1 / np.sin(gamma / 2)
    expected = reach * SIGMA / np.sqrt(2) * np.array([across, along, 1.0])
    np.testing.assert_allclose(covariance, np.diag(expected**2), atol=1e-18)


def test_skew_rays_leave_a_gap():
    one, two = symmetric(3.0, np.pi / 2, SIGMA)
    raised = two.observe(np.array([[0, 0, 0.01]]))
    met = intersect(one, two, one.observe(np.zeros((1, 3))), raised)
    assert met.gap_m[0] == pytest.approx(0.01, rel=1e-4)
    assert met.point_m[0, 2] == pytest.approx(0.005, rel=1e-3)


def test_the_more_exact_station_counts_more():
    one, two = symmetric(3.0, np.pi / 2, SIGMA)
    coarse = Theodolite(two.position_m, two.rotation, 10 * SIGMA, 10 * SIGMA)
    seen = one.observe(np.zeros((1, 3))), coarse.observe(np.array([[0, 0, 0.01]]))
    assert intersect(one, coarse, *seen).point_m[0, 2] == pytest.approx(0.01 / 101, rel=1e-2)


def test_rays_that_fix_no_point_are_refused():
    one, two = symmetric(3.0, np.pi / 2, SIGMA)
    level = np.array([[0.3, np.pi / 2]])
    with pytest.raises(InputError, match="point 0 are parallel"):
        intersect(one, two, level, level)
    away = one.observe(np.zeros((1, 3))) + np.array([np.pi, 0.0])
    with pytest.raises(InputError, match="behind a station"):
        intersect(one, two, away, two.observe(np.zeros((1, 3))))
    with pytest.raises(InputError, match=r"point 1 are .* expected two finite numbers"):
        intersect(one, two, [[0.1, 1.5], [np.nan, 1.5]], np.repeat(level, 2, axis=0))
    with pytest.raises(InputError, match="straight above"):
        one.observe(one.position_m + np.array([[0, 0, 2.0]]))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"position_m": [0, 0]}, "three finite numbers"),
        ({"rotation": np.diag([1.0, 1.0, 2.0])}, "orthogonal"),
        ({"rotation": np.diag([1.0, 1.0, -1.0])}, "left-handed"),
        ({"sigma_hz_rad": 0.0}, "sigma_hz_rad must be a number above 0, got 0.0"),
        ({"sigma_v_rad": np.nan}, "sigma_v_rad"),
    ],
)
def test_a_station_that_cannot_be_is_refused(given, words):
    with pytest.raises(InputError, match=words):
        Theodolite(**{"position_m": [0, 0, 0], **given})
