"""What is built otherwise than drawn: link geometry, and axes that wander as their joint turns."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from tests.benchmarks.withheld.arms import Arm
from tests.benchmarks.withheld.chains import Disturbance
from tests.benchmarks.withheld.effects.effect import JointEffect, any_joint, only_body
from tests.benchmarks.withheld.rigid import Array
from tests.benchmarks.withheld.sessions import Session


@dataclass(frozen=True)
class Geometry:
    """Link i carries axis i+1 in the wrong place or direction: across it, as what is along it is a joint's zero."""

    link: int
    motion: Array
    """(6,), in the frame of axis i+1."""

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "Geometry":
        link = int(rng.integers(arm.count - 1))
        tilt, shift = np.append(rng.normal(0, 1e-3, 2), 0.0), np.append(rng.normal(0, 5e-4, 2), 0.0)
        # A tilt about the joint's own axis would be its zero again.
        own = arm.chain.links[link, :3, :3].T[:, 2]
        flat = own - np.array([0, 0, own[2]])
        if np.linalg.norm(flat) > 1e-6 and not arm.chain.sliding[link]:
            flat /= np.linalg.norm(flat)
            tilt = tilt - (tilt @ flat) * flat
        kind = rng.integers(3)
        return cls(link, np.concatenate([tilt * (kind != 1), shift * (kind != 0)]))

    def disturb(self, session: Session, size: float) -> Disturbance:
        return Disturbance(link=only_body(session, self.link, np.tile(size * self.motion, (len(session.q), 1))))

    def answer(self, session: Session) -> dict[str, object]:
        return {"effect": "geometry", "frame": self.link + 1}


@dataclass(frozen=True)
class AxisWobble(JointEffect):
    """A worn bearing: the axis tilts and shifts along a closed smooth path through five places a turn."""

    path: CubicSpline
    period: float
    origin: float

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "AxisWobble":
        joint = any_joint(arm, rng)
        spread = np.array([1e-3, 1e-3, 0, 4e-4, 4e-4, 2e-4]) * _tilt_or_shift(rng)
        knots = rng.normal(0, 1, (5, 6)) * spread
        # What it does on average is the link's geometry and no wobble.
        knots -= knots.mean(axis=0)
        path = CubicSpline(np.arange(6) / 5, np.concatenate([knots, knots[:1]]), bc_type="periodic")
        # A slide has no turn: its guide bends over a length a little longer than what it travels.
        period = 2 * np.pi if not arm.chain.sliding[joint] else 2.6 * arm.reach[joint]
        return cls(joint, path, period, float(rng.uniform(0, 1)))

    def disturb(self, session: Session, size: float) -> Disturbance:
        turns = session.q[:, self.joint] / self.period + self.origin
        return Disturbance(axis=only_body(session, self.joint, size * self.path(np.mod(turns, 1.0))))

    def answer(self, session: Session) -> dict[str, object]:
        return {"effect": "axis_wobble", **self.place}


def _tilt_or_shift(rng: np.random.Generator) -> Array:
    kind = rng.integers(3)
    return np.repeat([float(kind != 1), float(kind != 0)], 3)
