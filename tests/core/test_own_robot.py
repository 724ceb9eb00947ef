"""A simulated arm of somebody's own robot: what was put in is found, whatever the robot."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from core.calibration import calibrate
from core.errors import RobotError
from core.instruments import MeasureRequest
from core.measurements import Instrument, Target
from core.robot import Joint, JointKind, Robot
from core.session import Session
from core.session_campaign import to_campaign
from core.session_events import InstrumentChosen, Planned, RobotChosen, TargetsNamed, Titled
from core.session_shots import shot_at
from core.suggested_plan import suggested_sweeps, suggested_targets
from core.twin import irb_l6, scara
from core.twin.instrument import DemoInstrument, DemoRobot
from core.twin.own_robot import own_cell

STATED = Instrument("laser-tracker", 5e-5)
PANDA = (
    """format = "trueaxis-robot/1"
name = "seven"
"""
    + "".join(
        f'[[joint]]\nkind = "revolute"\nlimits = {limits}\n'
        for limits in ([-166, 166], [-101, 101], [-166, 166], [-176, -4], [-166, 166], [-1, 215], [-166, 166])
    )
    + "".join(
        f"[[dh]]\ntheta_deg = 0.0\nd_mm = {d}\na_mm = {a}\nalpha_deg = {alpha}\n"
        for d, a, alpha in (
            (333, 0, -90),
            (0, 0, 90),
            (316, 82.5, 90),
            (0, -82.5, -90),
            (384, 0, 90),
            (0, 88, 90),
            (107, 0, 0),
        )
    )
)


def session_on(path: Path, toml: str, home: tuple[float, ...] | None = None) -> Session:
    """A new session on a robot with the suggested targets and sweeps."""
    with Session.create(path, [Titled("own"), RobotChosen(toml)]) as made:
        robot = made.state.robot
    targets = suggested_targets(robot)
    sweeps = suggested_sweeps(robot, {target.name: target.link for target in targets})
    session = Session.open(path)
    session.append_all([TargetsNamed(targets), InstrumentChosen("laser-tracker", 5e-5), Planned(sweeps, home)])
    return session


def measured(session: Session, seed: int = 3):
    """The whole plan, measured on a simulated arm; the cell."""
    state = session.state
    cell = own_cell(state.robot, state.targets, STATED, state.plan.home, seed)
    robot = DemoRobot(cell, seed)
    meter = DemoInstrument(cell, robot, seed)
    shots = []
    for step in state.steps:
        robot.move_to(step.start or step.commanded, lambda: False)
        robot.move_to(step.commanded, lambda: False)
        shots.append(shot_at(step, meter.measure(MeasureRequest(step.target, step.commanded), lambda: False)))
    session.append_all(shots)
    return cell


@pytest.mark.parametrize(
    "toml", [PANDA, scara.cell().robot_toml(), irb_l6.cell().robot_toml()], ids=["dh", "scara", "phi"]
)
def test_a_calibration_finds_what_was_put_in(tmp_path: Path, toml: str) -> None:
    with session_on(tmp_path / "a.trueaxis", toml) as session:
        cell = measured(session)
        found = calibrate(to_campaign(session.state))
    geometry = found.estimate.geometry
    assert found.not_swept == ()
    known = geometry.std > 0
    scores = (geometry.model.parameters - cell.truth.phi.parameters)[known] / geometry.std[known]
    assert np.sqrt(np.mean(scores**2)) < 1.6
    # It is worth while: the errors that were put in stand out of the uncertainty.
    off = (cell.nominal.parameters - cell.truth.phi.parameters)[known] / geometry.std[known]
    assert np.sqrt(np.mean(off**2)) > 3


def test_at_home_nothing_is_displaced() -> None:
    cell = irb_l6.cell()
    home = tuple(np.deg2rad([3.0, -2.0, 5.0, 1.0, -4.0, 7.0]))
    own = own_cell(cell.robot, (Target("T", 6),), STATED, home, 5)
    assert own.truth.arm.net(np.array([home]))[0] == pytest.approx(np.zeros(6), abs=1e-12)


def test_a_target_keeps_its_place_whatever_others_are_there() -> None:
    robot = irb_l6.cell().robot
    one = own_cell(robot, (Target("A", 6),), STATED, None, 5)
    two = own_cell(robot, (Target("B", 3), Target("A", 6), Target("F", 0)), STATED, None, 5)
    assert np.array_equal(one.truth.rest_points_m[0], two.truth.rest_points_m[1])
    assert len({tuple(p) for p in two.truth.rest_points_m.tolist()}) == 3


def test_a_known_place_is_kept() -> None:
    robot = replace(irb_l6.cell().robot)
    own = own_cell(robot, (Target("A", 6, (0.1, 0.0, 0.2)),), STATED, None, 5)
    frame = own.truth.frames_at_rest()[-1]
    assert own.truth.rest_points_m[0] == pytest.approx(frame[:3, :3] @ [0.1, 0.0, 0.2] + frame[:3, 3])


def test_an_arm_without_a_phi_model_is_refused_in_a_sentence() -> None:
    single = Robot("single", (Joint(JointKind.REVOLUTE),), np.eye(4)[None])
    with pytest.raises(RobotError, match="at least two joints"):
        own_cell(single, (Target("A", 1),), STATED, None, 1)
