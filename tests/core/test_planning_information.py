"""The information of planned shots: against finite differences, and against what calibrations really scatter by."""

from dataclasses import replace

import numpy as np
import pytest
from planned_arms import arm_of, deviations

from core.arm import carry
from core.arm_jacobian import moved, net_displacements
from core.calibration import calibrate
from core.geometry import Array
from core.kinematics import forward
from core.planning.expected_error import expected_error, mean_lengths, required
from core.planning.information import information_of, whitened
from core.planning.pose_plan import pose_pool
from core.planning.proposal import expected_by, poses_that_matter, propose, shown_by, swept_ranges
from core.planning.shots import pose_rows
from core.planning.site import Repeats, Site
from core.planning.site_makers import calibrated_site
from core.rotations import vectors_of_rotations
from core.twin import scara
from core.twin.campaign import simulate_campaign
from tests.benchmarks.planned_cell import (
    bound,
    calibrated,
    drawn_site,
    errors_of,
    kept_out_commands,
    measured,
    table_1,
    true_site,
)

CAMPAIGNS = 150


def scara_site() -> Site:
    return calibrated_site(calibrate(simulate_campaign(1, scara.cell())))


SITES = {"irb_l6": true_site, "scara": scara_site}


@pytest.fixture(scope="module", params=SITES)
def site(request: pytest.FixtureRequest) -> Site:
    return SITES[request.param]()


def some_shots(site: Site, count: int = 30) -> tuple[Array, np.ndarray]:
    return pose_pool(site, count, np.random.default_rng(4))


def by_differences(site: Site, commanded: Array, target: np.ndarray) -> Array:
    """Derivatives of the points by all unknowns, (m, 3, p), from the forward model alone."""
    columns = []
    for j in range(site.layout.size):
        step = np.zeros(site.layout.size)
        step[j] = 1e-5
        ends = []
        for sign in (1, -1):
            there = replace(site, state=moved(site.state, site.layout, sign * step))
            ends.append(there.carried(there.net(commanded), site.links[target], there.state.rest_points_m[target]))
        columns.append((ends[0] - ends[1]) / 2e-5)
    return np.stack(columns, axis=2)


def test_information_is_that_of_the_points_by_their_covariance(site: Site) -> None:
    plain = replace(site, repeats=Repeats(3e-4))
    commanded, target = some_shots(plain)
    jacobian = by_differences(plain, commanded, target)
    points = plain.carried(plain.net(commanded), plain.links[target], plain.state.rest_points_m[target])
    weight = np.linalg.inv(plain.sight.covariance(points) + 9e-8 * np.eye(3))
    expected = np.einsum("mip,mij,mjq->pq", jacobian, weight, jacobian)
    found = information_of(plain, pose_rows(commanded, target))
    assert found.shots == len(target)
    np.testing.assert_allclose(found.matrix, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


def test_the_repeatability_of_joints_lies_along_their_arcs(site: Site) -> None:
    """Points scattered by random errors of the joints have the covariance that the plan reckons with."""
    spread = np.where(site.robot.sliding, 2e-4, 5e-4) * np.arange(1, site.robot.joint_count + 1)
    commanded, target = some_shots(site, 5)
    found = site.predict(commanded, target)
    reckoned = found.by_net * spread
    a = whitened(replace(site, repeats=Repeats(0.0, spread)), commanded, target)
    covariance = site.sight.covariance(found.point_m) + reckoned @ np.swapaxes(reckoned, 1, 2)
    information = np.einsum("mip,mij,mjq->mpq", found.jacobian, np.linalg.inv(covariance), found.jacobian)
    np.testing.assert_allclose(np.swapaxes(a, 1, 2) @ a, information, rtol=0, atol=1e-9 * information.max())
    net = net_displacements(site.state, site.observations(commanded, target))[:1]
    scattered = net + np.random.default_rng(0).normal(size=(20_000, net.shape[1])) * spread
    link, rest = np.full(20_000, site.links[target[0]]), np.tile(site.state.rest_points_m[target[0]], (20_000, 1))
    seen = np.cov(carry(site.state.axes, site.robot.sliding, scattered, link, rest).T)
    np.testing.assert_allclose(seen, reckoned[0] @ reckoned[0].T, rtol=0, atol=0.03 * np.trace(seen))


def test_the_tool_follows_the_unknowns_as_an_arm_put_together_does(site: Site) -> None:
    """The derivatives of position and turn, against tools of calibrated arms whose unknowns differ."""
    rng = np.random.default_rng(5)
    commanded, _ = some_shots(site, 7)
    needed = required(site, commanded)
    for _ in range(6):
        step = 1e-6 * rng.normal(size=site.layout.size)
        tools = []
        for sign in (1, -1):
            arm = arm_of(site, moved(site.state, site.layout, sign * step))
            seen = site.observations(commanded, np.zeros(len(commanded), dtype=int))
            net = arm.drives.net_of_active(active(arm, seen.asked, site.home is not None))
            tools.append(arm.base @ forward(arm.robot, net))
        shift = (tools[0][:, :3, 3] - tools[1][:, :3, 3]) / 2
        turn = vectors_of_rotations(tools[0][:, :3, :3] @ np.swapaxes(tools[1][:, :3, :3], 1, 2)) / 2
        size = np.abs(shift).max()
        np.testing.assert_allclose(needed.position @ step, shift, rtol=0, atol=1e-4 * size)
        np.testing.assert_allclose(needed.orientation @ step, turn, rtol=0, atol=1e-4 * np.abs(turn).max())


def active(arm, asked: Array, home: bool) -> Array:
    """What the motors make of commands that count from the marks."""
    columns = [
        f.inverse(asked[:, i] + (float(f(0.0)) if home else 0.0)) for i, f in enumerate(arm.drives.transmissions)
    ]
    return np.stack(columns, axis=1)


@pytest.mark.parametrize("kind", ["sweeps", "poses"])
def test_calibrations_scatter_as_the_information_says(kind: str) -> None:
    """Squared errors of all unknowns in units of the bound have their number as mean; the tool misses by as much."""
    drawn = drawn_site()
    needed = poses_that_matter(drawn, swept_ranges(drawn, table_1()), 1)
    rows = propose(drawn, kind, 90, needed, 1).rows
    true = shown_by(true_site(), rows)
    arms = [calibrated(measured(drawn, rows, seed)) for seed in range(CAMPAIGNS)]
    errors = np.array([deviations(true, arm) for arm in arms])
    seen = np.isfinite(errors[0])
    matrix = information_of(true, rows).matrix[np.ix_(seen, seen)]
    squares = np.einsum("ki,ij,kj->k", errors[:, seen], matrix, errors[:, seen]) / seen.sum()
    assert squares.mean() == pytest.approx(1.0, abs=4 * np.sqrt(2 / (seen.sum() * CAMPAIGNS)))
    promised = bound(rows).rms_position_m
    found = np.sqrt(np.mean([np.sum(errors_of(arm).shift_m ** 2, axis=1) for arm in arms]))
    assert found == pytest.approx(promised, rel=0.12)


def test_table_1_is_worth_what_its_campaigns_show() -> None:
    """The bound of the paper's own plan, with the coupling that it does not show held: 1.60 mm."""
    promised = bound(table_1())
    found = [errors_of(calibrated(simulate_campaign(seed))).position_m for seed in range(CAMPAIGNS)]
    assert promised.mean_position_m == pytest.approx(1.6e-3, rel=0.01)
    assert np.mean(found) == pytest.approx(promised.mean_position_m, rel=0.15)


def test_a_coupling_that_sweeps_do_not_show_is_held() -> None:
    site = true_site()
    assert list(np.flatnonzero(site.coupled)) == [2, 3, 4]
    assert list(np.flatnonzero(shown_by(site, table_1()).coupled)) == [2, 4]
    assert information_of(site, table_1()).unobservable > 0
    assert information_of(shown_by(site, table_1()), table_1()).unobservable == 0
    commanded, target = some_shots(site)
    assert list(np.flatnonzero(shown_by(site, pose_rows(commanded, target)).coupled)) == [2, 3, 4]


def test_rows_to_be_checked_with_tell_nothing() -> None:
    site, table = true_site(), table_1()
    without = replace(table, check=np.ones(table.count, dtype=bool))
    assert information_of(site, table).shots == 129
    assert not information_of(site, without).matrix.any()


def test_more_shots_are_never_worse() -> None:
    site = true_site()
    commanded, target = some_shots(site, 120)
    few, many = (pose_rows(commanded[:k], target[:k]) for k in (90, 120))
    one, other = (expected_by(site, rows, kept_out_commands()) for rows in (few, many))
    assert other.mean_position_m < one.mean_position_m
    assert other.rms_orientation_rad < one.rms_orientation_rad
    twice = pose_rows(np.tile(commanded, (2, 1)), np.tile(target, 2))
    ratio = (
        expected_by(site, many, kept_out_commands()).rms_position_m
        / expected_by(site, twice, kept_out_commands()).rms_position_m
    )
    assert ratio == pytest.approx(np.sqrt(2))


def test_mean_lengths_of_normal_vectors() -> None:
    round_one = np.array([np.eye(3), 4 * np.eye(3)])
    np.testing.assert_allclose(mean_lengths(round_one), np.sqrt(8 / np.pi) * np.array([1.0, 2.0]), rtol=1e-9)
    flat = np.diag([1.0, 0.0, 0.0])[None]
    np.testing.assert_allclose(mean_lengths(flat), np.sqrt(2 / np.pi), rtol=2e-3)
    root = np.random.default_rng(1).normal(size=(3, 3))
    drawn = np.random.default_rng(2).normal(size=(200_000, 3)) @ root.T
    assert mean_lengths((root @ root.T)[None])[0] == pytest.approx(np.linalg.norm(drawn, axis=1).mean(), rel=5e-3)


def test_expected_errors_are_means_over_poses() -> None:
    site = true_site()
    covariance = information_of(shown_by(site, table_1()), table_1()).covariance
    needed = required(shown_by(site, table_1()), kept_out_commands())
    found = expected_error(needed, covariance)
    squares = [np.trace(g @ covariance @ g.T) for g in needed.position]
    assert found.rms_position_m == pytest.approx(np.sqrt(np.mean(squares)))
    assert found.worst_position_m == pytest.approx(np.sqrt(np.max(squares)))
    assert found.rms_position_m**2 == pytest.approx(np.trace(needed.loss(0.0) @ covariance))
    assert found.mean_position_m < found.rms_position_m < found.worst_position_m
