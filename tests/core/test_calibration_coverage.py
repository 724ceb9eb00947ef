"""What a calibration promises, it keeps: true parameters lie within the stated intervals as often as stated."""

import numpy as np
import pytest
from calibrated_twins import joint_scores, scores_over_seeds

from core.twin import irb_l6, scara

SEEDS = 200
WITHIN_95 = 1.96


@pytest.fixture(scope="module", params=["irb_l6", "scara"])
def scores(request):
    cell = {"irb_l6": irb_l6.cell, "scara": scara.cell}[request.param]()
    return scores_over_seeds(cell, range(5000, 5000 + SEEDS))


@pytest.mark.parametrize("estimate", ["all points at once", "joint by joint"])
def test_true_parameters_lie_within_95_percent_intervals_93_to_97_percent_of_the_time(scores, estimate):
    _, refined, first = scores
    inside = np.abs(refined if estimate == "all points at once" else first) < WITHIN_95
    assert 0.93 <= inside.mean() <= 0.97


@pytest.mark.parametrize("estimate", ["all points at once", "joint by joint"])
def test_no_single_parameter_is_far_from_its_promise(scores, estimate):
    names, refined, first = scores
    inside = np.mean(np.abs(refined if estimate == "all points at once" else first) < WITHIN_95, axis=0)
    # 200 draws of a fair 95 % scatter by 1.5 %; among some forty parameters 3.5 of these deviations must not occur.
    worst = int(np.argmax(np.abs(inside - 0.95)))
    assert abs(inside[worst] - 0.95) < 3.5 * np.sqrt(0.95 * 0.05 / SEEDS), names[worst]


def test_estimates_are_not_biased(scores):
    names, refined, _ = scores
    bias = refined.mean(axis=0) * np.sqrt(SEEDS)
    worst = int(np.argmax(np.abs(bias)))
    assert abs(bias[worst]) < 4.5, names[worst]


@pytest.mark.parametrize("cell", [irb_l6.cell, scara.cell], ids=["irb_l6", "scara"])
def test_parameters_err_together_as_their_covariance_says(cell):
    scores = np.stack([joint_scores(cell(), seed) for seed in range(7000, 7040)])
    # The mean of so many squares of standard normal numbers scatters by sqrt(2 / count).
    assert np.mean(scores**2) == pytest.approx(1.0, abs=4 * np.sqrt(2 / scores.size))
