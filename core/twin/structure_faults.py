"""Faults of links and bearings: rigid motions put between the motions of the joints.

A point on link k goes to ``W_1 M_1 E_1 W_2 M_2 E_2 ... W_k M_k p``: M_i the joint's motion, W_i the wobble of its axis,
E_i what happens to link i, all written with the arm at rest.
"""

import numpy as np

from core.geometry import Array, apply, perpendicular_basis
from core.twin.effect_units import Quantity
from core.twin.effects import Effect
from core.twin.joint_faults import Motion


def wobble(effect: Effect, motion: Motion, joint: int) -> Array:
    """W of axis_wobble, (m, 4, 4): a tilt (or a shift) by size (sin 2u, cos 2u - 1) across the axis, none at home.

    Twice a turn: what wobbles once a turn with its link looks like a differently mounted axis.
    """
    frame = motion.frames_at_rest[joint - 1]
    across = np.stack(perpendicular_basis(frame[:3, 2]))
    u = 2 * motion.turned(joint)
    vectors = effect.size * np.stack([np.sin(u), np.cos(u) - 1], axis=1) @ across
    if effect.quantity is Quantity.LENGTH:
        return _shifts(vectors)
    return _turns(vectors, frame[:3, 3])


def flexure(effect: Effect, motion: Motion, link: int) -> Array:
    """E of flexure, (m, 4, 4): a turn at the middle of the link by size times the moment of all weights beyond it.

    The last link bends where it begins, under its own weight and the payload's.
    """
    last = link == len(motion.frames_at_rest)
    ends = motion.frames_at_rest[link - 1 : link + 1, :3, 3]
    pivot = ends.mean(axis=0)
    moved = motion.links[:, link - 1]
    moment = motion.loads.moments(link if last else link + 1, apply(moved, pivot))
    at_rest = np.einsum("mji,mj->mi", moved[:, :3, :3], moment)
    return _turns(effect.size * at_rest, pivot)


def growth(effect: Effect, motion: Motion) -> Array:
    """What thermal adds to all lengths, relative, (m,): size times the arm's temperature above its first one."""
    warm = motion.cell.schedule.arm_c
    return effect.size * (warm - warm[0])


def grown_link(share: Array, motion: Motion, link: int) -> Array:
    """E of thermal, (m, 4, 4): the next axis moves away from this one by its distance times a share (m,)."""
    if link == len(motion.frames_at_rest):
        return _shifts(np.zeros((len(share), 3)))
    begin, end = motion.frames_at_rest[link - 1 : link + 1, :3, 3]
    return _shifts(share[:, None] * (end - begin))


def _shifts(vectors_m: Array) -> Array:
    out = np.zeros((len(vectors_m), 4, 4))
    out[:] = np.eye(4)
    out[:, :3, 3] = vectors_m
    return out


def _turns(rotation_vectors_rad: Array, pivot_m: Array) -> Array:
    """Turns by rotation vectors (m, 3) about one point."""
    angle = np.linalg.norm(rotation_vectors_rad, axis=1)
    k = np.zeros((len(angle), 3, 3))
    x, y, z = (rotation_vectors_rad / np.where(angle > 0, angle, 1.0)[:, None]).T
    k[:, 0, 1], k[:, 0, 2], k[:, 1, 2] = -z, y, -x
    k[:, 1, 0], k[:, 2, 0], k[:, 2, 1] = z, -y, x
    rotation = np.eye(3) + np.sin(angle)[:, None, None] * k + (1 - np.cos(angle))[:, None, None] * (k @ k)
    out = _shifts(pivot_m - rotation @ pivot_m)
    out[:, :3, :3] = rotation
    return out
