"""Test poses in a session: planned, visited by nominal and by compensated commands, undone, exported, read back."""

from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace
from session_scenes import demo_session

from core.campaign_files import read_campaign
from core.errors import InputError
from core.instruments import Reading
from core.kinematics import active_commands
from core.pose_visits import last_complete, next_number, pose_visits
from core.session import Session
from core.session_campaign import export_campaign, open_campaign, to_campaign
from core.session_events import PosesPlanned, SessionError
from core.session_plan import Plan, PlannedSweep
from core.session_poses import PosePlan, check_pose_plan, new_poses
from core.session_shots import senses, shot_of_pose
from core.twin import irb_l6
from core.twin.demo import plan_for

LINKS = {"T1": 6, "T2": 4, "T5": 6, "T6": 6}
NEAR = 0.01


def visit(session: Session, number: int, wanted: tuple[float, ...], shift: float, targets=("T1", "T5", "T6")) -> None:
    """A visit whose commands are off the wanted ones by ``shift`` at joint 1."""
    commanded = (wanted[0] + shift, *wanted[1:])
    for k, target in enumerate(targets):
        reading = Reading((float(k), 1.0, 2.0))
        came_from = senses(session.state.plan.home, commanded)
        session.append(shot_of_pose(number, target, commanded, wanted, came_from, reading))


@pytest.fixture
def session(tmp_path: Path):
    with demo_session(tmp_path / "a.trueaxis") as one:
        yield one


def test_the_demo_session_plans_the_test_poses_of_the_cell(session: Session) -> None:
    cell, plan = irb_l6.cell(), session.state.poses
    rows = cell.schedule
    stops = [k for k, stop in enumerate(rows.stops) if stop.phase == "pose"]
    np.testing.assert_allclose(plan.wanted, rows.commanded[stops], rtol=0, atol=1e-14)
    assert plan.targets == ("T1", "T5", "T6")


def test_visits_by_nominal_and_by_compensated_commands_are_told_apart(session: Session) -> None:
    first, second = session.state.poses.wanted[:2]
    visit(session, 0, first, 0.0)
    visit(session, 1, first, NEAR)
    visit(session, 2, second, 0.0, ("T1", "T5"))
    made = pose_visits(session.state)
    assert [(v.number, v.compensated, len(v.seen)) for v in made] == [(0, False, 3), (1, True, 3), (2, False, 2)]
    assert made[1].wants(first)
    assert not made[1].wants(second)
    assert last_complete(made, first, True, session.state.poses.targets) is made[1]
    assert last_complete(made, second, False, session.state.poses.targets) is None
    assert last_complete(made, second, False, ("T1",)) is made[2]


def test_a_pose_is_not_part_of_any_sweep_and_is_never_fitted(session: Session) -> None:
    before = session.state.next_step
    visit(session, 0, session.state.poses.wanted[0], NEAR)
    assert session.state.next_step == before
    table = to_campaign(session.state).measurements
    assert table.check.all()
    assert set(table.phase) == {"pose"}
    assert to_campaign(session.state).sweeps == ()


def test_undo_takes_one_shot_of_a_visit_back_and_numbers_are_not_used_twice(session: Session) -> None:
    visit(session, 0, session.state.poses.wanted[0], 0.0)
    session.undo()
    assert pose_visits(session.state)[0].seen == {"T1", "T5"}
    session.redo()
    visit(session, next_number(session.state), session.state.poses.wanted[0], 0.0)
    assert [v.number for v in pose_visits(session.state)] == [0, 1]
    for _ in range(6):
        session.undo()
    assert pose_visits(session.state) == ()


def test_wanted_poses_survive_the_way_through_a_campaign_folder(session: Session, tmp_path: Path) -> None:
    wanted = session.state.poses.wanted[0]
    visit(session, 0, wanted, 0.0)
    visit(session, 1, wanted, NEAR)
    export_campaign(session.state, tmp_path / "campaign")
    table = read_campaign(tmp_path / "campaign").measurements
    assert np.isnan(table.wanted[:3]).all()
    np.testing.assert_allclose(table.wanted[3:], np.tile(wanted, (3, 1)), rtol=0, atol=1e-14)
    with open_campaign(tmp_path / "campaign", tmp_path / "b.trueaxis") as other:
        made = pose_visits(other.state)
        assert [v.compensated for v in made] == [False, True]
        np.testing.assert_allclose(made[1].wanted, wanted, rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    ("plan", "sentence"),
    [
        (PosePlan(((0.0,) * 6,), ()), "without a target"),
        (PosePlan(((0.0,) * 6,), ("T2",)), "'T2' does not show the tool, expected one on link 6: T1, T5, T6"),
        (PosePlan(((0.0,) * 6,), ("T1", "T1")), "stands twice"),
        (PosePlan(((0.0,) * 6, (0.0,) * 5), ("T1",)), "pose 2 has 5 commands, expected 6"),
        (PosePlan(((0.0, 2.0, 0.0, 0.0, 0.0, 0.0),), ("T1",)), "pose 1 commands joint 2 to 114.592 deg, beyond its"),
    ],
)
def test_poses_that_cannot_be_are_refused(plan: PosePlan, sentence: str, session: Session) -> None:
    with pytest.raises(InputError, match=sentence):
        check_pose_plan(irb_l6.cell().robot, LINKS, plan)
    with pytest.raises(InputError, match=sentence):
        session.append(PosesPlanned(plan.wanted, plan.targets))


def test_a_shot_with_wanted_commands_of_another_robot_is_refused(session: Session) -> None:
    wanted = session.state.poses.wanted[0]
    good = shot_of_pose(0, "T1", wanted, wanted, (), Reading((0.0, 1.0, 2.0)))
    with pytest.raises(SessionError, match="wanted has 3 values, expected 6"):
        session.append(replace(good, wanted=wanted[:3]))


def test_new_poses_lie_within_the_swept_ranges_and_come_again_with_their_seed() -> None:
    cell = irb_l6.cell()
    plan = plan_for(cell)
    poses = new_poses(cell.robot, plan, 200, 4)
    check_pose_plan(cell.robot, LINKS, PosePlan(poses, ("T1",)))
    moved = active_commands(cell.robot, np.array(poses)) - active_commands(cell.robot, cell.home)
    for row in plan.sweeps:
        spread = moved[:, row.joint - 1]
        assert 0.7 * row.low > spread.min() >= 0.8 * row.low - 1e-9
        assert 0.7 * row.high < spread.max() <= 0.8 * row.high + 1e-9
    assert new_poses(cell.robot, plan, 200, 4) == poses
    assert new_poses(cell.robot, plan, 200, 5) != poses
    with pytest.raises(InputError, match="expected 1 to 1000"):
        new_poses(cell.robot, plan, 0, 1)
    with pytest.raises(InputError, match="no sweep is planned"):
        new_poses(cell.robot, Plan((), plan.home), 3, 1)
    narrow = Plan((PlannedSweep(6, 1, -0.1, 0.1, 3, ("T1",)),), plan.home)
    only = np.array(new_poses(cell.robot, narrow, 5, 1)) - cell.home
    assert np.abs(only[:, :5]).max() < 1e-12
