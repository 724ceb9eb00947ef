"""The phi-model: a notation for open chains that has no singularity where joint axes are parallel.

Source: Sultan and Wager, appendix, equations A1 to A3. Frame i has Z_i on the axis of joint i. A phi-frame
stands between frame i and frame i+1; its z-axis lies in the plane normal to Z_i, at an angle ``phi_i`` from X_i
that the user sets once so that Z_phi is never parallel to Z_{i+1}. From there on the link is described as by
Denavit and Hartenberg, now with two lines that cannot become parallel:

    T_{i+1 to i}   = T_phi(phi_i + psi_i, d_i) . T_link(a_i, b_i, alpha_i, theta_i)                     (A1)
    T_phi(u, d)    = [[-sin u, 0, cos u, 0], [cos u, 0, sin u, 0], [0, 1, 0, d], [0, 0, 0, 1]]          (A2)
    T_link         = Trans(0,0,a) Rot(z,theta) Trans(b,0,0) Rot(x,alpha)                                (A2)
    a tool frame   : T_link . Rot(z,gamma) Trans(0,0,h)                                                 (A3)

The axes alone fix every parameter, frame by frame, once the base frame is fixed (section 4): Z_1 on axis 1,
Y_1 along the common normal from axis 1 to axis 2, the origin where that normal meets axis 1, phi_1 = pi/2;
hence b_1 = 0 and alpha_1 = 90 degrees by construction. ``core/phi_convention.py`` says what is done for arms
for which that rule is not defined. Through a sliding axis only a direction is known: a = b = 0 (equation 9).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from core.errors import RobotError
from core.geometry import Array, Line, cross, joint_motion, wrap_angle
from core.phi_convention import Convention, base_frame
from core.phi_transforms import link_to, link_transform, phi_transform

PARAMETERS = ("a_m", "b_m", "alpha_rad", "theta_rad")


@dataclass(frozen=True)
class PhiModel:
    """The geometric parameters of frames 1..n-1 of an arm with n joints."""

    phi_rad: Array
    """The angles that the user sets, (n-1,)."""
    a_m: Array
    b_m: Array
    alpha_rad: Array
    theta_rad: Array
    sliding: np.ndarray
    """Which joints slide, boolean, (n,)."""

    def __post_init__(self) -> None:
        for name in ("phi_rad", *PARAMETERS):
            value = np.asarray(getattr(self, name), dtype=float)
            if value.shape != (len(self.sliding) - 1,):
                raise RobotError(
                    f"{len(self.sliding)} joints need {len(self.sliding) - 1} values of {name}, got {value.size}"
                )
            object.__setattr__(self, name, value)

    @property
    def parameters(self) -> Array:
        """a_m, b_m, alpha_rad, theta_rad of every frame, (n-1, 4)."""
        return np.stack([self.a_m, self.b_m, self.alpha_rad, self.theta_rad], axis=1)

    def link_transforms(self) -> Array:
        """The constant part of each link, T_phi(phi_i, 0) . T_link, from frame i+1 to frame i, (n-1, 4, 4)."""
        return phi_transform(self.phi_rad) @ link_transform(self.a_m, self.b_m, self.alpha_rad, self.theta_rad)


def frames(model: PhiModel, displacements: ArrayLike, base: Array | None = None) -> Array:
    """Frames 1..n before their own joint moves, T_{i to base}: equation A1 chained, shape (..., n, 4, 4).

    Frame i holds the axis of joint i, whose motion moves frame i+1 and what follows.
    """
    psi = np.asarray(displacements, dtype=float)
    turns, slides = np.where(model.sliding, 0.0, psi), np.where(model.sliding, psi, 0.0)
    out = np.empty((*psi.shape, 4, 4))
    out[..., 0, :, :] = np.eye(4) if base is None else base
    links = link_transform(model.a_m, model.b_m, model.alpha_rad, model.theta_rad)
    for i in range(len(model.sliding) - 1):
        phi = phi_transform(model.phi_rad[i] + turns[..., i], slides[..., i])
        out[..., i + 1, :, :] = out[..., i, :, :] @ phi @ links[i]
    return out


def axes(model: PhiModel, base: Array | None = None) -> tuple[Line, ...]:
    """The joint axes at zero displacement, in the frame that ``base`` carries frame 1 into."""
    at_zero = frames(model, np.zeros(len(model.sliding)), base)
    return tuple(Line(frame[:3, 3], frame[:3, 2]) for frame in at_zero)


def from_axes(lines: tuple[Line, ...], convention: Convention) -> tuple[Array, PhiModel]:
    """The base frame and the parameters of every frame from the joint axes at rest.

    Args:
        lines: the axes of joints 1..n at zero displacement, in any one frame.
        convention: the phi angles and the base-frame rule, see ``phi_convention.convention_for``.

    Returns:
        T_base (4, 4), from frame 1 to the frame of ``lines``, and the model.

    Raises:
        RobotError: a Z_phi is parallel to the axis that follows it, so that phi has to be chosen anew.
    """
    base = base_frame(lines, convention)
    frame, rows = base, []
    for i, line in enumerate(lines[1:]):
        phi_frame = frame @ phi_transform(convention.phi_rad[i])
        row = link_to(line, phi_frame, bool(convention.sliding[i + 1]), float(convention.flips[i]), i + 1)
        rows.append(row)
        frame = phi_frame @ link_transform(*row)
    a, b, alpha, theta = np.array(rows).reshape(-1, 4).T
    return base, PhiModel(convention.phi_rad, a, b, alpha, theta, convention.sliding)


def near(model: PhiModel, reference: PhiModel) -> PhiModel:
    """The same model with angles written as close to a reference's as whole turns allow (-179 rather than 181)."""
    alpha = reference.alpha_rad + wrap_angle(model.alpha_rad - reference.alpha_rad)
    theta = reference.theta_rad + wrap_angle(model.theta_rad - reference.theta_rad)
    return PhiModel(model.phi_rad, model.a_m, model.b_m, alpha, theta, model.sliding)


def parameter_twists(model: PhiModel, base: Array | None = None) -> Array:
    """How each parameter moves all that follows it, at zero displacement: shape (n-1, 4, 6).

    Row (i, k) is the velocity twist (angular, then linear at the outer frame's origin) for one unit of a, b, alpha or
    theta of frame i+1. The Jacobian of any point or axis beyond that frame follows by one cross product.
    """
    at_zero = frames(model, np.zeros(len(model.sliding)), base)
    phi_frames = at_zero[:-1] @ phi_transform(model.phi_rad)
    z_phi, origin_phi = phi_frames[:, :3, 2], phi_frames[:, :3, 3]
    x_next, origin_next = at_zero[1:, :3, 0], at_zero[1:, :3, 3]
    zero = np.zeros_like(z_phi)
    twists = [
        np.concatenate([zero, z_phi], axis=1),
        np.concatenate([zero, x_next], axis=1),
        np.concatenate([x_next, cross(origin_next, x_next)], axis=1),
        np.concatenate([z_phi, cross(origin_phi, z_phi)], axis=1),
    ]
    return np.stack(twists, axis=1)


def joint_twists(model: PhiModel, displacements: ArrayLike, base: Array | None = None) -> Array:
    """How each joint moves all that follows it: twists (angular, linear at the outer origin), (..., n, 6)."""
    chain = frames(model, displacements, base)
    z, origin = chain[..., :3, 2], chain[..., :3, 3]
    slides = np.asarray(model.sliding)[:, None]
    angular = np.where(slides, 0.0, z)
    return np.concatenate([angular, np.where(slides, z, cross(origin, z))], axis=-1)


def moved_axes(lines: tuple[Line, ...], displacements: ArrayLike, sliding: np.ndarray) -> tuple[Line, ...]:
    """Axes at rest carried to where they are after the joints before them have moved."""
    motion, out = np.eye(4), []
    for line, displacement, slides in zip(lines, np.asarray(displacements, dtype=float), sliding, strict=True):
        out.append(line.moved(motion))
        motion = motion @ joint_motion(line, displacement, bool(slides))
    return tuple(out)
