"""What the dashboard works on: one session in its cell, and all that an operator does with it.

    bench = Workbench(Session.open(path))
    bench.shooting.measure()
    bench.decisions.exclude(number, "target was bumped")
    bench.solving.solve()

Nothing here draws. Each part keeps what it decides or sees in the session first; listeners are told after it is on the
disk.
"""

from collections.abc import Callable

from app.decisions import Decisions
from app.known_so_far import KnownSoFar
from app.rigged_session import RiggedSession
from app.rigs import Rig
from app.robot_runs import RobotRuns
from app.shooting import Shooting
from app.solving import Solving
from app.typed_shots import TypedShots
from core.calibration import Calibration
from core.geometry import Array
from core.instruments import RobotDriver
from core.robot import Robot
from core.session import Session
from core.session_state import State
from core.twin.cell import Cell


class Workbench:
    """A session at work in its cell."""

    def __init__(self, session: Session, cell: Cell | None = None, seed: int = 1) -> None:
        """``cell`` is a simulated cell that the session may be of, beside the built-in ones."""
        self._work = RiggedSession(session, cell, seed)
        self.shooting = Shooting(self._work)
        self.runs = RobotRuns(self._work, self.shooting)
        self.typed = TypedShots(self._work)
        self.decisions = Decisions(self._work)
        self.solving = Solving(self._work)
        self.known = KnownSoFar(self._work, self.solving)

    @property
    def session(self) -> Session:
        return self._work.session

    @property
    def state(self) -> State:
        return self._work.state

    @property
    def rig(self) -> Rig:
        """Who moves the robot, and what looks at its targets."""
        return self._work.rig

    @property
    def robot(self) -> RobotDriver:
        """Who moves the robot."""
        return self.rig.driver

    @property
    def nominal(self) -> Robot:
        """The robot as designed."""
        return self._work.nominal

    @property
    def calibration(self) -> Calibration | None:
        """The last solution."""
        return self.solving.calibration

    @property
    def centre(self) -> Array:
        """Commands at the arm's marks, or zeros, (n,)."""
        return self._work.centre

    @property
    def standing(self) -> tuple[float, ...]:
        """Commands at which the arm is drawn, (n,)."""
        return self._work.standing

    def nominal_net(self, commanded: tuple[float, ...] | Array) -> Array:
        """Net displacements from the marks that the nominal arm believes in, (n,)."""
        return self._work.nominal_net(commanded)

    def on_change(self, listener: Callable[[], None]) -> None:
        """Be told, with no arguments, after anything changed."""
        self._work.on_change(listener)

    def changed(self) -> None:
        """Tell all listeners that something was written into the session."""
        self._work.changed()

    def switch(self, session: Session) -> None:
        """Work on another session; the one at hand is closed."""
        self.runs.stop()
        self._work.exchange(session)
        self.solving.forget()
        self._work.changed()
