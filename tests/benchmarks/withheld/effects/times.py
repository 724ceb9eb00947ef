"""What happens in time: warmth, creeping, bases and targets that are knocked."""

from dataclasses import dataclass

import numpy as np

from tests.benchmarks.withheld.arms import Arm
from tests.benchmarks.withheld.chains import Disturbance
from tests.benchmarks.withheld.rigid import Array
from tests.benchmarks.withheld.sessions import Session


@dataclass(frozen=True)
class Thermal:
    """Links grow as they warm, each with a lag of its own; where all do, the column leans a little as well."""

    link: int | None
    """None: every link."""
    lags_h: Array
    growth: Array
    """Of each link, beside the others', (n,)."""
    lean: float

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "Thermal":
        long = np.flatnonzero(np.linalg.norm(arm.chain.links[:-1, :3, 3], axis=1) > 0.15)
        link = int(rng.choice(long)) if rng.random() < 0.4 else None
        lags = rng.uniform(0.5, 1.2) * rng.uniform(0.8, 1.25, arm.count)
        return cls(link, lags, rng.uniform(0.7, 1.3, arm.count), float(rng.normal(0, 0.08)))

    def disturb(self, session: Session, size: float) -> Disturbance:
        chain, m = session.arm.chain, len(session.q)
        motion, axis = np.zeros((m, chain.count, 6)), np.zeros((m, chain.count, 6))
        for i in range(chain.count) if self.link is None else (self.link,):
            # The link's own vector, seen at its far end, grows in parts of itself.
            vector = chain.links[i, :3, :3].T @ chain.links[i, :3, 3]
            warmth = session.warmth(float(self.lags_h[i]))
            motion[:, i, 3:] = 1e-3 * size * self.growth[i] * warmth[:, None] * vector
        if self.link is None:
            axis[:, 0, 0] = 1e-3 * size * self.lean * session.warmth(float(self.lags_h[0]))
        return Disturbance(link=motion, axis=axis)

    def answer(self, session: Session) -> dict[str, object]:
        return {"effect": "thermal"} | ({} if self.link is None else {"joint": self.link + 1})


@dataclass(frozen=True)
class Drift:
    """The base (or the instrument's tripod) creeps, fast at first: a stretched exponential or a logarithm of time."""

    motion: Array
    pace_h: float
    power: float
    logarithmic: bool

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "Drift":
        return cls(_knock(rng), rng.uniform(1.0, 4.0), rng.uniform(0.7, 1.2), bool(rng.random() < 0.5))

    def disturb(self, session: Session, size: float) -> Disturbance:
        pace = session.hours / self.pace_h
        way = np.log1p(2 * pace) if self.logarithmic else 1 - np.exp(-(pace**self.power))
        return Disturbance(base=size * way[:, None] * self.motion)

    def answer(self, session: Session) -> dict[str, object]:
        return {"effect": "drift"}


@dataclass(frozen=True)
class BaseShift:
    """Someone knocked the base: most of it at once, a tenth settles within minutes."""

    share: float
    """Of the session's time that had passed."""
    motion: Array

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "BaseShift":
        return cls(rng.uniform(0.15, 0.85), _knock(rng))

    def disturb(self, session: Session, size: float) -> Disturbance:
        since = session.hours - self.share * session.hours[-1]
        way = np.where(since >= 0, 1 - 0.1 * np.exp(-np.maximum(since, 0) / 0.05), 0.0)
        return Disturbance(base=size * way[:, None] * self.motion)

    def answer(self, session: Session) -> dict[str, object]:
        return {"effect": "base_shift", "record": session.record_at(self.share * float(session.hours[-1]))}


@dataclass(frozen=True)
class TargetSlip:
    """A target gave way on its magnet."""

    share: float
    which: float
    motion: Array

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "TargetSlip":
        return cls(rng.uniform(0.2, 0.8), rng.uniform(0, 1), rng.normal(0, 3e-4, 3))

    def _target(self, session: Session) -> int:
        return int(self.which * session.targets)

    def disturb(self, session: Session, size: float) -> Disturbance:
        gone = (session.hours >= self.share * session.hours[-1]) & (session.target == self._target(session))
        return Disturbance(target=size * gone[:, None] * self.motion)

    def answer(self, session: Session) -> dict[str, object]:
        after = session.hours >= self.share * session.hours[-1]
        mine = after & (session.target == self._target(session))
        return {
            "effect": "target_slip",
            "target": f"T{self._target(session) + 1}",
            "record": int(session.record[mine][0]) if mine.any() else int(session.record[-1]),
        }


def _knock(rng: np.random.Generator) -> Array:
    return np.concatenate([rng.normal(0, 2e-4, 3), rng.normal(0, 3e-4, 3)])
