"""The demo robot and instrument measure the twin as a simulated campaign does, with noise from a seed."""

import numpy as np
import pytest
from session_scenes import go_on

from core.instruments import InstrumentFailed, MeasurementCancelled, MeasureRequest, Reading
from core.session_plan import steps_of
from core.theodolite import intersect
from core.twin import irb_l6, scara
from core.twin.demo import plan_for
from core.twin.instrument import DemoInstrument, DemoRobot
from core.twin.noise import Noise

NOISY = Noise()
QUIET = Noise(instrument=False, repeatability=False)


def cell_parts(seed: int = 1, noise: Noise = NOISY, **more: int) -> tuple[DemoRobot, DemoInstrument]:
    robot = DemoRobot(irb_l6.cell(), seed, noise=noise)
    return robot, DemoInstrument(irb_l6.cell(), robot, seed, noise=noise, **more)


def look(meter: DemoInstrument, target: str = "T1") -> Reading:
    return meter.measure(MeasureRequest(target, ()), go_on)


@pytest.mark.parametrize("cell", [irb_l6.cell(), scara.cell()], ids=lambda cell: cell.title)
def test_without_noise_it_sees_where_the_targets_truly_are(cell) -> None:
    robot = DemoRobot(cell, 1, noise=QUIET)
    meter = DemoInstrument(cell, robot, 1, noise=QUIET)
    for k, step in enumerate(steps_of(cell.robot, plan_for(cell))):
        robot.move_to(step.commanded, go_on)
        assert np.allclose(look(meter, step.target).point_m, cell.points_m[k], atol=1e-9)


def test_repeated_shots_scatter_as_the_instrument_promises() -> None:
    _, meter = cell_parts()
    readings = [look(meter) for _ in range(400)]
    points = np.array([reading.point_m for reading in readings])
    xx, xy, xz, yy, yz, zz = readings[0].covariance_m2
    stated = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    ratio = np.linalg.eigvals(np.linalg.solve(stated, np.cov(points.T))).real
    assert (ratio > 0.75).all()
    assert (ratio < 1.3).all()


def test_every_visit_stands_elsewhere_and_staying_is_no_visit() -> None:
    noise = Noise(instrument=False)
    robot, meter = cell_parts(noise=noise)
    home, away = robot.commanded, tuple(value + 0.01 for value in robot.commanded)
    seen = []
    for _ in range(300):
        robot.move_to(away, go_on)
        robot.move_to(home, go_on)
        seen.append(look(meter).point_m)
        robot.move_to(home, go_on)
        assert look(meter).point_m == seen[-1]
    lengths = np.linalg.norm(np.array(seen) - np.mean(seen, axis=0), axis=1)
    assert lengths.mean() == pytest.approx(irb_l6.cell().repeatability.mean_translation_m, rel=0.1)


def test_targets_on_one_link_are_displaced_together() -> None:
    robot, _ = cell_parts()
    still, _ = cell_parts(noise=QUIET)
    for _ in range(5):
        robot.move_to(tuple(value + 0.01 for value in robot.commanded), go_on)
        still.move_to(robot.commanded, go_on)
        there, true = robot.points_m()[[0, 4, 5]], still.points_m()[[0, 4, 5]]
        apart, truly = (np.linalg.norm(p - np.roll(p, 1, axis=0), axis=1) for p in (there, true))
        assert np.allclose(apart, truly, atol=1e-5)
        assert np.abs(there - true).max() > 1e-5


def test_the_angles_lead_to_the_point() -> None:
    _, meter = cell_parts()
    reading, pair = look(meter), irb_l6.cell().instrument
    angles = np.array(reading.angles_rad).reshape(2, 1, 2)
    assert np.allclose(intersect(pair.left, pair.right, *angles).point_m[0], reading.point_m, atol=1e-12)


def test_the_seed_tells_all_and_a_restart_goes_on_with_new_noise() -> None:
    first, again, other = (look(cell_parts(seed)[1]) for seed in (1, 1, 2))
    assert first == again
    assert first.point_m != other.point_m
    _, meter = cell_parts()
    second = [look(meter), look(meter)][1]
    _, restarted = cell_parts(shots_before=1)
    assert look(restarted) == second


def test_the_clock_and_the_temperatures_go_on() -> None:
    _, meter = cell_parts(shots_before=10)
    readings = [look(meter), look(meter)]
    assert [reading.time_s for reading in readings] == [440.0, 480.0]
    assert 20.0 < readings[0].temperature_c < 22.0
    assert readings[0].arm_temperature_c < readings[1].arm_temperature_c


def test_what_cannot_be_done_is_told() -> None:
    robot, meter = cell_parts()
    with pytest.raises(InstrumentFailed, match="knows no target 'T9', expected one of T1"):
        look(meter, "T9")
    with pytest.raises(InstrumentFailed, match="6 joints"):
        robot.move_to((0.0,), go_on)
    with pytest.raises(InstrumentFailed, match="joint 1 at 99 is beyond"):
        robot.move_to((99.0, 0.0, 0.0, 0.0, 0.0, 0.0), go_on)


def test_moves_and_shots_can_be_cancelled() -> None:
    robot = DemoRobot(irb_l6.cell(), 1, seconds_a_move=30.0)
    meter = DemoInstrument(irb_l6.cell(), robot, 1, seconds_a_shot=30.0)
    here = robot.commanded
    with pytest.raises(MeasurementCancelled):
        robot.move_to(tuple(value + 0.01 for value in here), lambda: True)
    assert robot.commanded == here
    with pytest.raises(MeasurementCancelled):
        meter.measure(MeasureRequest("T1", ()), lambda: True)
