"""The transforms of the phi-model's appendix (equations A2 and A3), and one link from one axis to the next."""

import numpy as np
from numpy.typing import ArrayLike

from core.errors import RobotError
from core.geometry import Array, Line, cross


def phi_transform(u_rad: ArrayLike, d_m: ArrayLike = 0.0) -> Array:
    """T_phi of equation A2: from the phi-frame to frame i; u = phi + psi, shape (..., 4, 4)."""
    u, d = np.broadcast_arrays(np.asarray(u_rad, dtype=float), np.asarray(d_m, dtype=float))
    out = np.zeros((*u.shape, 4, 4))
    out[..., 0, 0], out[..., 0, 2] = -np.sin(u), np.cos(u)
    out[..., 1, 0], out[..., 1, 2] = np.cos(u), np.sin(u)
    out[..., 2, 1], out[..., 2, 3], out[..., 3, 3] = 1.0, d, 1.0
    return out


def link_transform(a_m: ArrayLike, b_m: ArrayLike, alpha_rad: ArrayLike, theta_rad: ArrayLike) -> Array:
    """T_link of equation A2: from frame i+1 to the phi-frame, shape (..., 4, 4)."""
    a, b, alpha, theta = np.broadcast_arrays(*(np.asarray(v, dtype=float) for v in (a_m, b_m, alpha_rad, theta_rad)))
    ct, st, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    out = np.zeros((*a.shape, 4, 4))
    out[..., 0, 0], out[..., 0, 1], out[..., 0, 2], out[..., 0, 3] = ct, -st * ca, st * sa, b * ct
    out[..., 1, 0], out[..., 1, 1], out[..., 1, 2], out[..., 1, 3] = st, ct * ca, -ct * sa, b * st
    out[..., 2, 1], out[..., 2, 2], out[..., 2, 3], out[..., 3, 3] = sa, ca, a, 1.0
    return out


def tool_transform(
    a_m: float, b_m: float, alpha_rad: float, theta_rad: float, gamma_rad: float = 0.0, h_m: float = 0.0
) -> Array:
    """Equation A3: from an arbitrary end frame to the phi-frame, shape (4, 4)."""
    c, s = np.cos(gamma_rad), np.sin(gamma_rad)
    turn = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, h_m], [0, 0, 0, 1.0]])
    return link_transform(a_m, b_m, alpha_rad, theta_rad) @ turn


def link_to(line: Line, phi_frame: Array, slides: bool, flip: float, number: int) -> tuple[float, float, float, float]:
    """a, b, alpha, theta from a phi-frame to the next axis, by the common normal of Z_phi and Z_{i+1}.

    Args:
        line: the axis of joint ``number + 1``, in the frame into which ``phi_frame`` (4, 4) carries.
        slides: whether that joint slides; then only its direction counts and a = b = 0 (equation 9).
        flip: +1 to write alpha in (0, pi), -1 to write it in (-pi, 0).

    Raises:
        RobotError: Z_phi is parallel to the axis.
    """
    x_phi, y_phi, z_phi, origin = phi_frame[:3, :4].T
    normal = cross(z_phi, line.direction)
    sine = np.sqrt(normal @ normal)
    if sine < 1e-6:
        raise RobotError(
            f"phi_{number} makes Z_phi parallel to the axis of joint {number + 1}; choose a phi that differs by 90 deg"
        )
    x_next = flip * normal / sine
    alpha = np.arctan2(flip * sine, z_phi @ line.direction)
    theta = np.arctan2(x_next @ y_phi, x_next @ x_phi)
    if slides:
        return 0.0, 0.0, float(alpha), float(theta)
    between = line.point_m - origin
    across = cross(x_next, line.direction)
    return float(between @ across / (z_phi @ across)), float(between @ x_next), float(alpha), float(theta)
