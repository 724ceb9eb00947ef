"""What stands in the cell of a session, whatever the session says."""

from pathlib import Path

import numpy as np
import pytest

from app.rigs import SETTING, Source, key_of, no_robot, rig_for, source_events
from app.workbench import Workbench
from core.instruments import InstrumentFailed, MeasureRequest, Reading
from core.session import Session
from core.session_campaign import to_campaign
from core.session_events import InstrumentChosen, Planned, RobotChosen, Setting, TargetsNamed, Titled
from core.session_state import State
from core.suggested_plan import suggested_sweeps, suggested_targets
from core.twin import irb_l6, scara
from core.twin.demo import demo_events

ROBOT = """format = "trueaxis-robot/1"
name = "three"
[[joint]]
kind = "revolute"
[[joint]]
kind = "revolute"
[[joint]]
kind = "prismatic"
limits = [0, 400]
[[dh]]
theta_deg = 0
d_mm = 400
a_mm = 0
alpha_deg = -90
[[dh]]
theta_deg = 0
d_mm = 100
a_mm = 50
alpha_deg = 90
[[dh]]
theta_deg = 0
d_mm = 300
a_mm = 0
alpha_deg = 0
"""


def own_session(path: Path, source: Source | None) -> Session:
    """A session on a robot of somebody's own, with suggested targets and sweeps."""
    with Session.create(path, [Titled("own"), RobotChosen(ROBOT)]) as made:
        robot = made.state.robot
    targets = suggested_targets(robot)
    links = {target.name: target.link for target in targets}
    session = Session.open(path)
    session.append_all([TargetsNamed(targets), InstrumentChosen("total-station", 1e-4)])
    session.append(Planned(suggested_sweeps(robot, links)))
    if source is not None:
        session.append(Setting(SETTING, str(source)))
    return session


@pytest.fixture(params=[None, Source.BY_HAND, Source.SIMULATED])
def bench(request, tmp_path):
    session = own_session(tmp_path / "a.trueaxis", request.param)
    yield Workbench(session)
    session.close()


@pytest.mark.parametrize("cell", [irb_l6.cell(), scara.cell()], ids=["irb", "scara"])
def test_a_built_in_cell_is_known_by_its_robot(tmp_path, cell):
    with Session.create(tmp_path / "a.trueaxis", demo_events(cell)) as session:
        rig = rig_for(session.state, 1)
    assert rig.source is Source.DEMO
    assert rig.cell is cell
    assert rig.moves_itself


def test_an_own_robot_is_measured_by_hand_unless_it_is_simulated(bench):
    said = bench.state.settings.get(SETTING)
    assert bench.rig.source == (said or "by hand")
    assert (bench.rig.cell is None) == (said != "simulated")
    assert bench.nominal.name == "three"
    assert bench.nominal_net(bench.robot.commanded).shape == (3,)
    assert bench.known.base().settled == (said == "simulated")


def test_a_simulated_arm_of_the_own_robot_is_calibrated(tmp_path):
    with own_session(tmp_path / "a.trueaxis", Source.SIMULATED) as session:
        bench = Workbench(session)
        assert bench.runs.run(True) == sum(row.shots for row in bench.state.plan.sweeps)
        found = bench.solving.solve()
        assert found.not_swept == ()
        assert np.abs(bench.known.base().base - bench.rig.cell.truth.base).max() < 0.02


def test_the_rig_follows_what_the_session_says(tmp_path):
    with own_session(tmp_path / "a.trueaxis", None) as session:
        bench, seen = Workbench(session), []
        bench.on_change(lambda: seen.append(bench.rig.source))
        session.append(Setting(SETTING, "simulated"))
        bench.changed()
        session.append(Setting(SETTING, "nonsense"))
        bench.changed()
        assert seen == ["simulated", "by hand"]
        before = bench.rig
        bench.changed()
        assert bench.rig is before


def test_by_hand_a_shot_needs_its_coordinates(tmp_path):
    with own_session(tmp_path / "a.trueaxis", None) as session:
        bench = Workbench(session)
        with pytest.raises(InstrumentFailed, match="no coordinates of target 'T1' were entered"):
            bench.shooting.measure()
        bench.rig.meter.enter([Reading((1.0, 2.0, 3.0))])
        assert bench.shooting.measure().taken.point_m == (1.0, 2.0, 3.0)
        # The arm is drawn where it has to be sent.
        assert bench.robot.commanded == bench.state.shots[0].taken.commanded


def test_a_session_without_a_readable_robot_can_still_be_looked_at():
    for state in (State(), State(robot_toml="nonsense")):
        rig = rig_for(state, 1)
        assert rig.robot is no_robot(1)
        assert rig.source is Source.BY_HAND
        assert key_of(state).source is Source.BY_HAND
        with pytest.raises(InstrumentFailed):
            rig.meter.measure(MeasureRequest("T1", (0.0,)), lambda: False)


def test_what_is_simulated_says_so_in_every_report(tmp_path):
    with own_session(tmp_path / "a.trueaxis", None) as session:
        session.append_all(source_events(Source.SIMULATED, "three"))
        bench = Workbench(session)
        bench.runs.run(False)
        assert to_campaign(bench.state).notes["source"] == "simulated: no three was measured"
    with own_session(tmp_path / "b.trueaxis", Source.SIMULATED) as session:
        session.append_all(source_events(Source.BY_HAND, "three"))
        assert "source" not in session.state.facts
