"""What the measuring panel says, from an empty plan to the last shot."""

import re
from dataclasses import replace

import numpy as np
import pytest

from app.measure_words import entered_words, run_words, shot_words, step_words, sweeps_table, undo_words, verdict_words
from app.rigs import SETTING
from app.sweep_progress import sweep_progress
from app.workbench import Workbench
from core.session import Session
from core.session_events import Fact, OperatorNamed, Planned, PosesPlanned, Setting, TargetEntry, TargetsNamed
from core.session_plan import PlannedSweep
from core.session_state import State
from core.session_store import SUFFIX
from core.twin import irb_l6, scara
from core.twin.demo import demo_events


@pytest.fixture
def bench(tmp_path):
    session = Session.create(tmp_path / f"a{SUFFIX}", demo_events(irb_l6.cell()), by="A. Operator")
    yield Workbench(session)
    session.close()


def step_of(bench: Workbench, by_hand: bool = False) -> str:
    expected = bench.known.expected()
    return plain(step_words(bench.state, bench.nominal, by_hand, expected, bench.known.aims(expected)))


def verdict_of(bench: Workbench, joint: int) -> str:
    so_far = bench.known.so_far(joint, 1)
    slides = bool(bench.nominal.sliding[joint - 1])
    return plain(verdict_words(so_far, slides, bench.known.tool_std_m(so_far), bench.state))


def plain(html: str) -> str:
    return re.sub(r"<[^>]*>", "", html)


def test_a_step_says_command_place_reason_and_what_comes_next(bench):
    text = step_of(bench)
    assert "Joint 6: stop 1 of 17, target T1" in text
    assert "q6 = -23.4039°" in text
    assert "about, by the nominal arm" in text
    assert re.search(r"left: hz \d+\.\d{3}°, v \d+\.\d{3}°", text)
    assert "Only joint 6 moves" in text
    assert "Next: stop 2." in text
    bench.decisions.go_to(2, 1)
    text = step_of(bench)
    assert "The target was not seen before" in text
    assert "its motor stands still" in text
    assert "Next: target T3 at the same stop." in text


def test_the_copied_command_is_bare_numbers(bench):
    html = step_words(bench.state, bench.nominal, False, None)
    copied = re.search(r"data-copy='([^']*)'", html)[1]
    values = [float(word) for word in copied.split(", ")]
    assert values == pytest.approx(np.rad2deg(bench.state.next_step.commanded), abs=1e-4)


def test_by_hand_the_first_stop_of_a_pass_is_reached_from_beyond(bench):
    bench.session.append(Setting(SETTING, "by hand"))
    bench.changed()
    text = step_of(bench, by_hand=True)
    assert "Send the robot to" in text
    assert "First bring joint 6 to -24.9664°" in text
    assert "enter what the instrument shows" in text


def test_a_return_pass_is_told(bench):
    row = PlannedSweep(6, 1, -0.4, 0.4, 2, ("T1",), both_ways=True)
    bench.session.append(Planned((row,), bench.state.plan.home))
    bench.shooting.measure()
    bench.shooting.measure()
    assert "return pass" in step_of(bench)
    assert "It is the last shot of the plan" not in step_of(bench)
    bench.shooting.measure()
    assert "It is the last shot of the plan" in step_of(bench)


def test_when_nothing_is_left_it_says_why_and_where_to_go(bench):
    assert "No sweep is planned" in plain(step_words(State(), bench.nominal, False, None))
    bench.session.append(Planned((PlannedSweep(6, 1, -0.4, 0.4, 2, ("T1",)),), bench.state.plan.home))
    bench.shooting.measure()
    bench.decisions.skip("sight was blocked")
    text = step_of(bench)
    assert "Go to 3 Solve" in text
    assert "1 skipped" in text
    odd = replace(bench.state, targets=())
    assert "does not fit" in plain(step_words(odd, bench.nominal, False, None))


def test_the_table_counts_and_can_be_clicked(bench):
    bench.shooting.measure()
    bench.decisions.skip("sight was blocked")
    bench.shooting.measure_extra(6, 1, bench.state.plan.home[5])
    bench.decisions.exclude(bench.state.shots[0].id, "a cloud")
    html = sweeps_table(sweep_progress(bench.state), bench.nominal)
    assert html.count("data-say=") == 6
    assert "data-say='sweep-6-1'" in html
    assert "1 skipped, 1 extra, 1 excluded" in plain(html)
    assert "joint 6, an extra stop, target T1" in plain(shot_words(bench.state.shots[1], False, bench.state))
    bench.decisions.undo()
    assert "the shot of joint 6, an extra stop" in undo_words(bench.decisions.undo_event(), bench.state)
    assert "50°" in html
    assert "3.1°" in html
    assert "No sweep is planned" in sweeps_table((), bench.nominal)


def test_a_shot_that_went_wrong_is_named_in_the_table_and_in_words(bench):
    bench.runs.run(False)
    bench.decisions.undo()
    bench.session.append(Setting(SETTING, "by hand"))
    bench.changed()
    bench.typed.enter("-3000 5400 60", "mm")
    text = verdict_of(bench, 6)
    assert "measure again" in text
    assert "The axis of joint 6 was known before this shot, and is not with it." in text
    slip = bench.state.shots[-1]
    html = sweeps_table(sweep_progress(bench.state), bench.nominal, {(6, 1): [slip]})
    assert f"data-say='shot-{slip.id}'" in html
    assert "✖ record 17" in plain(html)
    several = {(6, 1): bench.state.shots[:6]}
    assert "✖ record 4, and 2 more" in plain(sweeps_table(sweep_progress(bench.state), bench.nominal, several))


def test_sliding_joints_are_told_in_millimetres(tmp_path):
    with Session.create(tmp_path / f"s{SUFFIX}", demo_events(scara.cell())) as session:
        bench = Workbench(session)
        assert "220 mm" in sweeps_table(sweep_progress(bench.state), bench.nominal)
        bench.decisions.go_to(3, 1)
        assert "q3 = -110.000 mm" in step_of(bench)
        assert "draws a line along its axis" in step_of(bench)
        for _ in range(3):
            bench.shooting.measure()
        assert "If you stop now: direction of axis 3 known to" in verdict_of(bench, 3)
        assert "off the line so far" in verdict_of(bench, 3)


def test_too_short_an_arc_says_how_long_it_must_be(bench):
    for _ in range(3):
        bench.shooting.measure()
    assert "3 of at least 4 shots" in verdict_of(bench, 6)
    for _ in range(2):
        bench.shooting.measure()
    text = verdict_of(bench, 6)
    assert bench.known.so_far(6, 1).live.fit is None
    assert re.search(
        r"5 shots over 12\.5° cannot be told from a straight line\. The arc has to reach about \d+°: \d+ more", text
    )


def test_a_shot_is_told_against_the_axis_and_its_prediction(bench):
    bench.runs.run(False)
    text = verdict_of(bench, 6)
    fit = bench.known.so_far(6, 1).live.fit
    axial = f"{abs(fit.axial_m[-1] * 1e3):.2f} mm"
    assert "Stop 17 of joint 6: axial" in text
    assert axial in text
    assert f"predicted ±{fit.sigma_m * fit.noise_factor * 1e3:.2f} mm each, chance" in text
    assert "times as much as the stated noise of 0.11 mm" in text
    assert "mm at the tool" in text


def test_before_any_shot_it_says_what_to_press():
    assert "Press Measure" in plain(verdict_words(None, False, None, State()))


def test_undo_says_what_it_takes_back(bench):
    assert "Nothing to undo" in plain(undo_words(bench.decisions.undo_event(), bench.state))
    bench.shooting.measure()
    assert "the shot of joint 6, stop 1, target T1" in undo_words(bench.decisions.undo_event(), bench.state)
    bench.decisions.exclude(bench.state.shots[0].id, "a cloud")
    assert "that record 1 is excluded" in undo_words(bench.decisions.undo_event(), bench.state)
    bench.decisions.skip("x")
    assert "the skipping of joint 6, stop 2" in undo_words(bench.decisions.undo_event(), bench.state)
    bench.session.append(Setting("transmission_6", "direct"))
    assert "the choice of transmission 6" in undo_words(bench.decisions.undo_event(), bench.state)
    bench.shooting.check_instrument("T1", 2)
    assert "one shot of the instrument check at target T1" in undo_words(bench.decisions.undo_event(), bench.state)
    bench.session.append(Fact("Place", "<b>hall</b>"))
    assert "what was entered as Place" in undo_words(bench.decisions.undo_event(), bench.state)
    bench.session.append(OperatorNamed("B. Somebody"))
    assert "the operator's name" in plain(undo_words(bench.decisions.undo_event(), bench.state)).replace("&#x27;", "'")


def test_a_run_tells_how_far_it_is(bench):
    assert plain(run_words(None, None, 0, 0, 0.0)) == ""
    text = plain(run_words(True, None, 30, 120, 60.0))
    assert "runs the whole plan: 30 of 120 shots, about 3 min 0 s left" in text
    assert "Paused" in run_words(None, False, 3, 17, 1.0)


def test_typed_points_are_echoed_or_refused():
    assert "One line a shot" in entered_words("", None, 0)
    assert "understood as 2 shots; the last one" in entered_words("the last one at 1, 2, 3 mm", None, 2)
    assert "&lt;b&gt;" in entered_words("", "line 1: '<b>'", 0)


def test_names_from_people_are_escaped(tmp_path):
    name = "<img src=x onerror=alert(1)>"
    events = [
        event for event in demo_events(irb_l6.cell()) if not isinstance(event, Planned | PosesPlanned | TargetsNamed)
    ]
    events += [TargetsNamed((TargetEntry(name, 6),)), Planned((PlannedSweep(6, 1, -0.2, 0.2, 5, (name,)),))]
    with Session.create(tmp_path / f"x{SUFFIX}", events, by=name) as session:
        bench = Workbench(session)
        bench.typed.enter("1 2 3", "mm")
        bench.decisions.exclude(bench.state.shots[0].id, name, by=name)
        pieces = (
            step_words(bench.state, bench.nominal, True, None),
            sweeps_table(sweep_progress(bench.state), bench.nominal),
            undo_words(bench.decisions.undo_event(), bench.state),
            shot_words(bench.state.shots[0], True, bench.state),
        )
    assert not any("<img" in piece for piece in pieces)
