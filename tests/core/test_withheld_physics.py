"""MuJoCo's truths of the withheld suite against statics done by hand."""

import numpy as np
import pytest

from tests.benchmarks.withheld.arms import ARMS, arm_named
from tests.benchmarks.withheld.chains import Disturbance, seen_points, stand
from tests.benchmarks.withheld.loads import nominal_masses, torques, usual_torques, wrenches

pytest.importorskip("mujoco", reason="MuJoCo is an extra of the tests")

from tests.benchmarks.withheld.physics.bodies import Springs, build
from tests.benchmarks.withheld.physics.equilibrium import resting_frames
from tests.benchmarks.withheld.physics.play import Track
from tests.benchmarks.withheld.physics.worlds import physics_made


def commands(key: str, count: int = 12) -> np.ndarray:
    arm, rng = arm_named(key), np.random.default_rng(3)
    return arm.homes.mean(axis=0) + 0.8 * rng.uniform(-1, 1, (count, arm.count)) * arm.reach


@pytest.mark.parametrize("key", ARMS)
def test_without_springs_the_bodies_stand_where_the_chain_does(key: str) -> None:
    arm, q = arm_named(key), commands(key)
    clutter = np.random.default_rng(4).normal(0, 1e-3, (arm.count, 6))
    frames = resting_frames(build(arm, clutter, nominal_masses(arm), 2.0, Springs()), q)
    at = stand(arm.chain, q, Disturbance(link=np.broadcast_to(clutter, (len(q), *clutter.shape))))
    np.testing.assert_allclose(frames[:, :3, 3], at.end_origin[:, -1], atol=1e-9)
    np.testing.assert_allclose(frames[:, :3, :3], at.end_rotation[:, -1], atol=1e-9)


@pytest.mark.parametrize("key", ARMS)
def test_a_stiff_spring_winds_up_by_torque_over_stiffness(key: str) -> None:
    arm, q = arm_named(key), commands(key)
    joint = int(usual_torques(arm).argmax())
    # A tenth of a milliradian: statics of the undeflected arm hold to a part in a thousand.
    stiffness = 1e4 * usual_torques(arm)[joint]
    none = np.zeros((arm.count, 6))
    frames = resting_frames(build(arm, none, nominal_masses(arm), 2.0, Springs({joint: stiffness})), q)
    turn = np.zeros(q.shape)
    turn[:, joint] = torques(stand(arm.chain, q), nominal_masses(arm), np.full(len(q), 2.0))[:, joint] / stiffness
    expected = stand(arm.chain, q, Disturbance(turn=turn)).end_origin[:, -1]
    rigid = stand(arm.chain, q).end_origin[:, -1]
    sag = np.linalg.norm(expected - rigid, axis=1).max()
    np.testing.assert_allclose(frames[:, :3, 3], expected, atol=2e-3 * sag)


def test_a_soft_link_bends_as_a_beam_does() -> None:
    arm, q, link = arm_named("irb"), commands("irb"), 1
    stiffness, none = 1e4 * usual_torques(arm).max(), np.zeros((arm.count, 6))
    bodies = build(arm, none, nominal_masses(arm), 8.0, Springs(link=link, bending=(stiffness,) * 3))
    frames = resting_frames(bodies, q)
    # The slope at the tip is the moment at the middle over the stiffness, in any direction as all three are equal.
    at = stand(arm.chain, q)
    force, moment = wrenches(at, nominal_masses(arm), np.full(len(q), 8.0))
    middle = (at.origin[:, link] + at.end_origin[:, link]) / 2
    own = nominal_masses(arm).links_kg[link] / 2
    centre = at.origin[:, link] + at.rotation[:, link] @ nominal_masses(arm).centres_m[link]
    beyond = moment[:, link + 1] + np.cross(at.origin[:, link + 1] - middle, force[:, link + 1])
    beyond = beyond + np.cross(centre - middle, [0.0, 0.0, -9.81 * own])
    turned = np.einsum("mij,mkj->mik", frames[:, :3, :3], at.end_rotation[:, -1]) - np.eye(3)
    slope = np.stack([turned[:, 2, 1], turned[:, 0, 2], turned[:, 1, 0]], axis=1)
    np.testing.assert_allclose(slope, beyond / stiffness, atol=3e-3 * np.abs(slope).max())


def there_and_back(key: str, joint: int) -> np.ndarray:
    arm = arm_named(key)
    values = np.concatenate([np.linspace(-0.3, 0.3, 6), np.linspace(0.3, -0.3, 6)])
    q = np.tile(arm.homes[0], (len(values), 1))
    q[:, joint] += values
    return q


def test_play_under_friction_trails_the_motor() -> None:
    arm = arm_named("irb")
    q = there_and_back("irb", 0)
    bodies = build(arm, np.zeros((6, 6)), nominal_masses(arm), 0.0, Springs(loose=0, friction=20.0))
    flanks = Track(bodies, 0, 1e-3).flanks(q)
    np.testing.assert_allclose(flanks[1:6], -1.0, atol=0.03)
    np.testing.assert_allclose(flanks[7:], 1.0, atol=0.03)


def test_play_held_by_weight_knows_no_direction() -> None:
    arm, joint = arm_named("irb"), 1
    q = there_and_back("irb", joint)
    load = torques(stand(arm.chain, q), nominal_masses(arm), np.zeros(len(q)))[:, joint]
    friction = 0.2 * np.abs(load).min()
    bodies = build(arm, np.zeros((6, 6)), nominal_masses(arm), 0.0, Springs(loose=joint, friction=friction))
    np.testing.assert_allclose(Track(bodies, joint, 1e-3).flanks(q), np.sign(load), atol=0.05)


@pytest.mark.parametrize("effect", ["compliance", "flexure", "payload"])
def test_worlds_are_as_strong_as_asked(effect: str) -> None:
    made = physics_made(arm_named("ur"), effect, 3.0, np.random.default_rng(6))
    assert made.visible[0] == pytest.approx(3.0, rel=0.02)
    assert made.effects[0]["effect"] == effect
    assert len(made.point_m) == made.session.measured.sum()


def test_the_load_moves_only_what_is_loaded() -> None:
    made = physics_made(arm_named("ur"), "payload", 10.0, np.random.default_rng(7))
    session = made.session
    nominal = seen_points(session.arm.chain, session.q, session.place_m, session.base)
    gap = np.linalg.norm(made.point_m - nominal[session.measured], axis=1)
    bare = session.payload_kg[session.measured] == 0
    # The bare rows show the clutter of geometry alone, tenths of a millimetre.
    assert gap[bare].max() < 4e-4
    assert gap[~bare].max() > 8e-4
