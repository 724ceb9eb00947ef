"""A rigid body followed by three points: its origin, and those one metre from it along its x and y."""

import numpy as np

from core.geometry import Array, apply, cross, skew


def markers(pose: Array) -> Array:
    """Origin and points one metre along x and y of frames (..., 4, 4), shape (..., 3, 3)."""
    local = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    return apply(pose[..., None, :, :], local)


def frames_of(shown: Array) -> Array:
    """Frames (k, 4, 4) by their markers (k, 3, 3)."""
    out = np.zeros((len(shown), 4, 4))
    x, y = shown[:, 1] - shown[:, 0], shown[:, 2] - shown[:, 0]
    out[:, :3, :3] = np.stack([x, y, cross(x, y)], axis=2)
    out[:, :3, 3], out[:, 3, 3] = shown[:, 0], 1.0
    return out


def marker_moves(shown: Array) -> Array:
    """Velocities of markers (k, 3, 3) by a shift of the first and a turn about it, (k, 9, 6)."""
    arm = shown - shown[:, :1]
    unit = np.broadcast_to(np.eye(3), (*arm.shape, 3))
    return np.concatenate([unit, -skew(arm)], axis=3).reshape(len(shown), 9, 6)
