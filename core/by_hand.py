"""A cell without drivers: a person moves the robot, and types in, pastes or imports what the instrument shows."""

from collections import deque
from collections.abc import Iterable

from core.instruments import Cancelled, InstrumentFailed, MeasureRequest, PointMeter, Reading, RobotDriver
from core.measurements import Instrument


class HandMovedRobot(RobotDriver):
    """A robot that somebody else moves: it stands where it was asked to, as nobody can tell."""

    def __init__(self, commanded: tuple[float, ...]) -> None:
        self.commanded = commanded

    def move_to(self, commanded: tuple[float, ...], cancelled: Cancelled) -> None:
        """Take it that it went there."""
        self.commanded = tuple(commanded)


class EnteredPoints(PointMeter):
    """Readings that were entered by hand wait here, in their order, until they are asked for."""

    def __init__(self, instrument: Instrument) -> None:
        self._instrument = instrument
        self._waiting: deque[Reading] = deque()

    @property
    def statement(self) -> Instrument:
        return self._instrument

    def enter(self, readings: Iterable[Reading]) -> None:
        """Lay readings ready instead of any that still wait."""
        self._waiting = deque(readings)

    def measure(self, request: MeasureRequest, cancelled: Cancelled) -> Reading:
        """The next reading that was entered.

        Raises:
            InstrumentFailed: none waits.
        """
        if not self._waiting:
            raise InstrumentFailed(
                f"no coordinates of target {request.target!r} were entered, expected x y z as the instrument shows them"
            )
        return self._waiting.popleft()
