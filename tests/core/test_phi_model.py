"""The phi-model: its transforms against products written out by hand, its parameters from axes, its derivatives."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from random_arms import SEEDS, convention_of, random_model, random_motion

from core.errors import RobotError
from core.geometry import Line, angle_between, invert
from core.phi_convention import convention_for
from core.phi_model import (
    PARAMETERS,
    PhiModel,
    axes,
    frames,
    from_axes,
    joint_twists,
    moved_axes,
    near,
    parameter_twists,
)
from core.phi_transforms import link_transform, phi_transform, tool_transform
from core.twin import scara

TURNING = [(False,) * n for n in (2, 3, 6)]
WITH_SLIDES = [
    (False, True, False),
    (False, False, True, False, False),
    (False, False, False, True, False, False),
    (False, False, True, True, False),
    (False, False, False, True),
]


def rot_z(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def rot_x(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]])


def shift(x=0.0, y=0.0, z=0.0):
    out = np.eye(4)
    out[:3, 3] = x, y, z
    return out


def phi_frame_by_hand(u, d):
    """Equation A2 as it is printed."""
    return np.array([[-np.sin(u), 0, np.cos(u), 0], [np.cos(u), 0, np.sin(u), 0], [0, 1, 0, d], [0, 0, 0, 1.0]])


class TestTransforms:
    @given(*[st.floats(-4, 4)] * 6)
    def test_equations_a2_and_a3(self, a, b, alpha, theta, gamma, h):
        link = shift(z=a) @ rot_z(theta) @ shift(x=b) @ rot_x(alpha)
        np.testing.assert_allclose(link_transform(a, b, alpha, theta), link, atol=1e-13)
        np.testing.assert_allclose(
            tool_transform(a, b, alpha, theta, gamma, h), link @ rot_z(gamma) @ shift(z=h), atol=1e-13
        )
        np.testing.assert_allclose(phi_transform(alpha, h), phi_frame_by_hand(alpha, h), atol=1e-15)

    def test_phi_frame_stands_across_the_joint(self):
        frame = phi_transform(0.7)
        np.testing.assert_allclose(frame[:3, 1], [0, 0, 1], atol=1e-15)
        np.testing.assert_allclose(frame[:3, 2], [np.cos(0.7), np.sin(0.7), 0], atol=1e-15)
        assert np.linalg.det(frame) == pytest.approx(1.0)

    @pytest.mark.parametrize("sliding", [*TURNING, *WITH_SLIDES])
    def test_chain_is_equation_a1_written_out(self, sliding):
        rng = np.random.default_rng(3)
        model, psi = random_model(rng, sliding), rng.normal(size=len(sliding))
        expected = [np.eye(4)]
        for i in range(len(sliding) - 1):
            u, d = (model.phi_rad[i], psi[i]) if sliding[i] else (model.phi_rad[i] + psi[i], 0.0)
            link = shift(z=model.a_m[i]) @ rot_z(model.theta_rad[i]) @ shift(x=model.b_m[i]) @ rot_x(model.alpha_rad[i])
            expected.append(expected[-1] @ phi_frame_by_hand(u, d) @ link)
        np.testing.assert_allclose(frames(model, psi), expected, atol=1e-12)
        many = frames(model, np.stack([np.zeros_like(psi), psi]))
        np.testing.assert_allclose(many[1], expected, atol=1e-12)

    def test_wrong_number_of_parameters_is_refused(self):
        with pytest.raises(RobotError, match="3 joints need 2 values of b_m, got 1"):
            PhiModel(np.zeros(2), np.zeros(2), np.zeros(1), np.zeros(2), np.zeros(2), np.zeros(3, dtype=bool))


class TestFromAxes:
    @pytest.mark.parametrize("sliding", TURNING)
    @given(SEEDS)
    def test_axes_give_the_parameters_back(self, sliding, seed):
        rng = np.random.default_rng(seed)
        model, base = random_model(rng, sliding), random_motion(rng)
        found_base, found = from_axes(axes(model, base), convention_of(model))
        np.testing.assert_allclose(found_base, base, atol=1e-9)
        np.testing.assert_allclose(near(found, model).parameters, model.parameters, atol=1e-9)

    @pytest.mark.parametrize("sliding", WITH_SLIDES)
    @given(SEEDS)
    def test_with_sliding_joints_axes_come_back_and_places_beyond_them_too(self, sliding, seed):
        rng = np.random.default_rng(seed)
        model, base = random_model(rng, sliding), random_motion(rng)
        convention = convention_of(model)
        lines = axes(model, base)
        _steep_enough(lines, convention)
        found_base, found = from_axes(lines, convention)
        assert np.all(found.parameters[convention.sliding[1:], :2] == 0.0)
        for line, again, slides in zip(lines, axes(found, found_base), sliding, strict=True):
            assert angle_between(line.direction, again.direction) < 1e-8
            if not slides:
                np.testing.assert_allclose(again.foot_of(line.point_m), line.point_m, atol=1e-7)

    @pytest.mark.parametrize("sliding", [s for s in WITH_SLIDES if not s[1]])
    @given(SEEDS)
    def test_with_sliding_joints_parameters_come_back(self, sliding, seed):
        rng = np.random.default_rng(seed)
        model, base = random_model(rng, sliding), random_motion(rng)
        found_base, found = from_axes(axes(model, base), convention_of(model))
        np.testing.assert_allclose(found_base, base, atol=1e-9)
        np.testing.assert_allclose(near(found, model).parameters, model.parameters, atol=1e-8)

    @given(SEEDS)
    def test_where_a_line_is_given_on_itself_does_not_matter(self, seed):
        rng = np.random.default_rng(seed)
        model = random_model(rng, (False,) * 5)
        lines = axes(model)
        slid = tuple(Line(line.point_m + rng.normal() * line.direction, line.direction) for line in lines)
        convention = convention_of(model)
        np.testing.assert_allclose(
            from_axes(slid, convention)[1].parameters, from_axes(lines, convention)[1].parameters, atol=1e-9
        )

    def test_z_phi_parallel_to_the_next_axis_is_refused_with_advice(self):
        lines = (
            Line(np.zeros(3), np.array([0, 0, 1.0])),
            Line(np.array([0, 0.4, 0]), np.array([1.0, 0, 0])),
            Line(np.array([0, 0.4, 0.5]), np.array([0.0, 0, 1.0])),
        )
        turning = np.zeros(3, dtype=bool)
        from_axes(lines, convention_for(lines, turning, np.array([np.pi / 2, np.pi / 2])))
        with pytest.raises(RobotError, match="phi_2 makes Z_phi parallel to the axis of joint 3"):
            from_axes(lines, convention_for(lines, turning, np.array([np.pi / 2, 0.0])))
        from_axes(lines, convention_for(lines, turning))

    @given(SEEDS)
    def test_chosen_phi_never_meets_the_singularity(self, seed):
        rng = np.random.default_rng(seed)
        directions = np.concatenate([np.eye(3), -np.eye(3)])[rng.integers(6, size=5)]
        lines = tuple(Line(rng.uniform(-1, 1, 3), d) for d in directions)
        convention = convention_for(lines, np.zeros(5, dtype=bool))
        base, model = from_axes(lines, convention)
        for line, again in zip(lines, axes(model, base), strict=True):
            assert angle_between(line.direction, again.direction) < 1e-9
            np.testing.assert_allclose(again.foot_of(line.point_m), line.point_m, atol=1e-9)

    @given(SEEDS)
    def test_near_changes_angles_by_whole_turns_only(self, seed):
        rng = np.random.default_rng(seed)
        model = random_model(rng, (False,) * 4)
        turns = 2 * np.pi * rng.integers(-2, 3, (2, 3))
        other = PhiModel(
            model.phi_rad, model.a_m, model.b_m, model.alpha_rad + turns[0], model.theta_rad + turns[1], model.sliding
        )
        np.testing.assert_allclose(near(other, model).parameters, model.parameters, atol=1e-12)
        np.testing.assert_allclose(near(model, other).parameters, other.parameters, atol=1e-12)


class TestConvention:
    def test_paper_like_arms_keep_the_rule_of_section_4(self):
        model = random_model(np.random.default_rng(1), (False,) * 6)
        convention = convention_of(model)
        assert (convention.origin_joint, convention.normal_joint, convention.heading_joint) == (0, 1, 1)
        assert convention.is_of_section_4
        assert not convention.heading_is_offset

    def test_parallel_first_axes_take_their_heading_from_each_other(self):
        cell = scara.cell()
        lines = cell.robot.axes_at_zero()
        convention = convention_for(lines, cell.robot.sliding, cell.robot.phi_rad)
        assert convention.heading_is_offset
        assert convention.heading_joint == 1
        base, model = from_axes(lines, convention)
        np.testing.assert_allclose(base, cell.robot.base_transform, atol=1e-12)
        np.testing.assert_allclose(model.a_m, [0.35, 0.0, 0.30], atol=1e-12)
        np.testing.assert_allclose(convention.free, [[1, 0, 1, 1], [0, 0, 1, 1], [1, 1, 1, 1]])

    def test_owner_s_base_frame_settles_the_sign_of_y(self):
        model = random_model(np.random.default_rng(2), (False,) * 3)
        lines = axes(model)
        one, other = (
            from_axes(lines, convention_for(lines, model.sliding, model.phi_rad, y_reference=sign * np.eye(3)[1]))[0]
            for sign in (1, -1)
        )
        np.testing.assert_allclose(one, np.eye(4), atol=1e-9)
        np.testing.assert_allclose(other, np.diag([-1.0, -1.0, 1.0, 1.0]), atol=1e-9)

    @pytest.mark.parametrize(
        ("lines", "sliding", "message"),
        [
            ((Line(np.zeros(3), np.eye(3)[2]),), [False], "at least two joints, got 1"),
            ((Line(np.zeros(3), np.eye(3)[2]), Line(np.zeros(3), np.eye(3)[0])), [True, True], "every joint slides"),
            ((Line(np.zeros(3), np.eye(3)[2]), Line(np.ones(3) * [0, 0, 1], np.eye(3)[2])), [False, False], "one line"),
        ],
    )
    def test_arms_without_a_frame_are_refused(self, lines, sliding, message):
        with pytest.raises(RobotError, match=message):
            convention_for(lines, np.array(sliding))


class TestDerivatives:
    @pytest.mark.parametrize("sliding", [*TURNING, *WITH_SLIDES])
    @settings(max_examples=20)
    @given(SEEDS)
    def test_parameter_twists(self, sliding, seed):
        rng = np.random.default_rng(seed)
        model, base = random_model(rng, sliding), random_motion(rng)
        twists = parameter_twists(model, base)
        zero = np.zeros(len(sliding))
        for i in range(len(sliding) - 1):
            for k, name in enumerate(PARAMETERS):
                ahead, behind = (frames(_with(model, name, i, e), zero, base) for e in (1e-5, -1e-5))
                # A frame before the one that the parameter belongs to stands still.
                np.testing.assert_allclose(ahead[: i + 1], behind[: i + 1], atol=1e-14)
                for frame, after, before in zip(
                    frames(model, zero, base)[i + 1 :], ahead[i + 1 :], behind[i + 1 :], strict=True
                ):
                    found = _twist((after - before) / 2e-5, frame)
                    np.testing.assert_allclose(found, twists[i, k], atol=1e-8)

    @pytest.mark.parametrize("sliding", [*TURNING, *WITH_SLIDES, (True, False, False)])
    @settings(max_examples=20)
    @given(SEEDS)
    def test_joint_twists(self, sliding, seed):
        rng = np.random.default_rng(seed)
        model, base, psi = random_model(rng, sliding), random_motion(rng), rng.normal(size=len(sliding))
        twists = joint_twists(model, psi, base)
        for i in range(len(sliding) - 1):
            step = np.zeros(len(sliding))
            step[i] = 1e-5
            slope = (frames(model, psi + step, base) - frames(model, psi - step, base))[-1] / 2e-5
            np.testing.assert_allclose(_twist(slope, frames(model, psi, base)[-1]), twists[i], atol=1e-8)

    @pytest.mark.parametrize("sliding", [*TURNING, *WITH_SLIDES])
    def test_moved_axes_are_the_axes_of_the_moved_frames(self, sliding):
        rng = np.random.default_rng(8)
        model, base, psi = random_model(rng, sliding), random_motion(rng), rng.normal(size=len(sliding))
        moved = moved_axes(axes(model, base), psi, model.sliding)
        for line, frame in zip(moved, frames(model, psi, base), strict=True):
            np.testing.assert_allclose(line.point_m, frame[:3, 3], atol=1e-12)
            np.testing.assert_allclose(line.direction, frame[:3, 2], atol=1e-12)


def _with(model: PhiModel, name: str, index: int, change: float) -> PhiModel:
    values = {key: getattr(model, key).copy() for key in PARAMETERS}
    values[name][index] += change
    return PhiModel(model.phi_rad, sliding=model.sliding, **values)


def _twist(slope, frame):
    """Angular and linear velocity, the latter of the point that is at the outer frame's origin."""
    velocity = slope @ invert(frame)
    return np.array([velocity[2, 1], velocity[0, 2], velocity[1, 0], *velocity[:3, 3]])


def _steep_enough(lines: tuple[Line, ...], convention) -> None:
    """Leave out arms whose own choice of frames is near a singularity."""
    model = from_axes(lines, convention)[1]
    assume(np.abs(np.sin(model.alpha_rad)).min() > 0.05)
