"""Plans of single-joint sweeps: limits, sight, number of shots, seeds, and that they can be calibrated with."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from core.calibrated_arm import calibrated_arm
from core.calibration import calibrate
from core.errors import InputError
from core.measurements import MOVE, SWEEP
from core.planning.proposal import Proposal, poses_that_matter, propose, swept_ranges
from core.planning.shots import shot_count, sweep_rows
from core.planning.sight import Field, Sight
from core.planning.site_makers import calibrated_site
from core.planning.sweep_plan import FEWEST_PASSIVE_STOPS, FEWEST_STOPS, least_shots, longest_run, slots_for
from core.planning.visibility import visible, within_limits
from core.session_plan import Plan, check_plan
from core.theodolite import Theodolite
from core.twin import irb_l6, scara
from core.twin.campaign import simulate_campaign
from core.twin.demo import plan_for
from core.twin.noise import Noise
from tests.benchmarks.planned_cell import bound, calibrated, drawn_site, errors_of, measured, table_1

EXACT = Noise(instrument=False, repeatability=False)


@cache
def proposed(shots: int, seed: int = 1) -> Proposal:
    site = drawn_site()
    return propose(site, "sweeps", shots, poses_that_matter(site, swept_ranges(site, table_1()), seed), seed)


@pytest.fixture(scope="module")
def proposal() -> Proposal:
    return proposed(129)


def test_every_command_is_within_limits_and_every_shot_seen(proposal: Proposal) -> None:
    site, rows = proposal.site, proposal.rows
    shots = rows.phase == SWEEP
    assert within_limits(site, rows.commanded).all()
    assert visible(site, rows.commanded[shots], rows.target[shots]).all()
    assert shot_count(rows) == int(shots.sum()) == 129
    assert set(rows.phase) == {MOVE, SWEEP}


def test_sweeps_are_such_as_a_session_takes(proposal: Proposal) -> None:
    site = proposal.site
    links = {target.name: target.link for target in site.targets}
    check_plan(site.robot, links, Plan(proposal.sweeps, tuple(site.home)))
    assert [sweep.joint for sweep in proposal.sweeps] == [6, 6, 5, 5, 4, 4, 3, 3, 2, 2, 1, 1]
    for sweep in proposal.sweeps:
        coupled = site.robot.coupling_from(sweep.joint) is not None
        own = [links[name] for name in sweep.targets]
        assert own[0] == sweep.joint if coupled else own[0] >= sweep.joint
        assert sweep.stops >= (FEWEST_PASSIVE_STOPS if len(own) == 2 else FEWEST_STOPS)
        if coupled and sweep.sweep == 1:
            assert own[1] > sweep.joint


def test_one_motor_moves_at_a_time_and_every_stop_is_reached_in_one_sense(proposal: Proposal) -> None:
    campaign = measured(proposal.site, proposal.rows, 0)
    for sweep in campaign.sweeps:
        travel = np.diff(sweep.commanded[:, sweep.joint - 1])
        assert (travel > 0).all()
    rows = proposal.rows
    for first in np.flatnonzero(rows.phase == MOVE):
        joint = rows.joint[first + 1] - 1
        assert rows.commanded[first, joint] < rows.commanded[first + 1, joint]


def test_the_seed_decides(proposal: Proposal) -> None:
    again, other = proposed.__wrapped__(129), proposed(129, seed=2)
    assert again.sweeps == proposal.sweeps
    assert other.sweeps != proposal.sweeps
    assert other.expected.mean_position_m == pytest.approx(proposal.expected.mean_position_m, rel=0.25)


def test_twice_as_good_as_table_1_shot_for_shot(proposal: Proposal) -> None:
    assert bound(proposal.rows).mean_position_m < bound(table_1()).mean_position_m / 2
    site = drawn_site()
    planned = [errors_of(calibrated(measured(site, proposal.rows, seed))).position_m for seed in range(10)]
    before = [errors_of(calibrated(simulate_campaign(seed))).position_m for seed in range(10)]
    assert np.mean(planned) < np.mean(before) / 2


def test_what_is_promised_from_the_drawing_holds_at_the_truth(proposal: Proposal) -> None:
    assert bound(proposal.rows).mean_position_m == pytest.approx(proposal.expected.mean_position_m, rel=0.1)


@pytest.mark.parametrize("shots", [66, 80, 129])
def test_without_noise_the_calibration_finds_the_arm(shots: int) -> None:
    rows = proposed(shots).rows
    assert shot_count(rows) == shots
    found = calibrate(measured(drawn_site(), rows, 0, EXACT))
    assert found.refinement.unobservable == 0
    assert all(fit is not None for fit in found.estimate.couplings[2:5])
    assert errors_of(calibrated_arm(found)).position_m < 1e-6


def test_the_d_criterion_is_for_all_unknowns(proposal: Proposal) -> None:
    site = proposal.site
    needed = poses_that_matter(site, swept_ranges(site, table_1()), 1)
    other = propose(site, "sweeps", 129, needed, 1, "D")
    assert other.indices.o1 > proposal.indices.o1
    assert other.expected.mean_position_m > proposal.expected.mean_position_m


def test_fewer_shots_mean_one_sweep_a_joint() -> None:
    site = drawn_site()
    assert least_shots(site) == 3 * 2 * FEWEST_PASSIVE_STOPS + 3 * FEWEST_STOPS
    assert [slot.joint for slot in slots_for(site, least_shots(site))] == [6, 5, 4, 3, 2, 1]
    with pytest.raises(InputError, match=f"65 shots are too few .* at least {least_shots(site)}"):
        slots_for(site, least_shots(site) - 1)


def test_a_joint_that_no_target_shows_is_named() -> None:
    site = drawn_site()
    without = site.state.rest_points_m.copy()
    without[[k for k, t in enumerate(site.targets) if t.link == 3]] = np.nan
    hidden = site.with_targets(site.targets, without)
    with pytest.raises(InputError, match="joint 3, expected one on link 3 itself"):
        slots_for(hidden, 129)
    alone = np.where(site.links[:, None] <= 4, site.state.rest_points_m, np.nan)
    with pytest.raises(InputError, match="joint 6, expected one on link 6"):
        slots_for(site.with_targets(site.targets, alone), 129)


def test_a_joint_that_cannot_be_seen_moving_is_named() -> None:
    """A station so near that steep sights hide all of it."""
    site = drawn_site()
    narrow = Field(steepest_rad=np.deg2rad(0.2))
    blind = replace(site, sight=Sight((Theodolite(np.array([0.0, 0.0, 3.0])),), sigma_m=1e-4, field=narrow))
    needed = poses_that_matter(blind, swept_ranges(blind, table_1()), 1)
    with pytest.raises(InputError, match="joint 6 cannot be seen moving"):
        propose(blind, "sweeps", 129, needed)


def test_an_arm_with_a_slide_is_planned_for() -> None:
    campaign = simulate_campaign(1, scara.cell())
    site = calibrated_site(calibrate(campaign))
    needed = poses_that_matter(site, swept_ranges(site, campaign.measurements), 1)
    found = propose(site, "sweeps", 80, needed)
    assert found.unobservable == 0
    assert found.shots == 80
    assert within_limits(site, found.rows.commanded).all()
    assert np.isfinite(found.expected.mean_position_m)


def test_rows_of_sweeps_about_home_are_those_of_the_protocol() -> None:
    """Table 1 by its plan: the same commands, in the same order, as the twin's campaign has them."""
    cell = irb_l6.cell()
    plan = plan_for(cell)
    rows = sweep_rows(cell.robot, plan.sweeps, tuple(t.name for t in cell.targets), cell.home)
    shots, table = rows.phase == SWEEP, table_1()
    swept = table.phase == SWEEP
    np.testing.assert_allclose(rows.commanded[shots], table.commanded[swept], rtol=0, atol=1e-12)
    np.testing.assert_array_equal(rows.target[shots], table.target[swept])
    np.testing.assert_array_equal(rows.approach[shots][:, 5][:17], table.approach[swept][:, 5][:17])


@pytest.mark.parametrize(
    ("flags", "run"),
    [([], (0, -1)), ([0, 0], (0, -1)), ([1, 1, 0, 1], (0, 1)), ([0, 1, 0, 1, 1, 1], (3, 5)), ([1], (0, 0))],
)
def test_longest_runs(flags: list[int], run: tuple[int, int]) -> None:
    assert longest_run(np.array(flags, dtype=bool)) == run
