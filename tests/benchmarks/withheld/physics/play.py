"""Play in one joint, stepped in time: the link turns freely between flanks that the motor carries along.

The link's hinge has dry friction; its limits are moved with the motor at every step. What a table of approach senses
misses is all there: weight that holds a flank, a still joint that changes flank as another joint turns its load past
its friction, an unloaded joint that floats.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from tests.benchmarks.withheld.physics.bodies import Bodies
from tests.benchmarks.withheld.rigid import Array

TIMESTEP = 1e-3
OWN_SPEED = 0.5
"""Of the joint with play, rad/s or m/s."""
OTHER_SPEED = 2.0
"""Of the others: only their weight matters to it."""
SETTLE = 100
"""Steps after each move."""


@dataclass(frozen=True)
class Track:
    """The joint with play while its arm follows commands."""

    bodies: Bodies
    joint: int
    half: float
    """Of the play, rad or m."""

    def flanks(self, q: Array) -> Array:
        """Where the link stands beside its motor after each command (m, n), in halves of the play, (m,)."""
        self.bodies.model.opt.timestep = TIMESTEP
        self.bodies.data.qpos[0] = q[0, self.joint]
        for _ in range(SETTLE):
            self._step(q[0])
        out, previous = np.empty(len(q)), q[0]
        for k, command in enumerate(q):
            for share in self._shares(previous, command):
                self._step(previous + share * (command - previous))
            out[k], previous = self._beside(command), command
        return out

    def _shares(self, previous: Array, command: Array) -> Array:
        """Parts of a move after each step, then the move's end while it settles."""
        way = np.abs(command - previous)
        own, others = way[self.joint], np.delete(way, self.joint).max()
        steps = int(np.ceil(max(own / OWN_SPEED, others / OTHER_SPEED) / TIMESTEP))
        return np.concatenate([np.arange(1, steps + 1) / max(steps, 1), np.ones(SETTLE if steps else 0)])

    def _step(self, command: Array) -> None:
        self.bodies.command(command)
        motor = command[self.joint]
        self.bodies.model.jnt_range[0] = motor - self.half, motor + self.half
        mujoco.mj_step(self.bodies.model, self.bodies.data)

    def _beside(self, command: Array) -> float:
        return float((self.bodies.data.qpos[0] - command[self.joint]) / self.half)
