"""Coordinates from people and files: every one at its step, and nothing guessed."""

from pathlib import Path

import numpy as np
import pytest
from session_scenes import demo_session, go_on, take

from core.by_hand import EnteredPoints, HandMovedRobot
from core.entered_shots import open_steps, shots_of_file, shots_of_lines
from core.errors import InputError
from core.instruments import InstrumentFailed, MeasureRequest, Reading
from core.measurements import Instrument
from core.point_lines import entered_points
from core.session import Session
from core.session_conditions import Conditions, condition_events, conditions_of
from core.session_events import WentTo

NOTHING = Conditions()


@pytest.fixture
def session(tmp_path: Path) -> Session:
    with demo_session(tmp_path / "a.trueaxis") as made:
        yield made


@pytest.mark.parametrize(
    "text",
    ["1 2 3\n4 5.5 -6", "1,2,3\n\n4,5.5,-6\n", "1; 2; 3\n4;5.5;-6", "1\t2\t3\n  4\t5.5\t-6e0 "],
)
def test_lines_may_be_parted_in_any_usual_way(text: str) -> None:
    points = entered_points(text, "mm")
    assert [point.point_m for point in points] == [(1e-3, 2e-3, 3e-3), (4e-3, 5.5e-3, -6e-3)]
    assert entered_points(text, "m")[0].point_m == (1.0, 2.0, 3.0)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("1 2", "line 1: '1 2', expected three numbers x y z in mm$"),
        ("1 2 3\n\n1 2 3 4", "line 3"),
        ("1,5 2,5 3,5", "with a decimal point"),
        ("1,5;2,5;3,5", "with a decimal point"),
        ("nan 1 2", "expected three numbers"),
        ("1 2 inf", "expected three numbers"),
        ("1 2 1e300", "at most"),
        ("<script>1 2 3", "expected three numbers"),
        ("١ 2 3", "expected three numbers"),
        ("1 2 3\n" * 3000, "3000 lines of coordinates, expected at most 2000"),
    ],
)
def test_what_is_no_point_is_refused_with_its_line(text: str, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        entered_points(text, "mm")
    with pytest.raises(InputError, match="expected mm or m"):
        entered_points("1 2 3", "inch")


def test_lines_go_to_the_open_steps_in_their_order(session: Session) -> None:
    take(session, 2)
    asked = session.state.steps[2:4]
    shots = shots_of_lines(session.state, entered_points("1 2 3\n4 5 6", "mm"), Conditions(21.5, 3.0))
    session.append_all(shots)
    for step, shot in zip(asked, session.state.shots[2:], strict=True):
        assert shot.key == step.key
        assert shot.taken.commanded == step.commanded
        assert (shot.taken.temperature_c, shot.taken.payload_kg) == (21.5, 3.0)
    assert session.state.next_step == session.state.steps[4]


def test_more_lines_than_steps_are_refused_and_nothing_is_taken(session: Session) -> None:
    assert len(open_steps(session.state)) == 17
    with pytest.raises(InputError, match=r"18 lines of coordinates, but 17 shots of joint 6, sweep 1 are still to do"):
        shots_of_lines(session.state, entered_points("1 2 3\n" * 18, "mm"), NOTHING)
    with pytest.raises(InputError, match="no coordinates were entered"):
        shots_of_lines(session.state, (), NOTHING)


def test_rows_of_a_file_find_their_steps_by_displacement_and_target(session: Session, tmp_path: Path) -> None:
    steps = [step for step in session.state.steps if step.joint == 4]
    session.append(WentTo(*steps[0].key))
    order = np.random.default_rng(1).permutation(len(steps))
    rows = [f"{steps[k].target},{np.rad2deg(steps[k].commanded[3]):.3f},{k},{k + 1},{k + 2},0.05" for k in order]
    path = tmp_path / "points.csv"
    path.write_text("target,q_deg,x_mm,y_mm,z_mm,sigma_mm\n" + "\n".join(rows))
    shots = shots_of_file(session.state, path, NOTHING)
    session.append_all(shots)
    for shot in session.state.shots:
        k = round(shot.taken.point_m[0] * 1e3)
        assert shot.key == steps[k].key
        assert shot.taken.covariance_m2[0] == pytest.approx(25e-10)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("target,x_mm,y_mm,z_mm\nT9,1,2,3\n", "'T9' is not watched in this sweep.*expected T1"),
        ("x_mm,y_mm,z_mm\n" + "1,2,3\n" * 18, "more points of target 'T1', but 0 shots"),
        ("q_deg,x_mm,y_mm,z_mm\n88,1,2,3\n", "joint 6 at 88, but the nearest open stop is at 26.5961 deg"),
        ("q_mm,x_mm,y_mm,z_mm\n1,1,2,3\n", "expected the points of this sweep"),
        ("x,y,z\n1,2,3\n", "has no unit in its name"),
        ("x_mm,y_mm\n1,2\n", "z_mm"),
        ("", "is empty"),
    ],
)
def test_a_file_that_is_not_of_this_sweep_is_refused(
    session: Session, tmp_path: Path, text: str, sentence: str
) -> None:
    path = tmp_path / "points.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=sentence):
        shots_of_file(session.state, path, NOTHING)


def test_a_person_moves_the_robot_and_enters_the_readings() -> None:
    robot, meter = HandMovedRobot((0.0,)), EnteredPoints(Instrument("total-station", 1e-4))
    robot.move_to((0.5,), go_on)
    assert robot.commanded == (0.5,)
    request = MeasureRequest("T1", (0.5,))
    with pytest.raises(InstrumentFailed, match="no coordinates of target 'T1' were entered"):
        meter.measure(request, go_on)
    meter.enter([Reading((1.0, 2.0, 3.0)), Reading((4.0, 5.0, 6.0))])
    assert [meter.measure(request, go_on).point_m[0] for _ in range(2)] == [1.0, 4.0]
    meter.enter([Reading((1.0, 2.0, 3.0))])
    meter.enter([])
    with pytest.raises(InstrumentFailed):
        meter.measure(request, go_on)


def test_conditions_are_entered_once_and_taken_away_again(session: Session) -> None:
    session.append_all(condition_events({"temperature_c": " 21.5 ", "payload_kg": "3"}, session.state))
    assert conditions_of(session.state) == Conditions(21.5, 3.0)
    assert condition_events({"temperature_c": "21.5"}, session.state) == []
    session.append_all(condition_events({"temperature_c": ""}, session.state))
    assert conditions_of(session.state) == Conditions(None, 3.0)
    seen = Reading((1.0, 2.0, 3.0), temperature_c=20.0)
    assert Conditions(30.0).noted(seen).temperature_c == 20.0


@pytest.mark.parametrize("text", ["warm", "1e9", "nan", "inf", "21,5", "-300"])
def test_conditions_that_cannot_be_are_refused(session: Session, text: str) -> None:
    with pytest.raises(InputError, match=r"air temperature .*expected a number from -60 to 100, or nothing"):
        condition_events({"temperature_c": text}, session.state)
