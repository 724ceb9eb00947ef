"""What every hidden effect can say and do."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from tests.benchmarks.withheld.arms import Arm
from tests.benchmarks.withheld.chains import Disturbance
from tests.benchmarks.withheld.rigid import Array
from tests.benchmarks.withheld.sessions import Session


class Effect(Protocol):
    """Something that the nominal arm does not know."""

    def disturb(self, session: Session, size: float) -> Disturbance:
        """What it does at each row of a session; size 1 moves points by about a millimetre."""
        ...

    def answer(self, session: Session) -> dict[str, object]:
        """The entry of answers.json: ``effect`` and its place, joints and links counted from 1."""
        ...


@dataclass(frozen=True)
class JointEffect:
    """Base of effects that act at one joint (from 0)."""

    joint: int

    @property
    def place(self) -> dict[str, object]:
        return {"joint": self.joint + 1}


def only_joint(session: Session, joint: int, value: Array) -> Array:
    """Joint offsets (m, n) that are ``value`` (m,) at one joint and zero elsewhere."""
    out = np.zeros(session.q.shape)
    out[:, joint] = value
    return out


def only_body(session: Session, body: int, motion: Array) -> Array:
    """Motions (m, n, 6) that are ``motion`` (m, 6) at one axis or link and zero elsewhere."""
    out = np.zeros((*session.q.shape, 6))
    out[:, body] = motion
    return out


def per_unit(arm: Arm, joint: int) -> float:
    """A millimetre or a milliradian: 1e-3 of what the joint moves in."""
    return 1e-3 if not arm.chain.sliding[joint] else 5e-4


def turning(arm: Arm, rng: np.random.Generator) -> int:
    """Any turning joint."""
    return int(rng.choice(np.flatnonzero(~np.array(arm.chain.sliding))))


def any_joint(arm: Arm, rng: np.random.Generator) -> int:
    return int(rng.integers(arm.count))


def phase(rng: np.random.Generator) -> float:
    return float(rng.uniform(-np.pi, np.pi))
