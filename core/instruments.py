"""What a session asks of the outside world: an instrument that measures points, a robot that goes where it is told.

A driver blocks while it works and looks at ``cancelled()`` now and then. It says what went wrong by raising
``InstrumentFailed`` with a sentence. ``measure_within`` runs it so that neither a hang nor an unforeseen error of a
driver reaches whoever asked.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from threading import Event, Lock, Thread
from time import monotonic

import numpy as np

from core.errors import TrueaxisError
from core.measurements import Instrument

Cancelled = Callable[[], bool]
"""Asked by a driver while it works: true once nobody wants the answer any more."""
LOOK_S = 0.01
"""How often an impatient caller is looked after."""


class InstrumentFailed(TrueaxisError):
    """The instrument or the robot did not do what it was asked for; the message is for the operator."""


class MeasurementCancelled(InstrumentFailed):
    """Somebody cancelled it."""


class MeasurementTimedOut(InstrumentFailed):
    """It took too long."""


@dataclass(frozen=True)
class MeasureRequest:
    """One point to be measured."""

    target: str
    commanded: tuple[float, ...]
    """Where the robot was sent, rad or m, (n,)."""
    expected_m: tuple[float, float, float] | None = None
    """About where the target should be, in the instrument's frame; None: not known."""


@dataclass(frozen=True)
class Reading:
    """What the instrument saw."""

    point_m: tuple[float, float, float]
    """In the instrument's frame."""
    covariance_m2: tuple[float, float, float, float, float, float] | None = None
    """xx, xy, xz, yy, yz, zz; None: the instrument's stated sigma."""
    angles_rad: tuple[float, ...] | None = None
    """hz and v of each station, if it reads angles."""
    time_s: float | None = None
    """On the instrument's clock."""
    temperature_c: float | None = None
    """Of the air."""
    arm_temperature_c: float | None = None

    def __post_init__(self) -> None:
        for name, count in (("point_m", 3), ("covariance_m2", 6), ("angles_rad", None)):
            values = getattr(self, name)
            if values is None:
                continue
            if (count and len(values) != count) or not np.isfinite(values).all():
                raise InstrumentFailed(f"the instrument sent {name} = {values}, expected {count or 'finite'} numbers")
            object.__setattr__(self, name, tuple(float(value) for value in values))


class PointMeter(ABC):
    """An instrument that measures points."""

    @property
    @abstractmethod
    def statement(self) -> Instrument:
        """What it is and what it promises."""

    @abstractmethod
    def measure(self, request: MeasureRequest, cancelled: Cancelled) -> Reading:
        """Measure one point.

        Raises:
            InstrumentFailed: it cannot; one sentence says why and what to do.
            MeasurementCancelled: ``cancelled()`` became true.
        """


class RobotDriver(ABC):
    """A robot that goes where it is told."""

    commanded: tuple[float, ...]
    """Where it was sent last, rad or m, (n,)."""

    @abstractmethod
    def move_to(self, commanded: tuple[float, ...], cancelled: Cancelled) -> None:
        """Bring every joint to its command, rad or m, (n,).

        Raises:
            InstrumentFailed: it cannot; one sentence says why.
            MeasurementCancelled: ``cancelled()`` became true.
        """


class Desk:
    """One instrument and the one request that it works on; for any number of threads."""

    def __init__(self, meter: PointMeter) -> None:
        self.meter = meter
        self._busy = Lock()
        self._stop = Event()

    def cancel(self) -> None:
        """Give up what is being measured now, if anything is."""
        self._stop.set()

    def measure(self, request: MeasureRequest, timeout_s: float) -> Reading:
        """Measure one point, or say why not, in time.

        Raises:
            InstrumentFailed: the instrument failed, or still works on what it was asked before.
            MeasurementCancelled: ``cancel`` was called.
            MeasurementTimedOut: nothing came within ``timeout_s`` seconds.
        """
        return self._within(lambda cancelled: self.meter.measure(request, cancelled), timeout_s)

    def _within(self, work: Callable[[Cancelled], Reading], timeout_s: float) -> Reading:
        if not self._busy.acquire(blocking=False):
            raise InstrumentFailed("the instrument is still busy with the last measurement; wait, or restart it")
        self._stop.clear()
        errand = _Errand(work, self._busy)
        end = monotonic() + timeout_s
        while not errand.finished.wait(LOOK_S):
            if self._stop.is_set():
                errand.unwanted.set()
                raise MeasurementCancelled("the measurement was cancelled")
            if monotonic() > end:
                errand.unwanted.set()
                raise MeasurementTimedOut(
                    f"the instrument did not answer within {timeout_s:g} s; check that it sees the target and try again"
                )
        return errand.answer()


class _Errand:
    """One call of a driver on a thread of its own, which may outlive whoever waits for it."""

    def __init__(self, work: Callable[[Cancelled], Reading], busy: Lock) -> None:
        self.finished, self.unwanted = Event(), Event()
        self._work, self._busy = work, busy
        self._reading: Reading | None = None
        self._wrong: Exception | None = None
        Thread(target=self._run, daemon=True, name="measure").start()

    def answer(self) -> Reading:
        if isinstance(self._wrong, TrueaxisError):
            raise self._wrong
        if self._wrong is not None:
            what = str(self._wrong) or type(self._wrong).__name__
            raise InstrumentFailed(f"the instrument's driver failed: {what}") from self._wrong
        if not isinstance(self._reading, Reading):
            raise InstrumentFailed(f"the instrument sent {self._reading!r}, expected a point")
        return self._reading

    def _run(self) -> None:
        try:
            self._reading = self._work(self.unwanted.is_set)
        except Exception as wrong:
            self._wrong = wrong
        finally:
            self._busy.release()
            self.finished.set()
