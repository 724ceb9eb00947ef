"""The simulated cells: that they are the arm of the paper, measured as the paper measured it."""

import time

import numpy as np
import pytest

from core.geometry import angle_between
from core.kinematics import active_commands, forward, nominal_net
from core.measurements import POSE, SWEEP
from core.phi_convention import convention_for
from core.phi_model import axes, from_axes, near
from core.robot_files import read_robot
from core.session_plan import commands_for
from core.twin import irb_l6, irb_l6_arm, scara
from core.twin.campaign import both_ways, in_motion, simulate_campaign, truth
from core.twin.cell import Cell
from core.twin.noise import Noise, Repeatability

SILENT = Noise(instrument=False, repeatability=False)
CELLS = [irb_l6.cell, scara.cell]


@pytest.fixture(scope="module")
def silent():
    return simulate_campaign(1, noise=SILENT)


def printed_four_bar(x):
    sine, cosine = np.sin(x), np.cos(x)
    return np.arctan((-0.998132 * sine + 0.213253 * cosine - 0.212863) / (cosine + 0.096654 * sine + 0.0006941))


N = 32 / 19
PRINTED_TRANSMISSIONS = [
    lambda x: x + 0.000771 * np.sin(x) + 0.000007 * np.cos(x),
    lambda x: x + 0.001094 * np.sin(x) + 0.001317 * np.cos(x),
    lambda x: x + 0.003462 * np.sin(x) + 0.000867 * np.cos(x),
    lambda x: x,
    lambda x: N * (x / N + 0.041227 * np.sin(x / N) + 0.000013 * np.cos(x / N)),
    lambda x: x + 0.017334 * np.sin(x) + 0.002677 * np.cos(x),
]
PRINTED_COUPLINGS = {
    2: printed_four_bar,
    3: lambda x: -x,
    4: lambda x: N * x + 0.040562 * np.sin(N * x) + 0.000018 * np.cos(N * x),
}


@pytest.mark.parametrize("joint", range(6))
def test_drives_are_those_of_section_4(joint):
    x = np.linspace(-1.2, 1.2, 25)
    f = truth().arm.transmissions[joint]
    np.testing.assert_allclose(f(x) - f.offset, PRINTED_TRANSMISSIONS[joint](x), atol=1e-14)


@pytest.mark.parametrize("joint", PRINTED_COUPLINGS)
def test_couplings_are_those_of_section_4_counted_from_zero(joint):
    x = np.linspace(-1.2, 1.2, 25)
    printed = PRINTED_COUPLINGS[joint]
    np.testing.assert_allclose(truth().arm.couplings[joint](x), printed(x) - printed(0.0), atol=1e-14)


def test_axes_stand_where_section_4_measured_them():
    for found, point, direction in zip(
        truth().arm.axes, irb_l6_arm.AXIS_POINTS_M, irb_l6_arm.AXIS_DIRECTIONS, strict=True
    ):
        assert angle_between(found.direction, direction) < 2e-4
        assert np.linalg.norm(found.foot_of(point) - point) < 2e-4


@pytest.mark.parametrize("make", CELLS)
def test_the_true_parameters_are_what_the_true_axes_say(make):
    """Errors of parameters that no axis can show would be no errors."""
    cell = make()
    rule = convention_for(
        axes(cell.nominal), cell.robot.sliding, cell.nominal.phi_rad, y_reference=np.array([0, 1.0, 0])
    )
    base, model = from_axes(cell.truth.arm.axes, rule)
    np.testing.assert_allclose(near(model, cell.truth.phi).parameters, cell.truth.phi.parameters, atol=1e-9)
    np.testing.assert_allclose(base, cell.truth.base, atol=1e-9)


def test_the_nominal_model_misses_by_what_the_paper_reports():
    """47.00 mm and 0.05 rad over twelve positions, each arm in its own base frame."""
    cell = irb_l6.cell()
    records = simulate_campaign(1, noise=SILENT).measurements
    poses = records.commanded[records.phase == POSE][::3]
    nominal, real = forward(cell.robot, nominal_net(cell.robot, poses)), cell.truth.tool_poses(poses)
    position = np.linalg.norm(nominal[:, :3, 3] - real[:, :3, 3], axis=1)
    cosine = (np.einsum("mij,mij->m", nominal[:, :3, :3], real[:, :3, :3]) - 1) / 2
    assert len(poses) == 12
    assert position.mean() == pytest.approx(0.0470, abs=0.0001)
    assert np.arccos(cosine).mean() == pytest.approx(0.050, abs=0.0005)


def test_tool_poses_agree_with_targets_on_the_end_effector(silent):
    """Three points on link 6 keep their place in the tool's frame."""
    records, true = silent.measurements, truth()
    rows = np.flatnonzero(records.phase == POSE)
    tools = true.base @ true.tool_poses(records.commanded[rows])
    seen = np.einsum("mji,mj->mi", tools[:, :3, :3], records.point_m[rows] - tools[:, :3, 3])
    for target in np.unique(records.target[rows]):
        same = seen[records.target[rows] == target]
        np.testing.assert_allclose(same, same[:1].repeat(len(same), axis=0), atol=1e-12)


def test_home_is_where_every_net_displacement_is_zero(silent):
    np.testing.assert_allclose(truth().arm.net(silent.home), 0, atol=1e-14)
    assert np.abs(silent.home).max() > 0.01


def test_rows_are_those_of_table_1(silent):
    records = silent.measurements
    sweeps = records.phase == SWEEP
    assert sweeps[:129].all()
    assert not sweeps[129:].any()
    assert [s.joint for s in silent.sweeps] == [6, 5, 4, 3, 2, 1]
    assert [len(s.rows) for s in silent.sweeps] == [17, 16, 32, 16, 32, 16]
    spans = [np.ptp(s.commanded[:, s.joint - 1]) for s in silent.sweeps]
    np.testing.assert_allclose(np.rad2deg(spans), [50, 60, 90, 45, 45, 48])
    middles = [s.commanded[:, s.joint - 1].mean() - silent.home[s.joint - 1] for s in silent.sweeps]
    np.testing.assert_allclose(middles, 0, atol=1e-14)
    np.testing.assert_array_equal(records.record, np.arange(1, 166))
    np.testing.assert_array_equal(records.check, ~sweeps)
    assert (np.diff(records.time_s) == 40).all()


@pytest.mark.parametrize("make", CELLS)
def test_one_motor_moves_in_a_sweep(make):
    campaign = simulate_campaign(1, make(), SILENT)
    for sweep in campaign.sweeps:
        motors = active_commands(campaign.robot, sweep.commanded)
        moved = np.ptp(motors, axis=0)
        assert moved[sweep.joint - 1] > 0.2
        np.testing.assert_allclose(np.delete(moved, sweep.joint - 1), 0, atol=1e-12)


@pytest.mark.parametrize("make", CELLS)
def test_commands_stay_within_the_limits(make):
    cell = make()
    low, high = np.array([joint.limits for joint in cell.robot.joints]).T
    assert (cell.schedule.commanded > low).all()
    assert (cell.schedule.commanded < high).all()


def test_sweeps_move_forwards_and_the_way_back_is_remembered(silent):
    records = silent.measurements
    for sweep in silent.sweeps:
        assert (records.approach[sweep.rows, sweep.joint - 1] == 1).all()
    fifth = silent.sweeps[1].rows[0]
    assert records.approach[fifth].tolist() == [1, 1, 1, 1, 1, -1]


def test_each_target_circles_the_axis_that_its_sweep_is_for(silent):
    for sweep in silent.sweeps:
        axis = truth().arm.axes[sweep.joint - 1]
        rides = np.array([silent.targets[t].link for t in sweep.target])
        own = sweep.point_m[rides == rides.min() if len(set(rides)) > 1 else rides > 0]
        away = np.linalg.norm(own - np.array([axis.foot_of(p) for p in own]), axis=1)
        assert away.min() > 0.1
        # Axes below stand at home, so those above do as well: the sweep's own axis is at rest.
        np.testing.assert_allclose(away, away[0], atol=1e-12)


def test_poses_show_three_points_that_are_not_in_line(silent):
    records = silent.measurements
    points = records.point_m[records.phase == POSE].reshape(12, 3, 3)
    area = np.linalg.norm(np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]), axis=1) / 2
    assert area.min() > 0.02


def test_theodolites_err_by_0_19_mm(silent):
    rows = silent.measurements.phase == SWEEP
    exact = silent.measurements.point_m[rows]
    only = Noise(instrument=True, repeatability=False)
    errors = [simulate_campaign(k, noise=only).measurements.point_m[rows] - exact for k in range(100)]
    assert np.sqrt(np.mean(np.sum(np.square(errors), axis=2))) * 1e3 == pytest.approx(0.19, rel=0.02)


def test_stated_covariance_is_that_of_the_instrument(silent):
    only = Noise(instrument=True, repeatability=False)
    exact, distances = silent.measurements.point_m, []
    for seed in range(60):
        records = simulate_campaign(seed, noise=only).measurements
        error = records.point_m - exact
        distances.append(np.einsum("mi,mij,mj->m", error, np.linalg.inv(records.covariance_m2), error))
    assert np.mean(distances) == pytest.approx(3.0, rel=0.03)


def test_the_arm_repeats_by_0_34_mm_and_3_3_mrad():
    rng = np.random.default_rng(5)
    corner = np.array([[0.1, 0, 0], [-0.05, 0.0866, 0], [-0.05, -0.0866, 0]])
    points = np.tile(corner, (4000, 1))
    moved = irb_l6.REPEATABILITY.displaced(points, np.repeat(np.arange(4000), 3), rng).reshape(4000, 3, 3)
    middles = moved.mean(axis=1)
    arms = moved - middles[:, None]
    turn = np.stack([arms[:, 0, 2], arms[:, 1, 2] - arms[:, 2, 2]], axis=1) / [0.1, 2 * 0.0866]
    about_z = arms[:, 0, 1] / 0.1
    angles = np.linalg.norm(np.column_stack([turn, about_z]), axis=1)
    assert np.linalg.norm(middles, axis=1).mean() * 1e3 == pytest.approx(0.34, rel=0.03)
    assert angles.mean() == pytest.approx(0.0033, rel=0.03)


def test_targets_of_one_link_move_together_and_the_floor_stays():
    points = np.array([[0, 0, 1.0], [0, 1.0, 0], [5, 5, 5.0]])
    moved = Repeatability(1e-3).displaced(points, np.array([0, 0, -1]), np.random.default_rng(1)) - points
    np.testing.assert_allclose(moved[0], moved[1], atol=1e-15)
    assert np.linalg.norm(moved[0]) > 1e-5
    np.testing.assert_array_equal(moved[2], 0)


def test_noise_can_be_switched_off_part_by_part(silent):
    both, bare = simulate_campaign(3), simulate_campaign(9, noise=SILENT)
    arm_only = simulate_campaign(3, noise=Noise(instrument=False))
    np.testing.assert_array_equal(bare.measurements.point_m, silent.measurements.point_m)
    read = both.measurements.point_m - arm_only.measurements.point_m
    assert np.sqrt(np.mean(np.sum(read**2, axis=1))) == pytest.approx(0.19e-3, rel=0.15)
    assert np.abs(arm_only.measurements.point_m - silent.measurements.point_m).max() > 3e-4


def test_a_seed_is_a_campaign():
    one, again, other = (simulate_campaign(seed).measurements.point_m for seed in (7, 7, 8))
    np.testing.assert_array_equal(one, again)
    assert np.abs(one - other).max() > 1e-4


@pytest.mark.parametrize("make", CELLS)
def test_it_says_that_it_is_simulated(make):
    campaign = simulate_campaign(4, make())
    assert "simulated" in campaign.title.lower()
    assert campaign.notes["source"].startswith("simulated")
    assert campaign.notes["seed"] == "4"


def test_a_campaign_takes_little_time():
    simulate_campaign(0)
    begin = time.perf_counter()
    for seed in range(10):
        simulate_campaign(seed)
    assert (time.perf_counter() - begin) / 10 < 0.02


@pytest.mark.parametrize("make", CELLS)
def test_the_nominal_robot_survives_its_own_text(make, tmp_path):
    cell: Cell = make()
    path = tmp_path / "robot.toml"
    path.write_text(cell.robot_toml(), encoding="utf-8")
    read = read_robot(path)
    np.testing.assert_allclose(read.link_transforms, cell.robot.link_transforms, atol=1e-12)
    np.testing.assert_allclose(read.phi_rad, cell.robot.phi_rad, atol=1e-14)
    assert [(j.kind, j.transmission) for j in read.joints] == [(j.kind, j.transmission) for j in cell.robot.joints]
    assert [(c.source, c.target, c.form) for c in read.couplings] == [
        (c.source, c.target, c.form) for c in cell.robot.couplings
    ]
    np.testing.assert_allclose(read.coupling_gains, cell.robot.coupling_gains, rtol=1e-12)
    assert [link.mass_kg for link in read.links] == [link.mass_kg for link in cell.robot.links]


def test_both_ways_comes_back_over_the_same_steps(silent):
    records = simulate_campaign(1, both_ways(irb_l6.cell()), SILENT).measurements
    sixth = np.flatnonzero(records.joint == 6)
    assert records.step[sixth].tolist() == [*range(17), *range(16, -1, -1)]
    assert records.approach[sixth, 5].tolist() == [1] * 17 + [-1] * 17
    np.testing.assert_allclose(records.point_m[sixth[:17]], records.point_m[sixth[17:]][::-1], atol=1e-14)


def test_in_motion_speeds_are_recorded(silent):
    records = simulate_campaign(1, in_motion(irb_l6.cell()), SILENT).measurements
    fourth = records.joint == 4
    assert (records.speed[fourth, 3] > 0.05).all()
    np.testing.assert_allclose(records.speed[fourth, 4], N * records.speed[fourth, 3])
    assert not records.speed[records.phase == POSE].any()
    assert silent.measurements.speed is None


@pytest.mark.parametrize("make", CELLS)
def test_motors_and_commands_are_each_other_s_inverse(make):
    robot = make().robot
    motors = np.random.default_rng(2).normal(size=(5, robot.joint_count))
    np.testing.assert_allclose(active_commands(robot, commands_for(robot, motors)), motors, atol=1e-14)


def test_the_scara_slides_by_its_ratio():
    campaign = simulate_campaign(1, scara.cell(), SILENT)
    slide = next(s for s in campaign.sweeps if s.joint == 3)
    travel = np.linalg.norm(slide.point_m[-1] - slide.point_m[0])
    assert np.ptp(slide.commanded[:, 2]) / travel == pytest.approx(scara.SLIDE_RATIO, rel=1e-12)
    assert campaign.home is None
    assert [len(s.rows) for s in campaign.sweeps] == [40, 30, 36, 40]


def test_the_scara_is_seen_by_a_tracker():
    cell = scara.cell()
    exact = simulate_campaign(1, cell, SILENT).measurements.point_m
    only = Noise(instrument=True, repeatability=False)
    errors = [simulate_campaign(k, cell, only).measurements.point_m - exact for k in range(30)]
    assert np.std(errors) * 1e3 == pytest.approx(0.02, rel=0.03)


def test_the_scara_s_axes_are_parallel_by_design_and_not_quite_in_truth():
    lines = scara.cell().truth.arm.axes
    assert max(angle_between(lines[0].direction, line.direction) for line in lines) < 0.01
    assert min(angle_between(lines[0].direction, line.direction) for line in lines[1:]) > 5e-4
    assert np.linalg.norm(lines[1].foot_of(lines[0].point_m) - lines[0].point_m) == pytest.approx(0.35062, abs=1e-6)
