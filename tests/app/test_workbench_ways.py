"""The less trodden ways of the workbench: by hand, extra stops, pausing, solving again after a restart."""

import threading

import msgspec
import numpy as np
import pytest

from app.rigs import SETTING
from app.sweep_progress import sweep_progress
from app.workbench import Workbench
from core.errors import InputError
from core.instruments import InstrumentFailed
from core.session import Session
from core.session_conditions import condition_events
from core.session_events import SessionError, Setting, Titled
from core.session_families import drive_key
from core.session_store import SUFFIX
from core.twin import irb_l6
from core.twin.demo import demo_events


@pytest.fixture
def bench(tmp_path):
    session = Session.create(tmp_path / f"a{SUFFIX}", demo_events(irb_l6.cell()), by="A. Operator")
    yield Workbench(session)
    session.close()


@pytest.fixture
def by_hand(bench):
    bench.session.append(Setting(SETTING, "by hand"))
    bench.changed()
    return bench


def test_undo_stops_where_the_session_began(bench):
    bench.session.append(Titled("mine"))
    bench.shooting.measure()
    bench.decisions.undo()
    bench.decisions.undo()
    with pytest.raises(SessionError, match="this is how the session began"):
        bench.decisions.undo()
    assert bench.state.robot is not None
    bench.decisions.redo()
    assert bench.state.title == "mine"


def test_typed_coordinates_become_the_next_shots(by_hand):
    heard = []
    by_hand.on_change(lambda: heard.append(len(by_hand.state.shots)))
    assert by_hand.typed.enter("1 2 3\n4 5 6", "mm") == 2
    assert heard == [2]
    assert [shot.taken.point_m[0] for shot in by_hand.state.shots] == [1e-3, 4e-3]
    with pytest.raises(InputError, match="line 2"):
        by_hand.typed.enter("1 2 3\n4 5", "mm")
    assert len(by_hand.state.shots) == 2


def test_a_file_of_points_becomes_shots(by_hand, tmp_path):
    path = tmp_path / "points.csv"
    path.write_text("x_mm,y_mm,z_mm\n1,2,3\n4,5,6\n7,8,9\n")
    assert by_hand.typed.enter_file(path) == 3
    assert by_hand.state.next_step.step == 3


def test_by_hand_a_shot_is_measured_again_and_the_instrument_checked(by_hand):
    by_hand.typed.enter("1 2 3", "mm")
    with pytest.raises(InstrumentFailed, match="no coordinates"):
        by_hand.shooting.measure_again(by_hand.state.shots[0].id)
    assert by_hand.typed.lay_ready("1.1 2 3", "mm") == 1
    by_hand.shooting.measure_again(by_hand.state.shots[0].id)
    assert [shot.counts for shot in by_hand.state.shots] == [False, True]
    by_hand.shooting.check_instrument("T1", by_hand.typed.lay_ready("1 2 3\n1 2 3.1\n1 2.1 3", "mm"))
    assert len(by_hand.state.checks[0].shots) == 3


def test_nothing_is_laid_ready_for_a_simulated_instrument_and_nobody_runs_by_hand(bench):
    with pytest.raises(InputError, match="simulated"):
        bench.typed.lay_ready("1 2 3", "mm")
    bench.session.append(Setting(SETTING, "by hand"))
    bench.changed()
    with pytest.raises(InputError, match="moved by hand"):
        bench.runs.run(True)


def test_an_extra_stop_counts_and_is_told_beside_the_plan(bench):
    bench.runs.run(False)
    at = bench.state.plan.home[5] + np.deg2rad(1.0)
    (shot,) = bench.shooting.measure_extra(6, 1, at)
    assert shot.taken.step == 17
    assert shot.taken.commanded[5] == pytest.approx(at)
    row = sweep_progress(bench.state)[0]
    assert (row.done, row.extra, row.left) == (17, 1, 0)
    assert len(bench.known.so_far(6, 1).shots) == 18
    (again,) = bench.shooting.measure_extra(6, 1, at)
    assert again.taken.step == 18
    with pytest.raises(InputError, match="joint 6, sweep 9 is not planned"):
        bench.shooting.measure_extra(6, 9, at)
    with pytest.raises(InputError, match="beyond its limits"):
        bench.shooting.measure_extra(6, 1, 7.0)
    assert bench.runs.run(True) == 129 - 17
    assert bench.solving.solve().refinement.residuals.used.sum() >= 129


def test_an_extra_stop_of_a_coupled_joint_sees_both_targets(bench):
    shots = bench.shooting.measure_extra(2, 1, bench.state.plan.home[1])
    assert [shot.taken.target for shot in shots] == ["T4", "T3"]


def test_skipped_shots_are_told_and_opened_again_on_demand(bench):
    bench.decisions.skip("sight was blocked")
    bench.runs.run(False)
    row = sweep_progress(bench.state)[0]
    assert (row.done, row.skipped, row.left, row.finished) == (16, 1, 0, True)
    bench.decisions.go_to(6, 1)
    bench.shooting.measure()
    assert sweep_progress(bench.state)[0].done == 17


def test_a_run_is_paused_and_goes_on(bench):
    paused = threading.Event()

    def after(done, total):
        if done == 5:
            bench.runs.pause()
            paused.set()

    assert bench.runs.run(True, progress=after) == 5
    assert paused.is_set()
    assert bench.runs.running is None
    assert bench.runs.paused is True
    assert bench.runs.run(bench.runs.paused) == 129 - 5
    assert bench.runs.paused is None


def test_a_run_that_is_stopped_is_not_gone_on_with(bench):
    bench.runs.run(False, progress=lambda done, total: bench.runs.stop() if done == 3 else None)
    assert len(bench.state.shots) == 3
    assert bench.runs.paused is None
    bench.shooting.measure()
    assert len(bench.state.shots) == 4


def test_conditions_ride_on_every_shot(bench):
    bench.session.append_all(condition_events({"temperature_c": "25", "payload_kg": "3"}, bench.state))
    shot = bench.shooting.measure()
    assert shot.taken.payload_kg == 3.0
    # The simulated instrument has a thermometer of its own.
    assert shot.taken.temperature_c != 25.0


def test_limits_and_test_poses_leave_a_solution_up_to_date(bench):
    bench.runs.run(False)
    bench.solving.solve()
    bench.session.append_all([Setting("limit_length_mm", 1.0), Setting("limit_pose_mm", 1.0)])
    pose = bench.state.shots[-1].taken
    bench.session.append(msgspec.structs.replace(pose, phase="pose", joint=0, step=-1, pose=0))
    bench.decisions.undo()
    bench.decisions.redo()
    assert bench.solving.since_solved == 0
    bench.decisions.exclude(bench.state.shots[0].id, "bumped")
    assert bench.solving.since_solved == 1
    bench.decisions.undo()
    assert bench.solving.since_solved == 2


def test_after_a_restart_the_solution_is_computed_again_unless_something_changed(bench):
    bench.runs.run(False)
    found = bench.solving.solve()
    assert bench.solving.since_solved == 0
    path = bench.session.path
    bench.session.close()
    again = Workbench(Session.open(path))
    again.solving.solve_again()
    assert again.calibration.estimate.noise_m == pytest.approx(found.estimate.noise_m)
    assert len(again.state.solves) == 1
    again.shooting.measure()
    again.decisions.undo()
    assert again.solving.since_solved == 2
    again.session.close()
    third = Workbench(Session.open(path))
    third.solving.solve_again()
    assert third.calibration is None
    third.session.close()


def test_the_family_of_a_drive_is_the_operators_choice(bench):
    bench.runs.run(False)
    bench.session.append(Setting(drive_key(6), "harmonics_2"))
    assert bench.solving.solve().estimate.transmissions[5].form.name == "harmonics_2"
    assert bench.state.solves[-1].solved.figures["drive of joint 6"] == "harmonics_2"
    bench.session.append(Setting(drive_key(6), "banana"))
    with pytest.raises(InputError, match="no transmission form 'banana'"):
        bench.solving.solve()
