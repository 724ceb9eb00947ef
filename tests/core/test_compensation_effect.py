"""What compensation is said to change is what it changes on the calibrated arm."""

import numpy as np
from arms_in_use import arm

from core.compensation import compensate
from core.compensation_effect import compensation_effect
from core.kinematics import forward, nominal_net
from core.rotations import vectors_of_rotations
from core.twin.noise import Noise


def commands(count: int = 40) -> np.ndarray:
    return np.random.default_rng(4).uniform(-0.4, 0.4, (count, 6))


def test_without_compensation_the_calibrated_arm_ends_where_nominal_commands_bring_it() -> None:
    ready, q = arm("l6", Noise()), commands()
    poses = forward(ready.nominal, nominal_net(ready.nominal, q))
    found = compensate(ready, poses, q)
    effect = compensation_effect(ready, poses, found, q)
    np.testing.assert_allclose(effect.nominal_commanded, q, rtol=0, atol=1e-7)
    there = forward(ready.robot, ready.drives.net(q))
    shift = np.linalg.norm(there[:, :3, 3] - poses[:, :3, 3], axis=1)
    turn = np.linalg.norm(vectors_of_rotations(there[:, :3, :3] @ np.swapaxes(poses[:, :3, :3], 1, 2)), axis=1)
    np.testing.assert_allclose(effect.nominal.position_m, shift, rtol=0, atol=1e-7)
    np.testing.assert_allclose(effect.nominal.rotation_rad, turn, rtol=0, atol=1e-7)
    assert effect.nominal.position_m.mean() > 0.03
    assert effect.compensated.position_m.max() < 1e-8
    assert effect.compensated.rotation_rad.max() < 1e-8
    np.testing.assert_allclose(effect.reached, poses, rtol=0, atol=1e-8)


def test_the_instrument_s_frame_changes_nothing() -> None:
    ready, q = arm("l6", Noise()), commands(5)
    poses = forward(ready.nominal, nominal_net(ready.nominal, q))
    here = compensation_effect(ready, poses, compensate(ready, poses, q), q)
    seen = ready.base @ poses
    there = compensation_effect(ready, seen, compensate(ready, seen, q, "instrument"), q, "instrument")
    np.testing.assert_allclose(there.nominal.position_m, here.nominal.position_m, rtol=0, atol=1e-9)
    np.testing.assert_allclose(there.reached, seen, rtol=0, atol=1e-8)


def test_poses_that_cannot_be_had_have_no_numbers() -> None:
    ready, q = arm("l6", Noise()), commands(3)
    poses = forward(ready.nominal, nominal_net(ready.nominal, q))
    poses[1, :3, 3] += 10.0
    effect = compensation_effect(ready, poses, compensate(ready, poses))
    for values in (effect.nominal.position_m, effect.compensated.rotation_rad, effect.nominal_commanded[:, 0]):
        assert np.isnan(values).tolist() == [False, True, False]
