"""Solving on demand: the last calibration of a session, and how much has come since."""

import contextlib
import hashlib

from app.ahead import SolveAhead
from app.rigged_session import RiggedSession
from core.calibration import Calibration
from core.calibration_json import calibration_to_json
from core.errors import TrueaxisError
from core.session_campaign import to_campaign
from core.session_events import Solved
from core.solve_figures import figures_of
from core.version import VERSION


class Solving:
    """The last solution."""

    def __init__(self, work: RiggedSession) -> None:
        self._work, self._ahead = work, SolveAhead()
        self.calibration: Calibration | None = None

    def solve(self, by: str | None = None) -> Calibration:
        """Calibrate from the shots that count; meanwhile no shot is taken, so that the solution is of all there are.

        Raises:
            TrueaxisError: the shots do not allow it; the sentence says why.
        """
        with self._work.alone:
            found = self._ahead.solution(to_campaign(self._work.state))
            digest = hashlib.sha256(calibration_to_json(found).encode()).hexdigest()
            solved = Solved(digest, len(found.refinement.residuals.row), VERSION, figures_of(found))
            self._work.session.append(solved, by)
            self.calibration = found
        self._work.changed()
        return found

    def solve_again(self) -> None:
        """Compute the last solution anew, as after a restart; nothing where shots or choices changed since.

        Raises:
            TrueaxisError: it cannot be computed any more.
        """
        if self._work.state.solves and self.calibration is None and not self.since_solved:
            self.calibration = self._ahead.solution(to_campaign(self._work.state))
            self._work.changed()

    def solve_ahead(self) -> None:
        """Compute the solution of what is there, so that it is at hand when it is asked for; nothing is decided."""
        with contextlib.suppress(TrueaxisError):
            self._ahead.prepare(to_campaign(self._work.state))

    @property
    def since_solved(self) -> int:
        """How many shots and decisions came after the last solution."""
        session = self._work.session
        return session.decisions_since(session.state.solves[-1].id) if session.state.solves else 0

    def forget(self) -> None:
        """The solution is of another session."""
        self.calibration = None
