"""What is kept out together, and that predictions of it come from the other folds alone."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from gap_arms import ARMS, SIGMA_M, Day, campaign, day, table, with_points

from core.gap.doings import doings
from core.gap.evidence import Chosen
from core.gap.folds import CHECK, FOLDS, blocks, placeable, regions, times
from core.gap.kept_out import KeptOut, mean_square
from core.gap.library import candidates
from core.gap.observations import Observations, observe
from core.gap.problem import Problem, pose_problem
from core.gap.sim import Sim
from core.gap.whitening import whitening
from core.geometry import Array
from core.measurements import Target

PRIOR = 1e-4
PLAN = Day(arc=11, poses=30, visits=2, shots=2)


def checked(seen: Observations, check: np.ndarray) -> Observations:
    rows = replace(seen.campaign.measurements, check=check)
    return replace(seen, campaign=replace(seen.campaign, measurements=rows))


@pytest.mark.parametrize("name", ["phi", "coupled", "dh with slides"])
class TestBlocks:
    def test_standstills_and_repeats_stay_together(self, name: str) -> None:
        seen = day(ARMS[name](1), 1, PLAN).seen
        fold = blocks(seen)
        for key in (seen.standstill, repeats_of(seen)):
            for group in np.unique(key):
                assert len(set(fold[key == group])) == 1

    def test_every_fold_has_a_piece_of_every_arc_and_poses(self, name: str) -> None:
        seen = day(ARMS[name](1), 1, PLAN).seen
        fold = blocks(seen)
        for joint in range(1, seen.joint_count + 1):
            arc = np.flatnonzero(seen.joint == joint)
            assert set(fold[arc]) == set(range(FOLDS))
            # Both ways through the same places, each piece of the arc in one fold.
            place = seen.active[arc, joint - 1]
            order = np.argsort(place, kind="stable")
            assert np.count_nonzero(np.diff(fold[arc][order])) == FOLDS - 1
        assert set(fold[seen.posed]) == set(range(FOLDS))

    def test_validation_rows_are_a_fold_of_their_own(self, name: str) -> None:
        seen = day(ARMS[name](1), 1, PLAN).seen
        check = np.arange(seen.count) % 7 == 0
        for cut in (blocks, times):
            fold = cut(checked(seen, check))
            np.testing.assert_array_equal(fold == CHECK, check)
        fold = blocks(checked(seen, np.ones(seen.count, dtype=bool)))
        np.testing.assert_array_equal(fold, blocks(seen))


def repeats_of(seen: Observations) -> np.ndarray:
    """Numbers of equal configurations of poses; each sweep point alone."""
    _, which = np.unique(np.round(seen.active, 9), axis=0, return_inverse=True)
    return np.where(seen.posed, which.ravel(), 10**6 + np.arange(seen.count))


def test_regions_are_regions() -> None:
    """Each configuration is nearer to the middle of its own region than to another's, within what k-means leaves."""
    rng = np.random.default_rng(2)
    active = rng.uniform(-1, 1, (400, 3)) * [1.0, 0.5, 0.1]
    span = np.ptp(active, axis=0)
    region = regions(active, span)
    middles = np.array([active[region == r].mean(axis=0) for r in np.unique(region)]) / span
    far = np.linalg.norm(active[:, None] / span - middles, axis=2)
    assert np.mean(np.unique(region)[far.argmin(axis=1)] == region) > 0.9
    np.testing.assert_array_equal(region, regions(active, span))


def test_times_are_fifths() -> None:
    seen = day(ARMS["phi"](1), 1, PLAN).seen
    fold = times(seen)
    assert np.all(np.diff(fold) >= 0)
    assert set(fold) == set(range(FOLDS))


@pytest.mark.parametrize("count", [1, 2, 4])
def test_a_handful_of_points_can_be_cut(count: int) -> None:
    seen = observe(campaign(ARMS["phi"](1), (Target("T", 4),), table(np.arange(4.0 * count).reshape(count, 4))))
    assert len(set(blocks(seen))) == count


class TestPlaceable:
    def seen(self, which: list[int]) -> Observations:
        targets = (Target("open", 4), Target("other", 4), Target("known", 4, (0.1, 0.0, 0.0)))
        rows = table(np.arange(4.0 * len(which)).reshape(-1, 4), np.array(which))
        return observe(campaign(ARMS["phi"](1), targets, rows))

    def test_a_target_of_one_fold_cannot_be_placed_from_the_others(self) -> None:
        seen, fold = self.seen([0, 0, 1, 1, 2]), np.array([0, 1, 2, 2, 3])
        np.testing.assert_array_equal(placeable(seen, fold, np.ones(5, dtype=bool)), [True, True, False, False, True])

    def test_points_left_out_and_validation_rows_place_nothing(self) -> None:
        seen, fold = self.seen([0, 0, 1, 1, 1]), np.array([0, 1, 0, 1, CHECK])
        used = np.array([True, False, True, True, False])
        np.testing.assert_array_equal(placeable(seen, fold, used), [False, True, True, True, True])


@cache
def problem(correlation: float = 0.0) -> tuple[Problem, np.ndarray]:
    """Residuals of noise and a ratio error, some points without weight, some validation rows."""
    sim = day(ARMS["coupled"](3), 3, Day(arc=8, poses=20), noise_m=3e-5)
    m = sim.seen.count
    check = np.arange(m) % 11 == 5
    seen = checked(sim.seen, check)
    sim = replace(sim, seen=seen)
    told = doings(seen)
    rng = np.random.default_rng(3)
    weight = np.where(check | (rng.random(m) < 0.05), 0.0, rng.uniform(0.5, 1.0, m))
    white = whitening(np.tile(SIGMA_M**2 * np.eye(3), (m, 1, 1)), weight, correlation)
    residual = seen.point_m - sim.points_m() + 1e-4 * np.sin(2 * seen.active[:, :3])
    return pose_problem(sim, told, candidates(told), residual, white), blocks(seen)


def chosen_of(one: Problem) -> Chosen:
    wanted = (("ratio", 2), ("eccentricity", 3), ("backlash", 1))
    numbers = [
        next(k for k in one.named if (one.candidates[k].place.effect, one.candidates[k].place.joint) == place)
        for place in wanted
    ]
    return Chosen(tuple(numbers), (2.0, 30.0, 0.3))


def refit(one: Problem, chosen: Chosen, fitted: np.ndarray) -> Array:
    """Residuals of all points after a ridge regression on some, every row written out."""
    columns = np.concatenate([np.arange(one.nuisance), *(np.arange(s.start, s.stop) for s in _groups(one, chosen))])
    x = one.design.some(columns).whole()
    root = one.white.root * np.sqrt(one.white.weight)[:, None, None]
    rows = (root @ x)[fitted].reshape(-1, len(columns))
    aim = (root @ one.residual_m[:, :, None])[fitted].ravel()
    sizes = np.concatenate(
        [np.full(s.stop - s.start, size) for s, size in zip(_groups(one, chosen), chosen.sizes, strict=True)]
        or [np.zeros(0)]
    )
    precision = np.sqrt(np.concatenate([one.nuisance_precision(PRIOR), 1 / sizes**2]))
    numbers = np.linalg.lstsq(
        np.vstack([rows, np.diag(precision)]), np.append(aim, np.zeros(len(columns))), rcond=None
    )[0]
    return one.residual_m - x @ numbers


def _groups(one: Problem, chosen: Chosen) -> list[slice]:
    return [one.slices[g] for g in chosen.groups]


class TestKeptOut:
    @pytest.mark.parametrize("some", [Chosen(), None])
    def test_each_fold_is_predicted_by_a_refit_on_the_others(self, some: Chosen | None) -> None:
        one, fold = problem()
        chosen = chosen_of(one) if some is None else some
        kept = KeptOut(one, fold, PRIOR, chosen_of(one).groups)
        left = kept.left_m(chosen)
        for f in range(CHECK + 1):
            expected = refit(one, chosen, (fold != f) & (fold != CHECK))
            np.testing.assert_allclose(left[fold == f], expected[fold == f], atol=1e-10)
        assert kept.square_m2(chosen) == pytest.approx(mean_square(left[kept.judged]), rel=1e-9)

    def test_all_together_are_fitted_as_a_regression_would(self) -> None:
        one, fold = problem()
        chosen = chosen_of(one)
        kept = KeptOut(one, fold, PRIOR, chosen.groups)
        index, numbers, covariance = kept.fitted(chosen)
        left = one.residual_m - kept.plain[:, :, index] @ numbers
        np.testing.assert_allclose(left, refit(one, chosen, fold != CHECK), atol=1e-10)
        assert np.linalg.eigvalsh(covariance).min() > 0

    @pytest.mark.parametrize("correlation", [0.0, 0.7])
    def test_what_is_predicted_has_no_say_in_its_prediction(self, correlation: float) -> None:
        """Points of a fold go astray by a metre: what is predicted for them stays what it was."""
        one, fold = problem(correlation)
        chosen = chosen_of(one)
        before = KeptOut(one, fold, PRIOR, chosen.groups).left_m(chosen)
        for f in (0, 3, CHECK):
            away = np.where((fold == f)[:, None], 1.0, 0.0) * np.ones(3)
            astray = replace(one, residual_m=one.residual_m + away)
            after = KeptOut(astray, fold, PRIOR, chosen.groups).left_m(chosen)
            np.testing.assert_allclose((after - away)[fold == f], before[fold == f], atol=1e-9)

    def test_validation_rows_change_no_estimate(self) -> None:
        one, fold = problem()
        chosen = chosen_of(one)
        _, before, _ = KeptOut(one, fold, PRIOR, chosen.groups).fitted(chosen)
        astray = replace(one, residual_m=one.residual_m + np.where((fold == CHECK)[:, None], 5.0, 0.0))
        _, after, _ = KeptOut(astray, fold, PRIOR, chosen.groups).fitted(chosen)
        np.testing.assert_allclose(after, before, atol=1e-12)

    def test_noise_leaves_what_is_expected(self) -> None:
        """Geometry and causes drawn from their priors, and noise: kept-out squares over what is expected of them."""
        one, fold = problem()
        one = replace(one, white=replace(one.white, weight=np.where(fold == CHECK, 0.0, 1.0)))
        chosen, m = chosen_of(one), one.sim.seen.count
        noise_m2, rng, ratio = np.full(m, 3 * SIGMA_M**2), np.random.default_rng(8), []
        index, precision = KeptOut(one, fold, PRIOR, chosen.groups).index(chosen)
        columns = KeptOut(one, fold, PRIOR, chosen.groups).plain[:, :, index]
        spread = np.where(np.arange(len(index)) < one.placement, 0.01, 1 / np.sqrt(precision))
        for _ in range(60):
            drawn = SIGMA_M * rng.normal(size=(m, 3)) + columns @ (spread * rng.normal(size=len(index)))
            kept = KeptOut(replace(one, residual_m=drawn), fold, PRIOR, chosen.groups)
            ratio.append(kept.square_m2(chosen) / kept.expected_m2(chosen, noise_m2))
        assert np.mean(ratio) == pytest.approx(1.0, abs=4 * np.std(ratio) / np.sqrt(60))
        assert np.std(ratio) < 0.3
        assert kept.expected_m2(chosen, noise_m2) > 1.1 * 3 * SIGMA_M**2

    def test_points_without_weight_are_not_judged_but_validation_rows_are(self) -> None:
        one, fold = problem()
        kept = KeptOut(one, fold, PRIOR, ())
        np.testing.assert_array_equal(kept.judged, (one.white.weight > 0) | (fold == CHECK))

    def test_validation_rows_change_neither_sums_nor_placement(self) -> None:
        one, _ = problem()
        check = one.sim.seen.check
        points = one.sim.seen.point_m + np.where(check[:, None], 3.0, 0.0)
        astray = pose_problem(
            Sim(with_points(one.sim.seen, points), one.sim.base, one.sim.target_m, one.sim.middle_m),
            one.doings,
            one.candidates,
            one.residual_m + np.where(check[:, None], 3.0, 0.0),
            one.white,
        )
        np.testing.assert_allclose(astray.sums.pull, one.sums.pull, atol=1e-9 * np.abs(one.sums.pull).max())
        assert astray.sums.total == pytest.approx(one.sums.total)
