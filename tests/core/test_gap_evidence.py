"""Evidence against a dense marginal likelihood, the level of the threshold, and a search for columns that are there."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from gap_arms import ARMS, SIGMA_M, Day, day, measured_at

from core.gap.analysis import null_threshold
from core.gap.doings import doings
from core.gap.effects.candidate import Candidate
from core.gap.evidence import HYPER, SIZES, Chosen, Evidence, joined
from core.gap.gram import Gram
from core.gap.library import candidates
from core.gap.problem import NULL_DRAWS, Problem, pose_problem
from core.gap.products import OfColumns
from core.gap.result import Place
from core.gap.search import search
from core.gap.whitening import whitening

PRIOR = 1e-4
PLACES = (("zero_offset", 2), ("ratio", 3), ("eccentricity", 1), ("compliance", 2), ("axis_wobble", 3), ("backlash", 4))


@cache
def posed(seed: int = 1, noise: float = 1.0) -> Problem:
    """An arm of which nothing but the noise is off, with the whole library."""
    sim = day(ARMS["phi"](seed), seed, Day(arc=7, poses=20))
    m = sim.seen.count
    rng = np.random.default_rng(seed)
    told = doings(sim.seen)
    white = whitening(np.tile(SIGMA_M**2 * np.eye(3), (m, 1, 1)), np.ones(m))
    return pose_problem(sim, told, candidates(told), noise * SIGMA_M * rng.normal(size=(m, 3)), white)


def dense(problem: Problem, prior: float, chosen: Chosen) -> float:
    """Log density of the whitened residuals by one big covariance, up to a constant; placement is free."""
    x = problem.white.rows(problem.design.whole()).reshape(-1, problem.design.count)
    y = problem.white.rows(problem.residual_m).ravel()
    full, _ = np.linalg.qr(x[:, : problem.placement], mode="complete")
    rest = full[:, problem.placement :].T
    geometry = rest @ x[:, problem.placement : problem.nuisance]
    covariance = np.eye(len(rest)) + prior**2 * geometry @ geometry.T
    for group, size in zip(chosen.groups, chosen.sizes, strict=True):
        own = rest @ x[:, problem.slices[group]]
        covariance += size**2 * own @ own.T
    left = rest @ y
    return float(-0.5 * (left @ np.linalg.solve(covariance, left) + np.linalg.slogdet(covariance)[1]))


def hyper(size: float) -> float:
    return float(HYPER[np.argmin(np.abs(SIZES - size))])


def number_of(problem: Problem, effect: str, joint: int) -> int:
    return next(k for k in problem.named if problem.candidates[k].place == Place(effect, joint=joint))


class TestAgainstADenseLikelihood:
    @pytest.mark.parametrize(("effect", "joint"), PLACES)
    def test_what_a_group_gains_and_at_which_size(self, effect: str, joint: int) -> None:
        problem = posed()
        evidence, k = problem.evidence(PRIOR), number_of(posed(), effect, joint)
        gain = evidence.gains(np.array([k]))
        none = dense(problem, PRIOR, Chosen())
        size = float(gain.size[0])
        exact = dense(problem, PRIOR, Chosen((k,), (size,))) - none - hyper(size)
        assert float(gain.evidence[0]) == pytest.approx(exact, abs=1e-4)
        for other in SIZES[np.abs(np.log(SIZES / size)) < 1.0]:
            assert dense(problem, PRIOR, Chosen((k,), (other,))) - none - hyper(other) <= exact + 1e-4

    def test_given_others(self) -> None:
        problem = posed()
        evidence = problem.evidence(PRIOR)
        numbers = [number_of(problem, *place) for place in PLACES]
        chosen = Chosen(tuple(numbers[:3]), (3.0, 0.5, 10.0))
        before = dense(problem, PRIOR, chosen)
        hypers = sum(0.5 * np.log10(size) ** 2 for size in chosen.sizes)
        assert evidence.given(chosen) == pytest.approx(before - dense(problem, PRIOR, Chosen()) - hypers, abs=1e-4)
        gains = evidence.gains(np.array(numbers[3:]), chosen)
        for k, gain, size in zip(numbers[3:], gains.evidence, gains.size, strict=True):
            exact = dense(problem, PRIOR, chosen.plus(k, float(size))) - before - hyper(size)
            assert gain == pytest.approx(exact, abs=1e-4)

    def test_geometry_priors_compete_by_their_own_evidence(self) -> None:
        problem = posed()
        exact = dense(problem, 1e-3, Chosen()) - dense(problem, 3e-5, Chosen())
        found = problem.evidence(1e-3).nuisance_evidence - problem.evidence(3e-5).nuisance_evidence
        assert found == pytest.approx(exact, abs=1e-4)

    def test_estimates_are_those_of_ridge_regression(self) -> None:
        problem = posed()
        chosen = Chosen(tuple(number_of(problem, *place) for place in PLACES[:3]), (3.0, 0.5, 10.0))
        evidence = problem.evidence(PRIOR)
        x = problem.white.rows(problem.design.whole()).reshape(-1, problem.design.count)
        index = np.concatenate([np.arange(problem.nuisance), evidence.index(chosen.groups)])
        prior = np.concatenate([problem.nuisance_precision(PRIOR), evidence.prior(chosen)])
        rows = np.vstack([x[:, index], np.diag(np.sqrt(prior))])
        aim = np.concatenate([problem.white.rows(problem.residual_m).ravel(), np.zeros(len(index))])
        expected = np.linalg.lstsq(rows, aim, rcond=None)[0]
        np.testing.assert_allclose(evidence.solution(chosen), expected[problem.nuisance :], atol=1e-6)


def test_joined_keeps_each_once_and_the_first_size() -> None:
    both = joined(Chosen((3, 5), (1.0, 2.0)), Chosen((5, 7), (9.0, 4.0)))
    assert (both.groups, both.sizes) == ((3, 5, 7), (1.0, 2.0, 4.0))
    assert both.without(1).groups == (3, 7)


class TestLevel:
    """The largest evidence that noise makes of anything: what is drawn beside the sums tells what fresh noise does."""

    def fresh(self, draws: int, seed: int) -> Evidence:
        """The same problem with other noise drawn beside it."""
        problem = posed()
        x = problem.white.rows(problem.design.whole()).reshape(-1, problem.design.count)
        noise = np.random.default_rng(seed).normal(size=(len(x), draws))
        return replace(
            problem.evidence(PRIOR), sums=replace(problem.sums, null_pulls=x.T @ noise, pull=x.T @ noise[:, 0])
        )

    def test_it_is_what_the_best_candidate_gains_from_a_draw(self) -> None:
        evidence, cost = self.fresh(1, 7), posed().cost
        gains = evidence.gains(np.arange(len(cost))).evidence - cost
        assert evidence.null_maxima(cost) == pytest.approx([gains.max()])

    def test_fresh_noise_rises_above_a_quantile_as_often_as_it_should(self) -> None:
        drawn = posed().evidence(PRIOR).null_maxima(posed().cost)
        fresh = self.fresh(400, 99).null_maxima(posed().cost)
        assert drawn.shape == (NULL_DRAWS,)
        # Two samples of one distribution: differences of empirical shares have this standard deviation.
        for q in (0.5, 0.9):
            std = np.sqrt(q * (1 - q) * (1 / NULL_DRAWS + 1 / 400))
            assert np.mean(fresh > np.quantile(drawn, q)) == pytest.approx(1 - q, abs=3 * std)

    def test_the_threshold_is_hardly_ever_reached(self) -> None:
        threshold = null_threshold(posed(), posed().evidence(PRIOR))
        assert np.mean(self.fresh(1000, 98).null_maxima(posed().cost) > threshold) <= 0.02


class TestSearch:
    def planted(self, places: tuple[tuple[str, int], ...], ratio: float) -> tuple[Problem, list[int]]:
        """Some candidates of the library at ``ratio`` noise standard deviations rms each, in a sim of exact columns."""
        problem = posed()
        rng = np.random.default_rng(len(places))
        whole = problem.design.whole()
        residual = problem.residual_m.copy()
        numbers = [number_of(problem, *place) for place in places]
        for k in numbers:
            group = problem.slices[k]
            moved = whole[:, :, group] @ rng.choice([-1.0, 1.0], group.stop - group.start)
            residual += ratio * SIGMA_M * moved / np.sqrt(np.mean(moved**2))
        return pose_problem(problem.sim, problem.doings, problem.candidates, residual, problem.white), numbers

    def found(self, problem: Problem) -> list[Candidate]:
        result = search(problem.evidence(PRIOR), problem.named, problem.cost, threshold=8.0)
        return [problem.candidates[k] for k in result.chosen.groups]

    @pytest.mark.parametrize("place", [("eccentricity", 1), ("axis_wobble", 3), ("latency", 4), ("ratio", 3)])
    @pytest.mark.parametrize("ratio", [3.0, 10.0])
    def test_one_that_is_there(self, place: tuple[str, int], ratio: float) -> None:
        problem, _ = self.planted((place,), ratio)
        assert {(c.place.effect, c.place.joint) for c in self.found(problem)} == {place}

    def test_three_that_are_there(self) -> None:
        places = (("eccentricity", 1), ("axis_wobble", 3), ("latency", 4))
        problem, _ = self.planted(places, 5.0)
        assert {(c.place.effect, c.place.joint) for c in self.found(problem)} == set(places)

    def test_nothing_where_there_is_only_noise(self) -> None:
        problem = posed()
        result = search(problem.evidence(PRIOR), problem.named, problem.cost, threshold=8.0)
        assert result.chosen.groups == ()
        assert result.log_evidence == 0.0
        assert np.isfinite(result.alone[problem.named]).all()
        assert np.isneginf(result.alone[problem.nameless]).all()

    def test_its_total_is_the_evidence_of_all_together_less_costs(self) -> None:
        problem, _ = self.planted((("eccentricity", 1), ("backlash", 4)), 3.0)
        evidence = problem.evidence(PRIOR)
        result = search(evidence, problem.named, problem.cost, threshold=8.0)
        expected = evidence.given(result.chosen) - sum(problem.cost[k] for k in result.chosen.groups)
        assert result.log_evidence == pytest.approx(expected)


def test_a_group_that_moves_no_point_gains_nothing() -> None:
    """A shift after the last point that counts has empty columns."""
    sim = day(ARMS["phi"](2), 2, Day(arc=5, poses=10))
    told, m = doings(sim.seen), sim.seen.count
    white = whitening(np.tile(SIGMA_M**2 * np.eye(3), (m, 1, 1)), np.where(np.arange(m) < m // 2, 1.0, 0.0))
    problem = pose_problem(measured_at(sim, sim.points_m()), told, candidates(told), np.zeros((m, 3)), white)
    empty = np.array([k for k in problem.named if not problem.sums.square.block(int(k)).any()])
    assert len(empty)
    gains = problem.evidence(PRIOR).gains(empty)
    assert gains.evidence.max() <= 0


def test_placement_that_stands_for_itself_is_eliminated_all_the_same() -> None:
    """A column twice, so well measured that the prior is lost in rounding: other columns see it as one column."""
    rng = np.random.default_rng(7)
    x = rng.standard_normal((90, 5))
    x[:, :3] *= 1e6
    x[:, 1] = x[:, 0]
    y = rng.standard_normal(90)
    sums = Gram(OfColumns(x.T, (slice(3, 5),)), x.T @ y, float(y @ y), 90, np.zeros((5, 1)))
    twice = Evidence(sums, 3, np.full(3, 1e-2))
    once = np.linalg.lstsq(x[:, [0, 2]], x[:, 3:], rcond=None)[0]
    left = x[:, 3:] - x[:, [0, 2]] @ once
    np.testing.assert_allclose(twice.square.whole[3:, 3:], left.T @ left, rtol=1e-5, atol=1e-4)
    np.testing.assert_allclose(twice.pull[3:], left.T @ y, rtol=1e-4, atol=1e-4)
