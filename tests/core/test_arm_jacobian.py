"""Predicted points and their derivatives: against the forward model of ``core.arm`` and central differences."""

from dataclasses import replace

import numpy as np
import pytest

from core.arm import Arm, carry
from core.arm_jacobian import ArmState, Layout, Observations, active_displacements, moved, net_displacements, predict
from core.geometry import angle_between
from core.kinematics import active_commands
from core.twin import irb_l6, scara

CELLS = {"irb_l6": irb_l6.cell, "scara": scara.cell}
COUNT = 40


def plain(arm: Arm):
    return tuple(replace(f, offset=0.0) for f in arm.transmissions)


def make(name, home, seed=1):
    """State, observations at random configurations, layout of everything, and the commands behind them."""
    cell, rng = CELLS[name](), np.random.default_rng(seed)
    arm, robot = cell.truth.arm, cell.robot
    n, targets = robot.joint_count, len(cell.targets)
    state = ArmState(arm.axes, plain(arm), arm.couplings, cell.truth.rest_points_m)
    reach = np.where(robot.sliding, 0.1, 0.5)
    asked = active_commands(robot, rng.uniform(-1, 1, (COUNT, n)) * reach)
    target = rng.permutation(np.arange(COUNT) % targets)
    links = np.array([t.link for t in cell.targets])[target]
    # Lower links too, so that every joint is beyond the reach of some points.
    links = np.where(np.arange(COUNT) % 3 == 0, rng.integers(0, links + 1), links)
    seen = Observations(rng.normal(size=(COUNT, 3)), target, links, asked, robot.sliding, home)
    everything = np.ones(n, dtype=bool)
    coupled = np.array([c is not None for c in arm.couplings])
    return state, seen, Layout.of(state, robot.sliding, everything, coupled), robot


@pytest.mark.parametrize("home", [False, True])
@pytest.mark.parametrize("name", CELLS)
class TestPrediction:
    def test_points_are_those_of_the_arm(self, name, home):
        state, seen, layout, robot = make(name, home)
        # From the marks on, a drive has done nothing when nothing was asked of it: f(act) = asked + f(0).
        at_zero = np.array([float(f(0.0)) for f in state.transmissions]) if home else np.zeros(len(state.axes))
        active = np.stack([f.inverse(seen.asked[:, i] + at_zero[i]) for i, f in enumerate(state.transmissions)], axis=1)
        np.testing.assert_allclose(active_displacements(state, seen), active, atol=1e-12)
        arm = Arm(robot, state.axes, state.transmissions, state.couplings)
        net = arm.net_of_active(active)
        np.testing.assert_allclose(net_displacements(state, seen), net, atol=1e-12)
        expected = carry(state.axes, robot.sliding, net, seen.link, state.rest_points_m[seen.target])
        np.testing.assert_allclose(predict(state, seen, layout).point_m, expected, atol=1e-12)

    def test_jacobian_by_every_unknown(self, name, home):
        state, seen, layout, _ = make(name, home)
        found = predict(state, seen, layout).jacobian
        assert found.shape == (COUNT, 3, layout.size)
        h = 1e-5
        for j in range(layout.size):
            step = np.zeros(layout.size)
            step[j] = h
            ahead, behind = (predict(moved(state, layout, sign * step), seen, layout).point_m for sign in (1, -1))
            np.testing.assert_allclose(found[:, :, j], (ahead - behind) / (2 * h), atol=2e-8, err_msg=f"unknown {j}")

    def test_every_unknown_moves_some_point(self, name, home):
        state, seen, layout, _ = make(name, home)
        size = np.abs(predict(state, seen, layout).jacobian).max(axis=(0, 1))
        assert size.min() > 1e-4

    def test_by_net_displacement(self, name, home):
        state, seen, layout, robot = make(name, home)
        net, rest = net_displacements(state, seen), state.rest_points_m[seen.target]
        found = predict(state, seen, layout).by_net
        for i in range(len(state.axes)):
            step = np.zeros(len(state.axes))
            step[i] = 1e-5
            ahead, behind = (carry(state.axes, robot.sliding, net + s * step, seen.link, rest) for s in (1, -1))
            np.testing.assert_allclose(found[:, :, i], (ahead - behind) / 2e-5, atol=2e-9)


@pytest.mark.parametrize("name", CELLS)
def test_without_offsets_and_marks_it_is_the_arm_under_its_commands(name):
    state, seen, layout, robot = make(name, home=False)
    commanded = np.random.default_rng(3).uniform(-0.1, 0.1, seen.asked.shape)
    seen = replace(seen, asked=active_commands(robot, commanded))
    arm = Arm(robot, state.axes, state.transmissions, state.couplings)
    expected = arm.points(commanded, seen.link, state.rest_points_m[seen.target])
    np.testing.assert_allclose(predict(state, seen, layout).point_m, expected, atol=1e-12)


@pytest.mark.parametrize("name", CELLS)
def test_from_the_marks_with_offsets_it_is_the_arm_under_its_commands(name):
    cell = CELLS[name]()
    state, seen, layout, robot = make(name, home=True)
    true = cell.truth
    commanded = true.home + np.random.default_rng(3).uniform(-0.1, 0.1, seen.asked.shape)
    seen = replace(seen, asked=active_commands(robot, commanded - true.home))
    expected = true.arm.points(commanded, seen.link, state.rest_points_m[seen.target])
    np.testing.assert_allclose(predict(state, seen, layout).point_m, expected, atol=1e-12)


@pytest.mark.parametrize("name", CELLS)
def test_what_is_held_is_not_laid_out_and_does_not_move(name):
    state, seen, _, robot = make(name, home=True)
    swept = np.ones(robot.joint_count, dtype=bool)
    swept[1] = False
    layout = Layout.of(state, robot.sliding, swept, np.zeros(robot.joint_count, dtype=bool))
    assert layout.axes[1] is None
    assert layout.transmissions[1] is None
    assert all(place is None for place in layout.couplings)
    after = moved(state, layout, np.full(layout.size, 0.01))
    assert after.axes[1] is state.axes[1]
    assert after.transmissions[1] is state.transmissions[1]
    assert predict(state, seen, layout).jacobian.shape[2] == layout.size


@pytest.mark.parametrize("name", CELLS)
def test_steps_tilt_and_shift_the_axes(name):
    state, _, layout, robot = make(name, home=True)
    step = np.zeros(layout.size)
    for place, slides in zip(layout.axes, robot.sliding, strict=True):
        step[place] = [3e-3, 4e-3] if slides else [3e-3, 4e-3, 0.6, 0.8]
    for line, after, slides in zip(state.axes, moved(state, layout, step).axes, robot.sliding, strict=True):
        assert angle_between(line.direction, after.direction) == pytest.approx(5e-3, rel=1e-6)
        assert np.linalg.norm(after.point_m - line.point_m) == pytest.approx(0.0 if slides else 1.0)
