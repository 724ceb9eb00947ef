"""Fits of joint axes: exact on exact points, indifferent to frame and order, and what they refuse."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_arms import SEEDS, random_line, random_motion

from core.axes import fit_axis
from core.errors import AxisUndefined, InputError
from core.geometry import Line, angle_between, apply, perpendicular_basis

ESTIMATORS = ["likelihood", "paper"]


def arc(line: Line, angles, radius=0.4, height=0.1):
    e1, e2 = perpendicular_basis(line.direction)
    ring = np.cos(angles)[:, None] * e1 + np.sin(angles)[:, None] * e2
    return line.point_m + height * line.direction + radius * ring


def two_arcs(line, angles, noise, rng):
    """Two targets of one link, seen at the same stops: points, targets, stops."""
    points = np.concatenate([arc(line, angles), arc(line, angles + 1.3, 0.25, -0.2)])
    points = points + noise * rng.normal(size=points.shape)
    return points, np.repeat([0, 1], len(angles)), np.tile(np.arange(len(angles)), 2)


def straight(line, ways):
    return line.point_m + ways[:, None] * line.direction


@pytest.mark.parametrize("estimator", ESTIMATORS)
class TestExactPoints:
    @given(SEEDS, st.floats(0.2, 6.0), st.integers(6, 30))
    @settings(max_examples=40)
    def test_rotary_axis_is_found(self, estimator, seed, span, count):
        line = random_line(np.random.default_rng(seed))
        fit = fit_axis(arc(line, np.linspace(0, span, count)), estimator=estimator)
        assert angle_between(fit.line.direction, line.direction) < 1e-7
        np.testing.assert_allclose(line.foot_of(fit.line.point_m), fit.line.point_m, atol=1e-7)
        assert fit.radius_m[0] == pytest.approx(0.4, abs=1e-7)
        assert max(np.abs(fit.axial_m).max(), np.abs(fit.radial_m).max()) < 1e-8

    @given(SEEDS)
    @settings(max_examples=40)
    def test_sliding_axis_is_found(self, estimator, seed):
        line = random_line(np.random.default_rng(seed))
        fit = fit_axis(straight(line, np.linspace(0, 0.5, 8)), sliding=True, estimator=estimator)
        assert angle_between(fit.line.direction, line.direction) < 1e-7
        assert fit.sliding
        assert np.isnan(fit.point_std_m)

    @given(SEEDS)
    @settings(max_examples=30)
    def test_targets_share_the_axis_and_have_circles_of_their_own(self, estimator, seed):
        rng = np.random.default_rng(seed)
        line = random_line(rng)
        points, target, stop = two_arcs(line, np.linspace(0, 1.2, 9), 0.0, rng)
        fit = fit_axis(points, target=target, stop=stop, estimator=estimator)
        assert angle_between(fit.line.direction, line.direction) < 1e-7
        np.testing.assert_allclose(fit.radius_m, [0.4, 0.25], atol=1e-7)
        assert fit.height_m[0] - fit.height_m[1] == pytest.approx(0.3, abs=1e-7)


@pytest.mark.parametrize("estimator", ESTIMATORS)
@pytest.mark.parametrize("sliding", [False, True])
class TestInvariance:
    """Neither the frame nor the order of the points matters; the noise is stated unequal to make it harder."""

    def points(self, rng, sliding):
        line = random_line(rng)
        angles = np.linspace(0, 1.5, 14)
        points = straight(line, angles) if sliding else arc(line, angles)
        sigma = rng.uniform(0.5, 2.0, len(points)) * 1e-4
        return points + sigma[:, None] * rng.normal(size=points.shape), sigma, angles

    @given(seed=SEEDS)
    @settings(max_examples=25)
    def test_a_rigid_motion_carries_the_fit_along(self, sliding, estimator, seed):
        rng = np.random.default_rng(seed)
        points, sigma, _ = self.points(rng, sliding)
        motion = random_motion(rng)
        here = fit_axis(points, sliding=sliding, estimator=estimator, sigma_m=sigma)
        there = fit_axis(apply(motion, points), sliding=sliding, estimator=estimator, sigma_m=sigma)
        moved = here.line.moved(motion)
        share = 1e-3 * here.direction_std_rad
        assert angle_between(moved.direction, there.line.direction) < share
        np.testing.assert_allclose(there.line.point_m, moved.point_m, atol=share)
        assert there.direction_std_rad == pytest.approx(here.direction_std_rad, rel=1e-3)
        np.testing.assert_allclose(there.radius_m, here.radius_m, atol=share)
        np.testing.assert_allclose(there.axial_m, here.axial_m, atol=share)
        if not sliding:
            np.testing.assert_allclose(there.radial_m, here.radial_m, atol=share)
            assert there.point_std_m == pytest.approx(here.point_std_m, rel=1e-3)

    @given(seed=SEEDS)
    @settings(max_examples=25)
    def test_order_of_points(self, sliding, estimator, seed):
        rng = np.random.default_rng(seed)
        points, sigma, commanded = self.points(rng, sliding)
        first = fit_axis(points, sliding=sliding, estimator=estimator, sigma_m=sigma, commanded=commanded)
        order = rng.permutation(len(points))
        if estimator == "paper":
            # Its equations single the first point out.
            order = np.concatenate([[0], order[order != 0]])
        again = fit_axis(
            points[order], sliding=sliding, estimator=estimator, sigma_m=sigma[order], commanded=commanded[order]
        )
        share = 1e-3 * first.direction_std_rad
        assert angle_between(again.line.direction, first.line.direction) < share
        np.testing.assert_allclose(again.line.point_m, first.line.point_m, atol=share)
        np.testing.assert_allclose(again.covariance, first.covariance, rtol=1e-2, atol=1e-4 * first.covariance.max())
        np.testing.assert_allclose(again.radial_m, first.radial_m[order], atol=share)


def test_the_papers_first_point_is_special_and_the_likelihoods_is_not():
    rng = np.random.default_rng(3)
    points = arc(random_line(rng), np.linspace(0, 1, 12)) + 1e-4 * rng.normal(size=(12, 3))
    turned = np.roll(points, 5, axis=0)
    ways = np.arange(12.0), np.roll(np.arange(12.0), 5)
    by = {
        e: [
            fit_axis(p, estimator=e, commanded=0.09 * w).line.direction
            for p, w in zip((points, turned), ways, strict=True)
        ]
        for e in ESTIMATORS
    }
    assert angle_between(*by["likelihood"]) < 1e-8
    assert angle_between(*by["paper"]) > 1e-5


def test_likelihood_is_the_least_sum_of_squares():
    rng = np.random.default_rng(5)
    line = random_line(rng)
    sigma = rng.uniform(0.5, 2, 20) * 1e-3
    points = arc(line, np.linspace(0, 1.5, 20)) + sigma[:, None] * rng.normal(size=(20, 3))
    fit = fit_axis(points, sigma_m=sigma)

    def cost(direction, point, height, radius):
        z = (points - point) @ direction - height
        rho = np.linalg.norm(np.cross(points - point, direction), axis=1) - radius
        return np.sum((z**2 + rho**2) / sigma**2)

    best = cost(fit.line.direction, fit.line.point_m, fit.height_m[0], fit.radius_m[0])
    assert best == pytest.approx(fit.chi_square, rel=1e-9)
    for _ in range(200):
        direction = fit.line.direction + 1e-4 * rng.normal(size=3)
        near = cost(
            direction / np.linalg.norm(direction),
            fit.line.point_m + 1e-5 * rng.normal(size=3),
            fit.height_m[0] + 1e-5 * rng.normal(),
            fit.radius_m[0] + 1e-5 * rng.normal(),
        )
        assert near > best


@pytest.mark.parametrize("estimator", ESTIMATORS)
@pytest.mark.parametrize("sliding", [False, True])
def test_basis_belongs_to_the_direction_whichever_way_it_points(sliding, estimator):
    rng = np.random.default_rng(6)
    line, ways = random_line(rng), np.linspace(0, 1, 10)
    points = straight(line, ways) if sliding else arc(line, ways)
    points = points + 1e-4 * rng.normal(size=points.shape)
    # Noise that is not round couples the tilts.
    factors = 1e-4 * rng.normal(size=(10, 3, 3))
    noise = factors @ factors.swapaxes(1, 2) + 1e-10 * np.eye(3)
    one, other = (
        fit_axis(points, sliding=sliding, estimator=estimator, commanded=s * ways, covariance_m2=noise) for s in (1, -1)
    )
    for fit in (one, other):
        np.testing.assert_allclose(np.cross(*fit.basis), fit.line.direction, atol=1e-12)
    np.testing.assert_allclose(one.line.direction, -other.line.direction, atol=1e-9)
    spreads = [_in_space(fit) for fit in (one, other)]
    np.testing.assert_allclose(spreads[0], spreads[1], rtol=1e-6, atol=1e-9 * np.abs(spreads[0]).max())


def _in_space(fit):
    """Covariance of the axis' closest points at +1 m and -1 m along it: says nothing of bases and senses."""
    sides = (1.0, -1.0) if fit.line.direction[2] > 0 else (-1.0, 1.0)
    if fit.sliding:
        rows = np.concatenate([s * fit.basis.T for s in sides])
    else:
        rows = np.concatenate([np.concatenate([s * fit.basis.T, fit.basis.T], axis=1) for s in sides])
    return rows @ fit.covariance @ rows.T


class TestRefusals:
    POINTS = arc(Line(np.zeros(3), np.eye(3)[2]), np.linspace(0, 1, 6))

    @pytest.mark.parametrize(
        ("changes", "message"),
        [
            ({"estimator": "magic"}, "no axis estimator 'magic'; expected one of likelihood, paper"),
            ({"points_m": np.zeros((6, 2))}, r"points need the shape \(k, 3\), got \(6, 2\)"),
            ({"points_m": np.where(np.arange(18).reshape(6, 3) == 7, np.nan, 1.0)}, r"point 3 is \[.*nan.*\]"),
            ({"target": np.zeros(5)}, r"6 points need 6 target numbers, got an array of shape \(5,\)"),
            ({"stop": np.zeros((6, 1))}, r"6 points need 6 stop numbers"),
            ({"sigma_m": np.ones(4)}, r"6 points need one standard deviation or 6"),
            ({"sigma_m": [1, 1, 0, 1, 1, 1]}, r"the standard deviation of point 3 is 0.0, expected a number > 0"),
            ({"covariance_m2": np.eye(3)}, r"6 points need covariances of shape \(6, 3, 3\), got \(3, 3\)"),
        ],
    )
    def test_wrong_input(self, changes, message):
        with pytest.raises(InputError, match=message):
            fit_axis(**{"points_m": self.POINTS, **changes})

    @pytest.mark.parametrize("count", [0, 1, 2, 3])
    @pytest.mark.parametrize("estimator", ESTIMATORS)
    def test_too_few_points(self, count, estimator):
        with pytest.raises(AxisUndefined, match=f"^{count} points are too few to find a joint axis and check it"):
            fit_axis(self.POINTS[:count], estimator=estimator)

    def test_too_few_points_for_two_targets(self):
        with pytest.raises(AxisUndefined, match="too few"):
            fit_axis(self.POINTS[:4], target=[0, 0, 1, 1])
