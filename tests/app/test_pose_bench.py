"""Verifying on the workbench: every shot is in the session, and what is compared is what was measured."""

from dataclasses import replace

import numpy as np
import pytest

from app.pose_bench import PoseBench
from app.pose_words import iso_words
from app.rigs import SETTING, Source
from app.workbench import Workbench
from core.errors import InputError
from core.instruments import InstrumentFailed
from core.kinematics import forward, nominal_net
from core.pose_visits import pose_visits
from core.repeatability import repeated_poses
from core.session import Session
from core.session_events import PosesPlanned, SessionError, Setting
from core.session_store import SUFFIX
from core.twin import irb_l6
from core.twin.demo import demo_events


@pytest.fixture
def bench(tmp_path):
    cell = irb_l6.cell()
    one = Workbench(Session.create(tmp_path / f"a{SUFFIX}", demo_events(cell), by="A. Operator"), cell)
    yield one
    one.session.close()


@pytest.fixture
def poses(bench):
    return PoseBench(bench)


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    """A session with table 1 measured and solved; tests copy its file."""
    cell = irb_l6.cell()
    path = tmp_path_factory.mktemp("solved") / f"a{SUFFIX}"
    one = Workbench(Session.create(path, demo_events(cell), by="A. Operator"), cell)
    one.runs.run(True)
    one.session.close()
    return path


@pytest.fixture
def ready(solved, tmp_path):
    path = tmp_path / f"b{SUFFIX}"
    path.write_bytes(solved.read_bytes())
    one = Workbench(Session.open(path), irb_l6.cell())
    one.solving.solve()
    yield one
    one.session.close()


def test_before_a_solution_poses_go_by_nominal_commands_only(bench, poses):
    visit = poses.next_visit()
    assert (visit.pose.number, visit.compensated, visit.targets) == (1, False, ("T1", "T5", "T6"))
    assert visit.commanded == bench.state.poses.wanted[0]
    assert poses.next_visit(True) is None
    with pytest.raises(SessionError, match="no solution yet: solve"):
        poses.visit_of(visit.pose, True)
    poses.measure(visit)
    taken = [s.taken for s in bench.state.shots]
    assert [(t.phase, t.pose, t.target, t.check, t.wanted) for t in taken] == [
        ("pose", 0, name, True, None) for name in ("T1", "T5", "T6")
    ]
    assert len({t.approach for t in taken}) == 1
    assert taken[0].approach == tuple(np.sign(np.subtract(visit.commanded, bench.rig.cell.home)).astype(int))
    assert poses.next_visit().pose.number == 2
    loop, why = poses.loop()
    assert loop is None
    assert "Solve with a sweep of every joint" in why


def test_the_whole_loop_on_the_twin(ready):
    poses, told = PoseBench(ready), []
    assert poses.run(progress=lambda done, total: told.append((done, total))) == 24
    assert told[-1] == (24, 24)
    assert poses.next_visit() is None
    loop, why = poses.loop()
    assert why == ""
    assert loop.nominal.goal.tolist() == loop.compensated.goal.tolist() == list(range(12))
    assert 0.03 < loop.nominal.errors.position.mean < 0.06
    assert loop.compensated.errors.position.mean < 3e-3
    # What is compared is what was measured against where the nominal arm has the tool for the wanted commands.
    arm, wanted = poses.arm, np.array(ready.state.poses.wanted)
    np.testing.assert_allclose(
        loop.compensated.errors.predicted,
        arm.base @ forward(arm.nominal, nominal_net(arm.nominal, wanted)),
        rtol=0,
        atol=1e-9,
    )
    sent = [s.taken for s in ready.state.shots if s.taken.wanted is not None]
    assert len(sent) == 36
    assert all(np.abs(np.subtract(t.commanded, t.wanted)).max() > 1e-3 for t in sent)


def test_a_visit_goes_on_after_undo_while_the_robot_stands_there(ready):
    poses = PoseBench(ready)
    poses.measure(poses.next_visit())
    where = ready.robot.points_m()
    ready.decisions.undo()
    visit = poses.next_visit()
    assert (visit.pose.number, visit.targets) == (1, ("T6",))
    poses.measure(visit)
    np.testing.assert_array_equal(ready.robot.points_m(), where)
    assert [v.number for v in pose_visits(ready.state)] == [0]
    assert len({s.taken.approach for s in ready.state.shots if s.taken.phase == "pose"}) == 1


def test_a_visit_that_was_left_is_made_anew_from_elsewhere(ready):
    poses = PoseBench(ready)
    poses.measure(poses.next_visit())
    ready.decisions.undo()
    again = PoseBench(ready)
    visit = again.next_visit()
    assert (visit.pose.number, visit.targets) == (1, ("T1", "T5", "T6"))
    before = ready.robot.points_m()
    again.measure(visit)
    assert [(v.number, len(v.seen)) for v in pose_visits(ready.state)] == [(0, 2), (1, 3)]
    assert np.abs(ready.robot.points_m() - before).max() > 1e-6


def test_after_a_restart_it_goes_on_with_the_next_pose(ready):
    poses = PoseBench(ready)
    for _ in range(3):
        poses.measure(poses.next_visit())
    path = ready.session.path
    ready.session.close()
    again = Workbench(Session.open(path), ready.rig.cell)
    try:
        assert PoseBench(again).next_visit().pose.number == 4
        assert PoseBench(again).loop()[0] is None
        again.solving.solve()
        assert PoseBench(again).loop()[0].nominal.count == 3
    finally:
        again.session.close()


def test_stop_ends_a_run_after_the_shot_in_progress(ready):
    poses = PoseBench(ready)
    ready.on_change(lambda: ready.runs.stop() if len(ready.state.shots) == 129 + 4 else None)
    assert poses.run() == 2
    assert [len(v.seen) for v in pose_visits(ready.state)] == [3, 1]
    poses.measure(poses.next_visit())
    assert [len(v.seen) for v in pose_visits(ready.state)][:2] == [3, 3]


def test_a_failure_in_the_middle_keeps_what_was_shot(ready, monkeypatch):
    poses, real, count = PoseBench(ready), ready.rig.meter.measure, []

    def fail(request, cancelled):
        count.append(request.target)
        if len(count) == 2:
            raise InstrumentFailed("the reflector is not in sight; aim again")
        return real(request, cancelled)

    monkeypatch.setattr(ready.rig.meter, "measure", fail)
    with pytest.raises(InstrumentFailed):
        poses.measure(poses.next_visit())
    assert poses.next_visit().targets == ("T5", "T6")
    poses.measure(poses.next_visit())
    assert count == ["T1", "T5", "T5", "T6"]
    assert [len(v.seen) for v in pose_visits(ready.state)] == [3]


def test_a_new_solution_makes_old_compensated_visits_outdated(ready):
    poses = PoseBench(ready)
    poses.run()
    assert not any(pose.outdated for pose in poses.poses())
    ready.decisions.exclude(ready.state.shots[5].id, "target was bumped")
    ready.solving.solve()
    assert all(pose.outdated for pose in poses.poses())
    assert poses.loop()[0].compensated.count == 12


def test_an_excluded_shot_leaves_too_little_of_its_pose_for_its_orientation(ready):
    poses = PoseBench(ready)
    poses.run(False)
    shot = next(s for s in ready.state.shots if s.taken.phase == "pose" and s.taken.target == "T5")
    ready.decisions.exclude(shot.id, "target was bumped")
    assert poses.next_visit(False).pose.number == 1
    assert poses.loop()[0].nominal.errors.orientation.count == 11


def test_poses_that_the_arm_cannot_compensate_are_named_and_passed_over(ready):
    low, high = np.array([joint.limits for joint in ready.rig.cell.robot.joints]).T
    edge = (float(high[0]), *ready.state.poses.wanted[0][1:])
    inside = ready.state.poses.wanted[1]
    ready.session.append(PosesPlanned((edge, inside), ("T1", "T5", "T6")))
    poses = PoseBench(ready)
    refused = poses.poses()[0]
    assert refused.compensated is None
    assert refused.refusal.startswith("pose 1 cannot be compensated: beyond limits: joint 1")
    assert poses.run(True) == 1
    with pytest.raises(SessionError, match="pose 1 cannot be compensated"):
        poses.visit_of(refused, True)
    assert low[0] < -1


def test_new_poses_take_the_place_of_the_old_ones_but_visits_stay(ready):
    poses = PoseBench(ready)
    poses.run(False)
    poses.plan(5)
    assert len(ready.state.poses.wanted) == 5
    shown = poses.poses()
    assert len(shown) == 17
    assert [p.nominal_visit is not None for p in shown] == [False] * 5 + [True] * 12
    ready.decisions.undo()
    assert len(ready.state.poses.wanted) == 12
    with pytest.raises(InputError, match="expected 1 to 1000"):
        poses.plan(0)


def test_limits_are_kept_in_the_session_and_checked(ready):
    poses = PoseBench(ready)
    poses.keep_limits({"limit_pose_mm": 2.5, "limit_pose_mrad": 0.0})
    assert (poses.limits.position_m, poses.limits.orientation_rad) == (pytest.approx(2.5e-3), None)
    for wrong in (float("nan"), -1.0, "x", 1e9):
        with pytest.raises(InputError, match="the limit of the position is"):
            poses.keep_limits({"limit_pose_mm": wrong})
    assert poses.limits.position_m == pytest.approx(2.5e-3)


def test_a_session_without_targets_on_the_last_link_says_so(ready):
    poses = PoseBench(ready)
    visit = replace(poses.next_visit(), targets=())
    with pytest.raises(SessionError, match="no target on the last link"):
        poses.measure(visit)


def test_a_person_moves_the_robot_and_types_what_the_instrument_shows(ready):
    ready.session.append(Setting(SETTING, Source.BY_HAND))
    ready.changed()
    poses = PoseBench(ready)
    visit = poses.next_visit()
    for text, words in (
        ("1 2 3\n4 5 6", "2 points were entered, expected 3, one line each: T1, T5, T6"),
        ("1 2\n3 4 5\n6 7 8", "line 1"),
        ("", "0 points were entered"),
    ):
        with pytest.raises(InputError, match=words):
            poses.measure_entered(visit, text, "mm")
        assert pose_visits(ready.state) == ()
    poses.measure_entered(visit, "1 2 3\n4 5 6\n7 8 9", "mm")
    made = pose_visits(ready.state)[0]
    assert made.seen == {"T1", "T5", "T6"}
    assert made.shots[1].taken.point_m == pytest.approx((0.004, 0.005, 0.006))
    assert poses.next_visit().pose.number == 2


def test_repeated_visits_have_a_repeatability(ready):
    poses = PoseBench(ready)
    pose = poses.poses()[2]
    for _ in range(3):
        for compensated in (False, True):
            poses.measure(poses.visit_of(pose, compensated))
    loop, _ = poses.loop()
    words = iso_words(loop, {0: 3})
    assert "<td>3, nominal</td><td class='n'>3</td>" in words
    assert "<td>3, compensated</td><td class='n'>3</td>" in words
    one = repeated_poses(loop.found)[0]
    assert f"{one.repeatability_m * 1e3:.2f}" in words
    assert iso_words(None, {}) == iso_words(None, {3: 1})
