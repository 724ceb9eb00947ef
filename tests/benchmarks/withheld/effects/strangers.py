"""Effects that no library of the contract's table holds: the right answer is that something acts, and where."""

from dataclasses import dataclass

import numpy as np

from tests.benchmarks.withheld.arms import Arm
from tests.benchmarks.withheld.chains import Disturbance
from tests.benchmarks.withheld.effects.effect import JointEffect, any_joint, only_joint, per_unit, phase
from tests.benchmarks.withheld.effects.library import Draw
from tests.benchmarks.withheld.rigid import Array
from tests.benchmarks.withheld.sessions import Session

TIME, CONFIGURATION = {"variable": "time"}, {"variable": "configuration"}


def other(where: dict[str, object]) -> dict[str, object]:
    """The entry of answers.json for an effect that the product has no candidate for."""
    return {"effect": "other", "where": where}


def _reaches(session: Session, joint: int) -> Array:
    """A joint's command from the middle of its range, in parts of its reach, (m,)."""
    arm = session.arm
    return (session.q[:, joint] - arm.homes.mean(axis=0)[joint]) / arm.reach[joint]


@dataclass(frozen=True)
class CableDrag(JointEffect):
    """A cable that goes taut on one side and slack on the other, more in some stances of the next joint."""

    middle: float

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "CableDrag":
        return cls(any_joint(arm, rng), rng.uniform(-0.5, 0.5))

    def disturb(self, session: Session, size: float) -> Disturbance:
        next_joint = session.q[:, (self.joint + 1) % session.arm.count]
        taut = np.tanh((_reaches(session, self.joint) - self.middle) / 0.25) * (1 + 0.3 * np.cos(next_joint))
        return Disturbance(turn=only_joint(session, self.joint, per_unit(session.arm, self.joint) * size * taut))

    def answer(self, session: Session) -> dict[str, object]:
        return other(self.place)


@dataclass(frozen=True)
class Bump(JointEffect):
    """A chipped tooth: wrong in one narrow place."""

    middle: float

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "Bump":
        return cls(any_joint(arm, rng), rng.uniform(-0.6, 0.6))

    def disturb(self, session: Session, size: float) -> Disturbance:
        bump = np.exp(-0.5 * ((_reaches(session, self.joint) - self.middle) / 0.12) ** 2)
        return Disturbance(turn=only_joint(session, self.joint, 2 * per_unit(session.arm, self.joint) * size * bump))

    def answer(self, session: Session) -> dict[str, object]:
        return other(self.place)


@dataclass(frozen=True)
class Product(JointEffect):
    """A joint's error that depends on another joint, as of a hose across both."""

    second: int
    starts: tuple[float, float]

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "Product":
        joint = any_joint(arm, rng)
        second = int((joint + rng.integers(1, arm.count)) % arm.count)
        return cls(joint, second, (rng.uniform(-0.4, 0.4), rng.uniform(-0.4, 0.4)))

    def disturb(self, session: Session, size: float) -> Disturbance:
        a = np.sin(1.6 * _reaches(session, self.joint) + self.starts[0])
        b = np.sin(1.6 * _reaches(session, self.second) + self.starts[1])
        unit = 2 * per_unit(session.arm, self.joint) * size
        return Disturbance(turn=only_joint(session, self.joint, unit * a * b))

    def answer(self, session: Session) -> dict[str, object]:
        return other(self.place | {"second": self.second + 1})


@dataclass(frozen=True)
class SoftStop(JointEffect):
    """A buffer that pushes back near one end of the range."""

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "SoftStop":
        return cls(any_joint(arm, rng))

    def disturb(self, session: Session, size: float) -> Disturbance:
        pressed = np.maximum(_reaches(session, self.joint) - 0.4, 0.0)
        unit = -3 * per_unit(session.arm, self.joint) * size
        return Disturbance(turn=only_joint(session, self.joint, unit * pressed))

    def answer(self, session: Session) -> dict[str, object]:
        return other(self.place)


@dataclass(frozen=True)
class Scatter(JointEffect):
    """A joint that comes to rest a little elsewhere each time, whatever it did before."""

    seed: int

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "Scatter":
        return cls(any_joint(arm, rng), int(rng.integers(2**31)))

    def disturb(self, session: Session, size: float) -> Disturbance:
        # Rows of one standstill share it: a new one begins wherever the arm moved.
        moved = np.any(np.diff(session.q, axis=0, prepend=session.q[:1] + 1.0) != 0, axis=1)
        stop = np.cumsum(moved)
        error = np.random.default_rng(self.seed).normal(size=stop.max() + 1)[stop]
        return Disturbance(turn=only_joint(session, self.joint, per_unit(session.arm, self.joint) * size * error))

    def answer(self, session: Session) -> dict[str, object]:
        return other(self.place)


@dataclass(frozen=True)
class HvacSwing:
    """The hall's heating: the base swings to and fro with a period of half an hour or so."""

    motion: Array
    period_h: float
    start: float

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "HvacSwing":
        return cls(_sway(rng), rng.uniform(0.3, 0.8), phase(rng))

    def disturb(self, session: Session, size: float) -> Disturbance:
        swing = np.sin(2 * np.pi * session.hours / self.period_h + self.start)
        return Disturbance(base=size * swing[:, None] * self.motion)

    def answer(self, session: Session) -> dict[str, object]:
        return other(TIME)


@dataclass(frozen=True)
class RandomWalk:
    """The base wanders without aim."""

    seed: int

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "RandomWalk":
        return cls(int(rng.integers(2**31)))

    def disturb(self, session: Session, size: float) -> Disturbance:
        rng, hours = np.random.default_rng(self.seed), session.hours
        steps = rng.normal(size=(len(hours), 6)) * np.sqrt(np.diff(hours, prepend=0.0))[:, None]
        return Disturbance(base=size * np.cumsum(steps, axis=0) * np.repeat([1e-4, 1.5e-4], 3))

    def answer(self, session: Session) -> dict[str, object]:
        return other(TIME)


@dataclass(frozen=True)
class Refraction:
    """Air in layers bends the line of sight: points shift with the square of their height."""

    way: Array

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "Refraction":
        return cls(rng.normal(size=3))

    def disturb(self, session: Session, size: float) -> Disturbance:
        height = session.nominal_m[:, 2] - session.base[2, 3]
        return Disturbance(stretch=3e-3 * size * (height**2)[:, None] * self.way)

    def answer(self, session: Session) -> dict[str, object]:
        return other(CONFIGURATION)


def _sway(rng: np.random.Generator) -> Array:
    return np.concatenate([rng.normal(0, 2e-4, 3), rng.normal(0, 3e-4, 3)])


STRANGERS: dict[str, Draw] = {
    "cable": CableDrag.draw,
    "bump": Bump.draw,
    "product": Product.draw,
    "stop": SoftStop.draw,
    "scatter": Scatter.draw,
    "hvac": HvacSwing.draw,
    "walk": RandomWalk.draw,
    "refraction": Refraction.draw,
}
"""Out of the vocabulary, by short names."""
