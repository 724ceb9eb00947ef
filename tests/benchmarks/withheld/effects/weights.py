"""What weight does: joints wind up, links bend, and the load is not what was written."""

from dataclasses import dataclass

import numpy as np

from tests.benchmarks.withheld.arms import Arm
from tests.benchmarks.withheld.chains import Disturbance, Stand, stand
from tests.benchmarks.withheld.effects.effect import JointEffect, only_body, only_joint
from tests.benchmarks.withheld.loads import Masses, load_alone, torques, true_masses, usual_torques, wrenches
from tests.benchmarks.withheld.rigid import Array
from tests.benchmarks.withheld.sessions import Session


def stiffening(load: Array, hardness: float) -> Array:
    """The windup u of a spring that grows stiffer: u + hardness u^3 = load."""
    u = load / (1 + hardness)
    for _ in range(12):
        u = u - (u + hardness * u**3 - load) / (1 + 3 * hardness * u**2)
    return u


@dataclass(frozen=True)
class Compliance(JointEffect):
    """A joint that winds up under its load until spring and weight agree where they then are."""

    masses: Masses
    hardness: float

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "Compliance":
        usual = usual_torques(arm)
        loaded = np.flatnonzero(usual > 0.02 * usual.max())
        return cls(int(rng.choice(loaded)), true_masses(arm, rng), rng.uniform(0.1, 0.4))

    def disturb(self, session: Session, size: float) -> Disturbance:
        j, usual = self.joint, usual_torques(session.arm)[self.joint]
        windup = np.zeros(len(session.q))
        for _ in range(3):
            at = stand(session.arm.chain, session.q + only_joint(session, j, windup))
            load = torques(at, self.masses, session.payload_kg)[:, j] / usual
            windup = 1e-3 * size * stiffening(load, self.hardness)
        return Disturbance(turn=only_joint(session, j, windup))

    def answer(self, session: Session) -> dict[str, object]:
        return {"effect": "compliance", **self.place}


@dataclass(frozen=True)
class Payload:
    """The load is heavier or hangs elsewhere than written, on joints that the sim holds to give as written."""

    heavier: float
    """Excess in parts of what was written."""
    centre_m: Array
    softness: Array

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "Payload":
        heavier = float(rng.choice([-1, 1]) * rng.uniform(0.5, 1.0))
        return cls(heavier, arm.payload_m + rng.normal(0, 0.03, 3), arm.softness * rng.uniform(0.8, 1.2, arm.count))

    def disturb(self, session: Session, size: float) -> Disturbance:
        excess = load_alone(session.arm, self.heavier, self.centre_m)
        load = torques(session.nominal, excess, session.payload_kg)
        return Disturbance(turn=size * 4.0 * self.softness * load)

    def answer(self, session: Session) -> dict[str, object]:
        return {"effect": "payload"}


@dataclass(frozen=True)
class Flexure:
    """A link as a beam clamped at its joint (Euler and Bernoulli): tip shift and slope by end force, end moment
    and its own weight, unlike in its two planes, and twist about itself."""

    link: int
    masses: Masses
    thin: tuple[float, float]
    """Softness in the two planes."""
    twist: float
    """Softness in torsion, beside that in bending."""

    @classmethod
    def draw(cls, arm: Arm, rng: np.random.Generator) -> "Flexure":
        long = np.linalg.norm(arm.chain.links[:-1, :3, 3], axis=1) > 0.09
        thin = (float(rng.uniform(0.6, 1.4)), float(rng.uniform(0.6, 1.4)))
        return cls(int(rng.choice(np.flatnonzero(long))), true_masses(arm, rng), thin, rng.uniform(0.1, 0.4))

    def disturb(self, session: Session, size: float) -> Disturbance:
        arm, i = session.arm, self.link
        frame, length = self._beam(arm)
        along = session.nominal.rotation[:, i] @ frame
        force, moment, own = self._end_loads(session.nominal, session.payload_kg, along)
        stiff = usual_torques(arm).max()
        shift, slope = self._tip(force / stiff, moment / stiff, own / stiff, length)
        # From the beam's axes to the frame at the link's far end.
        to_end = arm.chain.links[i, :3, :3].T @ frame
        motion = np.concatenate([slope @ to_end.T, shift @ to_end.T], axis=1)
        return Disturbance(link=only_body(session, i, 1e-3 * size * motion))

    def _beam(self, arm: Arm) -> tuple[Array, float]:
        """Axes of the beam, x along it, in the frame of its joint, (3, 3), and its length."""
        vector = arm.chain.links[self.link, :3, 3]
        length = float(np.linalg.norm(vector))
        x = vector / length
        side = np.cross(x, [0.0, 0.0, 1.0] if abs(x[2]) < 0.9 else [0.0, 1.0, 0.0])
        y = side / np.linalg.norm(side)
        return np.stack([x, y, np.cross(x, y)], axis=1), length

    def _end_loads(self, at: Stand, payload_kg: Array, along: Array) -> tuple[Array, Array, Array]:
        """Force and moment at the far end and the link's own weight, in the beam's axes, each (m, 3)."""
        i = self.link
        force, moment = wrenches(at, self.masses, payload_kg)
        own = force[:, i] - force[:, i + 1]
        # The next joint's origin may slide beyond the far end: its moment is carried there.
        lever = at.origin[:, i + 1] - at.end_origin[:, i]
        end = moment[:, i + 1] + np.cross(lever, force[:, i + 1])
        force_end, moment_end, weight = (np.einsum("mji,mj->mi", along, load) for load in (force[:, i + 1], end, own))
        return force_end, moment_end, weight

    def _tip(self, force: Array, moment: Array, own: Array, length: float) -> tuple[Array, Array]:
        """Shift and slope of a cantilever's tip, in the beam's axes; own weight spread evenly."""
        shift, slope = np.zeros_like(force), np.zeros_like(force)
        w = own / length
        for side, other, sign, soft in ((1, 2, 1.0, self.thin[0]), (2, 1, -1.0, self.thin[1])):
            f, m, q = force[:, side], sign * moment[:, other], w[:, side]
            shift[:, side] = soft * (f * length**3 / 3 + m * length**2 / 2 + q * length**4 / 8)
            slope[:, other] = sign * soft * (f * length**2 / 2 + m * length + q * length**3 / 6)
        slope[:, 0] = self.twist * moment[:, 0] * length
        return 2.0 * shift / length, 2.0 * slope / length

    def answer(self, session: Session) -> dict[str, object]:
        return {"effect": "flexure", "joint": self.link + 1}
