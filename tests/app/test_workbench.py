"""What the dashboard works on: measuring, judging, solving, all of it in the session first."""

import numpy as np
import pytest

from app.sweep_progress import sweep_progress
from app.workbench import Workbench
from core.errors import AxisUndefined, TrueaxisError
from core.instruments import InstrumentFailed
from core.session import Session
from core.session_events import SessionError
from core.session_store import SUFFIX
from core.twin import irb_l6
from core.twin.demo import demo_events


@pytest.fixture
def bench(tmp_path):
    cell = irb_l6.cell()
    session = Session.create(tmp_path / f"a{SUFFIX}", demo_events(cell), by="A. Operator")
    yield Workbench(session, cell)
    session.close()


def test_a_shot_is_in_the_file_before_listeners_hear_of_it(bench):
    seen = []
    bench.on_change(lambda: seen.append(len(Session.open(bench.session.path, read_only=True).state.shots)))
    bench.shooting.measure()
    bench.shooting.measure()
    assert seen == [1, 2]


def test_joint_6_comes_first_and_the_plan_is_walked_in_order(bench):
    bench.shooting.measure()
    rows = sweep_progress(bench.state)
    assert [row.planned.joint for row in rows] == [6, 5, 4, 3, 2, 1]
    assert [row.done for row in rows] == [1, 0, 0, 0, 0, 0]
    assert rows[0].current


def test_run_this_sweep_stops_at_its_end(bench):
    told = []
    assert bench.runs.run(False, progress=lambda done, total: told.append((done, total))) == 17
    assert told[-1] == (17, 17)
    assert sweep_progress(bench.state)[0].finished
    assert not sweep_progress(bench.state)[1].done


def test_run_all_then_solve_finds_the_arm(bench):
    assert bench.runs.run(True) == 129
    found = bench.solving.solve()
    assert found.not_swept == ()
    true = bench.rig.cell.truth
    geometry = found.estimate.geometry
    scores = (
        (geometry.model.parameters - true.phi.parameters) / np.where(geometry.std > 0, geometry.std, np.inf)
    ).ravel()
    assert np.abs(scores).max() < 4.5
    assert bench.state.solves[-1].solved.shots == 129
    with pytest.raises(SessionError, match="every planned shot is done"):
        bench.shooting.measure()


def test_after_a_stop_the_first_stop_of_a_sweep_is_measured_as_ever(bench):
    bench.runs.stop()
    assert bench.shooting.measure().taken.step == 0


def test_undo_takes_the_last_shot_back_and_redo_brings_it_again(bench):
    bench.shooting.measure()
    first = bench.shooting.measure()
    bench.decisions.undo()
    assert [s.id for s in bench.state.shots][-1] != first.id
    bench.decisions.redo()
    assert bench.state.shots[-1].id == first.id


def test_an_excluded_shot_is_kept_and_does_not_count(bench):
    bench.runs.run(False)
    number = bench.state.shots[4].id
    with_all = bench.known.so_far(6, 1).shots
    bench.decisions.exclude(number, "target was bumped")
    assert bench.state.shot(number).reason == "target was bumped"
    assert len(bench.known.so_far(6, 1).shots) == len(with_all) - 1
    bench.decisions.include(number)
    assert len(bench.known.so_far(6, 1).shots) == len(with_all)


def test_measuring_again_supersedes(bench):
    bench.runs.run(False)
    old = bench.state.shots[3]
    new = bench.shooting.measure_again(old.id)
    assert new.taken.replaces == old.id
    assert not bench.state.shot(old.id).counts
    assert new.taken.commanded == old.taken.commanded
    with pytest.raises(SessionError, match="belongs to no planned stop"):
        bench.shooting.measure_again(10**6)


def test_skip_and_go_to_another_sweep(bench):
    bench.decisions.skip("sight was blocked")
    assert bench.state.next_step.step == 1
    bench.decisions.go_to(3, 1)
    assert bench.state.next_step.joint == 3
    bench.runs.run(False)
    with pytest.raises(SessionError, match="is done"):
        bench.decisions.go_to(3, 1)


def test_couplings_hold_the_next_motor_still(bench):
    bench.decisions.go_to(2, 1)
    step = bench.state.next_step
    home = np.array(bench.state.plan.home)
    moved = np.array(step.commanded) - home
    assert moved[2] == pytest.approx(-moved[1])


def test_a_failure_is_noted_and_loses_nothing(bench, monkeypatch):
    bench.shooting.measure()

    def fail(request, cancelled):
        raise InstrumentFailed("the reflector is not in sight; aim again")

    monkeypatch.setattr(bench.rig.meter, "measure", fail)
    with pytest.raises(InstrumentFailed, match="not in sight"):
        bench.shooting.measure()
    assert len(bench.state.shots) == 1
    assert bench.state.failures[-1].sentence == "the reflector is not in sight; aim again"


def test_too_few_shots_are_no_calibration(bench):
    for _ in range(3):
        bench.shooting.measure()
    with pytest.raises(AxisUndefined, match="too few"):
        bench.solving.solve()
    assert bench.calibration is None


def test_a_session_goes_on_where_it_was_and_with_fresh_noise(bench):
    bench.runs.run(False)
    path, points = bench.session.path, [s.taken.point_m for s in bench.state.shots]
    bench.session.close()
    again = Workbench(Session.open(path), bench.rig.cell)
    try:
        assert again.state.next_step.joint == 5
        assert again.shooting.measure().taken.point_m not in points
    finally:
        again.session.close()


def test_a_read_only_session_refuses_in_a_sentence(bench):
    watching = Workbench(Session.open(bench.session.path), bench.rig.cell)
    with pytest.raises(TrueaxisError):
        watching.shooting.measure()


def test_checking_the_instrument_shows_its_promise_kept(bench):
    bench.shooting.check_instrument("T1", 8)
    check = bench.state.checks[-1]
    promise = bench.state.instrument.sigma_m * 3**0.5
    assert len(check.shots) == 8
    assert 0.4 * promise < check.net_radial_m < 1.8 * promise
    assert bench.state.shots == ()


def test_switching_to_another_session_forgets_the_solution_and_closes_the_first(bench, tmp_path):
    bench.runs.run(False)
    bench.solving.solve()
    first = bench.session
    bench.runs.paused = True
    bench.switch(Session.create(tmp_path / f"b{SUFFIX}", demo_events(bench.rig.cell)))
    assert bench.runs.paused is None
    assert first.read_only
    assert bench.calibration is None
    assert bench.state.shots == ()
    bench.shooting.measure()
    assert len(bench.state.shots) == 1


def test_the_next_shot_is_expected_where_it_comes(bench):
    by_the_arm = bench.known.expected()
    assert not by_the_arm.by_sweep
    first = bench.shooting.measure().taken.point_m
    # Some 5 cm is what the nominal arm misses by.
    assert np.linalg.norm(by_the_arm.point_m - np.array(first)) < 0.12
    for _ in range(9):
        bench.shooting.measure()
    expected = bench.known.expected()
    assert expected.by_sweep
    seen = bench.shooting.measure().taken.point_m
    assert np.linalg.norm(expected.point_m - np.array(seen)) < 5e-3
