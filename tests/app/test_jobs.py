"""One worker: in order, one at a time, and nothing goes wrong silently."""

import threading

import pytest

from app.jobs import Jobs
from core.errors import InputError


@pytest.fixture
def jobs():
    worker = Jobs()
    yield worker
    worker.close()


def test_jobs_are_done_in_order_on_one_thread(jobs):
    done, threads = [], set()
    for k in range(50):
        jobs.ask(lambda k=k: (done.append(k), threads.add(threading.get_ident())), done.append)
    jobs.wait()
    assert done == list(range(50))
    assert threads != {threading.get_ident()}
    assert len(threads) == 1


def test_a_refusal_reaches_whoever_asked_as_it_is(jobs):
    said = []

    def refuse():
        raise InputError("joint 7 is not there; expected 1..6")

    jobs.ask(refuse, said.append)
    jobs.wait()
    assert said == ["joint 7 is not there; expected 1..6"]


def test_an_unforeseen_error_is_a_sentence_too_and_the_worker_goes_on(jobs, caplog):
    said = []
    jobs.ask(lambda: 1 / 0, said.append)
    jobs.ask(lambda: said.append("next"), said.append)
    jobs.wait()
    assert "ZeroDivisionError" in said[0]
    assert "Nothing was lost" in said[0]
    assert said[1] == "next"
    assert "Traceback" in caplog.text


def test_busy_while_something_is_done(jobs):
    go = threading.Event()
    jobs.ask(go.wait, print)
    assert jobs.busy
    go.set()
    jobs.wait()
    assert not jobs.busy


def test_the_worker_thinks_ahead_once_after_a_rest(monkeypatch):
    monkeypatch.setattr("app.jobs.REST_S", 0.02)
    thought = threading.Semaphore(0)
    worker = Jobs()
    worker.when_idle(thought.release)
    try:
        worker.ask(lambda: None, lambda _: None)
        assert thought.acquire(timeout=5)
        assert not thought.acquire(timeout=0.2)
        worker.ask(lambda: None, lambda _: None)
        assert thought.acquire(timeout=5)
    finally:
        worker.close()


def test_what_goes_wrong_in_thinking_ahead_stops_nothing(monkeypatch, caplog):
    monkeypatch.setattr("app.jobs.REST_S", 0.02)
    tried, done = threading.Event(), []

    def wrong():
        tried.set()
        raise ZeroDivisionError

    worker = Jobs()
    worker.when_idle(wrong)
    try:
        worker.ask(lambda: None, lambda _: None)
        assert tried.wait(5)
        worker.ask(lambda: done.append(1), done.append)
        worker.wait()
    finally:
        worker.close()
    assert done == [1]
    assert "ZeroDivisionError" in caplog.text
