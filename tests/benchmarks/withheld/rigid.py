"""Rigid motions of many points at once: turns about z, and small motions given as a turn and a shift."""

import numpy as np

Array = np.ndarray


def turn_z(angle: Array) -> Array:
    """Rotations about z by angles (m,), rad, shape (m, 3, 3)."""
    out = np.zeros((*angle.shape, 3, 3))
    out[..., 0, 0] = out[..., 1, 1] = np.cos(angle)
    out[..., 1, 0] = np.sin(angle)
    out[..., 0, 1] = -out[..., 1, 0]
    out[..., 2, 2] = 1.0
    return out


def turn(vector: Array) -> Array:
    """Rotations by vectors (m, 3): about their direction by their length, rad (Rodrigues), shape (m, 3, 3)."""
    angle = np.sqrt((vector**2).sum(axis=-1))[..., None, None]
    k = np.zeros((*vector.shape[:-1], 3, 3))
    k[..., 2, 1], k[..., 0, 2], k[..., 1, 0] = vector[..., 0], vector[..., 1], vector[..., 2]
    k = k - np.swapaxes(k, -1, -2)
    small = angle < 1e-8
    safe = np.where(small, 1.0, angle)
    first = np.where(small, 1.0, np.sin(safe) / safe)
    second = np.where(small, 0.5, (1.0 - np.cos(safe)) / safe**2)
    return np.eye(3) + first * k + second * (k @ k)


def moved(rotation: Array, origin: Array, motion: Array) -> tuple[Array, Array]:
    """Frames (m, 3, 3), (m, 3) after motions (m, 6) in their own coordinates: turned by [:3], shifted by [3:]."""
    shifted = origin + np.einsum("mij,mj->mi", rotation, motion[:, 3:])
    return rotation @ turn(motion[:, :3]), shifted


def homogeneous(rotation: Array, origin: Array) -> Array:
    """A transform (4, 4) from a rotation (3, 3) and an origin (3,)."""
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = rotation, origin
    return out
