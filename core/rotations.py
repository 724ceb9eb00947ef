"""Rotations as people write them: quaternions w x y z, rotation vectors, turns about fixed axes (roll, pitch, yaw)."""

import numpy as np
from numpy.typing import ArrayLike

from core.geometry import Array, skew


def quaternions(rotation: ArrayLike) -> Array:
    """Unit quaternions w x y z of rotations (m, 3, 3), (m, 4); of q and -q either one.

    Of the four ways to write them the one with the largest divisor is taken (Shepperd 1978, doi 10.2514/3.55767b).
    """
    rotation = np.asarray(rotation, dtype=float)
    trace = np.trace(rotation, axis1=1, axis2=2)
    diagonal = np.diagonal(rotation, axis1=1, axis2=2)
    squares = np.concatenate([(1 + trace)[:, None], 1 + 2 * diagonal - trace[:, None]], axis=1)
    r = np.moveaxis(rotation, 0, -1)
    products = np.array(
        [
            [squares[:, 0], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], squares[:, 1], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]],
            [r[0, 2] - r[2, 0], r[0, 1] + r[1, 0], squares[:, 2], r[1, 2] + r[2, 1]],
            [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], squares[:, 3]],
        ]
    )
    out = products[np.argmax(squares, axis=1), :, np.arange(len(rotation))]
    return out / np.linalg.norm(out, axis=1, keepdims=True)


def rotations_of_quaternions(quaternion: ArrayLike) -> Array:
    """Rotations (m, 3, 3) of quaternions w x y z (m, 4) of any length but zero."""
    q = np.asarray(quaternion, dtype=float)
    w, x, y, z = (q / np.linalg.norm(q, axis=-1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def rotations_of_turns(turns_rad: ArrayLike) -> Array:
    """Rz(rz) Ry(ry) Rx(rx): turned about fixed x first, then y, then z; (m, 3, 3) of angles (m, 3)."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(turns_rad).T, np.sin(turns_rad).T
    rows = [
        [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
        [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
        [-sy, cy * sx, cy * cx],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def turns_of_rotations(rotation: ArrayLike) -> Array:
    """Angles rx, ry, rz (m, 3) of ``rotations_of_turns``, exact at every rotation.

    Where ry is a right angle only the sum or difference of the others counts; rz then takes what rounding says, and rx
    is found after rz has been undone, so that the three still make the same rotation.
    """
    r = np.moveaxis(np.asarray(rotation, dtype=float), 0, -1)
    rz = np.arctan2(r[1, 0], r[0, 0])
    c, s = np.cos(rz), np.sin(rz)
    ry = np.arctan2(-r[2, 0], c * r[0, 0] + s * r[1, 0])
    rx = np.arctan2(s * r[0, 2] - c * r[1, 2], c * r[1, 1] - s * r[0, 1])
    return np.stack([rx, ry, rz], axis=1)


def rotations_of_vectors(vectors_rad: ArrayLike) -> Array:
    """Rotations (m, 3, 3) by rotation vectors (m, 3): axis times angle (Rodrigues)."""
    vectors = np.asarray(vectors_rad, dtype=float)
    angle = np.linalg.norm(vectors, axis=-1)
    k = skew(vectors)
    # sinc is exact at 0, where the axis is not defined.
    first, half = np.sinc(angle / np.pi), np.sinc(angle / (2 * np.pi))
    return np.eye(3) + first[..., None, None] * k + 0.5 * (half**2)[..., None, None] * (k @ k)


def vectors_of_rotations(rotation: ArrayLike) -> Array:
    """Rotation vectors (m, 3), axis times angle in [0, pi], of rotations (m, 3, 3)."""
    q = quaternions(rotation)
    q = q * np.where(q[:, :1] < 0, -1.0, 1.0)
    sine = np.linalg.norm(q[:, 1:], axis=1)
    angle = 2 * np.arctan2(sine, q[:, 0])
    return q[:, 1:] * np.where(sine > 1e-150, angle / np.maximum(sine, 1e-150), 2.0)[:, None]


def nearest_rotations(matrices: Array) -> Array:
    """The rotations nearest to matrices, (m, 3, 3), in the sense of least squares (Kabsch 1976)."""
    u, _, vt = np.linalg.svd(matrices)
    signs = np.ones((len(matrices), 3))
    signs[:, 2] = np.linalg.det(u @ vt)
    return (u * signs[:, None]) @ vt
