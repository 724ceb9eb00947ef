"""Faults added to the simulated cells: each does what its line in the catalogue says, and nothing else."""

import re

import numpy as np
import pytest

from core.arm import carry
from core.errors import InputError
from core.geometry import Array, angle_between, apply, rigid_fit
from core.measurements import POSE
from core.phi_model import frames
from core.twin import irb_l6, scara
from core.twin.campaign import both_ways, in_motion, simulate_campaign, truth
from core.twin.cell import Cell
from core.twin.effect_units import Quantity
from core.twin.effects import CATALOGUE, parse_effect
from core.twin.forward import true_points
from core.twin.noise import Noise

SILENT = Noise(instrument=False, repeatability=False)
DEG = np.pi / 180
CONTRACT = (
    "geometry zero_offset ratio eccentricity mesh backlash compliance coupling axis_wobble latency thermal drift "
    "base_shift target_slip scale hysteresis flexure payload linkage quantisation"
)


def faulty(cell: Cell, *texts: str) -> Array:
    return true_points(cell, tuple(parse_effect(text, cell.robot) for text in texts))


def rows_of(cell: Cell, joint: int) -> np.ndarray:
    return np.flatnonzero(cell.schedule.column("joint") == joint)


def turned(cell: Cell, points: Array, joint: int) -> Array:
    """By how much each point of a sweep lies further round its axis than on the healthy arm, rad."""
    axis, rows = cell.truth.arm.axes[joint - 1], rows_of(cell, joint)
    before, after = (p[rows] - axis.point_m for p in (cell.points_m, points))
    across = [v - (v @ axis.direction)[:, None] * axis.direction for v in (before, after)]
    sine = np.cross(*across) @ axis.direction
    return np.arctan2(sine, np.sum(across[0] * across[1], axis=1))


def x_of(cell: Cell, joint: int) -> Array:
    """What the motor of a joint makes of its commands in its own sweep."""
    schedule = cell.schedule
    return cell.truth.arm.active(schedule.commanded)[schedule.stop][rows_of(cell, joint), joint - 1]


def test_every_effect_of_the_contract_can_be_made():
    assert [kind.name for kind in CATALOGUE] == CONTRACT.split()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("zero_offset:1:0.1deg", lambda x: 0.1 * DEG + 0 * x),
        ("ratio:1:0.5%", lambda x: 0.005 * x),
        ("eccentricity:1:0.2deg", lambda x: 0.2 * DEG * (0.8 * np.sin(x) + 0.6 * np.cos(x))),
        ("mesh:1:2mrad", lambda x: 2e-3 * np.sin(9.5 * x + 0.5)),
        ("quantisation:1:0.5deg", lambda x: 0.5 * DEG * np.round(x / (0.5 * DEG)) - x),
        ("backlash:1:0.2", lambda x: -0.1 * DEG + 0 * x),
    ],
)
def test_drive_faults_turn_the_joint_by_their_formula(text, expected):
    cell = irb_l6.cell()
    np.testing.assert_allclose(turned(cell, faulty(cell, text), 1), expected(x_of(cell, 1)), atol=1e-12)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("zero_offset:3:0.4", lambda x: 0.4e-3 + 0 * x),
        ("ratio:3:1000ppm", lambda x: 1e-3 * x),
        ("mesh:3:30um", lambda x: 30e-6 * np.sin(9.5 * 2 * np.pi * x / 0.04 + 0.5)),
        ("compliance:3:5um/N", lambda x: -5e-6 * 2.0 * 9.80665 + 0 * x),
    ],
)
def test_drive_faults_slide_the_joint_by_their_formula(text, expected):
    """Joint 3 of the SCARA slides up; 2 kg hang on it."""
    cell = scara.cell()
    rows, axis = rows_of(cell, 3), cell.truth.arm.axes[2]
    slid = (faulty(cell, text) - cell.points_m)[rows] @ axis.direction
    np.testing.assert_allclose(slid, expected(x_of(cell, 3)), atol=2e-9)


def test_a_fault_of_one_joint_leaves_the_links_below_alone():
    cell = irb_l6.cell()
    moved = np.linalg.norm(faulty(cell, "zero_offset:4:0.3deg") - cell.points_m, axis=1)
    below = cell.target_links[cell.schedule.target] < 4
    assert below.any()
    assert moved[below].max() == 0
    assert moved[~below].min() > 1e-4


def test_backlash_shows_as_the_gap_between_forward_and_backward():
    cell = both_ways(irb_l6.cell())
    angle = turned(cell, faulty(cell, "backlash:1:0.2deg"), 1)
    np.testing.assert_allclose(angle[:16], -0.1 * DEG, atol=1e-12)
    np.testing.assert_allclose(angle[16:], 0.1 * DEG, atol=1e-12)


def test_hysteresis_builds_up_after_a_reversal_to_the_backlash_that_it_tends_to():
    cell = both_ways(irb_l6.cell())
    angle = turned(cell, faulty(cell, "hysteresis:1:0.2deg"), 1)
    step, half = 48 / 15, 24 / 15
    assert angle[15] == pytest.approx(-0.1 * DEG, rel=1e-3)
    # Backwards: from half a step beyond the last point, 2 half steps after the reversal there.
    travel = half + step * np.arange(16)
    np.testing.assert_allclose(angle[16:], 0.1 * DEG * (1 - 2 * np.exp(-travel / 5)), atol=2e-3 * 0.1 * DEG)


def test_latency_needs_speed():
    cell = in_motion(irb_l6.cell())
    angle = turned(cell, faulty(cell, "latency:1:20ms"), 1)
    np.testing.assert_allclose(angle, -0.020 * cell.schedule.speed[cell.schedule.stop][rows_of(cell, 1), 0], atol=1e-12)
    assert angle.max() < -1e-4
    still = irb_l6.cell()
    np.testing.assert_allclose(faulty(still, "latency:all:20ms"), still.points_m, atol=1e-14)


def test_a_campaign_with_latency_is_measured_in_motion():
    late = simulate_campaign(1, noise=SILENT, effects=(parse_effect("latency:1:20ms"),))
    assert np.abs(late.measurements.speed).max() > 0.1
    moved = np.linalg.norm(late.measurements.point_m - irb_l6.cell().points_m, axis=1)
    assert moved[rows_of(irb_l6.cell(), 1)].min() > 1e-4
    assert moved[late.measurements.phase == POSE].max() < 1e-12


def test_compliance_sags_by_the_weight_that_the_drive_holds():
    """With the forearm level; joint 4 keeps the hand level, so drive 3 carries the hand as if hung on axis 4."""
    cell = irb_l6.cell()
    torque = -9.80665 * (14.0 * 0.24 + (4.0 + 3.0 + 1.5) * 0.67)
    points = faulty(cell, "compliance:3:5urad/Nm")
    home = np.argmin(np.abs(x_of(cell, 3)))
    # Joint 3 turns about +X, along which the forearm's weight turns it down: negative.
    assert turned(cell, points, 3)[home] == pytest.approx(5e-6 * torque, rel=0.03)


def test_payload_sags_as_elastic_energy_demands():
    """Castigliano: weight times its own sag is the sum over the drives of torque squared over stiffness."""
    cell, weight = irb_l6.cell(), 5 * 9.80665
    arm, schedule, down = cell.truth.arm, cell.schedule, -cell.truth.base[:3, 2]
    last = np.flatnonzero(schedule.column("pose") == 11)
    motion = rigid_fit(cell.points_m[last], faulty(cell, "payload:-:5kg")[last])
    active = arm.active(schedule.commanded[-1:])
    tool = (cell.truth.frames_at_rest()[-1] @ cell.robot.link_transforms[-1])[None, :3, 3]

    def height(x: Array) -> float:
        return float(-carry(arm.axes, cell.robot.sliding, arm.net_of_active(x), np.array([6]), tool)[0] @ down)

    torques = [-weight * (height(active + d) - height(active - d)) / 2e-6 for d in 1e-6 * np.eye(6)]
    before = carry(arm.axes, cell.robot.sliding, arm.net_of_active(active), np.array([6]), tool)[0]
    sag = (apply(motion, before) - before) @ down
    assert sag > 5e-4
    assert weight * sag == pytest.approx(np.sum(np.square(torques) / cell.stiffness), rel=0.03)


def test_a_new_coupling_turns_the_other_joint():
    cell = irb_l6.cell()
    rows = rows_of(cell, 4)[1::2]
    moved = np.linalg.norm(faulty(cell, "coupling:4-6:0.02") - cell.points_m, axis=1)
    radius = 0.161
    np.testing.assert_allclose(moved[rows], 0.02 * np.abs(x_of(cell, 4)[1::2]) * radius, rtol=0.02)
    assert moved[rows_of(cell, 6)].max() < 1e-12


def test_geometry_moves_all_that_follows():
    cell, effect = irb_l6.cell(), parse_effect("geometry:2.a:1mm")
    true = truth(cell, (effect,))
    assert true.phi.a_m[1] - cell.truth.phi.a_m[1] == pytest.approx(1e-3)
    shift = true.rest_points_m - cell.truth.rest_points_m
    riding = cell.target_links > 2
    np.testing.assert_allclose(np.linalg.norm(shift[riding], axis=1), 1e-3, rtol=1e-9)
    np.testing.assert_allclose(shift[~riding], 0, atol=1e-15)
    records = simulate_campaign(1, noise=SILENT, effects=(effect,)).measurements
    rows = cell.schedule
    again = true.arm.points(records.commanded, true.links[rows.target], true.rest_points_m[rows.target])
    np.testing.assert_allclose(records.point_m, again, atol=1e-12)


def test_an_angle_of_the_geometry_tilts_the_axes_that_follow():
    true = truth(effects=(parse_effect("geometry:3.alpha:0.1deg"),)).arm.axes
    tilt = [angle_between(a.direction, b.direction) for a, b in zip(true, truth().arm.axes, strict=True)]
    assert tilt[:3] == [0, 0, 0]
    assert tilt[3] == pytest.approx(0.1 * DEG)


@pytest.mark.parametrize("text", ["axis_wobble:1:0.03deg", "axis_wobble:1:0.4mm"])
def test_wobble_leaves_the_circle_twice_a_turn(text):
    cell = scara.cell()
    rows = rows_of(cell, 1)
    moved = (faulty(cell, text) - cell.points_m)[rows]
    axis, x = cell.truth.arm.axes[0], x_of(cell, 1)
    if "mm" in text:
        np.testing.assert_allclose(moved @ axis.direction, 0, atol=1e-15)
        np.testing.assert_allclose(np.linalg.norm(moved, axis=1), 0.4e-3 * 2 * np.abs(np.sin(x)), atol=1e-12)
        return
    columns = np.stack([f(k * x) for k in (1, 2, 3) for f in (np.sin, np.cos)] + [np.ones_like(x)], axis=1)
    left_over = np.linalg.lstsq(columns, moved @ axis.direction)[1]
    assert np.abs(moved @ axis.direction).max() > 1e-4
    assert left_over[0] < 1e-15


def test_thermal_growth_scales_the_whole_arm_from_its_first_axis():
    cell = irb_l6.cell()
    points = faulty(cell, "thermal:all:100ppm/K")
    warm = cell.schedule.arm_c - cell.schedule.arm_c[0]
    origin = frames(cell.truth.phi, np.zeros(6), cell.truth.base)[0, :3, 3]
    grown = origin + (cell.points_m - origin) * (1 + 1e-4 * warm)[:, None]
    np.testing.assert_allclose(points, grown, atol=1e-12)
    assert np.abs(points - cell.points_m).max() > 3e-4


def test_thermal_growth_of_one_link_leaves_the_others_alone():
    cell = irb_l6.cell()
    moved = np.linalg.norm(faulty(cell, "thermal:3:100") - cell.points_m, axis=1)
    warm = cell.schedule.arm_c - cell.schedule.arm_c[0]
    links = cell.target_links[cell.schedule.target]
    assert moved[links < 3].max() == 0
    np.testing.assert_allclose(moved[links == 6], 0.6727 * 1e-4 * warm[links == 6], rtol=1e-3)


def test_flexure_bends_what_lies_beyond():
    cell = irb_l6.cell()
    moved = np.linalg.norm(faulty(cell, "flexure:3:10urad/Nm") - cell.points_m, axis=1)
    links = cell.target_links[cell.schedule.target]
    assert moved[links <= 3].max() == 0
    # Weights of links 4..6 about the middle of the forearm (0.335 m out), turning T1, 0.625 m further out.
    moment = 9.80665 * (4.0 * 0.355 + 3.0 * 0.465 + 1.5 * 0.5675)
    row = rows_of(cell, 6)[8]
    assert moved[row] == pytest.approx(1e-5 * moment * 0.64, rel=0.05)


def test_linkage_is_a_parallelogram_that_does_not_quite_close():
    """Checked by closing the loop: crank 1, coupler 3, output crank 1.01, ground 3, square at home."""
    cell = irb_l6.cell()
    x = x_of(cell, 1)
    output = x + turned(cell, faulty(cell, "linkage:1:1%"), 1)
    start = np.angle(-3 + 1j) - np.arccos((10 + 1.01**2 - 9) / (2 * np.sqrt(10) * 1.01))
    crank, rocker = np.exp(1j * (np.pi / 2 + x)), 3 + 1.01 * np.exp(1j * (start + output))
    np.testing.assert_allclose(np.abs(rocker - crank), 3, atol=1e-12)
    assert np.abs(output - x).max() > 1e-3
    np.testing.assert_allclose(faulty(cell, "linkage:1:0%"), cell.points_m, atol=1e-12)


def test_base_drift_scale_and_slip():
    cell = irb_l6.cell()
    clean, records = cell.points_m, np.arange(1, 166)
    shifted = np.linalg.norm(faulty(cell, "base_shift:60:1mm") - clean, axis=1)
    np.testing.assert_allclose(shifted, np.where(records >= 60, 1e-3, 0), atol=1e-12)
    crept = np.linalg.norm(faulty(cell, "drift:-:0.5mm/h") - clean, axis=1)
    np.testing.assert_allclose(crept, 0.5e-3 * cell.schedule.time_s / 3600, atol=1e-12)
    np.testing.assert_allclose(faulty(cell, "scale:-:200ppm"), clean * 1.0002, rtol=1e-14)
    slipped = np.linalg.norm(faulty(cell, "target_slip:T1@100:2mm") - clean, axis=1)
    which = (cell.schedule.target == 0) & (records >= 100)
    np.testing.assert_allclose(slipped, np.where(which, 2e-3, 0), atol=1e-12)


def test_turning_the_base_keeps_axis_1():
    cell = irb_l6.cell()
    np.testing.assert_allclose(turned(cell, faulty(cell, "base_shift:1:0.05deg"), 1), 0.05 * DEG, atol=1e-12)


def test_a_slip_without_a_record_begins_half_way():
    cell = irb_l6.cell()
    moved = np.linalg.norm(faulty(cell, "target_slip:T3:1mm") - cell.points_m, axis=1)[cell.schedule.target == 2]
    assert np.flatnonzero(moved > 5e-4).tolist() == list(range(len(moved) // 2, len(moved)))


def test_all_means_all_that_move_so():
    cell = scara.cell()
    np.testing.assert_array_equal(
        faulty(cell, "quantisation:all:0.1deg"), faulty(cell, *(f"quantisation:{k}:0.1deg" for k in (1, 2, 4)))
    )


def test_no_effect_is_the_healthy_arm():
    for cell in (irb_l6.cell(), scara.cell()):
        np.testing.assert_allclose(faulty(cell, "scale:-:0", "ratio:1:0", "flexure:all:0"), cell.points_m, atol=1e-13)


def test_a_fault_of_the_arm_does_not_show_in_what_the_campaign_says():
    healthy, sick = simulate_campaign(1), simulate_campaign(1, effects=(parse_effect("backlash:2:0.2deg"),))
    np.testing.assert_array_equal(healthy.measurements.commanded, sick.measurements.commanded)
    np.testing.assert_array_equal(healthy.home, sick.home)
    assert (healthy.title, healthy.notes, healthy.targets) == (sick.title, sick.notes, sick.targets)
    assert np.abs(healthy.measurements.point_m - sick.measurements.point_m).max() > 1e-4


def test_sizes_are_read_with_or_without_their_unit():
    assert parse_effect("backlash:3:0.2").size == pytest.approx(0.2 * DEG)
    assert parse_effect(" backlash : 3 : 0.2 mrad ").size == pytest.approx(0.2e-3)
    assert parse_effect("backlash:3:0.2", scara.nominal_robot()).size == pytest.approx(0.2e-3)
    assert parse_effect("scale:-:-12").size == pytest.approx(-12e-6)
    assert parse_effect("thermal:all:1e2").size == pytest.approx(1e-4)
    assert parse_effect("geometry:2:0.1deg").parameter == "theta"
    assert parse_effect("geometry:2:1").quantity is Quantity.LENGTH
    coupling = parse_effect("coupling:3-4:1%")
    assert (coupling.source, coupling.joint, coupling.size) == (3, 4, 0.01)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("backlash:3", "has 2 parts, expected three: NAME:JOINT:SIZE"),
        ("slop:3:1", "there is no effect 'slop'; expected one of geometry, zero_offset"),
        ("backlash:elbow:1", "backlash needs a joint in the middle, got 'elbow'"),
        ("backlash:7:1deg", "has no joint or link 7, expected 1..6"),
        ("backlash:3:1mm", "joint 3 of ASEA IRB L6 turns, so its size is in deg"),
        ("backlash:3:abc", "must be a number with or without a unit, got 'abc'"),
        ("backlash:3:1furlong", "there is no unit 'furlong'; expected one of deg, rad"),
        ("ratio:3:1deg", "the size of ratio must be a fraction (1, %, ppm), got '1deg'"),
        ("geometry:6:1mm", "has no frame 6, expected 1..5"),
        ("geometry:2.alpha:1mm", "alpha is an angle"),
        ("coupling:3:0.1", "coupling needs two joints such as 3-4"),
        ("coupling:3-3:0.1", "from one joint to another"),
        ("drift:3:1", "drift needs '-' in the middle, got '3'"),
        ("quantisation:1:0deg", "a step must be greater than 0"),
        ("backlash:1:1e999", "must be a finite number"),
    ],
)
def test_effects_that_cannot_be_are_refused_in_one_sentence(text, words):
    with pytest.raises(InputError, match=re.escape(words)) as refused:
        parse_effect(text, irb_l6.nominal_robot())
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("target_slip:T9:1mm", "there is no target 'T9'; expected one of P1"),
        ("base_shift:900:1mm", "there is no record 900, expected 1..176"),
        ("backlash:3:1deg", "joint 3 of SCARA 650 slides, so its size is in mm"),
        ("linkage:3:1%", "joint 3 of SCARA 650 slides, expected one that turns"),
        ("linkage:2:1%", "joint 2 turns by 126 deg from home, a parallelogram can follow 75 deg"),
        ("linkage:4:1%", "a parallelogram can follow"),
    ],
)
def test_effects_that_the_cell_has_no_place_for_are_refused(text, words):
    with pytest.raises(InputError, match=re.escape(words)):
        simulate_campaign(1, scara.cell(), effects=(parse_effect(text),))
