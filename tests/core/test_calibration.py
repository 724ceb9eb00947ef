"""The whole way from a campaign to a calibrated arm."""

from dataclasses import fields, replace

import numpy as np
import pytest

from core.calibration import calibrate
from core.errors import AxisUndefined, CampaignError, NotConverged
from core.kinematics import forward
from core.measurements import Measurements
from core.twin import irb_l6, scara
from core.twin.campaign import simulate_campaign, truth
from core.twin.effects import parse_effect
from core.twin.noise import Noise

SILENT = Noise(instrument=False, repeatability=False)
CELLS = {"irb_l6": irb_l6.cell, "scara": scara.cell}


def only(campaign, keep):
    """The campaign with some of its rows."""
    table = campaign.measurements
    rows = keep(table)
    columns = {f.name: getattr(table, f.name) for f in fields(table)}
    kept = Measurements(**{name: None if column is None else column[rows] for name, column in columns.items()})
    return replace(campaign, measurements=kept)


def with_points(campaign, points_m):
    return replace(campaign, measurements=replace(campaign.measurements, point_m=points_m))


def with_covariance(campaign, covariance_m2):
    return replace(campaign, measurements=replace(campaign.measurements, covariance_m2=covariance_m2))


@pytest.fixture(scope="module")
def noisy():
    return simulate_campaign(1)


@pytest.mark.parametrize("name", CELLS)
def test_without_noise_the_arm_is_found_to_rounding(name):
    cell = CELLS[name]()
    found, true = calibrate(simulate_campaign(1, cell, noise=SILENT)), truth(cell)
    for estimate in (found.estimate, found.joint_by_joint):
        for function, expected in zip(estimate.arm.transmissions, true.arm.transmissions, strict=True):
            np.testing.assert_allclose(function.coefficients, expected.coefficients, atol=1e-9)
            assert function.offset == pytest.approx(expected.offset, abs=1e-9)
        for line, expected in zip(estimate.arm.axes, true.arm.axes, strict=True):
            np.testing.assert_allclose(line.direction, expected.direction, atol=1e-9)


def test_without_noise_table_2_is_found(noisy):
    found, true = calibrate(simulate_campaign(1, noise=SILENT)), truth()
    np.testing.assert_allclose(found.estimate.geometry.model.parameters, true.phi.parameters, atol=1e-9)
    np.testing.assert_allclose(found.estimate.geometry.base, true.base, atol=1e-9)


@pytest.mark.parametrize("name", CELLS)
def test_the_calibrated_robot_puts_the_tool_where_the_arm_puts_it(name):
    cell = CELLS[name]()
    found, true = calibrate(simulate_campaign(1, cell, noise=SILENT)), truth(cell)
    commanded = true.arm.commanded_for(np.random.default_rng(0).uniform(-0.2, 0.2, (20, cell.robot.joint_count)))
    predicted = forward(found.robot(), found.estimate.arm.net(commanded))
    real = true.base @ true.tool_poses(commanded)
    in_instrument = found.estimate.geometry.base @ predicted
    # The SCARA's tool hangs along parallel axes: where along them is agreed, not measured.
    along = np.abs((in_instrument - real)[:, :3, 3] @ true.arm.axes[0].direction)
    across = np.linalg.norm(np.cross((in_instrument - real)[:, :3, 3], true.arm.axes[0].direction), axis=1)
    assert across.max() < (1e-8 if name == "irb_l6" else 5e-4)
    assert name == "scara" or along.max() < 1e-8


def test_kept_out_points_shrink_from_centimetres_to_the_noise(noisy):
    """The 12 test positions that no fit has seen, target T1: calibrated prediction against measurement."""
    found, table = calibrate(noisy), noisy.measurements
    rows = np.flatnonzero((table.phase == "pose") & (table.target == 0))
    rest = np.broadcast_to(found.refinement.rest_points_m[0], (len(rows), 3))
    links = np.full(len(rows), noisy.targets[0].link)
    predicted = found.estimate.arm.points(table.commanded[rows], links, rest)
    error = np.linalg.norm(predicted - table.point_m[rows], axis=1)
    assert table.check[rows].all()
    assert error.mean() < 3e-3


def test_noise_is_found_whatever_was_stated(noisy):
    true_sigma = np.hypot(0.19e-3 / np.sqrt(3), 0.34e-3 / np.sqrt(8 / np.pi))
    table = noisy.measurements
    for covariance in (table.covariance_m2, table.covariance_m2 * 100, table.covariance_m2 * np.nan):
        found = calibrate(with_covariance(noisy, covariance))
        assert found.estimate.noise_m == pytest.approx(true_sigma, rel=0.12)


def test_gross_errors_are_named_and_left_out(noisy):
    points = noisy.measurements.point_m.copy()
    points[5] += 0.01
    points[40, 2] += 0.004
    found = calibrate(with_points(noisy, points))
    assert {r.record for r in found.rejected} == {int(noisy.measurements.record[k]) for k in (5, 40)}
    assert {r.joint for r in found.rejected} == {6, 4}
    kept = calibrate(with_points(noisy, points), reject=False)
    assert kept.rejected == ()
    assert kept.estimate.noise_m > 2 * found.estimate.noise_m


def test_a_drive_that_is_not_its_family_does_not_bend_the_geometry():
    """A mesh error that first harmonics cannot follow goes into the noise along the arc, not into lengths."""
    effect = parse_effect("mesh:1:0.5deg", irb_l6.cell().robot)
    found, true = calibrate(simulate_campaign(3, effects=(effect,))), truth()
    assert found.refinement.arc_excess[0] > 1e-3
    assert found.refinement.arc_excess[1:].max() == 0
    geometry = found.estimate.geometry
    error = (geometry.model.parameters - true.phi.parameters)[geometry.std > 0] / geometry.std[geometry.std > 0]
    assert np.sqrt(np.mean(error**2)) < 1.5


def test_paper_estimator_takes_the_whole_way(noisy):
    ours, paper = calibrate(noisy), calibrate(noisy, estimator="paper")
    assert paper.estimator == "paper"
    assert paper.joint_by_joint.axis_std(6)[0] > 1.05 * ours.joint_by_joint.axis_std(6)[0]
    np.testing.assert_allclose(
        paper.estimate.geometry.model.parameters, ours.estimate.geometry.model.parameters, atol=1e-4
    )


def test_refinement_is_never_less_certain_than_joint_by_joint(noisy):
    found = calibrate(noisy)
    assert np.all(found.estimate.geometry.std <= found.joint_by_joint.geometry.std * 1.05)


def test_joints_without_a_sweep_are_named_and_nothing_is_made_up(noisy):
    found = calibrate(only(noisy, lambda t: t.joint != 3))
    assert found.not_swept == (3,)
    assert found.not_moved == ()
    assert found.estimate.geometry is None
    assert found.nominal is None
    assert found.estimate.transmissions[2] is None
    assert all(finding.frame is None for finding in found.findings)
    with pytest.raises(NotConverged, match="sweep of every joint"):
        found.robot()


def test_a_sweep_whose_command_never_changes_is_not_moved(noisy):
    table = noisy.measurements
    commanded = table.commanded.copy()
    rows = table.joint == 6
    commanded[rows, 5] = commanded[rows, 5].mean()
    found = calibrate(replace(noisy, measurements=replace(table, commanded=commanded)))
    assert found.not_moved == (6,)
    assert found.not_swept == ()


def test_one_sweep_alone_gives_its_axis(noisy):
    found = calibrate(only(noisy, lambda t: t.joint == 1))
    line, true = found.estimate.arm.axes[0], truth().arm.axes[0]
    direction_std, _ = found.estimate.axis_std(1)
    assert np.linalg.norm(line.direction - true.direction) < 4 * direction_std
    assert found.not_swept == (2, 3, 4, 5, 6)


@pytest.mark.parametrize(
    ("keep", "sentence"),
    [
        (lambda t: t.phase == "pose", "no sweep"),
        (lambda t: (t.joint == 6) & (t.step < 3), "joint 6, sweep 1: 3 points are too few"),
        (lambda t: (t.joint == 4) & (t.target != 1), "no target rides on link 4 itself"),
    ],
)
def test_useless_campaigns_are_refused_in_a_sentence(noisy, keep, sentence):
    with pytest.raises((CampaignError, AxisUndefined), match=sentence):
        calibrate(only(noisy, keep))


def test_two_motors_moving_at_once_are_refused(noisy):
    table = noisy.measurements
    commanded = table.commanded.copy()
    rows = np.flatnonzero(table.joint == 6)
    commanded[rows, 0] += np.linspace(0, 0.1, len(rows))
    with pytest.raises(CampaignError, match=r"joint 6, sweep 1: the command of joint 1 changes by 5\.73 deg"):
        calibrate(replace(noisy, measurements=replace(table, commanded=commanded)))


def test_an_unswept_joint_that_stands_in_two_places_is_refused(noisy):
    table = noisy.measurements
    commanded = table.commanded.copy()
    commanded[table.joint == 6, 0] += 0.2
    with pytest.raises(CampaignError, match="joint 1 has no sweep of its own"):
        calibrate(only(replace(noisy, measurements=replace(table, commanded=commanded)), lambda t: t.joint != 1))


def test_held_joints_may_stand_anywhere():
    """Sweeps measured in a configuration each of its own give the same zero-pose geometry."""
    cell = scara.cell()
    campaign, true = simulate_campaign(2, cell, noise=SILENT), truth(cell)
    table = only(campaign, lambda t: t.phase == "sweep").measurements
    commanded = table.commanded.copy()
    for joint in (1, 2, 3, 4):
        held = np.array([0.4, -0.3, 0.02, 0.5]) * joint / 4
        held[joint - 1] = 0.0
        commanded[table.joint == joint] += held
    points = true.arm.points(commanded, true.links[table.target], true.rest_points_m[table.target])
    found = calibrate(replace(campaign, measurements=replace(table, commanded=commanded, point_m=points)))
    for estimate in (found.estimate, found.joint_by_joint):
        for line, expected in zip(estimate.arm.axes, true.arm.axes, strict=True):
            np.testing.assert_allclose(line.direction, expected.direction, atol=1e-8)


def test_with_no_marks_all_offsets_go_into_the_geometry(noisy):
    """Without a home pose commands count from their own zero, and predictions are the same."""
    marked, unmarked = calibrate(noisy), calibrate(replace(noisy, home=None))
    assert all(f.offset == 0 for f in unmarked.estimate.arm.transmissions)
    rows = np.flatnonzero(noisy.measurements.joint == 5)
    commanded = noisy.measurements.commanded[rows]
    links = np.full(len(rows), 6)
    one, other = (
        found.estimate.arm.points(commanded, links, np.broadcast_to(found.refinement.rest_points_m[0], (len(rows), 3)))
        for found in (marked, unmarked)
    )
    assert np.abs(one - other).max() < 2e-4


def test_the_same_campaign_gives_the_same_answer(noisy):
    one, other = calibrate(noisy), calibrate(noisy)
    np.testing.assert_array_equal(one.estimate.axis_covariance, other.estimate.axis_covariance)
    assert one.findings == other.findings


@pytest.mark.parametrize("size_m", [0.005, 0.1, 1.0])
@pytest.mark.parametrize("row", [3, 20, 60, 100, 128])
def test_one_gross_error_anywhere_is_found_and_nothing_else(noisy, row, size_m):
    points = noisy.measurements.point_m.copy()
    points[row] += np.array([0.6, -0.6, 0.5]) * size_m
    found = calibrate(with_points(noisy, points))
    assert [r.record for r in found.rejected] == [int(noisy.measurements.record[row])]


def test_lost_motion_between_sweeps_does_not_bend_the_geometry():
    """Backlash of joint 3 leaves link 3 at another place in each sweep; lengths must not pay for it."""
    effect = parse_effect("backlash:3:0.2deg", irb_l6.cell().robot)
    for noise in (SILENT, Noise()):
        found, true = calibrate(simulate_campaign(5, noise=noise, effects=(effect,))), truth()
        assert not found.refinement.tied
        error = found.estimate.geometry.model.parameters - true.phi.parameters
        # Half the lost motion is a zero offset of joint 3, which moves axis 4 sideways; nothing else may change.
        error[2, 1] += 0.5 * np.deg2rad(0.2) * 0.6727
        if noise is SILENT:
            assert np.abs(error).max() < 5e-5
        else:
            std = found.estimate.geometry.std
            assert np.sqrt(np.mean((error[std > 0] / std[std > 0]) ** 2)) < 1.6


def test_sweeps_that_agree_share_the_places_of_targets(noisy):
    assert all(calibrate(simulate_campaign(seed)).refinement.tied for seed in range(30))


def test_rounding_is_never_rejected():
    assert calibrate(simulate_campaign(1, noise=SILENT)).rejected == ()
