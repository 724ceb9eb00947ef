"""Whatever a driver does, whoever asks gets a reading or a sentence, in time."""

import threading
import time
from collections.abc import Callable

import pytest

from core.instruments import (
    Cancelled,
    Desk,
    InstrumentFailed,
    MeasurementCancelled,
    MeasurementTimedOut,
    MeasureRequest,
    PointMeter,
    Reading,
)
from core.measurements import Instrument

REQUEST = MeasureRequest("T1", (0.0,))
SEEN = Reading((1.0, 2.0, 3.0))


class Stub(PointMeter):
    """An instrument that does what a test wants."""

    def __init__(self, work: Callable[[Cancelled], Reading]) -> None:
        self._work = work

    @property
    def statement(self) -> Instrument:
        return Instrument()

    def measure(self, request: MeasureRequest, cancelled: Cancelled) -> Reading:
        return self._work(cancelled)


def raising(wrong: Exception) -> Stub:
    def work(cancelled: Cancelled) -> Reading:
        raise wrong

    return Stub(work)


def test_a_reading_comes_through() -> None:
    assert Desk(Stub(lambda cancelled: SEEN)).measure(REQUEST, 1.0) == SEEN


def test_an_instruments_own_sentence_comes_through() -> None:
    with pytest.raises(InstrumentFailed, match=r"^the left one does not see T1$"):
        Desk(raising(InstrumentFailed("the left one does not see T1"))).measure(REQUEST, 1.0)


@pytest.mark.parametrize("wrong", [ZeroDivisionError("division by zero"), OSError(5, "Input/output error"), KeyError()])
def test_an_unforeseen_error_becomes_a_sentence_with_its_cause(wrong: Exception) -> None:
    with pytest.raises(InstrumentFailed, match=r"the instrument's driver failed: .") as told:
        Desk(raising(wrong)).measure(REQUEST, 1.0)
    assert told.value.__cause__ is wrong


def test_what_is_no_reading_is_refused() -> None:
    with pytest.raises(InstrumentFailed, match="sent None, expected a point"):
        Desk(Stub(lambda cancelled: None)).measure(REQUEST, 1.0)


@pytest.mark.parametrize("values", [{"point_m": (1.0, 2.0)}, {"point_m": (float("nan"), 0.0, 0.0)}])
def test_a_reading_must_be_three_finite_numbers(values: dict) -> None:
    with pytest.raises(InstrumentFailed, match="sent point_m"):
        Reading(**values)


def test_a_deaf_driver_is_left_behind_and_stays_busy_until_it_returns() -> None:
    release = threading.Event()

    def deaf(cancelled: Cancelled) -> Reading:
        release.wait(10.0)
        return SEEN

    desk = Desk(Stub(deaf))
    start = time.monotonic()
    with pytest.raises(MeasurementTimedOut, match=r"did not answer within 0\.05 s"):
        desk.measure(REQUEST, 0.05)
    assert time.monotonic() - start < 1.0
    with pytest.raises(InstrumentFailed, match="still busy"):
        desk.measure(REQUEST, 0.05)
    release.set()
    end = time.monotonic() + 5.0
    while time.monotonic() < end:
        try:
            assert desk.measure(REQUEST, 1.0) == SEEN
            return
        except InstrumentFailed:
            time.sleep(0.01)
    pytest.fail("the instrument stayed busy")


def test_cancelling_ends_the_wait_and_tells_the_driver() -> None:
    told, working = threading.Event(), threading.Event()

    def patient(cancelled: Cancelled) -> Reading:
        working.set()
        while not cancelled():
            time.sleep(0.001)
        told.set()
        raise MeasurementCancelled("cancelled")

    desk = Desk(Stub(patient))

    def cancel() -> None:
        working.wait(5.0)
        desk.cancel()

    canceller = threading.Thread(target=cancel)
    canceller.start()
    with pytest.raises(MeasurementCancelled):
        desk.measure(REQUEST, 10.0)
    canceller.join()
    assert told.wait(5.0)


def test_a_cancel_of_nothing_does_not_spoil_the_next_measurement() -> None:
    desk = Desk(Stub(lambda cancelled: SEEN))
    desk.cancel()
    assert desk.measure(REQUEST, 1.0) == SEEN
