"""What a joint's drive does to its displacement: masters, ratios, gears, encoders."""

from dataclasses import dataclass
from math import pi

import numpy as np

from tests.benchmarks.withheld.arms import Arm
from tests.benchmarks.withheld.chains import Disturbance
from tests.benchmarks.withheld.effects.effect import JointEffect, any_joint, only_joint, per_unit, phase, turning
from tests.benchmarks.withheld.rigid import Array
from tests.benchmarks.withheld.sessions import Session


@dataclass(frozen=True)
class ZeroOffset(JointEffect):
    """Mastered in the wrong place."""

    sign: float

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "ZeroOffset":
        return cls(any_joint(arm, rng), float(rng.choice([-1, 1])))

    def disturb(self, session: Session, size: float) -> Disturbance:
        wrong = np.full(len(session.q), self.sign * size * per_unit(session.arm, self.joint))
        return Disturbance(turn=only_joint(session, self.joint, wrong))

    def answer(self, session: Session) -> dict[str, object]:
        return {"effect": "zero_offset", **self.place}


@dataclass(frozen=True)
class Ratio(JointEffect):
    """Displacement in the wrong measure, with a slight unevenness of 4 % as a real drive has."""

    sign: float
    waves: float
    start: float

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "Ratio":
        return cls(any_joint(arm, rng), float(rng.choice([-1, 1])), rng.uniform(1.5, 3.0), phase(rng))

    def disturb(self, session: Session, size: float) -> Disturbance:
        q, reach = session.q[:, self.joint], session.arm.reach[self.joint]
        turns = q / reach
        wrong = turns + 0.04 * np.sin(self.waves * turns + self.start)
        unit = per_unit(session.arm, self.joint)
        return Disturbance(turn=only_joint(session, self.joint, self.sign * size * unit * wrong))

    def answer(self, session: Session) -> dict[str, object]:
        return {"effect": "ratio", **self.place}


@dataclass(frozen=True)
class Eccentricity(JointEffect):
    """A wheel off its centre: the angle seen from the wrong centre, and a little of the second order."""

    start: float
    second: float
    second_start: float

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "Eccentricity":
        return cls(turning(arm, rng), phase(rng), rng.uniform(0.03, 0.12), phase(rng))

    def disturb(self, session: Session, size: float) -> Disturbance:
        q, e = session.q[:, self.joint], 1.5e-3 * size
        seen = np.arctan2(e * np.sin(q - self.start), 1.0 + e * np.cos(q - self.start))
        wrong = seen + self.second * e * np.sin(2 * q + self.second_start)
        return Disturbance(turn=only_joint(session, self.joint, wrong))

    def answer(self, session: Session) -> dict[str, object]:
        return {"effect": "eccentricity", **self.place}


@dataclass(frozen=True)
class Mesh(JointEffect):
    """Teeth: a wave with flanks of unequal length, so with weaker second and third orders of its own."""

    times: float
    """A turn of the joint."""
    start: float
    skew: float

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "Mesh":
        times = 2.0 if rng.random() < 0.2 else float(rng.uniform(3.0, 15.0))
        return cls(turning(arm, rng), times, phase(rng), rng.uniform(0.1, 0.25))

    def disturb(self, session: Session, size: float) -> Disturbance:
        angle = self.times * session.q[:, self.joint] + self.start
        # A sine whose phase runs ahead of itself: sin(a + k sin a) = J-weighted orders 1, 2, 3.
        wave = np.sin(angle + 2 * self.skew * np.sin(angle))
        return Disturbance(turn=only_joint(session, self.joint, 1e-3 * size * wave))

    def answer(self, session: Session) -> dict[str, object]:
        return {"effect": "mesh", **self.place}


@dataclass(frozen=True)
class Quantisation:
    """Encoders that know whole steps only: exact rounding, each joint's steps beginning somewhere."""

    joint: int | None
    """None: every joint."""
    starts: Array
    """In steps, (n,)."""

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "Quantisation":
        joint = any_joint(arm, rng) if rng.random() < 0.5 else None
        return cls(joint, rng.uniform(0, 1, arm.count))

    def disturb(self, session: Session, size: float) -> Disturbance:
        step = np.array([2e-3 if slides else 2 * pi / 2048 for slides in session.arm.chain.sliding]) * size
        rounded = (np.round(session.q / step + self.starts) - self.starts) * step
        wrong = rounded - session.q
        if self.joint is not None:
            wrong = only_joint(session, self.joint, wrong[:, self.joint])
        return Disturbance(turn=wrong)

    def answer(self, session: Session) -> dict[str, object]:
        return {"effect": "quantisation"} | ({} if self.joint is None else {"joint": self.joint + 1})


@dataclass(frozen=True)
class Latency:
    """The arm is where it was told to be a moment ago, or what was read is where it was; it swings like a pendulum."""

    joint: int | None
    """None: every joint."""

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "Latency":
        return cls(any_joint(arm, rng) if rng.random() < 0.5 else None)

    def disturb(self, session: Session, size: float) -> Disturbance:
        # A late reading is where the arm was: by the time of the measurement it has moved on.
        delay = -2e-3 * size if session.readback else 2e-3 * size
        wrong = -session.speed * delay + 0.5 * session.bend * delay**2
        if self.joint is not None:
            wrong = only_joint(session, self.joint, wrong[:, self.joint])
        return Disturbance(turn=wrong)

    def answer(self, session: Session) -> dict[str, object]:
        return {"effect": "latency"} | ({} if self.joint is None else {"joint": self.joint + 1})
