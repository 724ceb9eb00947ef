"""What the instrument does to the points."""

from dataclasses import dataclass

import numpy as np

from tests.benchmarks.withheld.arms import Arm
from tests.benchmarks.withheld.chains import Disturbance
from tests.benchmarks.withheld.sessions import Session


@dataclass(frozen=True)
class Scale:
    """A length unit that is off; an instrument of angles is off a little more along the line of sight."""

    sign: float
    deeper: float

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "Scale":
        return cls(float(rng.choice([-1, 1])), rng.uniform(-0.05, 0.05))

    def disturb(self, session: Session, size: float) -> Disturbance:
        point = session.nominal_m
        sight = point.mean(axis=0) / np.linalg.norm(point.mean(axis=0))
        deep = (point @ sight)[:, None] * sight
        return Disturbance(stretch=1e-3 * self.sign * size * (point + self.deeper * deep))

    def answer(self, session: Session) -> dict[str, object]:
        return {"effect": "scale"}
