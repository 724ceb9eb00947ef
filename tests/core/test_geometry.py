"""Rigid motions and lines: by property, and against scipy."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_arms import SEEDS, random_line, random_motion
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from core.geometry import (
    Line,
    angle_between,
    apply,
    common_normal,
    invert,
    joint_motion,
    line_distance,
    perpendicular_basis,
    rigid_fit,
    rotation_about,
    skew,
    transform,
    wrap_angle,
)

ANGLES = st.floats(-20, 20)


class TestRotations:
    @given(SEEDS, ANGLES)
    def test_rotation_is_scipys(self, seed, angle):
        direction = random_line(np.random.default_rng(seed)).direction
        expected = Rotation.from_rotvec(angle * direction).as_matrix()
        np.testing.assert_allclose(rotation_about(direction, angle), expected, atol=1e-14)

    def test_it_is_right_handed(self):
        np.testing.assert_allclose(rotation_about([0, 0, 1], np.pi / 2) @ [1, 0, 0], [0, 1, 0], atol=1e-15)

    def test_many_angles_at_once(self):
        angles = np.linspace(-4, 4, 12).reshape(3, 4)
        many = rotation_about([0.6, 0.0, 0.8], angles)
        assert many.shape == (3, 4, 3, 3)
        np.testing.assert_allclose(many[2, 1], rotation_about([0.6, 0.0, 0.8], angles[2, 1]))

    @given(SEEDS)
    def test_skew_is_the_cross_product(self, seed):
        a, b = np.random.default_rng(seed).normal(size=(2, 3))
        np.testing.assert_allclose(skew(a) @ b, np.cross(a, b), atol=1e-14)

    @given(st.floats(-1e4, 1e4))
    def test_wrapped_angles_are_the_same_and_in_range(self, angle):
        wrapped = wrap_angle(angle)
        assert -np.pi <= wrapped < np.pi
        assert np.exp(1j * wrapped) == pytest.approx(np.exp(1j * angle), abs=1e-9)

    @pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-7, 1.0, np.pi - 1e-7, np.pi])
    def test_angle_between_is_exact_near_0_and_pi(self, angle):
        u, v = np.array([2.0, 0.0, 0.0]), 3.0 * np.array([np.cos(angle), np.sin(angle), 0.0])
        assert angle_between(u, v) == pytest.approx(angle, rel=1e-9, abs=1e-15)


class TestMotions:
    @given(SEEDS)
    def test_inverse(self, seed):
        rng = np.random.default_rng(seed)
        many = np.stack([random_motion(rng) for _ in range(3)])
        np.testing.assert_allclose(invert(many), np.linalg.inv(many), atol=1e-12)

    @given(SEEDS)
    def test_applying_two_motions_is_applying_their_product(self, seed):
        rng = np.random.default_rng(seed)
        first, second, points = random_motion(rng), random_motion(rng), rng.normal(size=(5, 3))
        np.testing.assert_allclose(apply(second, apply(first, points)), apply(second @ first, points), atol=1e-12)

    @given(SEEDS, ANGLES)
    def test_a_turn_leaves_its_axis_and_the_distance_from_it_alone(self, seed, angle):
        rng = np.random.default_rng(seed)
        line, points = random_line(rng), rng.normal(size=(4, 3))
        motion = joint_motion(line, angle, sliding=False)
        on_axis = line.point_m + rng.normal(size=(3, 1)) * line.direction
        np.testing.assert_allclose(apply(motion, on_axis), on_axis, atol=1e-12)
        for point in points:
            moved = apply(motion, point)
            foot = line.foot_of(point)
            np.testing.assert_allclose(line.foot_of(moved), foot, atol=1e-12)
            expected = Rotation.from_rotvec(angle * line.direction).apply(point - foot)
            np.testing.assert_allclose(moved - foot, expected, atol=1e-12)

    def test_a_slide_moves_along_the_direction_only(self):
        line = Line(np.array([5.0, 6.0, 7.0]), np.array([0.0, 3.0, 4.0]))
        motions = joint_motion(line, np.array([0.0, 0.5]), sliding=True)
        np.testing.assert_allclose(apply(motions, [[1.0, 2, 3], [1, 2, 3]]), [[1, 2, 3], [1, 2.3, 3.4]], atol=1e-15)

    @given(SEEDS)
    def test_rigid_fit_finds_the_motion_under_any_weights(self, seed):
        rng = np.random.default_rng(seed)
        motion, points = random_motion(rng), rng.normal(size=(4, 3))
        fit = rigid_fit(points, apply(motion, points), rng.uniform(0.1, 3.0, 4))
        np.testing.assert_allclose(fit, motion, atol=1e-9)

    def test_rigid_fit_of_a_mirror_image_is_still_a_rotation(self):
        points = np.random.default_rng(1).normal(size=(6, 3))
        fit = rigid_fit(points, points * [1, 1, -1])
        assert np.linalg.det(fit[:3, :3]) == pytest.approx(1.0)

    def test_rigid_fit_is_the_least_weighted_sum_of_squares(self):
        rng = np.random.default_rng(2)
        a, weights = rng.normal(size=(7, 3)), rng.uniform(0.2, 3, 7)
        b = apply(random_motion(rng), a) + 0.1 * rng.normal(size=a.shape)

        def cost(x: np.ndarray) -> float:
            moved = apply(transform(Rotation.from_rotvec(x[:3]).as_matrix(), x[3:]), a)
            return float(weights @ np.sum((moved - b) ** 2, axis=1))

        found = rigid_fit(a, b, weights)
        here = np.concatenate([Rotation.from_matrix(found[:3, :3]).as_rotvec(), found[:3, 3]])
        assert cost(here) <= minimize(cost, here + 0.02 * rng.normal(size=6), method="BFGS").fun * (1 + 1e-9)


class TestBasis:
    @given(SEEDS)
    def test_right_handed_and_normal(self, seed):
        direction = random_line(np.random.default_rng(seed)).direction
        e1, e2 = perpendicular_basis(direction)
        np.testing.assert_allclose(np.cross(e1, e2), direction, atol=1e-14)
        np.testing.assert_allclose(
            np.stack([e1, e2, direction]) @ np.stack([e1, e2, direction]).T, np.eye(3), atol=1e-14
        )

    @pytest.mark.parametrize("direction", [*np.eye(3), *-np.eye(3), [0.0, 1e-9, -1.0]])
    def test_along_coordinate_axes(self, direction):
        direction = np.array(direction) / np.linalg.norm(direction)
        e1, e2 = perpendicular_basis(direction)
        np.testing.assert_allclose(np.cross(e1, e2), direction, atol=1e-14)

    @pytest.mark.parametrize("z", [1e-9, -1e-9])
    def test_it_is_smooth_on_either_side_of_the_equator(self, z):
        step = 1e-7
        one = np.array([0.6, 0.8, z])
        other = one + np.array([step, -0.75 * step, 0.0])
        moved = np.array(perpendicular_basis(other / np.linalg.norm(other))) - perpendicular_basis(
            one / np.linalg.norm(one)
        )
        assert np.abs(moved).max() < 4 * step


class TestLines:
    @given(SEEDS)
    def test_common_normal_joins_the_nearest_points(self, seed):
        rng = np.random.default_rng(seed)
        first, second = random_line(rng), random_line(rng)
        foot_1, foot_2 = common_normal(first, second)
        between = foot_2 - foot_1
        scale = 1 / np.linalg.norm(np.cross(first.direction, second.direction)) ** 2
        assert abs(between @ first.direction) < 1e-12 * scale
        assert abs(between @ second.direction) < 1e-12 * scale
        np.testing.assert_allclose(first.foot_of(foot_1), foot_1, atol=1e-12 * scale)
        np.testing.assert_allclose(second.foot_of(foot_2), foot_2, atol=1e-12 * scale)
        assert line_distance(first, second) == pytest.approx(np.linalg.norm(between), abs=1e-9 * scale)

    def test_parallel_lines_have_no_normal_but_a_distance(self):
        first, second = Line(np.zeros(3), np.array([0, 0, 1.0])), Line(np.array([3.0, 4, 9]), np.array([0, 0, -2.0]))
        with pytest.raises(ValueError, match="parallel lines"):
            common_normal(first, second)
        assert line_distance(first, second) == pytest.approx(5.0)

    @given(SEEDS)
    @settings(max_examples=30)
    def test_moved_line_holds_the_moved_points(self, seed):
        rng = np.random.default_rng(seed)
        line, motion = random_line(rng), random_motion(rng)
        moved = line.moved(motion)
        point = apply(motion, line.point_m + 0.7 * line.direction)
        np.testing.assert_allclose(moved.point_m + 0.7 * moved.direction, point, atol=1e-12)

    def test_direction_is_made_a_unit_vector(self):
        np.testing.assert_allclose(Line(np.zeros(3), np.array([0.0, 3.0, 4.0])).direction, [0, 0.6, 0.8])

    @pytest.mark.parametrize(
        ("point", "direction"), [(np.zeros(2), np.ones(3)), (np.zeros(3), np.zeros(3)), ([0, np.nan, 0], np.ones(3))]
    )
    def test_impossible_lines_are_refused(self, point, direction):
        with pytest.raises(ValueError, match="a line needs"):
            Line(point, direction)
