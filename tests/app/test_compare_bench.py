"""The comparison runs in a process of its own: it tells how far it is, can be stopped, and nothing waits for it."""

import pickle
import queue
import time

import pytest

from app.compare_bench import CompareBench
from app.compare_words import table_words, verdict_words
from core.errors import InputError
from core.rivals.comparison import Comparison

PATIENCE_S = 240


@pytest.fixture(scope="module")
def made() -> tuple[Comparison, list[int]]:
    """One trial, as the dashboard makes it."""
    bench, told, ends = CompareBench(), [], queue.Queue()
    begun = time.monotonic()
    bench.compare(1, told.append, ends.put)
    assert time.monotonic() - begun < 5
    assert bench.running
    with pytest.raises(InputError, match="being made already"):
        bench.compare(1, told.append, ends.put)
    assert ends.get(timeout=PATIENCE_S) == ""
    assert not bench.running
    return bench.found, told


def test_it_tells_how_far_it_is_and_brings_the_comparison_back(made) -> None:
    found, told = made
    assert told == [0]
    assert found.trials == 1
    assert len(found.rows) > 10
    assert any(row.own for row in found.rows)
    assert any(one.name == "paper, after" for one in found.references)
    assert pickle.loads(pickle.dumps(found)).rows[0].name == found.rows[0].name


def test_the_page_shows_every_method_and_what_to_read_it_against(made) -> None:
    found, _ = made
    words = table_words(found)
    for row in found.rows:
        assert f"<td class='n'>{row.position_m.mean * 1e3:.2f}</td>" in words
    assert "paper, after" in words
    assert words.index(f"{min(row.position_m.mean for row in found.rows) * 1e3:.2f}") < words.index("no calibration")
    assert "12 kept-out poses each" in verdict_words(found, "")
    assert "It was stopped." in verdict_words(None, "It was stopped.")


def test_it_can_be_stopped() -> None:
    bench, ends = CompareBench(), queue.Queue()
    bench.compare(100, lambda done: None, ends.put)
    bench.stop()
    assert ends.get(timeout=60) == "It was stopped."
    assert not bench.running
    assert bench.found is None
    bench.stop()


@pytest.mark.parametrize("trials", [0, 101, 2.5, None])
def test_a_number_of_trials_that_cannot_be_is_refused(trials) -> None:
    with pytest.raises(InputError, match="expected a whole number from 1 to 100"):
        CompareBench().compare(trials, lambda done: None, lambda why: None)
