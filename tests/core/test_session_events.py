"""Hostile values get one clear sentence; honest ones survive to the last bit."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.session_entries import DamagedEntry, carved, decoded, encoded, new_entry
from core.session_events import (
    CheckShot,
    Event,
    Fact,
    Judged,
    NoteWritten,
    RobotChosen,
    SessionError,
    Setting,
    ShotTaken,
    TargetEntry,
    TargetsNamed,
    Titled,
    checked,
)

NUMBERS = st.floats(min_value=-1e12, max_value=1e12)
LINES = st.text(
    st.characters(exclude_categories=("Cc", "Cs", "Zl", "Zp")),
    max_size=200,
)
HOSTILE: tuple[tuple[object, str], ...] = (
    (Titled("x" * 201), "title = 'xxx.*at most 200 characters"),
    (Titled("x" * 10_000_000), "at most 200 characters"),
    (Titled("a\nb"), "without control characters"),
    (Titled("a\0b"), "without control characters"),
    (Titled("\ud800"), "without control characters"),
    (Titled("a\u2028b"), "without control characters"),
    (Titled(7), "title = 7: expected a text, got a whole number"),
    (Titled(None), "expected a text, got nothing"),
    (Titled(b"bytes"), "expected a text, got bytes"),
    (NoteWritten("x" * 10_001), "at most 10000 characters"),
    (ShotTaken("T1", (0.0,), (math.nan, 0.0, 0.0)), r"point_m\[0\] = nan: expected a number"),
    (ShotTaken("T1", (0.0,), (math.inf, 0.0, 0.0)), r"point_m\[0\] = inf: expected a number"),
    (ShotTaken("T1", (0.0,), (1e13, 0.0, 0.0)), "expected a number <= 1000000000000"),
    (ShotTaken("T1", (0.0,), (0.0, 0.0)), "array of length 3"),
    (ShotTaken("T1", (0.0,), ("0", 0.0, 0.0)), r"point_m\[0\] = '0': expected a number, got a text"),
    (ShotTaken("T1", (0.0,) * 101, None), "length <= 100"),
    (ShotTaken("T1", (0.0,), None, temperature_c=math.nan), "temperature_c = nan"),
    (ShotTaken("T1", (0.0,), None, joint=True), "joint = True: expected a whole number, got bool"),
    (ShotTaken("T1", (0.0,), None, phase="swing"), "phase"),
    (ShotTaken("T1", (0.0,), None, approach=(2,)), "approach"),
    (Judged((), "kept"), "length >= 1"),
    (Judged((1,), "loved"), "verdict = 'loved'"),
    (Judged((0,), "kept"), "expected a whole number >= 1"),
    (Judged((2**70,), "kept"), "expected a whole number <= "),
    (TargetsNamed(()), "length >= 1"),
    (TargetsNamed((TargetEntry("T", -1),)), "link = -1"),
    (Fact("key", object()), "no plain value"),
    (Setting("tolerance_m", math.nan), "value = nan"),
    (CheckShot(1, "T1", np.full(3, np.nan)), r"point_m\[0\] = nan"),
    ("titled", "is not an event"),
    (None, "is not an event"),
)


@pytest.mark.parametrize(("event", "sentence"), HOSTILE, ids=[str(k) for k in range(len(HOSTILE))])
def test_a_hostile_value_gets_one_short_sentence(event: Event, sentence: str) -> None:
    with pytest.raises(SessionError, match=sentence) as told:
        checked(event)
    assert len(str(told.value)) < 300
    assert "\n" not in str(told.value)


def test_nesting_without_end_is_refused() -> None:
    deep: object = 0.0
    for _ in range(100_000):
        deep = [deep]
    with pytest.raises(SessionError):
        checked(Setting("x", deep))


def test_an_event_of_many_megabytes_is_refused() -> None:
    with pytest.raises(SessionError, match=r"takes 9.0 MB, expected at most 8 MB"):
        encoded(new_entry(1, RobotChosen("x" * 9_000_000), ""))


def test_a_hostile_author_is_refused() -> None:
    for author in ("x" * 201, "a\nb", 5):
        with pytest.raises(SessionError, match="author"):
            new_entry(1, Titled("x"), author)


@settings(max_examples=200, deadline=None)
@given(st.lists(NUMBERS, min_size=1, max_size=9), st.tuples(NUMBERS, NUMBERS, NUMBERS), LINES, LINES)
def test_what_is_kept_is_what_was_given(commanded: list, point: tuple, target: str, author: str) -> None:
    entry = new_entry(17, ShotTaken(target, tuple(commanded), point, joint=1), author)
    again = decoded(encoded(entry))
    assert again == entry
    assert again.event.point_m == point
    assert again.by == author


def test_arrays_may_be_given_where_numbers_are_listed() -> None:
    event = checked(ShotTaken("T1", np.array([0.5, np.pi]), np.arange(3.0), joint=np.int64(2)))
    assert event == ShotTaken("T1", (0.5, math.pi), (0.0, 1.0, 2.0), joint=2)


@settings(max_examples=300, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 255))
def test_any_changed_byte_of_an_entry_is_noticed(place: int, change: int) -> None:
    data = bytearray(encoded(new_entry(3, ShotTaken("T1", (0.1, 0.2), (1.0, 2.0, 3.0), joint=1), "A. Name")))
    data[place % len(data)] ^= change
    with pytest.raises(DamagedEntry):
        decoded(bytes(data))


def test_intact_entries_are_found_in_any_bytes() -> None:
    entries = [new_entry(k, Titled(f"title {k}"), "") for k in range(1, 6)]
    data = [encoded(entry) for entry in entries]
    data[2] = data[2].replace(b"title", b"tidle")
    noise = b'\x00{"crc":"00000000","size":"9999999",\xff'
    assert [entry.seq for entry in carved(noise + noise.join(data) + data[0][:30])] == [1, 2, 4, 5]
