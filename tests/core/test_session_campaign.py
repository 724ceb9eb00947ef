"""A session exports as a campaign folder, a campaign folder opens as a session, and both calibrate alike."""

from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from session_scenes import busy_session, demo_session, take

from core.calibration import calibrate
from core.campaign_files import read_campaign
from core.campaign_writer import write_campaign
from core.errors import CampaignError
from core.instruments import Reading
from core.measurements import Campaign
from core.phi_model import from_axes
from core.robot_writer import phi_robot_toml
from core.session import Session
from core.session_campaign import export_campaign, open_campaign, to_campaign
from core.session_events import Judged, Planned, SessionError, ShotTaken, Titled
from core.session_plan import PlannedSweep
from core.session_shots import shot_at
from core.twin import irb_l6, scara
from core.twin.campaign import both_ways, in_motion, simulate_campaign
from core.twin.demo import demo_events

CELLS = (irb_l6.cell(), scara.cell(), both_ways(irb_l6.cell()), in_motion(scara.cell()))
URDF = """<robot name="two"><link name="a"/><link name="b"/><link name="c"/>
<joint name="j1" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="j2" type="revolute"><parent link="b"/><child link="c"/><origin xyz="0.5 0 0"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint></robot>"""


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session in which the whole of table 1 was measured."""
    path = tmp_path_factory.mktemp("sessions") / "a.trueaxis"
    with demo_session(path) as session:
        take(session, len(session.state.steps))
    return path


def assert_same(first: Campaign, second: Campaign) -> None:
    """The same to the digits that a campaign's files keep."""
    assert (first.title, first.targets, first.instrument) == (second.title, second.targets, second.instrument)
    assert first.notes == second.notes
    assert np.allclose(first.home, second.home, rtol=1e-14) if first.home is not None else second.home is None
    for column in fields(first.measurements):
        one, two = (getattr(campaign.measurements, column.name) for campaign in (first, second))
        if one is None or two is None:
            assert one is two, column.name
        elif one.dtype.kind == "f":
            assert np.allclose(one, two, rtol=1e-13, atol=1e-15, equal_nan=True), column.name
        else:
            assert (one == two).all(), column.name


def test_the_demo_session_calibrates_to_the_arm_that_stands_there(measured: Path) -> None:
    with Session.open(measured, read_only=True) as session:
        found = calibrate(to_campaign(session.state))
    true = irb_l6.cell().truth
    geometry = found.estimate.geometry
    actual = from_axes(true.arm.axes, found.convention)[1]
    error = np.abs(geometry.model.parameters - actual.parameters)
    known = np.isfinite(geometry.std) & (geometry.std > 0)
    assert found.not_swept == ()
    assert known.sum() >= 15
    assert (error[known] < 5 * geometry.std[known]).all()
    assert (error[~known] < 1e-9).all()
    # Nominal and actual differ by several millimetres: the session's data tell so.
    assert np.abs(found.nominal.parameters - geometry.model.parameters)[:, :2].max() > 5e-3


def test_a_session_survives_the_way_through_a_campaign_folder(measured: Path, tmp_path: Path) -> None:
    with Session.open(measured, read_only=True) as session:
        state = session.state
    export_campaign(state, tmp_path / "campaign")
    assert_same(to_campaign(state), read_campaign(tmp_path / "campaign"))
    with open_campaign(tmp_path / "campaign", tmp_path / "b.trueaxis", by="A. Name") as other:
        assert_same(to_campaign(state), to_campaign(other.state))
        assert [step.key for step in other.state.steps] == [step.key for step in state.steps]
        for one, two in zip(state.steps, other.state.steps, strict=True):
            assert one.commanded == pytest.approx(two.commanded, abs=1e-12)
        assert other.state.position is None


@pytest.mark.parametrize(
    "cell",
    [irb_l6.cell(), scara.cell(), both_ways(irb_l6.cell()), in_motion(scara.cell())],
    ids=lambda cell: cell.title,
)
def test_every_column_of_a_campaign_survives_the_way_through_a_session(cell, tmp_path: Path) -> None:
    write_campaign(tmp_path / "first", simulate_campaign(3, cell), cell.robot_toml())
    with open_campaign(tmp_path / "first", tmp_path / "a.trueaxis") as session:
        export_campaign(session.state, tmp_path / "second")
        assert len(session.state.shots) == read_campaign(tmp_path / "first").measurements.count
        assert session.state.position is None
    assert_same(read_campaign(tmp_path / "first"), read_campaign(tmp_path / "second"))
    for name in ("robot.toml", "measurements.csv"):
        assert (tmp_path / "first" / name).read_text() == (tmp_path / "second" / name).read_text()


def test_rare_columns_and_moves_survive_too(tmp_path: Path) -> None:
    folder = tmp_path / "first"
    folder.mkdir()
    (folder / "robot.toml").write_text(
        'format = "trueaxis-robot/1"\nname = "two"\nurdf = "two.urdf"\nbase_link = "a"\ntip_link = "c"\n'
    )
    (folder / "two.urdf").write_text(URDF)
    (folder / "campaign.toml").write_text(
        'format = "trueaxis-campaign/1"\ntitle = "rare"\njoint_values = "readback"\noperator = "Ida"\nhall = 7\n'
        'long = """first\\nsecond"""\n'
        '[[target]]\nname = "T1"\nlink = 2\nxyz_mm = [1.0, 2.0, 3.0]\nxyz_sigma_mm = 0.5\n'
    )
    (folder / "measurements.csv").write_text(
        "record,phase,joint,sweep,step,pose,use,approach1,approach2,target,q1_deg,q2_deg,x_mm,y_mm,z_mm,sigma_mm,"
        "speed1_deg_s,tau2_nm,read1_deg,target_qw,target_qx,target_qy,target_qz,sim_x_mm,sim_y_mm,sim_z_mm,payload_kg\n"
        "2,move,,,,,,,,,1,2,,,,,,,,,,,,,,,\n"
        "5,sweep,1,1,0,,fit,1,,T1,5,0,1,2,3,0.1,4,,5.01,1,0,0,0,1,2,3,1.5\n"
        "6,sweep,1,1,1,,fit,1,,T1,6,0,,,,,,,,,,,,,,,\n"
        "9,pose,,,,3,check,,-1,T1,7,8,4,5,6,,,2.5,,,,,,,,,\n"
    )
    first = read_campaign(folder)
    with open_campaign(folder, tmp_path / "a.trueaxis") as session:
        assert (session.state.operator, session.state.facts["hall"]) == ("Ida", "7")
        assert_same(first, to_campaign(session.state))
        export_campaign(session.state, tmp_path / "second")
    assert_same(first, read_campaign(tmp_path / "second"))
    assert (tmp_path / "second" / "two.urdf").read_text() == URDF


def test_shots_that_do_not_count_are_not_exported_and_the_notes_say_so(tmp_path: Path) -> None:
    with busy_session(tmp_path / "a.trueaxis") as session:
        step, old = session.state.steps[5], session.state.shots[5]
        session.append(shot_at(step, reading_of(old.taken), replaces=old.id))
        campaign = to_campaign(session.state)
        assert campaign.measurements.record.tolist() == [1, 2, 4, 5, *range(7, 14)]
        assert campaign.notes["left out"] == "record 3: somebody walked by; record 6: measured again"
        session.append(Judged((session.state.shots[2].id,), "kept"))
        assert 3 in to_campaign(session.state).measurements.record


def reading_of(shot: ShotTaken) -> Reading:
    return Reading(shot.point_m, shot.covariance_m2)


def test_a_session_without_robot_targets_or_shots_is_told_what_is_missing(tmp_path: Path) -> None:
    empty = Session.create(tmp_path / "a.trueaxis", [Titled("empty")])
    with empty, pytest.raises(SessionError, match="no robot is chosen yet"):
        to_campaign(empty.state)
    with demo_session(tmp_path / "b.trueaxis") as session, pytest.raises(SessionError, match="no shot counts yet"):
        export_campaign(session.state, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_wrong_campaign_makes_no_session(tmp_path: Path) -> None:
    cell = irb_l6.cell()
    write_campaign(tmp_path / "first", simulate_campaign(1, cell), phi_robot_toml(cell.robot, cell.nominal))
    table = tmp_path / "first" / "measurements.csv"
    table.write_text(table.read_text().replace(",T1,", ",T9,", 1))
    with pytest.raises(CampaignError, match="T9"):
        open_campaign(tmp_path / "first", tmp_path / "a.trueaxis")
    assert not (tmp_path / "a.trueaxis").exists()


def test_sweeps_that_were_held_elsewhere_come_back_as_a_plan_with_the_same_commands(tmp_path: Path) -> None:
    cell = irb_l6.cell()
    held = tuple((np.array(cell.home) + np.deg2rad([5, 10, -20, 0, 30, 0])).tolist())
    plan = Planned((PlannedSweep(6, 1, -0.4, 0.4, 5, ("T1",), held=held),), tuple(cell.home))
    events = [event for event in demo_events(cell) if not isinstance(event, Planned)]
    with Session.create(tmp_path / "a.trueaxis", [*events, plan]) as session:
        take(session, 5)
        export_campaign(session.state, tmp_path / "campaign")
        with open_campaign(tmp_path / "campaign", tmp_path / "b.trueaxis") as again:
            before = np.array([step.commanded for step in session.state.steps])
            assert np.array([step.commanded for step in again.state.steps]) == pytest.approx(before, abs=1e-12)
            assert again.state.next_step is None
