"""Where fits of axes go wrong elsewhere: each trap that was heard of, as a test."""

import numpy as np
import pytest

from core.axes import fit_axis
from core.displacement import displacements
from core.errors import AxisUndefined
from core.geometry import angle_between, perpendicular_basis
from tests.benchmarks.axis_efficiency import ROTARY
from tests.benchmarks.simulated_sweeps import DIRECTION, axis_error

SIGMA = 1e-4


def ring(angles, radius=0.3, direction=(0.0, 0.0, 1.0), centre=(0.0, 0.0, 0.0)):
    e1, e2 = perpendicular_basis(np.asarray(direction, dtype=float))
    return np.asarray(centre) + radius * (np.cos(angles)[:, None] * e1 + np.sin(angles)[:, None] * e2)


def noisy(points, seed=0, sigma=SIGMA):
    return points + sigma * np.random.default_rng(seed).normal(size=points.shape)


class TestExactCircles:
    @pytest.mark.parametrize("estimator", ["likelihood", "paper"])
    @pytest.mark.parametrize("centre", [(0.0, 0.0, 0.0), (5.0, -3.0, 2.0)], ids=["centred", "away"])
    @pytest.mark.parametrize("sign", [1.0, -1.0])
    @pytest.mark.parametrize("axis", [0, 1, 2])
    def test_about_each_coordinate_axis(self, axis, sign, centre, estimator):
        direction = sign * np.eye(3)[axis]
        angles = np.linspace(0, 6, 40)
        points = ring(angles, direction=direction, centre=centre)
        for commanded in (None, angles):
            fit = fit_axis(points, estimator=estimator, commanded=commanded)
            np.testing.assert_allclose(fit.line.direction, direction, atol=1e-9)
            np.testing.assert_allclose(fit.line.point_m, centre, atol=1e-9)
            assert fit.rms_axial_m < 1e-9
            assert np.isfinite(fit.covariance).all()

    def test_of_points_that_are_already_centred(self):
        angles = np.linspace(0, 2 * np.pi, 13)[:-1]
        points = ring(angles, direction=[0.6, 0.0, 0.8])
        assert np.abs(points.mean(axis=0)).max() < 1e-15
        fit = fit_axis(points)
        np.testing.assert_allclose(fit.line.direction, [0.6, 0.0, 0.8], atol=1e-9)
        np.testing.assert_allclose(fit.line.point_m, np.zeros(3), atol=1e-9)

    @pytest.mark.parametrize("axis", [0, 1, 2])
    def test_lines_along_each_coordinate_axis(self, axis):
        points = np.outer(np.linspace(-1, 1, 9), np.eye(3)[axis])
        fit = fit_axis(points, sliding=True)
        np.testing.assert_allclose(fit.line.direction, np.eye(3)[axis], atol=1e-12)


class TestWobble:
    def test_out_of_plane_motion_shows_as_axial_residual(self):
        angles = np.linspace(0, 2 * np.pi, 73)[:-1]
        wobble = 0.2e-3 * np.cos(2 * angles)
        points = ring(angles) + wobble[:, None] * np.eye(3)[2]
        # The paper's equations count from the first point, so that its axis leans towards it.
        assert fit_axis(points, estimator="paper").rms_axial_m > 0.1e-3
        fit = fit_axis(points)
        np.testing.assert_allclose(fit.axial_m, wobble, atol=1e-6)
        assert fit.rms_axial_m == pytest.approx(0.2e-3 / np.sqrt(2), rel=1e-3)
        assert fit.rms_radial_m < 1e-6

    def test_in_plane_motion_shows_as_radial_residual(self):
        angles = np.linspace(0, 2 * np.pi, 73)[:-1]
        bulge = 0.2e-3 * np.cos(3 * angles)
        points = ring(angles)
        fit = fit_axis(points * (1 + bulge / 0.3)[:, None])
        np.testing.assert_allclose(fit.radial_m, bulge, atol=1e-6)
        assert fit.rms_axial_m < 1e-9


class TestSense:
    """Which way is positive is for all points to say, not for two of them."""

    @pytest.mark.parametrize("turn", [1.0, -1.0])
    @pytest.mark.parametrize("which", [0, -1, 1])
    def test_gross_errors_of_single_points_do_not_turn_it_round(self, turn, which):
        angles = turn * np.linspace(0, 1.2, 20)
        wrong = angles.copy()
        wrong[which] += turn * (1.8 if which == 0 else -1.8)
        fit = fit_axis(noisy(ring(wrong)))
        assert fit.line.direction[2] * turn > 0.99

    @pytest.mark.parametrize("turn", [1.0, -1.0])
    def test_nor_do_outliers_off_the_circle(self, turn):
        angles = turn * np.linspace(0, 1.2, 30)
        points = noisy(ring(angles))
        points[0], points[-1] = points[-1] + [0, 0, 0.01], points[0] - [0, 0, 0.01]
        for commanded in (None, np.abs(angles)):
            fit = fit_axis(points, commanded=commanded, robust=True, reject=True)
            assert fit.line.direction[2] * turn > 0.99

    @pytest.mark.parametrize("turn", [1.0, -1.0])
    def test_a_full_turn_that_ends_where_it_began(self, turn):
        angles = turn * np.linspace(0, 2 * np.pi, 25)
        for commanded in (None, np.abs(angles)):
            assert fit_axis(noisy(ring(angles)), commanded=commanded).line.direction[2] * turn > 0.99

    def test_commands_in_any_order(self):
        rng = np.random.default_rng(1)
        angles = rng.permutation(np.linspace(-1, 1, 15))
        for sign in (1, -1):
            assert fit_axis(noisy(ring(angles)), commanded=sign * angles).line.direction[2] * sign > 0.99

    @pytest.mark.parametrize("sign", [1.0, -1.0])
    def test_sliding_axis_points_where_commands_grow(self, sign):
        ways = np.random.default_rng(2).permutation(np.linspace(0, 0.4, 12))
        points = noisy(np.outer(ways, [0.0, 0.6, 0.8]))
        fit = fit_axis(points, sliding=True, commanded=sign * ways)
        np.testing.assert_allclose(fit.line.direction, sign * np.array([0.0, 0.6, 0.8]), atol=1e-2)


class TestManyTurns:
    @pytest.mark.parametrize("sign", [1.0, -1.0])
    def test_720_degrees_in_steps_of_144(self, sign):
        angles = sign * np.deg2rad(144.0 * np.arange(6))
        points = noisy(ring(angles, direction=DIRECTION, centre=[1.0, 2, 3]), sigma=1e-5)
        commanded = np.abs(angles)
        fit = fit_axis(points, commanded=commanded)
        assert angle_between(fit.line.direction, sign * DIRECTION) < 1e-3
        np.testing.assert_allclose(fit.line.point_m, [1, 2, 3], atol=1e-4)
        found = displacements(fit, points, commanded=commanded)
        np.testing.assert_allclose(found.value, commanded, atol=1e-3)

    def test_steps_of_more_than_half_a_turn(self):
        angles = np.deg2rad(216.0 * np.arange(8))
        points = noisy(ring(angles), sigma=1e-5)
        fit = fit_axis(points, commanded=angles)
        assert fit.line.direction[2] > 0.99
        np.testing.assert_allclose(displacements(fit, points, commanded=angles).value, angles, atol=1e-3)


class TestUndefined:
    """What cannot be found is refused in a sentence that says why."""

    @pytest.mark.parametrize("sigma_m", [None, SIGMA])
    @pytest.mark.parametrize("estimator", ["likelihood", "paper"])
    def test_collinear_points(self, estimator, sigma_m):
        for points in (
            np.outer(np.arange(8.0), [1.0, 2.0, 3.0]),
            np.outer(np.arange(8.0), [0.1, 0.2, 0.3]) + np.array([7.0, -5.0, 3.0]),
            np.outer(np.arange(8.0), [1.0, 0.0, 0.0]),
        ):
            with pytest.raises(AxisUndefined, match="straight line"):
                fit_axis(points, estimator=estimator, sigma_m=sigma_m)

    @pytest.mark.parametrize("seed", range(40))
    def test_collinear_points_with_noise(self, seed):
        points = noisy(np.outer(np.arange(20.0), [0.01, 0.02, 0.03]), seed)
        for sigma_m in (None, SIGMA):
            with pytest.raises(AxisUndefined, match="straight line"):
                fit_axis(points, sigma_m=sigma_m)

    @pytest.mark.parametrize("sliding", [False, True])
    def test_all_points_at_one_place(self, sliding):
        with pytest.raises(AxisUndefined, match="of one place, no more than their noise: the joint did not move"):
            fit_axis(np.tile([1.0, 2.0, 3.0], (8, 1)), sliding=sliding)

    @pytest.mark.parametrize("count", [6, 20, 100, 400])
    @pytest.mark.parametrize("sliding", [False, True])
    def test_all_points_at_one_place_but_for_noise(self, sliding, count):
        for seed in range(60):
            points = noisy(np.tile([1.0, 2.0, 3.0], (count, 1)), seed)
            with pytest.raises(AxisUndefined, match=r"sits on the axis|straight line|too little for their noise"):
                fit_axis(points, sliding=sliding, sigma_m=SIGMA)

    @pytest.mark.parametrize("seed", range(5))
    def test_a_target_on_the_axis(self, seed):
        points = noisy(ring(np.linspace(0, 6, 40), radius=0.5 * SIGMA), seed)
        with pytest.raises(AxisUndefined, match="sits on the axis"):
            fit_axis(points, sigma_m=SIGMA)

    @pytest.mark.parametrize("seed", range(5))
    def test_a_target_almost_on_the_axis_is_used_with_its_true_uncertainty(self, seed):
        points = noisy(ring(np.linspace(0, 6, 60), radius=0.002, centre=[3.0, 4.0, 1.0]), seed, 2e-5)
        fit = fit_axis(points, sigma_m=2e-5)
        assert np.linalg.norm((fit.line.point_m - [3, 4, 1])[:2]) < 4 * fit.point_std_m
        assert angle_between(fit.line.direction, [0, 0, 1]) < 4 * fit.direction_std_rad
        assert 1e-4 < fit.direction_std_rad < 1e-2

    @pytest.mark.parametrize("estimator", ["likelihood", "paper"])
    def test_four_points_are_enough_and_are_checked(self, estimator):
        points = noisy(ring(np.array([0.0, 0.5, 1.0, 1.5])))
        fit = fit_axis(points, estimator=estimator)
        assert fit.degrees_of_freedom == 2
        assert angle_between(fit.line.direction, [0, 0, 1]) < 0.05
        assert np.isfinite(fit.direction_std_rad)
        with pytest.raises(AxisUndefined, match="3 points are too few"):
            fit_axis(points[:3], estimator=estimator)


class TestGrossErrors:
    @pytest.mark.parametrize("estimator", ["likelihood", "paper"])
    @pytest.mark.parametrize("way", ["axial", "radial"])
    def test_outliers_are_named_and_left_out(self, way, estimator):
        angles = np.linspace(0, 1.6, 40)
        points = noisy(ring(angles))
        clean = fit_axis(np.delete(points, [0, 27], axis=0), sigma_m=SIGMA, estimator=estimator)
        points[[0, 27]] += np.array([0, 0, 2e-3]) if way == "axial" else points[[0, 27]] * (2e-3 / 0.3)
        kept = fit_axis(points, sigma_m=SIGMA, estimator=estimator)
        fit = fit_axis(points, sigma_m=SIGMA, estimator=estimator, reject=True)
        assert kept.used.all()
        assert kept.outliers[[0, 27]].any()
        assert np.flatnonzero(~fit.used).tolist() == [0, 27]
        assert not fit.outliers[fit.used].any()
        assert angle_between(fit.line.direction, clean.line.direction) < 1e-9
        left_out = np.hypot(fit.axial_m, fit.radial_m)[[0, 27]]
        np.testing.assert_allclose(left_out, 2e-3, atol=6e-4)

    def test_hardly_any_honest_point_is_called_an_outlier(self):
        named = 0
        for seed in range(200):
            fit = fit_axis(noisy(ring(np.linspace(0, 1, 25)), seed), reject=True)
            named += int((~fit.used).sum())
        assert named <= 2

    def test_even_where_the_stated_noise_is_wrong(self):
        points = noisy(ring(np.linspace(0, 1.6, 40)))
        points[7] += [0, 0, 2e-3]
        for stated in (SIGMA / 10, SIGMA * 10, None):
            fit = fit_axis(points, sigma_m=stated, reject=True)
            assert np.flatnonzero(~fit.used).tolist() == [7]

    @pytest.mark.parametrize("sliding", [False, True])
    def test_robust_fit_with_a_tenth_of_gross_errors(self, sliding):
        ways = np.linspace(0, 1.6, 50)
        true = np.outer(ways, [0.0, 0.0, 1.0]) if sliding else ring(ways)
        errors = {False: [], True: []}
        for seed in range(30):
            points = noisy(true, seed)
            rng = np.random.default_rng(1000 + seed)
            bad = rng.choice(50, 5, replace=False)
            points[bad] += rng.normal(size=(5, 3)) * 5e-3
            for robust in errors:
                fit = fit_axis(points, sliding=sliding, robust=robust, commanded=ways)
                errors[robust].append(angle_between(fit.line.direction, [0, 0, 1]))
        plain, robust = (np.sqrt(np.mean(np.square(errors[k]))) for k in (False, True))
        assert robust < plain / 4

    def test_robust_fit_of_clean_points_loses_little(self):
        errors = {False: [], True: []}
        for seed in range(100):
            for robust in errors:
                fit = fit_axis(noisy(ring(np.linspace(0, 1.6, 30)), seed), robust=robust)
                errors[robust].append(angle_between(fit.line.direction, [0, 0, 1]))
        plain, robust = (np.sqrt(np.mean(np.square(errors[k]))) for k in (False, True))
        assert robust < 1.1 * plain


class TestNoiseOfEachPoint:
    """Stated covariances are used as they are stated: the errors agree with them, and knowing them helps."""

    def simulate(self, seed, sliding=False):
        rng = np.random.default_rng(seed)
        ways = np.linspace(0.3, 1.4, 16)
        basis = np.vstack([perpendicular_basis(DIRECTION), DIRECTION])
        local = np.stack([np.zeros(16), np.zeros(16), ways], axis=1)
        if not sliding:
            local = 0.4 * np.stack([np.cos(ways), np.sin(ways), np.zeros(16)], axis=1)
        factors = rng.normal(size=(16, 3, 3)) * [1e-4, 2e-5, 3e-4]
        covariance = factors @ factors.swapaxes(1, 2) + 1e-10 * np.eye(3)
        noise = (np.linalg.cholesky(covariance) @ rng.normal(size=(16, 3, 1)))[:, :, 0]
        return np.array([-3.1, 4.4, 0.2]) + local @ basis + noise, covariance

    @pytest.mark.parametrize("estimator", ["likelihood", "paper"])
    @pytest.mark.parametrize("sliding", [False, True])
    def test_covariance_of_the_axis_is_consistent(self, sliding, estimator):
        sweeps, squares = 400, []
        for seed in range(sweeps):
            points, covariance = self.simulate(seed, sliding)
            fit = fit_axis(points, sliding=sliding, estimator=estimator, covariance_m2=covariance)
            error = axis_error(fit.basis, fit.line.point_m, fit.line.direction, sliding)
            squares.append(error @ np.linalg.solve(fit.covariance, error))
        freedom = 2 if sliding else 4
        assert np.mean(squares) == pytest.approx(freedom, abs=2.576 * np.sqrt(2 * freedom / sweeps))

    @pytest.mark.parametrize("sliding", [False, True])
    def test_knowing_it_helps(self, sliding):
        errors = {False: [], True: []}
        for seed in range(100):
            points, covariance = self.simulate(seed, sliding)
            for known in errors:
                fit = fit_axis(points, sliding=sliding, covariance_m2=covariance if known else None)
                errors[known].append(angle_between(fit.line.direction, DIRECTION))
        assert np.mean(np.square(errors[True])) < 0.5 * np.mean(np.square(errors[False]))

    def test_equal_noise_of_all_coordinates_is_the_same_however_it_is_stated(self):
        points = noisy(ring(np.linspace(0, 1, 12)))
        one = fit_axis(points, sigma_m=2e-4)
        other = fit_axis(points, covariance_m2=np.tile(4e-8 * np.eye(3), (12, 1, 1)))
        np.testing.assert_allclose(other.covariance, one.covariance, rtol=1e-9)

    def test_shared_stops_of_two_targets_improve_the_axis_and_stay_consistent(self):
        scene, rng, squares, stated = ROTARY[5], np.random.default_rng(9), [], []
        assert scene.shared
        for _ in range(300):
            points = scene.points_m + rng.normal(size=scene.points_m.shape) * scene.sigmas_m[:, None]
            alone = fit_axis(points, target=scene.target, sigma_m=scene.sigmas_m)
            fit = fit_axis(points, target=scene.target, stop=scene.stop, sigma_m=scene.sigmas_m)
            error = axis_error(fit.basis, fit.line.point_m, fit.line.direction)
            squares.append(error @ np.linalg.solve(fit.covariance, error))
            stated.append(fit.point_std_m / alone.point_std_m)
        assert np.mean(squares) == pytest.approx(4, abs=2.576 * np.sqrt(8 / 300))
        assert max(stated) < 0.8


def test_a_million_points():
    angles = np.linspace(0.3, 1.9, 1_000_000)
    points = noisy(ring(angles, direction=DIRECTION, centre=[2.0, -1.0, 0.4]))
    fit = fit_axis(points, sigma_m=SIGMA)
    assert angle_between(fit.line.direction, DIRECTION) < 4 * fit.direction_std_rad
    assert fit.direction_std_rad < 5e-6
    assert len(fit.axial_m) == 1_000_000
