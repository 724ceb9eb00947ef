"""A plan as steps: table 1 in its order, with the commands that hold the next motor still."""

import numpy as np
import pytest

from core.errors import InputError
from core.kinematics import active_commands
from core.session_plan import Plan, PlannedSweep, check_plan, commands_for, extra_step, steps_of
from core.twin import irb_l6, scara
from core.twin.campaign import both_ways
from core.twin.demo import plan_for

LINKS = {"T1": 6, "T2": 4, "T3": 3, "T4": 2, "T5": 6, "T6": 6}
CELLS = [irb_l6.cell(), scara.cell(), both_ways(irb_l6.cell())]


def sweep(**changes: object) -> Plan:
    values = {"joint": 6, "sweep": 1, "low": -0.4, "high": 0.4, "stops": 5, "targets": ("T1",)}
    return Plan((PlannedSweep(**values | changes),), tuple(irb_l6.cell().home))


def test_the_demo_plan_is_table_1_joint_6_first() -> None:
    plan = plan_for(irb_l6.cell())
    table = [(row.joint, round(np.rad2deg(row.high - row.low)), row.stops, len(row.targets)) for row in plan.sweeps]
    assert table == [(6, 50, 17, 1), (5, 60, 16, 1), (4, 90, 16, 2), (3, 45, 16, 1), (2, 45, 16, 2), (1, 48, 16, 1)]
    check_plan(irb_l6.cell().robot, LINKS, plan)


@pytest.mark.parametrize("cell", CELLS, ids=lambda cell: cell.title)
def test_steps_are_the_rows_of_a_simulated_campaign(cell) -> None:
    rows, steps = cell.schedule, steps_of(cell.robot, plan_for(cell))
    assert len(steps) == int((rows.column("phase") == "sweep").sum()) == sum(r.shots for r in plan_for(cell).sweeps)
    names = [target.name for target in cell.targets]
    for k, step in enumerate(steps):
        stop = rows.stops[rows.stop[k]]
        assert (step.joint, step.sweep, step.step) == (stop.joint, stop.sweep, stop.step)
        assert step.target == names[rows.target[k]]
        assert step.sense == rows.approach[rows.stop[k], step.joint - 1]
        assert np.allclose(step.commanded, rows.commanded[rows.stop[k]], atol=1e-14)


def test_only_the_swept_motor_moves() -> None:
    robot = irb_l6.cell().robot
    for step in steps_of(robot, plan_for(irb_l6.cell())):
        moved = active_commands(robot, np.array([step.commanded]))[0] - active_commands(robot, irb_l6.cell().home)[0]
        assert np.abs(np.delete(moved, step.joint - 1)).max() < 1e-12


def test_a_pass_starts_beyond_its_first_stop() -> None:
    robot = irb_l6.cell().robot
    steps = steps_of(robot, sweep(both_ways=True))
    starts = [k for k, step in enumerate(steps) if step.start is not None]
    assert starts == [0, 5]
    for k in starts:
        step = steps[k]
        assert (step.commanded[5] - step.start[5]) * step.sense == pytest.approx(0.1)


def test_commands_are_undone_by_the_controller() -> None:
    for cell in CELLS:
        motors = np.random.default_rng(1).normal(size=(20, cell.robot.joint_count))
        assert np.allclose(active_commands(cell.robot, commands_for(cell.robot, motors)), motors, atol=1e-13)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"joint": 7}, "joint 7, sweep 1: expected a joint 1..6"),
        ({"low": 0.4}, "expected the lower value first"),
        ({"targets": ("T9",)}, "no target 'T9', expected one of T1"),
        ({"targets": ("T4",)}, "'T4' rides on link 2 and cannot see joint 6 move"),
        ({"targets": ("T1", "T1")}, "stands twice"),
        ({"high": 40.0}, "beyond its limits"),
        ({"stops": 300_000}, "300000 shots, expected at most 200000"),
    ],
)
def test_a_plan_that_cannot_be_made_is_refused(changes: dict, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        check_plan(irb_l6.cell().robot, LINKS, sweep(**changes))


def test_the_same_sweep_twice_and_a_short_home_are_refused() -> None:
    row = sweep().sweeps[0]
    with pytest.raises(InputError, match="joint 6, sweep 1 stands twice"):
        check_plan(irb_l6.cell().robot, LINKS, Plan((row, row)))
    with pytest.raises(InputError, match="home has 2 values, expected 6"):
        check_plan(irb_l6.cell().robot, LINKS, Plan((row,), (0.0, 0.0)))


def test_a_sweep_may_be_held_elsewhere_than_at_home() -> None:
    cell = irb_l6.cell()
    held = tuple((np.array(cell.home) + np.deg2rad([0, 10, -20, 0, 30, 0])).tolist())
    steps = steps_of(cell.robot, sweep(held=held))
    moved = active_commands(cell.robot, np.array([s.commanded for s in steps])) - active_commands(cell.robot, held)
    assert np.abs(np.delete(moved, 5, axis=1)).max() < 1e-12
    assert moved[:, 5] == pytest.approx(np.linspace(-0.4, 0.4, 5))
    with pytest.raises(InputError, match="held at 2 values, expected 6"):
        check_plan(cell.robot, LINKS, sweep(held=(0.0, 0.0)))


def test_a_pass_never_starts_beyond_a_limit() -> None:
    robot = irb_l6.cell().robot
    high = robot.joints[5].limits[1] - irb_l6.cell().home[5]
    steps = steps_of(robot, sweep(high=high, both_ways=True))
    assert max(step.start[5] for step in steps if step.start is not None) <= robot.joints[5].limits[1]


def test_an_extra_stop_is_made_like_the_sweep_that_it_belongs_to() -> None:
    cell = irb_l6.cell()
    plan = plan_for(cell)
    row = next(row for row in plan.sweeps if row.joint == 4)
    planned = next(step for step in steps_of(cell.robot, plan) if step.joint == 4 and step.step == 7)
    extra = extra_step(cell.robot, plan, row, planned.commanded[3], 16, "T2")
    assert extra.commanded == pytest.approx(planned.commanded, abs=1e-12)
    assert (extra.step, extra.sense, extra.target) == (16, 1, "T2")
    assert extra.start[3] < extra.commanded[3]
    with pytest.raises(
        InputError, match=r"the extra stop commands joint 4 to 171.887 deg, beyond its limits -90 to 90 deg"
    ):
        extra_step(cell.robot, plan, row, 3.0, 16, "T2")
