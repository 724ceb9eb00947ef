"""Joints moved by linkages: a motion that leaks from one joint to the next, and a four-bar whose bars are off."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tests.benchmarks.withheld.arms import Arm
from tests.benchmarks.withheld.chains import Disturbance
from tests.benchmarks.withheld.effects.effect import JointEffect, only_joint, phase
from tests.benchmarks.withheld.rigid import Array
from tests.benchmarks.withheld.sessions import Session


@dataclass(frozen=True)
class Coupling:
    """Joint i's motor moves the next turning joint as well, nearly in proportion."""

    source: int
    to: int
    sign: float
    start: float

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "Coupling":
        turns = np.flatnonzero(~np.array(arm.chain.sliding))
        pairs = [(int(a), int(b)) for a, b in pairwise(turns) if a > 0 or len(turns) < 4]
        source, to = pairs[rng.integers(len(pairs))]
        return cls(source, to, float(rng.choice([-1, 1])), phase(rng))

    def disturb(self, session: Session, size: float) -> Disturbance:
        x = session.arm.active(session.q)[:, self.source]
        leaked = 1e-3 * self.sign * size * (x + 0.05 * (np.sin(2 * x + self.start) - np.sin(self.start)))
        return Disturbance(turn=only_joint(session, self.to, leaked))

    def answer(self, session: Session) -> dict[str, object]:
        return {"effect": "coupling", "from": self.source + 1, "to": self.to + 1}


@dataclass(frozen=True)
class Linkage(JointEffect):
    """A parallelogram that is none: crank, coupler, rocker and ground each off, the loop closed exactly."""

    wrong: Array
    """Relative errors of crank, coupler, rocker, ground, (4,), in 1e-3."""
    ratio: float
    """Crank over ground."""
    start: float
    """Angle between crank and ground at command zero of the joint's range."""

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "Linkage":
        if arm.elbow is None:
            raise ValueError(f"no joint of {arm.key} keeps clear of a four-bar's dead points")
        return cls(arm.elbow, rng.normal(0, 1.5, 4), rng.uniform(0.25, 0.4), rng.uniform(1.45, 1.7))

    def disturb(self, session: Session, size: float) -> Disturbance:
        middle = session.arm.homes.mean(axis=0)[self.joint]
        crank = session.q[:, self.joint] - middle + self.start
        # Mastered in the middle of its range: there it is right.
        wrong = self._rocker(crank, size) - crank - (self._rocker(np.array([self.start]), size) - self.start)
        return Disturbance(turn=only_joint(session, self.joint, wrong))

    def _rocker(self, crank: Array, size: float) -> Array:
        """Angle of the rocker for that of the crank: where two circles meet, on the parallelogram's branch."""
        a, b, c, d = np.array([self.ratio, 1.0, self.ratio, 1.0]) * (1 + 1e-3 * size * self.wrong)
        dx, dy = a * np.cos(crank) - d, a * np.sin(crank)
        reach = np.hypot(dx, dy)
        inner = np.arccos(np.clip((c**2 + reach**2 - b**2) / (2 * c * reach), -1, 1))
        both = np.arctan2(dy, dx) + np.stack([inner, -inner])
        apart = np.angle(np.exp(1j * (both - crank)))
        return crank + np.take_along_axis(apart, np.abs(apart).argmin(axis=0)[None], axis=0)[0]

    def answer(self, session: Session) -> dict[str, object]:
        return {"effect": "linkage", **self.place}
