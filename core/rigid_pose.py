"""Poses of a rigid body from three or more points on it, by maximum likelihood, with their covariance.

The body is known by the places s_j of its points in a frame of its own; of pose k the points p_kj were measured with
covariances C_kj. Minimised is

    sum_j e_kj' C_kj^-1 e_kj,      e_kj = p_kj - (R_k s_j + c_k)

by Gauss-Newton from the unweighted fit in closed form (Arun 1987, doi 10.1109/TPAMI.1987.4767965; Umeyama 1991, doi
10.1109/34.88573). All poses are done at once. Where the shape of the body is not known, it is found from the poses
themselves: poses and places are fitted in turn (generalised Procrustes: Gower 1975, doi 10.1007/BF02291478).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from core.geometry import Array, apply, skew
from core.rotations import rotations_of_vectors

MOST_STEPS = 50
MOST_ROUNDS = 500
SETTLED_M = 1e-10
FLATTEST = 0.02
"""Points lie on a line where their spread across it is below this share of the spread along it."""


@dataclass(frozen=True)
class PointSets:
    """Points of one body in several poses."""

    point_m: Array
    """Measured points, (k, j, 3); anything where not seen."""
    covariance_m2: Array
    """Their covariance, (k, j, 3, 3)."""
    seen: np.ndarray
    """Which of them were seen, boolean, (k, j)."""

    @property
    def information(self) -> Array:
        """Inverse covariances, zero where nothing was seen, (k, j, 3, 3)."""
        known = np.where(self.seen[..., None, None], self.covariance_m2, np.eye(3))
        return np.where(self.seen[..., None, None], np.linalg.inv(known), 0.0)


@dataclass(frozen=True)
class RigidPoses:
    """Where a body was."""

    transform: Array
    """From the body's frame to the frame of the points, (k, 4, 4)."""
    covariance: Array
    """Of the shift of the body's origin and of the turn about it, in the frame of the points, (k, 6, 6), m and rad."""
    residual_m: Array
    """Measured minus fitted, NaN where not seen, (k, j, 3)."""
    chi_square: Array
    """(k,)."""
    degrees_of_freedom: np.ndarray
    """(k,)."""


def can_be_placed(body_m: Array, seen: np.ndarray) -> np.ndarray:
    """Which sets of seen points (k, j) of a body (j, 3) fix its pose: three or more that are not on a line, (k,)."""
    count = seen.sum(axis=1)
    weight = seen[..., None] / np.maximum(count, 1)[:, None, None]
    centred = np.where(seen[..., None], body_m - np.sum(weight * body_m, axis=1, keepdims=True), 0.0)
    sizes = np.linalg.svd(centred, compute_uv=False) if body_m.size else np.zeros((len(seen), 2))
    wide = sizes[:, 1] > FLATTEST * sizes[:, 0] if sizes.shape[1] > 1 else np.zeros(len(seen), dtype=bool)
    return (count >= 3) & wide


def fit_poses(body_m: ArrayLike, points: PointSets) -> RigidPoses:
    """The poses of a body of which each set of points fixes one.

    Args:
        body_m: places of the points in the body's frame, (j, 3).
        points: as measured, k sets.
    """
    body, seen = np.asarray(body_m, dtype=float), points.seen
    rotation, origin = _closed_form(body, points)
    information = points.information
    for _ in range(MOST_STEPS):
        arm = np.einsum("kab,jb->kja", rotation, body)
        residual = np.where(seen[..., None], points.point_m - arm - origin[:, None], 0.0)
        # A shift t and a turn w move a point by t + w x arm = (1, -[arm]x) (t, w).
        columns = np.concatenate([np.broadcast_to(np.eye(3), (*arm.shape, 3)), -skew(arm)], axis=3)
        weighted = information @ columns
        normal = np.einsum("kjai,kjab->kib", columns, weighted)
        gradient = np.einsum("kjai,kja->ki", weighted, residual)
        step = np.linalg.solve(normal, gradient[..., None])[..., 0]
        origin = origin + step[:, :3]
        rotation = rotations_of_vectors(step[:, 3:]) @ rotation
        if np.abs(step).max(initial=0.0) < 1e-13:
            break
    residual = points.point_m - np.einsum("kab,jb->kja", rotation, body) - origin[:, None]
    residual = np.where(seen[..., None], residual, np.nan)
    zero = np.nan_to_num(residual)
    transform = np.zeros((len(seen), 4, 4))
    transform[:, :3, :3], transform[:, :3, 3], transform[:, 3, 3] = rotation, origin, 1.0
    return RigidPoses(
        transform=transform,
        covariance=np.linalg.inv(normal),
        residual_m=residual,
        chi_square=np.einsum("kja,kjab,kjb->k", zero, information, zero),
        degrees_of_freedom=3 * seen.sum(axis=1) - 6,
    )


def fit_body(start_m: ArrayLike, points: PointSets) -> Array:
    """The shape of a body from its poses: places of its points about their middle, (j, 3).

    Args:
        start_m: roughly the places, (j, 3).
        points: k sets, each of which fixes a pose; every point is seen in at least one.
    """
    body = np.asarray(start_m, dtype=float)
    body = body - body.mean(axis=0)
    for _ in range(MOST_ROUNDS):
        poses = fit_poses(body, points).transform
        back = np.swapaxes(poses[:, :3, :3], 1, 2)
        local = np.einsum(
            "kab,kjb->kja", back, np.where(points.seen[..., None], points.point_m, 0.0) - poses[:, None, :3, 3]
        )
        information = back[:, None] @ points.information @ poses[:, None, :3, :3]
        total = np.linalg.inv(information.sum(axis=0))
        better = np.einsum("jab,kjbc,kjc->ja", total, information, local)
        better = better - better.mean(axis=0)
        change = np.abs(better - body).max()
        body = better
        if change < SETTLED_M:
            break
    return body


def moved(transform: Array, body_m: Array) -> Array:
    """Points of a body (j, 3) in each of its poses (k, 4, 4), (k, j, 3)."""
    return apply(transform[:, None], body_m[None])


def _closed_form(body: Array, points: PointSets) -> tuple[Array, Array]:
    """Rotations (k, 3, 3) and origins (k, 3) that fit best if all points weigh the same."""
    weight = points.seen / points.seen.sum(axis=1, keepdims=True)
    place = np.where(points.seen[..., None], points.point_m, 0.0)
    here, there = np.einsum("kj,jb->kb", weight, body), np.einsum("kj,kja->ka", weight, place)
    spread = np.einsum("kj,kja,kjb->kab", weight, place - there[:, None], body[None] - here[:, None])
    u, _, vt = np.linalg.svd(spread)
    signs = np.ones((len(place), 3))
    signs[:, 2] = np.sign(np.linalg.det(u @ vt))
    rotation = (u * signs[:, None]) @ vt
    return rotation, there - np.einsum("kab,kb->ka", rotation, here)
