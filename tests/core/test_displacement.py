"""Displacements of joints: signs, turns, means over targets, and how the axis' own errors enter."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_arms import SEEDS, random_line

from core.axes import fit_axis
from core.displacement import displacements
from core.errors import InputError
from core.geometry import Line, apply, joint_motion

SIGMA = 1e-4


def sweep(line, displacement, places, sliding=False):
    """Targets (t, 3) carried by a joint: points (t * stops, 3), targets, stops."""
    motions = joint_motion(line, displacement, sliding)
    points = np.concatenate([apply(motions, np.tile(place, (len(displacement), 1))) for place in places])
    return (
        points,
        np.repeat(np.arange(len(places)), len(displacement)),
        np.tile(np.arange(len(displacement)), len(places)),
    )


def off_axis(line, rng):
    place = rng.normal(size=3)
    return place + 0.5 * np.cross(line.direction, place - line.point_m) / 2


@pytest.mark.parametrize("sliding", [False, True])
class TestExactPoints:
    @given(seed=SEEDS, sign=st.sampled_from([1.0, -1.0]))
    @settings(max_examples=30)
    def test_motion_in_the_sense_of_command_is_positive(self, sliding, seed, sign):
        rng = np.random.default_rng(seed)
        line, true = random_line(rng), sign * np.linspace(0, 1.4, 9)
        points, target, stop = sweep(line, true, [off_axis(line, rng), off_axis(line, rng)], sliding)
        commanded = np.abs(true)
        fit = fit_axis(points, sliding=sliding, target=target, stop=stop, commanded=commanded[stop])
        found = displacements(fit, points, stop=stop, target=target, commanded=commanded)
        np.testing.assert_allclose(found.value, commanded, atol=1e-7)

    @given(seed=SEEDS)
    @settings(max_examples=30)
    def test_against_the_commands_it_is_negative(self, sliding, seed):
        # The sense is settled by the whole sweep; one step back within it keeps its sign.
        rng = np.random.default_rng(seed)
        true = np.array([0.0, 0.3, 0.2, 0.5, 0.9, 0.8])
        line = random_line(rng)
        points, _, _ = sweep(line, true, [off_axis(line, rng)], sliding)
        for commanded in (true, None):
            fit = fit_axis(points, sliding=sliding, commanded=commanded)
            np.testing.assert_allclose(displacements(fit, points, commanded=commanded).value, true, atol=1e-7)

    @given(seed=SEEDS)
    @settings(max_examples=20)
    def test_it_counts_from_the_first_stop(self, sliding, seed):
        rng = np.random.default_rng(seed)
        line = random_line(rng)
        points, _, _ = sweep(line, np.linspace(-0.7, 0.7, 8), [off_axis(line, rng)], sliding)
        found = displacements(fit_axis(points, sliding=sliding), points)
        np.testing.assert_allclose(found.value, np.linspace(0, 1.4, 8), atol=1e-7)


class TestTurns:
    LINE = Line(np.array([1.0, 2.0, 3.0]), np.array([0.3, -0.5, 0.8]))

    def found(self, true, commanded):
        points, _, _ = sweep(self.LINE, true, [np.array([1.4, 2.0, 3.2])])
        fit = fit_axis(points, commanded=commanded)
        return displacements(fit, points, commanded=commanded).value

    def test_beyond_90_and_180_degrees_without_commands(self):
        true = np.linspace(0, 5.5, 24)
        np.testing.assert_allclose(self.found(true, None), true, atol=1e-9)

    def test_several_turns_without_commands(self):
        true = np.linspace(0, 15.0, 30)
        np.testing.assert_allclose(self.found(true, None), true, atol=1e-9)

    def test_720_degrees_in_steps_of_144(self):
        true = np.deg2rad(144.0 * np.arange(6))
        np.testing.assert_allclose(self.found(true, true), true, atol=1e-9)

    def test_commands_tell_turns_where_the_drive_is_far_off(self):
        commanded = np.deg2rad(200.0 * np.arange(9))
        true = commanded + 0.3 * np.sin(commanded) + 1.1
        np.testing.assert_allclose(self.found(true, commanded), true - true[0], atol=1e-9)

    def test_forth_and_back(self):
        true = np.concatenate([np.linspace(0, 4, 12), np.linspace(4, 0.1, 12)])
        for commanded in (None, true):
            np.testing.assert_allclose(self.found(true, commanded), true, atol=1e-9)


class TestNoise:
    """What is said of the displacements' uncertainty."""

    LINE = Line(np.zeros(3), np.array([0.0, 0.0, 1.0]))
    TRUE = np.linspace(0, 1.5, 12)
    PLACES = (np.array([0.5, 0.0, 0.1]), np.array([0.0, 0.2, -0.1]))

    @pytest.mark.parametrize("sliding", [False, True])
    def test_stated_scatter_is_right(self, sliding):
        points, target, stop = sweep(self.LINE, self.TRUE, self.PLACES, sliding)
        exact = fit_axis(points, sliding=sliding, target=target, stop=stop, sigma_m=SIGMA, commanded=self.TRUE[stop])
        rng, errors = np.random.default_rng(1), []
        for _ in range(400):
            noise = SIGMA * rng.normal(size=points.shape)
            found = displacements(exact, points + noise, stop=stop, target=target, commanded=self.TRUE)
            errors.append(found.value - found.value.mean() - (self.TRUE - self.TRUE.mean()))
        # The free start of the sweep takes one stop's worth of scatter away.
        expected = np.mean(found.std**2) * (1 - 1 / len(self.TRUE))
        assert np.mean(np.square(errors)) == pytest.approx(expected, rel=0.06)
        far, near = 0.5, 0.2
        if sliding:
            np.testing.assert_allclose(found.std, SIGMA / np.sqrt(2), rtol=1e-9)
        else:
            np.testing.assert_allclose(found.std, SIGMA / np.hypot(far, near), rtol=1e-3)

    @pytest.mark.parametrize(
        ("sliding", "change"), [(False, 0), (False, 1), (False, 2), (False, 3), (True, 0), (True, 1)]
    )
    def test_axis_effect_is_the_derivative_by_tilts_and_shifts(self, sliding, change):
        rng = np.random.default_rng(3)
        line = random_line(rng)
        places = [off_axis(line, rng), off_axis(line, rng)]
        points, target, stop = sweep(line, self.TRUE, places, sliding)
        fit = fit_axis(points, sliding=sliding, target=target, stop=stop, sigma_m=SIGMA, commanded=self.TRUE[stop])
        effect = displacements(fit, points, stop=stop, target=target, commanded=self.TRUE).axis_effect[:, change]
        values = []
        for step in (1e-6, -1e-6):
            tilt, shift = np.zeros(2), np.zeros(2)
            (tilt if change < 2 else shift)[change % 2] = step
            direction = fit.line.direction + tilt @ fit.basis
            direction /= np.linalg.norm(direction)
            e1 = fit.basis[0] - direction * (fit.basis[0] @ direction)
            e1 /= np.linalg.norm(e1)
            moved = replace(
                fit,
                line=Line(fit.line.point_m + shift @ fit.basis, direction),
                basis=np.stack([e1, np.cross(direction, e1)]),
            )
            values.append(displacements(moved, points, stop=stop, target=target, commanded=self.TRUE).value)
        slope = (values[0] - values[1]) / 2e-6
        # Each target counts from a start of its own; its effect on all stops alike is free.
        np.testing.assert_allclose(slope - slope[0], effect - effect[0], atol=1e-6)

    def test_a_point_that_is_left_out_is_not_used(self):
        points, _, _ = sweep(self.LINE, self.TRUE, self.PLACES[:1])
        points = points + SIGMA * np.random.default_rng(2).normal(size=points.shape)
        points[5] += [0, 0, 0.01]
        fit = fit_axis(points, reject=True)
        found = displacements(fit, points)
        assert np.flatnonzero(np.isnan(found.value)).tolist() == [5]
        assert np.isnan(found.std[5])
        np.testing.assert_allclose(np.delete(found.value, 5), np.delete(self.TRUE, 5), atol=2e-3)

    def test_targets_that_miss_stops_still_share_the_displacement(self):
        points, target, stop = sweep(self.LINE, self.TRUE, self.PLACES)
        seen = np.ones(len(points), dtype=bool)
        seen[[2, 3, 17, 20]] = False
        points, target, stop = points[seen], target[seen], stop[seen]
        fit = fit_axis(points, target=target, stop=stop)
        found = displacements(fit, points, stop=stop, target=target, commanded=self.TRUE)
        np.testing.assert_allclose(found.value, self.TRUE, atol=1e-9)

    def test_stops_at_the_end_that_no_point_was_seen_at_are_there_without_a_value(self):
        points, target, stop = sweep(self.LINE, self.TRUE, self.PLACES[:1])
        fit = fit_axis(points[:-2], target=target[:-2], stop=stop[:-2])
        found = displacements(fit, points[:-2], stop=stop[:-2], target=target[:-2], commanded=self.TRUE)
        assert found.value.shape == found.std.shape == self.TRUE.shape
        assert found.axis_effect.shape == (len(self.TRUE), 4)
        assert np.flatnonzero(np.isnan(found.value)).tolist() == [len(self.TRUE) - 2, len(self.TRUE) - 1]
        np.testing.assert_allclose(found.value[:-2], self.TRUE[:-2], atol=1e-9)


def test_shapes_that_do_not_fit_are_refused():
    points, _, _ = sweep(Line(np.zeros(3), np.eye(3)[2]), np.linspace(0, 1, 6), [np.array([0.3, 0, 0])])
    fit = fit_axis(points)
    with pytest.raises(InputError, match="5 points need as many stops, targets and fitted points"):
        displacements(fit, points[:5])
    with pytest.raises(InputError, match="6 points need as many"):
        displacements(fit, points, stop=np.arange(5))
    with pytest.raises(InputError, match="stop 5 has no command"):
        displacements(fit, points, commanded=np.linspace(0, 1, 5))
