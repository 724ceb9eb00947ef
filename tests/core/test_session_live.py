"""What shots say before anything is solved: where the base stands, where the next target will be."""

from pathlib import Path

import numpy as np
import pytest
from session_scenes import demo_session, take

from core.calibration import calibrate
from core.kinematics import link_frames
from core.session import Session
from core.session_campaign import to_campaign
from core.session_events import Judged, WentTo
from core.session_live import base_of, base_so_far, expected_place, sweep_so_far, tool_place_std_m
from core.twin import irb_l6

TRUE_BASE = irb_l6.cell().truth.base


@pytest.fixture
def session(tmp_path: Path) -> Session:
    with demo_session(tmp_path / "a.trueaxis") as made:
        yield made


def go_to(session: Session, joint: int) -> None:
    session.append(WentTo(*next(step for step in session.state.steps if step.joint == joint).key))


def test_only_shots_that_count_and_show_the_joint_alone_are_taken(session: Session) -> None:
    take(session, 6)
    session.append(Judged((session.state.shots[1].id,), "excluded", "a cloud"))
    so_far = sweep_so_far(session.state, 6, 1)
    assert [shot.record for shot in so_far.shots] == [1, 3, 4, 5, 6]
    go_to(session, 2)
    take(session, 6)
    # T3 rides beyond the joint that motor 2 drags along.
    assert {shot.taken.target for shot in sweep_so_far(session.state, 2, 1).shots} == {"T4"}


def test_the_base_settles_once_axes_are_found_that_are_not_parallel(session: Session) -> None:
    assert not base_so_far(session.state).settled
    take(session, 17)
    assert not base_so_far(session.state).settled
    take(session, 32)
    placed = base_so_far(session.state)
    assert placed.settled
    # The arm is some centimetres and half a degree off its design.
    assert np.linalg.norm(placed.base[:3, 3] - TRUE_BASE[:3, 3]) < 0.2
    assert np.abs(placed.base[:3, :3] - TRUE_BASE[:3, :3]).max() < 0.1


def test_a_calibration_knows_the_base(session: Session) -> None:
    take(session, len(session.state.steps))
    base = base_of(calibrate(to_campaign(session.state)))
    assert np.abs(base - TRUE_BASE).max() < 0.01


def test_the_next_target_is_expected_by_the_arm_then_by_its_own_sweep(session: Session) -> None:
    errors = []
    for k in range(len(session.state.steps)):
        step = session.state.next_step
        expected = expected_place(session.state, step, sweep_so_far(session.state, step.joint, step.sweep), TRUE_BASE)
        take(session, 1)
        if expected is not None:
            seen = np.array(session.state.shots[-1].taken.point_m)
            errors.append((expected.by_sweep, float(np.linalg.norm(seen - expected.point_m)), k))
    by_sweep = [error for told, error, _ in errors if told]
    assert len(by_sweep) > 60
    assert max(by_sweep) < 0.012
    assert len(errors) > 120
    assert max(error for _, error, _ in errors) < 0.12


def test_nothing_is_expected_of_a_target_that_nobody_has_seen(session: Session) -> None:
    go_to(session, 3)
    step = session.state.next_step
    assert step.target == "T3"
    state, first = session.state, session.state.steps[0]
    assert expected_place(state, step, sweep_so_far(state, 3, 1), TRUE_BASE) is None
    assert expected_place(state, first, sweep_so_far(state, 6, 1), None) is None


def test_the_axis_is_less_well_known_at_a_far_tool(session: Session) -> None:
    take(session, 3)
    assert tool_place_std_m(session.state, sweep_so_far(session.state, 6, 1)) is None
    take(session, 14 + 16)
    so_far = sweep_so_far(session.state, 5, 1)
    at_tool = tool_place_std_m(session.state, so_far)
    fit = so_far.live.fit
    assert at_tool > 0.9 * fit.point_std_m * fit.noise_factor
    go_to(session, 3)
    take(session, 12)
    far = sweep_so_far(session.state, 3, 1)
    assert tool_place_std_m(session.state, far) > far.live.fit.point_std_m * far.live.fit.noise_factor


def test_before_any_axis_the_arm_is_put_where_its_target_was_seen(session: Session) -> None:
    before = base_so_far(session.state).base
    # Out of the instrument, which stands at zero.
    assert np.linalg.norm(before[:3, 3]) > 1.0
    take(session, 2)
    base = base_so_far(session.state).base
    frames = link_frames(session.state.robot, np.zeros((1, 6)))[0]
    tool = base[:3, :3] @ frames[6, :3, 3] + base[:3, 3]
    assert np.linalg.norm(tool - np.array(session.state.shots[-1].taken.point_m)) < 0.3
