"""Forces and moments that weight puts on an arm: sums over the bodies beyond each joint."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from tests.benchmarks.withheld.arms import Arm, arm_named
from tests.benchmarks.withheld.chains import Stand, stand
from tests.benchmarks.withheld.rigid import Array

G = 9.81


@dataclass(frozen=True)
class Masses:
    """The bodies of an arm as they really are."""

    links_kg: Array
    centres_m: Array
    """(n, 3), in the frame after joint i moved."""
    payload_factor: float
    payload_m: Array
    """In the last frame, (3,)."""


def nominal_masses(arm: Arm) -> Masses:
    return Masses(arm.masses_kg, arm.centres_m, 1.0, arm.payload_m)


def true_masses(arm: Arm, rng: np.random.Generator) -> Masses:
    """Off by up to 20 %, centres by 12 %, the load's by centimetres."""
    return Masses(
        arm.masses_kg * rng.uniform(0.8, 1.2, arm.count),
        arm.centres_m * (1 + rng.normal(0, 0.12, arm.centres_m.shape)),
        rng.uniform(0.97, 1.03),
        arm.payload_m + rng.normal(0, 0.02, 3),
    )


def load_alone(arm: Arm, factor: float, centre_m: Array) -> Masses:
    """Weightless links and a load of ``factor`` times the written payload."""
    return Masses(np.zeros(arm.count), arm.centres_m, factor, centre_m)


def wrenches(at: Stand, masses: Masses, payload_kg: Array) -> tuple[Array, Array]:
    """Force (m, n, 3), N, and moment about joint i (m, n, 3), Nm, of all beyond it, in the base's frame."""
    centres = at.origin + np.einsum("mnij,nj->mni", at.rotation, masses.centres_m)
    load = at.end_origin[:, -1] + at.end_rotation[:, -1] @ masses.payload_m
    carried = payload_kg * masses.payload_factor
    mass = np.broadcast_to(masses.links_kg, centres.shape[:2]).copy()
    first = centres * mass[..., None]
    mass[:, -1] += carried
    first[:, -1] += load * carried[:, None]
    mass_beyond = np.cumsum(mass[:, ::-1], axis=1)[:, ::-1]
    first_beyond = np.cumsum(first[:, ::-1], axis=1)[:, ::-1]
    down = np.array([0.0, 0.0, -G])
    arm_of = first_beyond - mass_beyond[..., None] * at.origin
    return mass_beyond[..., None] * down, np.cross(arm_of, down)


def torques(at: Stand, masses: Masses, payload_kg: Array) -> Array:
    """Torque about (force along) each joint's axis, (m, n)."""
    force, moment = wrenches(at, masses, payload_kg)
    acting = np.where(np.array(at.chain.sliding)[:, None], force, moment)
    return np.einsum("mni,mni->mn", acting, at.axis)


def usual_torques(arm: Arm) -> Array:
    """Largest load of each joint over its range, (n,), Nm or N; the same for every session of an arm."""
    return _usual(arm.key)


@cache
def _usual(key: str) -> Array:
    arm = arm_named(key)
    rng = np.random.default_rng(7)
    q = arm.homes.mean(axis=0) + rng.uniform(-1, 1, (300, arm.count)) * arm.reach
    return np.abs(torques(stand(arm.chain, q), nominal_masses(arm), np.full(300, arm.payload_kg))).max(axis=0)
