"""What a joint loses on reversal: play followed along the commanded path, and a memory that fades with travel."""

from dataclasses import dataclass

import numpy as np

from tests.benchmarks.withheld.arms import Arm
from tests.benchmarks.withheld.chains import Disturbance, stand
from tests.benchmarks.withheld.effects.effect import JointEffect, any_joint, only_joint, per_unit
from tests.benchmarks.withheld.loads import Masses, torques, true_masses, usual_torques
from tests.benchmarks.withheld.rigid import Array
from tests.benchmarks.withheld.sessions import Session

SUBSTEPS = 6
"""Of each move, at which the load is looked at."""


def load_along_path(session: Session, joint: int, masses: Masses) -> Array:
    """Load of a joint over its usual load at substeps of every move, (m, SUBSTEPS); the last is the row itself."""
    before = np.concatenate([session.q[:1], session.q[:-1]])
    share = np.arange(1, SUBSTEPS + 1) / SUBSTEPS
    way = before[:, None] + share[:, None] * (session.q - before)[:, None]
    flat = way.reshape(-1, session.arm.count)
    carried = np.repeat(session.payload_kg, SUBSTEPS)
    load = torques(stand(session.arm.chain, flat), masses, carried)[:, joint]
    usual = usual_torques(session.arm)
    return (load / max(usual[joint], 0.02 * usual.max())).reshape(-1, SUBSTEPS)


@dataclass(frozen=True)
class Backlash(JointEffect):
    """The link floats between two flanks: pushed by the motor, held by friction, dropped by weight beyond friction."""

    friction: float
    """In parts of the joint's usual load."""
    masses: Masses

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "Backlash":
        return cls(any_joint(arm, rng), float(rng.choice([rng.uniform(0.15, 1.0), 1.5])), true_masses(arm, rng))

    def flank(self, session: Session, half: float) -> Array:
        """Where the link stands between its flanks at each row, -1 to +1, (m,)."""
        load = load_along_path(session, self.joint, self.masses)
        motor = session.q[:, self.joint]
        out, link = np.empty(len(motor)), motor[0] - half
        previous = motor[0]
        for k, now in enumerate(motor):
            for i in range(SUBSTEPS):
                at = previous + (now - previous) * (i + 1) / SUBSTEPS
                if abs(load[k, i]) > self.friction:
                    link = at + half * np.sign(load[k, i])
                else:
                    link = min(max(link, at - half), at + half)
            out[k], previous = (link - now) / half, now
        return out

    def disturb(self, session: Session, size: float) -> Disturbance:
        half = per_unit(session.arm, self.joint) * size
        return Disturbance(turn=only_joint(session, self.joint, half * self.flank(session, half)))

    def answer(self, session: Session) -> dict[str, object]:
        return {"effect": "backlash", **self.place}


@dataclass(frozen=True)
class Hysteresis(JointEffect):
    """Bouc and Wen's memory: z' = (1 - |z|^p sign(z x')) x' / length, a little more of it under load."""

    length: float
    """Travel over which it builds up, in parts of the joint's reach."""
    power: float
    masses: Masses
    loaded: float

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "Hysteresis":
        joint, length = any_joint(arm, rng), np.exp(rng.uniform(np.log(0.08), np.log(0.5)))
        return cls(joint, float(length), float(rng.uniform(1.0, 2.0)), true_masses(arm, rng), rng.uniform(0.0, 0.3))

    def memory(self, travel: Array) -> Array:
        """The state z after each of a row of travels (m,), in lengths."""
        out, z = np.empty(len(travel)), 0.0
        for k, way in enumerate(travel):
            steps = max(1, int(np.ceil(abs(way) / 0.1)))
            dx = way / steps
            for _ in range(steps if abs(way) < 8 else 0):
                half = z + 0.5 * self._slope(z, dx)
                z = float(np.clip(z + self._slope(half, dx), -1, 1))
            if abs(way) >= 8:
                z = float(np.sign(way))
            out[k] = z
        return out

    def _slope(self, z: float, dx: float) -> float:
        return dx * (1.0 - abs(z) ** self.power * np.sign(z * dx))

    def disturb(self, session: Session, size: float) -> Disturbance:
        q = session.q[:, self.joint]
        z = self.memory(np.diff(q, prepend=q[0]) / (self.length * session.arm.reach[self.joint]))
        load = np.abs(load_along_path(session, self.joint, self.masses)[:, -1])
        lost = z * (1.0 + self.loaded * (load - 0.5))
        return Disturbance(turn=only_joint(session, self.joint, -per_unit(session.arm, self.joint) * size * lost))

    def answer(self, session: Session) -> dict[str, object]:
        return {"effect": "hysteresis", **self.place}
