"""Setting up a cell: whatever is changed, what stays planned can be made, and an undo brings back what went."""

from pathlib import Path

import numpy as np
import pytest
from session_scenes import demo_session

from core.cell_setup import (
    changed_sweeps,
    changed_targets,
    commands_of_text,
    ends_of,
    home_events,
    new_cell_events,
    planned_sweep,
    same_cell_events,
    text_of_commands,
)
from core.errors import InputError
from core.kinematics import active_commands
from core.session import Session
from core.session_events import Fact, InstrumentChosen, RobotChosen, TargetEntry
from core.session_poses import new_poses
from core.session_state import State
from core.twin import irb_l6, scara

ROBOT = irb_l6.cell().robot


@pytest.fixture
def session(tmp_path: Path) -> Session:
    with demo_session(tmp_path / "a.trueaxis") as made:
        yield made


def entries(session: Session, **links: int) -> tuple[TargetEntry, ...]:
    """The session's targets, some on other links (0..), some gone (-1), some new."""
    now = {target.name: target.link for target in session.state.targets} | links
    return tuple(TargetEntry(name, link) for name, link in now.items() if link >= 0)


@pytest.mark.parametrize("cell", [irb_l6.cell(), scara.cell()], ids=["irb", "scara"])
def test_a_new_session_on_a_robot_can_be_measured_at_once(cell, tmp_path: Path) -> None:
    events = new_cell_events(RobotChosen(cell.robot_toml()), cell.robot, "mine", InstrumentChosen("other"))
    with Session.create(tmp_path / "a.trueaxis", events) as session:
        assert session.state.next_step.joint == cell.robot.joint_count
        assert session.state.title == "mine"
        session.append(Fact("Robot serial number", "L6-17"))
        again = same_cell_events(session.state)
        with Session.create(tmp_path / "b.trueaxis", again) as other:
            assert other.state.steps == session.state.steps
            assert other.state.shots == ()
            assert other.state.facts["Robot serial number"] == "L6-17"


def test_without_a_robot_there_is_no_other_session_like_it() -> None:
    with pytest.raises(InputError, match="has no robot"):
        same_cell_events(State())


def test_a_target_may_be_added_and_nothing_else_changes(session: Session) -> None:
    events = changed_targets(session.state, entries(session, T9=5))
    assert len(events) == 1
    session.append_all(events)
    assert session.state.target_links["T9"] == 5


def test_a_target_that_goes_takes_its_sweeps_along_and_undo_brings_them_back(session: Session) -> None:
    before = session.state
    events = changed_targets(session.state, entries(session, T1=-1))
    session.append_all(events)
    assert [row.joint for row in session.state.plan.sweeps] == [4, 3, 2]
    assert session.state.poses.wanted == ()
    assert session.state.next_step is not None
    for _ in events:
        session.undo()
    assert (session.state.plan, session.state.poses) == (before.plan, before.poses)


def test_a_target_on_another_link_leaves_the_sweeps_that_it_still_sees(session: Session) -> None:
    session.append_all(changed_targets(session.state, entries(session, T1=3)))
    rows = {row.joint: row.targets for row in session.state.plan.sweeps}
    assert rows == {4: ("T2",), 3: ("T3",), 2: ("T4", "T3"), 1: ("T1",)}
    with pytest.raises(InputError, match="the last target cannot be removed"):
        changed_targets(session.state, ())


def test_a_sweep_is_entered_by_its_commands(session: Session) -> None:
    state, at = session.state, np.deg2rad([10.0, -20.0])
    row = planned_sweep(state, 6, 2, tuple(at), 5, ("T1",), True, None)
    session.append_all(changed_sweeps(state, (*state.plan.sweeps, row)))
    assert [(r.joint, r.sweep) for r in session.state.plan.sweeps[:3]] == [(6, 1), (6, 2), (5, 1)]
    steps = [step for step in session.state.steps if (step.joint, step.sweep) == (6, 2)]
    assert np.rad2deg([steps[0].commanded[5], steps[4].commanded[5]]) == pytest.approx([-20, 10])
    assert ends_of(ROBOT, session.state, row) == pytest.approx((at[1], at[0]))
    held = commands_of_text(ROBOT, "0 5 -10 0 20 0", "others at")
    row = planned_sweep(state, 6, 2, tuple(at), 5, ("T1",), False, held)
    session.append_all(changed_sweeps(session.state, (row,)))
    assert np.rad2deg(session.state.steps[0].commanded) == pytest.approx([0, 5, -10, 0, 20, -20])


@pytest.mark.parametrize(
    ("joint", "stops", "targets", "sentence"),
    [(7, 5, ("T1",), "joint 7"), (6, 1, ("T1",), "1 stops, expected 2"), (6, 5, (), "no target")],
)
def test_a_sweep_that_cannot_be_is_refused(
    session: Session, joint: int, stops: int, targets: tuple, sentence: str
) -> None:
    with pytest.raises(InputError, match=sentence):
        planned_sweep(session.state, joint, 1, (0.0, 0.1), stops, targets, False, None)


def test_a_new_home_leaves_where_the_swept_motors_go(session: Session) -> None:
    before = active_commands(ROBOT, np.array([step.commanded for step in session.state.steps]))
    home = tuple((np.array(session.state.plan.home) + 0.01).tolist())
    session.append_all(home_events(session.state, home))
    after = active_commands(ROBOT, np.array([step.commanded for step in session.state.steps]))
    own = [step.joint - 1 for step in session.state.steps]
    # The others wait at the new marks.
    assert after[range(len(own)), own] == pytest.approx(before[range(len(own)), own], abs=1e-12)
    assert session.state.plan.home == home


def test_commands_are_read_and_written_in_the_units_of_the_joints() -> None:
    robot = scara.cell().robot
    assert commands_of_text(robot, "90, -45; 100 0", "home") == pytest.approx((np.pi / 2, -np.pi / 4, 0.1, 0.0))
    assert text_of_commands(robot, commands_of_text(robot, "90 -45 100 0", "home")) == "90 -45 100 0"
    assert commands_of_text(robot, "  ", "home") is None
    assert text_of_commands(robot, None) == ""


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("1 2", "home: 2 numbers, expected 4, one a joint, or nothing"),
        ("1 2 3 x", "home: joint 4 = 'x', expected a number from -180 to 180 deg"),
        ("1 2 200 0", "home: joint 3 = '200', expected a number from -150 to 150 mm"),
        ("nan 2 3 4", "joint 1 = 'nan'"),
    ],
)
def test_commands_that_cannot_be_are_refused(text: str, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        commands_of_text(scara.cell().robot, text, "home")


def test_test_poses_stay_within_what_sweeps_that_are_held_elsewhere_see(session: Session) -> None:
    held = commands_of_text(ROBOT, "0 0 0 60 0 0", "others at")
    row = planned_sweep(session.state, 4, 1, tuple(np.deg2rad([40.0, 80.0])), 5, ("T2", "T1"), False, held)
    session.append_all(changed_sweeps(session.state, (row,)))
    poses = np.rad2deg(new_poses(ROBOT, session.state.plan, 50, 1))
    assert poses[:, 3].min() >= 40
    assert poses[:, 3].max() <= 80
    assert np.ptp(poses[:, 3]) > 25
