"""Families that an operator chooses for drives and couplings, and what changed from one solution to the next."""

from dataclasses import replace
from pathlib import Path

import pytest
from session_scenes import demo_session, take

from core.calibration import calibrate
from core.errors import InputError
from core.session_campaign import to_campaign
from core.session_events import Setting
from core.session_families import AUTO, coupling_key, drive_families, drive_key, with_families
from core.solve_figures import changes, figures_of
from core.twin import irb_l6, scara

ROBOT = irb_l6.cell().robot


def test_what_is_chosen_is_used_and_the_rest_stays() -> None:
    chosen = with_families(ROBOT, {drive_key(1): "harmonics_2", coupling_key(3): "proportional", "other": 1.0})
    assert chosen.joints[0].transmission == "harmonics_2"
    assert chosen.joints[1:] == ROBOT.joints[1:]
    assert chosen.coupling_into(3).form == "proportional"
    assert chosen.coupling_into(5) == ROBOT.coupling_into(5)
    assert with_families(ROBOT, {}).joints == ROBOT.joints


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({drive_key(1): "banana"}, "joint 1: there is no transmission form 'banana'"),
        ({drive_key(1): "gear"}, "joint 1: .*needs the joint's drive_ratio"),
        ({drive_key(1): 3.0}, "setting transmission_1 = 3.0, expected the name of a family"),
        ({coupling_key(3): "banana"}, "coupling 2 -> 3: there is no coupling form 'banana'"),
    ],
)
def test_a_family_that_cannot_be_is_refused(settings: dict, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        with_families(ROBOT, settings)


def test_a_sliding_joint_has_no_turning_family() -> None:
    robot = scara.cell().robot
    assert drive_families(robot.joints[2]) == (AUTO, "direct", "ratio")
    with pytest.raises(InputError, match="joint 3 slides"):
        with_families(robot, {drive_key(3): "first_harmonic"})


def test_every_family_that_is_offered_can_be_had() -> None:
    for robot in (ROBOT, scara.cell().robot):
        for number, joint in enumerate(robot.joints, 1):
            for family in drive_families(joint):
                with_families(robot, {drive_key(number): family})


def test_a_solution_uses_the_choice_and_tells_what_changed(tmp_path: Path) -> None:
    with demo_session(tmp_path / "a.trueaxis") as session:
        take(session, len(session.state.steps))
        first = calibrate(to_campaign(session.state))
        session.append(Setting(drive_key(1), "direct"))
        second = calibrate(to_campaign(session.state))
    assert second.estimate.transmissions[0].form.name == "direct"
    told = changes(figures_of(first), figures_of(second))
    assert told[0].name == "drive of joint 1"
    assert (told[0].before, told[0].after) == ("first_harmonic", "direct")
    assert changes(figures_of(first), figures_of(first)) == ()
    moved = {change.name: change for change in told}
    geometry = [estimate.estimate.geometry.model.theta_rad[0] for estimate in (first, second)]
    if "theta1" in moved:
        assert moved["theta1"].after - moved["theta1"].before == pytest.approx((geometry[1] - geometry[0]) * 57.29578)


def test_a_joint_that_is_known_now_is_told() -> None:
    told = changes({"noise_mm": 0.2}, {"noise_mm": 0.2, "a1_mm": 5.0, "u of a1_mm": 1.0})
    assert [(change.name, change.before, change.after, change.unit) for change in told] == [("a1", None, 5.0, "mm")]


def test_a_number_that_hardly_moved_is_not_told() -> None:
    before = {"a1_mm": 5.0, "u of a1_mm": 1.0}
    assert changes(before, {**before, "a1_mm": 5.05}) == ()
    assert changes(before, {**before, "a1_mm": 5.5})[0].in_std == pytest.approx(0.5)


def test_a_robot_that_says_auto_is_left_to_evidence() -> None:
    robot = replace(ROBOT, joints=tuple(replace(joint, transmission=AUTO) for joint in ROBOT.joints))
    assert with_families(robot, {}).joints == robot.joints
