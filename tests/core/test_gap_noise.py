"""The noise: its scale from repeats within its own spread, whatever its tails; outliers, tails, memory."""

from functools import cache

import numpy as np
import pytest
from gap_arms import ARMS, Day, day
from gap_cells import SIGMA_M, crane_cell, measured
from numpy.random import Generator

from core.gap.analysis import analyse
from core.gap.doings import Doings, doings
from core.gap.noise_found import (
    HEAVY,
    OUTLYING,
    TAILS,
    memory,
    repeats,
    robust_variance,
    student_weights,
    tail_degrees,
)
from core.gap.observations import observe
from core.geometry import Array


@cache
def told() -> Doings:
    """Poses visited five times, in five rounds."""
    return doings(day(ARMS["phi"](1), 1, Day(arc=25, poses=40, visits=5)).seen)


def autoregressive(rng: Generator, m: int, correlation: float) -> Array:
    out = rng.normal(size=(m, 3))
    for k in range(1, m):
        out[k] = correlation * out[k - 1] + np.sqrt(1 - correlation**2) * out[k]
    return out


def everywhere() -> np.ndarray:
    return np.ones(told().count, dtype=bool)


class TestRepeats:
    @pytest.mark.parametrize("scale", [0.5, 1.0, 2.0])
    def test_scale_within_its_spread(self, scale: float) -> None:
        """What configurations add to every visit alike does not count. 4 standard deviations of a mean of squares."""
        rng = np.random.default_rng(1)
        systematic = np.sin(3 * told().active[:, :3]) * 50
        found = repeats(told(), systematic + scale * rng.normal(size=(told().count, 3)), everywhere(), near=False)
        assert found is not None
        # The first pose of the first round alone is reached from elsewhere.
        assert found.pairs == 159
        # Pairs of neighbours among five visits share points: spread of about 1.5 times that of independent ones.
        assert found.variance / scale**2 == pytest.approx(1.0, abs=4 * 1.5 * np.sqrt(2 / found.freedom))

    def test_it_is_right_on_average(self) -> None:
        rng = np.random.default_rng(2)
        found = [repeats(told(), rng.normal(size=(told().count, 3)), everywhere(), False).variance for _ in range(40)]
        assert np.mean(found) == pytest.approx(1.0, abs=4 * np.std(found) / np.sqrt(40))
        assert np.std(found) == pytest.approx(np.sqrt(2 / 480) * np.sqrt(1.25), rel=0.5)

    def test_outliers_hardly_count(self) -> None:
        """One point in a hundred astray by fifteen standard deviations, which triples a plain variance.

        Each is in two pairs at most, and counts as nine variances at most.
        """
        noise = np.random.default_rng(3).normal(size=(told().count, 3))
        clean = repeats(told(), noise, everywhere(), near=False)
        noise[::100] += 15.0
        found = repeats(told(), noise, everywhere(), near=False)
        assert np.var(noise) > 3.0
        assert clean.variance < found.variance < clean.variance * 1.35

    def test_heavy_tails_give_the_scale_of_the_middle(self) -> None:
        """Student with 3 degrees of freedom has variance 3; most points lie closer than that."""
        rng = np.random.default_rng(4)
        found = repeats(told(), rng.standard_t(3, size=(told().count, 3)), everywhere(), near=False)
        assert 1.2 < found.variance < 3.0

    def test_points_that_may_not_be_asked_are_not(self) -> None:
        noise = np.random.default_rng(5).normal(size=(told().count, 3))
        usable = np.arange(told().count) % 3 > 0
        noise[~usable] = 1e6
        found = repeats(told(), noise, usable, near=False)
        assert found.variance == pytest.approx(1.0, abs=0.4)

    def test_other_senses_payloads_or_targets_are_no_repeats(self) -> None:
        """Arcs go there and back: each place is reached twice, in two senses."""
        sim = day(ARMS["phi"](2), 2, Day(arc=30, poses=3, shots=5))
        one = doings(sim.seen)
        assert one.past.complete
        split = np.where(one.sense > 0, 5.0, 0.0)[:, :1] * np.ones(3)
        strict = repeats(one, split, np.ones(one.count, dtype=bool), near=False)
        # Too few in one sense: then any sense will do, and the loss between them counts.
        assert strict is None or strict.variance > 1.0

    def test_shots_of_one_standstill_are_no_repeats(self) -> None:
        sim = day(ARMS["phi"](3), 3, Day(arc=3, poses=40, shots=12))
        one = doings(sim.seen)
        assert repeats(one, np.zeros((one.count, 3)), np.ones(one.count, dtype=bool), near=False) is None

    def test_near_ones_alone_while_time_may_move_things(self) -> None:
        one = doings(day(ARMS["phi"](2), 2, Day(arc=25, poses=80, visits=3)).seen)
        drift = np.linspace(0, 100, one.count)[:, None] * np.ones(3)
        usable = np.ones(one.count, dtype=bool)
        assert repeats(one, drift, usable, near=False).variance > 50
        assert repeats(one, drift, usable, near=True) is None
        assert repeats(told(), np.ones((told().count, 3)), everywhere(), near=True).pairs == 159

    def test_memory_makes_near_repeats_alike(self) -> None:
        """Rounds of forty poses apart: correlated noise has forgotten, the scale is right."""
        noise = autoregressive(np.random.default_rng(7), told().count, 0.7)
        found = repeats(told(), noise, everywhere(), near=False)
        assert found.variance == pytest.approx(1.0, abs=0.35)
        assert found.lag == pytest.approx(40, abs=1)

    def test_too_few_are_none(self) -> None:
        usable = np.zeros(told().count, dtype=bool)
        usable[:50] = True
        assert repeats(told(), np.ones((told().count, 3)), usable, near=False) is None


class TestScale:
    def test_normal_values(self) -> None:
        values = 2.5 * np.random.default_rng(1).normal(size=(2000, 3))
        assert robust_variance(values) == pytest.approx(6.25, rel=4 * np.sqrt(2.5 / 6000))

    def test_a_few_wild_values(self) -> None:
        """3 % of them: each counts as a clipped one, nine variances at most."""
        values = np.random.default_rng(2).normal(size=(2000, 3))
        values[:60] *= 1e6
        assert 1.2 < robust_variance(values) < 1.45

    def test_nothing_but_zeros(self) -> None:
        assert robust_variance(np.zeros((5, 3))) < 1e-100


class TestTails:
    @pytest.mark.parametrize("degrees", [3.0, 5.0])
    def test_degrees_of_freedom_of_a_student_distribution(self, degrees: float) -> None:
        rng = np.random.default_rng(1)
        values = rng.normal(size=(1500, 3)) / np.sqrt(rng.chisquare(degrees, (1500, 1)) / degrees)
        found = tail_degrees(7.0 * values)
        assert abs(TAILS.index(found) - TAILS.index(degrees)) <= 1

    def test_normal_noise_is_normal(self) -> None:
        found = [tail_degrees(np.random.default_rng(seed).normal(size=(800, 3))) for seed in range(30)]
        assert np.mean(np.isinf(found)) >= 0.8
        assert min(found) > HEAVY

    def test_weights_turn_down_what_is_far_off(self) -> None:
        rng = np.random.default_rng(2)
        values = rng.standard_t(3, size=(500, 3))
        weight = student_weights(values, 3.0)
        far = np.argsort(np.linalg.norm(values, axis=1))
        assert np.all(np.diff(weight[far]) <= 1e-12)
        assert weight[far[-1]] < 0.3
        np.testing.assert_array_equal(student_weights(values, np.inf), 1.0)


class TestMemory:
    @pytest.mark.parametrize("correlation", [0.3, 0.7])
    def test_correlation_of_neighbours(self, correlation: float) -> None:
        found = [
            memory(told(), autoregressive(np.random.default_rng(seed), told().count, correlation), everywhere())
            for seed in range(10)
        ]
        assert np.mean(found) == pytest.approx(correlation, abs=0.08)

    def test_none_where_there_is_none(self) -> None:
        found = [
            memory(told(), np.random.default_rng(s).normal(size=(told().count, 3)), everywhere()) for s in range(40)
        ]
        assert np.mean(np.array(found) == 0) >= 0.95

    def test_an_error_that_follows_the_arc_is_no_memory(self) -> None:
        """Points of an arc have neighbours that are alike because the joint is; poses are asked."""
        smooth = np.where(told().seen.swept[:, None], 5.0, 0.0) * np.ones(3)
        noise = np.random.default_rng(1).normal(size=smooth.shape)
        assert memory(told(), noise + smooth, everywhere()) == 0

    def test_a_few_points_have_none(self) -> None:
        usable = np.arange(told().count) < 15
        assert memory(told(), np.ones((told().count, 3)), usable) == 0


def test_outliers_are_far_beyond_what_normal_noise_does() -> None:
    rng = np.random.default_rng(3)
    worst = np.abs(rng.normal(size=(20_000, 3))).max()
    assert worst < OUTLYING


def test_what_a_fit_misses_everywhere_makes_no_outliers() -> None:
    """Over points that were not searched: three hundred times the noise at all of them, ten times that at one."""
    analysis = analyse(observe(measured(crane_cell())))
    seen = analysis.sim.seen
    left_m = np.random.default_rng(3).normal(0.0, 300 * SIGMA_M, (seen.count, 3))
    left_m[17] = 3000 * SIGMA_M
    noise = analysis.noise.over(seen, left_m)
    assert noise.outliers.tolist() == [17]
    assert np.count_nonzero(noise.weight) == seen.count - 1
