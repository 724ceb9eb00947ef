"""Work in a process of its own: it tells, ends, fails in a sentence, and can be stopped; nobody waits for it."""

import queue
import time
from pathlib import Path

import pytest

from app.beside import STOPPED, Beside
from core.errors import CampaignError, InputError

PATIENCE_S = 60


def counted(tell, count: int) -> int:
    for number in range(count):
        tell(number)
    return count


def refused(tell) -> None:
    raise CampaignError("joint 7 is not there; expected 1..6")


def crashed(tell) -> float:
    return 1 / 0


def endless(tell, marker: Path) -> None:
    tell("begun")
    time.sleep(PATIENCE_S)
    marker.write_text("it went on")


def unsendable(tell) -> object:
    return lambda: None


class Ends(queue.Queue):
    def __call__(self, made: object, why_not: str) -> None:
        self.put((made, why_not))


def test_it_tells_and_brings_back_what_came_of_it():
    beside, told, ends = Beside("a count"), [], Ends()
    beside.start(counted, (3,), told.append, ends)
    assert ends.get(timeout=PATIENCE_S) == (3, "")
    assert told == [0, 1, 2]
    assert not beside.running


@pytest.mark.parametrize(
    ("work", "sentence", "trace"),
    [
        (refused, "joint 7 is not there; expected 1..6", False),
        (crashed, "ZeroDivisionError", True),
        (unsendable, "the log has the details", True),
    ],
)
def test_what_goes_wrong_is_a_sentence_and_what_was_not_foreseen_is_in_the_log(work, sentence, trace, caplog):
    beside, ends = Beside("a try"), Ends()
    beside.start(work, (), print, ends)
    made, why_not = ends.get(timeout=PATIENCE_S)
    assert made is None
    assert sentence in why_not
    assert ("Traceback" in caplog.text) == trace
    assert not beside.running


def test_one_at_a_time_and_it_can_be_stopped(tmp_path):
    beside, told, ends = Beside("a nap"), queue.Queue(), Ends()
    beside.start(endless, (tmp_path / "marker",), told.put, ends)
    assert beside.running
    with pytest.raises(InputError, match="a nap is being made already"):
        beside.start(counted, (3,), told.put, ends)
    assert told.get(timeout=PATIENCE_S) == "begun"
    beside.stop()
    assert ends.get(timeout=PATIENCE_S) == (None, STOPPED)
    assert not beside.running
    assert list(tmp_path.iterdir()) == []
    beside.stop()


def test_who_watches_may_fail_without_harm(caplog):
    beside, ends = Beside("a count"), Ends()

    def gone(value: object) -> None:
        raise KeyError(value)

    beside.start(counted, (2,), gone, ends)
    assert ends.get(timeout=PATIENCE_S) == (2, "")
    assert "progress could not be shown" in caplog.text
