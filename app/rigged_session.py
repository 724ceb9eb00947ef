"""A session in its cell: the robot and the instrument that it says, and who is told of what changes.

Everything that an operator decides or an instrument sees goes into the session first; listeners are told after it is on
the disk. Any thread may call.
"""

import threading
from collections.abc import Callable

import numpy as np

from app.rigs import key_of, rig_for
from core.geometry import Array
from core.instruments import Desk
from core.kinematics import nominal_net
from core.robot import Robot
from core.session import Session
from core.session_state import State
from core.twin.cell import Cell


class RiggedSession:
    """The session that is worked on, with its rig."""

    def __init__(self, session: Session, cell: Cell | None = None, seed: int = 1) -> None:
        """``cell`` is a simulated cell that the session may be of, beside the built-in ones."""
        self.session = session
        self.alone = threading.Lock()
        """Held by whoever measures, writes what was measured, or solves: one at a time."""
        self._telling = threading.RLock()
        self._cell, self._seed = cell, seed
        self._listeners: list[Callable[[], None]] = []
        self._set_up()

    @property
    def state(self) -> State:
        return self.session.state

    @property
    def nominal(self) -> Robot:
        """The robot as designed."""
        return self.rig.robot

    @property
    def centre(self) -> Array:
        """Commands at the arm's marks, or zeros, about which sweeps are made unless they are held elsewhere, (n,)."""
        home = self.state.plan.home
        return np.zeros(self.nominal.joint_count) if home is None else np.array(home)

    @property
    def standing(self) -> tuple[float, ...]:
        """Commands at which the arm is drawn, (n,): where the robot was sent, or where a person has to send it next."""
        step = self.state.next_step
        return self.rig.driver.commanded if self.rig.moves_itself or step is None else step.commanded

    def nominal_net(self, commanded: tuple[float, ...] | Array) -> Array:
        """Net displacements from the marks that the nominal arm believes in, (n,)."""
        return nominal_net(self.nominal, np.array(commanded) - self.centre)[0]

    def on_change(self, listener: Callable[[], None]) -> None:
        """Be told, with no arguments, after anything changed."""
        self._listeners.append(listener)

    def changed(self) -> None:
        """Tell all listeners; robot and instrument are set up anew first if the session says otherwise than before."""
        with self._telling:
            if key_of(self.state, self._cell) != self._key:
                self._set_up()
            for listener in self._listeners:
                listener()

    def exchange(self, session: Session) -> None:
        """Put another session in the place of this one, which is closed; nobody is told yet."""
        with self.alone:
            old, self.session = self.session, session
            self._set_up()
            old.close()

    def _set_up(self) -> None:
        """Robot and instrument as the session has them now."""
        self._key = key_of(self.state, self._cell)
        self.rig = rig_for(self.state, self._seed, self._cell)
        self.desk = Desk(self.rig.meter)
