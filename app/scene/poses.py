"""Where links stand, as a scene takes it: positions and quaternions (w, x, y, z)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from core.geometry import Array, Line, apply, joint_motion


@dataclass(frozen=True)
class Pose:
    """Where a node of a scene stands: a point given in it goes to ``position_m + R(wxyz) point``."""

    position_m: Array
    """(3,)"""
    wxyz: Array
    """Unit quaternion, (4,)."""


def link_motions(axes: tuple[Line, ...], sliding: np.ndarray, net: ArrayLike) -> Array:
    """How links 0..n have moved since all joints stood at zero, shape (n + 1, 4, 4).

    Args:
        axes: joint axes at zero displacement, n lines.
        sliding: which joints slide, boolean, (n,).
        net: net displacements, rad or m, (n,).

    Raises:
        ValueError: the numbers of axes, flags and displacements differ, or a displacement is not finite.
    """
    net = np.asarray(net, dtype=float)
    if net.shape != (len(axes),) or not np.isfinite(net).all():
        raise ValueError(f"{len(axes)} joints need as many finite displacements, got {net}")
    motions = [np.eye(4)]
    for line, displacement, slides in zip(axes, net, sliding, strict=True):
        motions.append(motions[-1] @ joint_motion(line, displacement, bool(slides)))
    return np.stack(motions)


def pose_of(motion: Array, origin_m: ArrayLike) -> Pose:
    """The pose of a node whose shape is given about an origin at rest, after a rigid motion (4, 4)."""
    wxyz = Rotation.from_matrix(motion[:3, :3]).as_quat(scalar_first=True)
    return Pose(apply(motion, origin_m), wxyz)


def turning_to(direction: ArrayLike) -> Array:
    """A quaternion that turns the z-axis into a unit direction, (4,)."""
    x, y, z = np.asarray(direction, dtype=float)
    if z < -1 + 1e-12:
        return np.array([0.0, 1.0, 0.0, 0.0])
    half = np.array([1.0 + z, -y, x, 0.0])
    return half / np.linalg.norm(half)
