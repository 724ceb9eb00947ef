"""Denavit-Hartenberg parameters in place of phi-model ones, and what nearly parallel axes do to them.

Source: Denavit and Hartenberg, "A kinematic notation for lower-pair mechanisms based on matrices", ASME Journal of
Applied Mechanics 22, 1955. That four of them a joint do not change continuously where consecutive axes are parallel,
so that they cannot be calibrated there, was shown by Hayati and Mirmirani ("Improving the absolute positioning accuracy
of robot manipulators", Journal of Robotic Systems 2, 1985) and by Mooring (see Mooring, Roth and Driels, Fundamentals
of Manipulator Calibration, Wiley 1991). Where two axes are parallel, d_i and d_{i+1} move the chain alike, and no
parameter tilts the second axis about the common normal's own direction across them: the Jacobian loses rank. Where they
nearly are, the common normal of the real arm may lie metres away.
"""

from dataclasses import replace

import numpy as np

from core.dh_export import dh_chain
from core.geometry import Array, Line, transform
from core.phi_transforms import link_transform
from core.rivals.chain_parameters import ChainParameters, axes_by_twists
from core.rivals.rotation_charts import left_jacobian
from core.robot import Robot
from core.rotations import rotations_of_vectors


class DhParameters(ChainParameters):
    """Two shifts and two turns of frame 0 across axis 1, then theta, d, a, alpha of rows 1..n-1 (standard notation).

    Four suffice for frame 0: along and about axis 1 it may stand anywhere, since d_1 and theta_1 make up for it.
    """

    def __init__(self, nominal: Robot, base: Array) -> None:
        """Args:
        nominal: the robot whose rows are the start.
        base: from its base frame to the instrument's, (4, 4).
        """
        chain = dh_chain(replace(nominal, base_transform=base @ nominal.base_transform))
        self._base = chain.base
        self._rows = np.array([[r.theta_rad, r.d_m, r.a_m, r.alpha_rad] for r in chain.rows[:-1]])

    @property
    def size(self) -> int:
        return 4 + self._rows.size

    def rows(self, x: Array) -> Array:
        """theta_rad, d_m, a_m, alpha_rad of rows 1..n-1, (n-1, 4)."""
        return self._rows + x[4:].reshape(self._rows.shape)

    def axes(self, x: Array) -> tuple[Line, ...]:
        return tuple(Line(frame[:3, 3], frame[:3, 2]) for frame in self._frames(x))

    def by_parameters(self, x: Array) -> Array:
        frames, n = self._frames(x), len(self._rows) + 1
        z, x_next = frames[:-1, :3, 2], frames[1:, :3, 0]
        none = np.zeros_like(z)
        turns = np.stack([z, none, none, x_next], axis=1).reshape(-1, 3)
        shifts = np.stack([none, z, x_next, none], axis=1).reshape(-1, 3)
        here, there = frames[:-1, :3, 3], frames[1:, :3, 3]
        centres = np.stack([here, here, here, there], axis=1).reshape(-1, 3)
        lines = self.axes(x)
        by_rows = axes_by_twists(lines, turns, shifts, centres, np.repeat(np.arange(1, n), 4))
        across = self._base[:3, :3]
        turns = np.concatenate([np.zeros((2, 3)), (across @ left_jacobian(np.append(x[2:4], 0.0)))[:, :2].T])
        shifts = np.concatenate([across[:, :2].T, np.zeros((2, 3))])
        by_base = axes_by_twists(lines, turns, shifts, frames[0, :3, 3], np.zeros(4, dtype=int))
        return np.concatenate([by_base, by_rows], axis=1)

    def _frames(self, x: Array) -> Array:
        """Frames 0..n-1 at rest, whose z-axes are the joint axes, (n, 4, 4)."""
        turn = rotations_of_vectors(np.append(x[2:4], 0.0)[None])[0]
        out = [self._base @ transform(turn, [x[0], x[1], 0.0])]
        theta, d, a, alpha = self.rows(x).T
        for row in link_transform(d, a, alpha, theta):
            out.append(out[-1] @ row)
        return np.stack(out)
