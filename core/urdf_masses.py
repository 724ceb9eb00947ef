"""Masses of a URDF tree, gathered onto the moving links that carry them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.geometry import Array, apply


@dataclass(frozen=True)
class UrdfJoint:
    """One joint element of a URDF file."""

    name: str
    kind: str
    parent: str
    child: str
    origin: Array
    """From the child link's frame at rest to the parent link's, (4, 4), m."""
    axis: Array
    """Unit vector in the child link's frame, (3,)."""
    limits: tuple[float, float]
    """Lowest and highest displacement, rad or m."""
    mimics: bool
    """Whether it follows another joint."""


@dataclass(frozen=True)
class LinkInertia:
    """Mass and centre of mass of one link, or of several that move as one."""

    mass_kg: float
    centre_m: Array
    """In the link's frame, (3,)."""


def lumped_masses(
    by_child: dict[str, UrdfJoint], moving: Sequence[UrdfJoint], inertias: dict[str, LinkInertia]
) -> tuple[LinkInertia, ...]:
    """Mass and centre of what moves with each joint, in the frame of the joint's child link.

    All that is fixed to a moving link counts with it. Nothing is said (an empty tuple) unless every moving link
    has an inertial element of its own: gravity needs them all.
    """
    if any(joint.child not in inertias for joint in moving):
        return ()
    fixed_to: dict[str, list[UrdfJoint]] = {}
    for joint in by_child.values():
        if joint.kind == "fixed":
            fixed_to.setdefault(joint.parent, []).append(joint)
    return tuple(_lump(joint.child, fixed_to, inertias) for joint in moving)


def _lump(link: str, fixed_to: dict[str, list[UrdfJoint]], inertias: dict[str, LinkInertia]) -> LinkInertia:
    mass, moment = 0.0, np.zeros(3)
    waiting, met = [(link, np.eye(4))], {link}
    while waiting:
        name, placed = waiting.pop()
        if name in inertias:
            mass += inertias[name].mass_kg
            moment += inertias[name].mass_kg * apply(placed, inertias[name].centre_m)
        for joint in fixed_to.get(name, []):
            if joint.child not in met:
                met.add(joint.child)
                waiting.append((joint.child, placed @ joint.origin))
    return LinkInertia(mass, moment / mass if mass > 0 else np.zeros(3))
