"""A session's state is the fold of its events; undo and redo have no end; nothing is ever deleted."""

import random
import sqlite3
from pathlib import Path

import pytest
from session_scenes import busy_session, demo_session, take

from core.errors import InputError
from core.instruments import Reading
from core.session import Session
from core.session_entries import Entry, encoded
from core.session_events import (
    CheckShot,
    Created,
    Event,
    Fact,
    Failed,
    InstrumentChosen,
    Judged,
    NoteWritten,
    OperatorNamed,
    RobotChosen,
    SessionError,
    Setting,
    Skipped,
    Solved,
    TargetEntry,
    TargetsNamed,
    Titled,
    Undo,
    WentTo,
)
from core.session_fold import folded
from core.session_shots import shot_at
from core.session_state import State
from core.session_timeline import Timeline
from core.version import VERSION

SEEN = Reading((1.0, 2.0, 3.0), (1e-8, 0.0, 0.0, 1e-8, 0.0, 1e-8), time_s=40.0)


@pytest.fixture
def session(tmp_path: Path) -> Session:
    with demo_session(tmp_path / "a.trueaxis") as made:
        yield made


def undoable_titles(session: Session) -> list[str]:
    return [entry.event.title for entry in session.entries if isinstance(entry.event, Titled)]


def test_every_kind_of_decision_shows_in_the_state(session: Session) -> None:
    take(session, 2)
    first, second = session.state.shots
    session.append(Judged((first.id,), "excluded", "a cloud"), by="B. Other")
    session.append(OperatorNamed("C. Third"))
    session.append(Fact("payload", "none"))
    session.append(Setting("tolerance_m", 0.002))
    session.append(NoteWritten("the floor shook", second.id))
    session.append(Failed("the instrument sees nothing"))
    session.append(Solved("ab" * 32, 2, VERSION, {"noise_mm": 0.2}))
    state = session.state
    assert (state.shot(first.id).verdict, state.shot(first.id).reason) == ("excluded", "a cloud")
    assert state.shot(first.id).judged_by == "B. Other"
    assert not state.shot(first.id).counts
    assert state.shot(second.id).counts
    assert state.operator == "C. Third"
    assert state.facts["payload"] == "none"
    assert state.settings["tolerance_m"] == 0.002
    assert [(note.note.text, note.by) for note in state.notes] == [("the floor shook", "C. Third")]
    assert [failure.sentence for failure in state.failures] == ["the instrument sees nothing"]
    assert state.solves[-1].solved.figures == {"noise_mm": 0.2}
    assert state.software == (VERSION,)
    assert state.created_utc <= first.utc <= second.utc <= state.changed_utc


def test_an_excluded_shot_can_count_again(session: Session) -> None:
    take(session, 1, SEEN)
    number = session.state.shots[0].id
    session.append(Judged((number,), "excluded", "a cloud"))
    session.append(Judged((number,), "kept"))
    assert session.state.shot(number).counts


def test_a_shot_measured_again_is_kept_and_superseded(session: Session) -> None:
    step = session.state.next_step
    take(session, 1, SEEN)
    old = session.state.shots[0]
    session.append(shot_at(step, SEEN, replaces=old.id))
    first, second = session.state.shots
    assert (first.superseded_by, second.superseded_by) == (second.id, None)
    assert [shot.counts for shot in session.state.shots] == [False, True]
    assert (first.record, second.record) == (1, 2)
    with pytest.raises(SessionError, match="was replaced before"):
        session.append(shot_at(step, SEEN, replaces=old.id))


def test_the_position_follows_shots_skips_and_jumps(session: Session) -> None:
    steps = session.state.steps
    assert session.state.position == 0
    take(session, 2, SEEN)
    assert session.state.position == 2
    session.append(Skipped(*steps[2].key, reason="hidden"))
    assert session.state.position == 3
    session.append(WentTo(*steps[40].key))
    assert session.state.position == 40
    take(session, 1, SEEN)
    assert session.state.position == 41
    session.append(WentTo(*steps[-1].key))
    take(session, 1, SEEN)
    assert session.state.position == 3
    session.append(shot_at(steps[2], SEEN))
    assert steps[2].key in session.state.done


def test_when_all_is_done_there_is_no_next_step(session: Session) -> None:
    take(session, len(session.state.steps), SEEN)
    assert session.state.position is None
    assert session.state.next_step is None


def test_checks_of_the_instrument_are_gathered_by_number(session: Session) -> None:
    for check, x in ((1, 0.0), (1, 0.002), (2, 5.0), (1, 0.004)):
        session.append(CheckShot(check, "T1", (x, 0.0, 0.0)))
    by_number = {check.number: check for check in session.state.checks}
    assert len(by_number[1].shots) == 3
    assert by_number[1].net_radial_m == pytest.approx(0.002)
    assert by_number[2].net_radial_m is None
    with pytest.raises(SessionError, match="is of target 'T1'"):
        session.append(CheckShot(1, "T2", (0.0, 0.0, 0.0)))


def test_undo_and_redo_without_limit(session: Session) -> None:
    start = session.state
    states = []
    for number in range(200):
        states.append(session.append(Titled(f"title {number}")).title)
    for number in reversed(range(1, 200)):
        assert session.undo().title == states[number - 1]
    session.undo()
    assert session.state.title == start.title
    for title in states:
        assert session.redo().title == title
    with pytest.raises(SessionError, match="nothing to redo"):
        session.redo()


def test_everything_can_be_undone_down_to_the_beginning(session: Session) -> None:
    take(session, 3, SEEN)
    while session.state.undo_next is not None:
        session.undo()
    assert session.state.shots == ()
    assert session.state.robot is None
    assert session.state.created_utc
    with pytest.raises(SessionError, match="nothing to undo"):
        session.undo()


def test_what_merely_took_place_is_not_undone(session: Session) -> None:
    take(session, 1, SEEN)
    session.append(Solved("ab" * 32, 1, VERSION))
    session.append(Failed("a cable is loose"))
    session.undo()
    assert session.state.shots == ()
    assert len(session.state.solves) == len(session.state.failures) == 1


def test_something_new_after_an_undo_forgets_the_redo_but_deletes_nothing(session: Session) -> None:
    session.append(Titled("one"))
    session.undo()
    session.append(Titled("two"))
    with pytest.raises(SessionError, match="nothing to redo"):
        session.redo()
    assert undoable_titles(session)[1:] == ["one", "two"]
    one = next(entry for entry in session.entries if entry.event == Titled("one"))
    assert not session.counts(one.seq)
    assert isinstance(session.entries[one.seq].event, Undo)


def model_state(entries: tuple[Entry, ...]) -> tuple[State, list[int]]:
    """Undo and redo as one would explain them: a list of what counts, folded from the beginning every time."""
    done, undone = [], []
    for entry in entries:
        if entry.kind == "undo":
            last = next(e for e in reversed(done) if e.event.undoable)
            done.remove(last)
            undone.append(last)
        elif entry.kind == "redo":
            done.append(undone.pop())
            done.sort(key=lambda e: e.seq)
        else:
            undone = [] if entry.event.undoable else undone
            done.append(entry)
    return folded(State(), done), [entry.seq for entry in undone]


@pytest.mark.parametrize("seed", range(8))
def test_any_mixture_of_events_undo_and_redo_is_the_fold_of_what_counts(tmp_path: Path, seed: int) -> None:
    rng = random.Random(seed)
    with demo_session(tmp_path / "a.trueaxis") as session:
        for number in range(150):
            move = rng.choice(["undo", "undo", "redo", "shot", "shot", "title", "solve", "judge"])
            if move == "undo" and session.state.undo_next:
                session.undo()
            elif move == "redo" and session.state.undone:
                session.redo()
            elif move == "shot" and session.state.next_step:
                take(session, 1, SEEN)
            elif move == "title":
                session.append(Titled(f"title {number}"))
            elif move == "solve":
                session.append(Solved("0" * 64, 1, VERSION))
            elif session.state.shots:
                session.append(Judged((rng.choice(session.state.shots).id,), "doubtful"))
            state, undone = model_state(session.entries)
            assert (session.state.title, session.state.shots) == (state.title, state.shots)
            assert (session.state.solves, list(session.state.undone)) == (state.solves, undone)
        fresh = Timeline(session.entries).state
    assert fresh == session.state


def test_a_session_opens_as_it_was_left(tmp_path: Path) -> None:
    path = tmp_path / "a.trueaxis"
    with busy_session(path) as session:
        before, position = session.state, session.state.position
    with Session.open(path) as again:
        assert again.state == before
        assert again.state.position == position
        assert list(again.redo().skipped.values()) == ["not seen from there"]
    assert [p.name for p in tmp_path.iterdir()] == ["a.trueaxis"]


def test_an_acknowledged_event_can_be_read_by_others_at_once(tmp_path: Path) -> None:
    path = tmp_path / "a.trueaxis"
    with demo_session(path) as session, Session.open(path, read_only=True) as other:
        session.append(Titled("seen?"))
        assert other.state.title != "seen?"
        assert other.refresh().title == "seen?"
        session.undo()
        assert other.refresh().title == session.state.title


def test_many_events_are_taken_together_or_not_at_all(session: Session) -> None:
    before = session.entries
    step = session.state.next_step
    with pytest.raises(SessionError, match="no shot 999"):
        session.append_all([shot_at(step, SEEN), Judged((999,), "kept")])
    assert session.entries == before
    state = session.append_all([shot_at(step, SEEN), Titled("both")])
    assert (len(state.shots), state.title) == (1, "both")


def test_events_are_never_changed_or_deleted_in_the_file(tmp_path: Path) -> None:
    path = tmp_path / "a.trueaxis"
    busy_session(path).close()
    connection = sqlite3.connect(path)
    for statement in ("DELETE FROM events", "UPDATE events SET entry = ''"):
        with pytest.raises(sqlite3.IntegrityError, match="never"):
            connection.execute(statement)
    connection.close()


def test_events_carry_time_author_and_number(session: Session) -> None:
    session.append(OperatorNamed("A. Name"))
    session.append(Titled("x"))
    session.append(Titled("y"), by="somebody else")
    assert [entry.by for entry in session.entries[-2:]] == ["A. Name", "somebody else"]
    assert [entry.seq for entry in session.entries] == list(range(1, len(session.entries) + 1))
    times = [entry.utc for entry in session.entries]
    assert times == sorted(times)


REFUSED: tuple[tuple[Event, str], ...] = (
    (Created("0"), "written by the session itself"),
    (Undo(1), "written by the session itself"),
    (Judged((1,), "kept"), "no shot 1"),
    (Judged((1,), "excluded"), "without a reason"),
    (NoteWritten("x", 1), "no shot 1"),
    (CheckShot(1, "T9", (0.0, 0.0, 0.0)), "no target 'T9'"),
    (Skipped(6, 1, 99, 1, "T1"), "not planned"),
    (WentTo(9, 1, 0, 1, "T1"), "not planned"),
    (RobotChosen("format = 'trueaxis-robot/1'"), "robot.toml: 0 ..joint.. tables"),
    (RobotChosen("x = 1", {"../../evil": "x"}), "leads out of the folder"),
    (TargetsNamed((TargetEntry("T1", 6), TargetEntry("T1", 5))), "same name"),
    (TargetsNamed((TargetEntry("T1", 7),)), "rides on link 7"),
    (TargetsNamed((TargetEntry("T1", 6),)), "no target 'T2'"),
)


@pytest.mark.parametrize(("event", "sentence"), REFUSED, ids=[f"{k}" for k in range(len(REFUSED))])
def test_an_event_that_makes_no_sense_is_refused_and_changes_nothing(
    session: Session, event: Event, sentence: str
) -> None:
    before, rows = session.state, session.entries
    with pytest.raises(InputError, match=sentence):
        session.append(event)
    assert session.state is before
    assert session.entries == rows


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"commanded": (0.0,) * 5}, "commanded has 5 values, expected 6"),
        ({"target": "T9"}, "no target 'T9'"),
        ({"joint": 7}, "expected a joint 1..6"),
        ({"sweep": 0}, "sweep 0, step 0"),
        ({"target": "T4"}, "cannot see joint 6"),
        ({"covariance_m2": (1e-8, 2e-8, 0.0, 1e-8, 0.0, 1e-8)}, "not positive definite"),
        ({"phase": "move"}, "is a move, expected no target"),
        ({"phase": "pose"}, "pose without its number"),
        ({"approach": (1, 0)}, "approach has 2 values"),
        ({"replaces": 3}, "replaces shot 3"),
        ({"record": 1}, "record 1, expected 3"),
    ],
)
def test_a_shot_that_does_not_fit_is_refused(session: Session, changes: dict, sentence: str) -> None:
    take(session, 2, SEEN)
    good = session.state.shots[0].taken
    values = {name: getattr(good, name) for name in good.__struct_fields__}
    with pytest.raises(SessionError, match=sentence):
        session.append(type(good)(**values | changes))


def test_robot_and_targets_cannot_be_pulled_from_under_the_shots(session: Session) -> None:
    take(session, 1, SEEN)
    toml = session.state.robot_toml
    cut = toml[: toml.rindex("[[joint]]")] + toml[toml.index("[[frame]]") :]
    with pytest.raises(InputError):
        session.append(RobotChosen(cut))
    assert session.append(InstrumentChosen("laser-tracker", 2e-5)).instrument.sigma_m == 2e-5
    assert session.append(RobotChosen(toml)).robot.name == "ASEA IRB L6"


def test_a_closed_session_takes_nothing_more(session: Session) -> None:
    session.close()
    with pytest.raises(SessionError, match="it was closed"):
        session.append(Titled("x"))
    session.close()


def test_entries_are_found_again_byte_by_byte(session: Session) -> None:
    take(session, 1)
    with Session.open(session.path, read_only=True) as other:
        assert [encoded(e) for e in other.entries] == [encoded(e) for e in session.entries]
