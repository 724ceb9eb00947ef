"""Coordinates that a person reads off an instrument: shots that were typed, pasted or sent as a file."""

from pathlib import Path

from app.rigged_session import RiggedSession
from core.by_hand import EnteredPoints
from core.entered_shots import shots_of_file, shots_of_lines
from core.errors import InputError
from core.instruments import Reading
from core.point_lines import entered_points
from core.session_conditions import conditions_of
from core.session_events import ShotTaken


class TypedShots:
    """Takes what a person enters."""

    def __init__(self, work: RiggedSession) -> None:
        self._work = work

    def enter(self, text: str, unit: str, by: str | None = None) -> int:
        """Take coordinates that were typed or pasted as the next shots of this sweep, all of them or none.

        Raises:
            InputError: a line is no point, or there are too many of them.
            SessionError: the session is read-only.
        """
        state = self._work.state
        return self._enter(shots_of_lines(state, entered_points(text, unit), conditions_of(state)), by)

    def enter_file(self, path: Path, by: str | None = None) -> int:
        """Take the points of a CSV file as shots of this sweep, all of them or none.

        Raises:
            InputError: the file cannot be read, or its points do not belong to this sweep.
            SessionError: the session is read-only.
        """
        state = self._work.state
        return self._enter(shots_of_file(state, path, conditions_of(state)), by)

    def lay_ready(self, text: str, unit: str) -> int:
        """Lay typed coordinates ready for whatever is measured next by hand; how many there are.

        Raises:
            InputError: a line is no point, or nobody measures by hand here.
        """
        meter = self._work.rig.meter
        if not isinstance(meter, EnteredPoints):
            raise InputError("the points of this cell are simulated, expected no coordinates by hand")
        points = entered_points(text, unit)
        meter.enter([Reading(point.point_m) for point in points])
        return len(points)

    def _enter(self, shots: list[ShotTaken], by: str | None) -> int:
        with self._work.alone:
            self._work.session.append_all(shots, by)
        self._work.changed()
        return len(shots)
