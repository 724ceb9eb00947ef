"""The withheld suite's generator is sound physics, whatever a diagnosis may make of it."""

from pathlib import Path

import numpy as np
import pytest

from core.campaign_files import read_campaign
from core.kinematics import link_frames, nominal_net
from tests.benchmarks.withheld.absorbed import CLUTTER, SIGMA_M, Absorber
from tests.benchmarks.withheld.arms import ARMS, arm_named
from tests.benchmarks.withheld.cases import IMPOSSIBLE
from tests.benchmarks.withheld.chains import Disturbance, seen_points, stand
from tests.benchmarks.withheld.effects.library import NAMED
from tests.benchmarks.withheld.loads import nominal_masses, torques
from tests.benchmarks.withheld.protocols import Plan, rich_session
from tests.benchmarks.withheld.worlds import make_campaign, needs, shift_m, single_world


@pytest.mark.parametrize("key", ARMS)
def test_the_nominal_arm_is_the_one_that_the_product_reads(key: str, tmp_path: Path) -> None:
    world = make_campaign(key, None, 0.0, 1, tmp_path)
    campaign, session = read_campaign(tmp_path), world.session
    frames = link_frames(campaign.robot, nominal_net(campaign.robot, campaign.measurements.commanded))
    at = session.nominal
    np.testing.assert_allclose(frames[:, :-1, :3, :3], at.rotation, atol=1e-9)
    np.testing.assert_allclose(frames[:, :-1, :3, 3], at.origin, atol=1e-9)
    np.testing.assert_allclose([link.centre_m for link in campaign.robot.links], session.arm.centres_m, atol=1e-12)


@pytest.mark.parametrize("key", ARMS)
def test_nothing_wrong_leaves_noise_and_clutter_alone(key: str, tmp_path: Path) -> None:
    world = make_campaign(key, None, 0.0, 2, tmp_path)
    table = read_campaign(tmp_path).measurements
    gap = (table.point_m - world.session.nominal_m)[world.session.measured]
    # Clutter and noise are within the absorber's own model: what is left is the noise, one sigma a coordinate.
    assert Absorber(world.session).left(gap) == pytest.approx(1.0, abs=4 / np.sqrt(6 * len(gap)) + 0.03)


@pytest.mark.parametrize("name", NAMED)
@pytest.mark.parametrize("key", ARMS)
def test_every_effect_is_as_strong_as_asked_and_written_as_a_campaign(key: str, name: str, tmp_path: Path) -> None:
    if (key, name) in IMPOSSIBLE:
        with pytest.raises(ValueError, match=key):
            make_campaign(key, name, 3.0, 3, tmp_path)
        return
    world = make_campaign(key, name, 3.0, 3, tmp_path)
    # Rounding jumps as its step grows, so that no step may come nearer than some per cent.
    assert world.visible[0] == pytest.approx(3.0, rel=0.05 if name == "quantisation" else 0.015)
    assert world.answers[0]["effect"] == name
    campaign = read_campaign(tmp_path)
    assert 650 <= campaign.measurements.seen.sum() <= 1150
    noise = campaign.measurements.point_m[world.session.measured] - world.points_m()
    assert noise.std() == pytest.approx(SIGMA_M, rel=0.08)


@pytest.mark.parametrize("name", sorted(set(NAMED) - {"base_shift", "target_slip", "quantisation"}))
def test_effects_grow_smoothly_with_their_size(name: str) -> None:
    world = single_world(arm_named("irb"), NAMED[name], 3.0, np.random.default_rng(5), **needs(name))
    hidden = world.hidden[0]
    once = shift_m(world.session, hidden)
    twice = shift_m(world.session, type(hidden)(hidden.effect, 1.02 * hidden.size))
    assert np.abs(twice - once).max() < 0.1 * np.abs(once).max()
    assert np.linalg.norm(twice) > np.linalg.norm(once)


def test_torques_are_the_slope_of_the_potential_energy() -> None:
    arm, rng = arm_named("seven"), np.random.default_rng(0)
    q = arm.homes.mean(axis=0) + 0.3 * rng.normal(size=(5, arm.count))
    masses, load = nominal_masses(arm), np.full(5, 3.0)

    def energy(q: np.ndarray) -> np.ndarray:
        at = stand(arm.chain, q)
        centres = at.origin + np.einsum("mnij,nj->mni", at.rotation, masses.centres_m)
        hung = at.end_origin[:, -1] + at.end_rotation[:, -1] @ masses.payload_m
        return 9.81 * (centres[..., 2] @ masses.links_kg + load * hung[:, 2])

    for j in range(arm.count):
        step = 1e-5 * np.eye(arm.count)[j]
        slope = (energy(q + step) - energy(q - step)) / 2e-5
        np.testing.assert_allclose(torques(stand(arm.chain, q), masses, load)[:, j], -slope, atol=1e-6)


@pytest.mark.parametrize("key", ARMS)
def test_absorbed_columns_are_the_slopes_of_the_points(key: str) -> None:
    session = rich_session(arm_named(key), np.random.default_rng(1), Plan(targets=2))
    columns, n = Absorber(session).columns * SIGMA_M, session.arm.count
    for i in range(n - 1):
        for k in range(6):
            motion = np.zeros((len(session.q), n, 6))
            motion[:, i, k] = 1e-6
            moved = seen_points(session.arm.chain, session.q, session.place_m, session.base, Disturbance(link=motion))
            slope = (moved - session.nominal_m)[session.measured].ravel() / 1e-6
            np.testing.assert_allclose(columns[:, 12 + 6 * i + k], CLUTTER * slope, atol=1e-9)
