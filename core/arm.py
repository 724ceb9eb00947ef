"""An arm as it is, or as a calibration says it is: joint axes, and what its drives make of commands (figure 3).

For a commanded displacement c_i the controller asks motor i for ``A_i = c_i - offset_i - gain_i A_{i-1}``, with the
nominal gain of the coupling; the arm makes of it

    A_i = f_i(act_i)          the active displacement, through the transmission function
    net_i = act_i + f_{i-1,i}(act_{i-1})                and the passive one, through the coupling function

and a point on link k goes to ``M_1(net_1) M_2(net_2) ... M_k(net_k) p``, each M_i a motion about axis i at rest.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from core.geometry import Array, Line
from core.kinematics import active_commands
from core.motion_forms import MotionFunction
from core.robot import Robot


@dataclass(frozen=True)
class Arm:
    """Axes at zero displacement in one outer frame, with transmission and coupling functions."""

    robot: Robot
    """The nominal robot: its controller's gains, its joints' kinds and limits."""
    axes: tuple[Line, ...]
    """The joint axes at zero net displacement, n lines."""
    transmissions: tuple[MotionFunction, ...]
    """Actual active displacement to commanded one, with the transducer's offset, n functions."""
    couplings: tuple[MotionFunction | None, ...]
    """Active displacement of joint i-1 to passive one of joint i, n entries; None: no coupling into it."""

    def active(self, commanded: ArrayLike) -> Array:
        """What each motor makes its joint do, shape (m, n), for commands of shape (m, n)."""
        offsets = np.array([f.offset for f in self.transmissions])
        asked = active_commands(self.robot, np.atleast_2d(commanded) - offsets)
        columns = [f.inverse(asked[:, i] + f.offset) for i, f in enumerate(self.transmissions)]
        return np.where(self.robot.commanded, np.stack(columns, axis=1), 0.0)

    def net(self, commanded: ArrayLike) -> Array:
        """How far each joint is from its zero, shape (m, n)."""
        return self.net_of_active(self.active(commanded))

    def net_of_active(self, active: Array) -> Array:
        """Active plus passive displacements, shape (m, n)."""
        net = active.copy()
        for i, coupling in enumerate(self.couplings):
            if coupling is not None:
                net[:, i] += coupling(active[:, i - 1])
        return net

    def commanded_for(self, net: ArrayLike) -> Array:
        """The commands that bring the joints to given net displacements, shape (m, n): figure 5 read from the left.

        A passive joint follows its coupling whatever is asked of it; its command is 0.
        """
        net = np.atleast_2d(np.asarray(net, dtype=float))
        active, asked, commanded = net.copy(), np.zeros_like(net), np.zeros_like(net)
        gains, compensated = self.robot.coupling_gains, self.robot.coupling_compensated
        for i, transmission in enumerate(self.transmissions):
            coupling = self.couplings[i]
            if coupling is not None:
                active[:, i] -= coupling(active[:, i - 1])
            if not self.robot.commanded[i]:
                active[:, i] = 0.0
                continue
            commanded[:, i] = transmission(active[:, i])
            asked[:, i] = commanded[:, i] - transmission.offset
            if gains[i] and compensated[i]:
                commanded[:, i] += gains[i] * asked[:, i - 1]
        return commanded

    def points(self, commanded: ArrayLike, link: ArrayLike, rest_points_m: ArrayLike) -> Array:
        """Where points on links are after commands, shape (m, 3).

        Args:
            commanded: commands, (m, n), rad or m.
            link: the link that each point rides on, 0..n, integer (m,).
            rest_points_m: the points when every net displacement is zero, in the outer frame, (m, 3).
        """
        return carry(self.axes, self.robot.sliding, self.net(commanded), np.asarray(link), rest_points_m)


def carry(axes: tuple[Line, ...], sliding: np.ndarray, net: Array, link: np.ndarray, rest_points_m: ArrayLike) -> Array:
    """Points at rest moved by the joints up to their link, shape (m, 3); net displacements (m, n)."""
    points = np.array(rest_points_m, dtype=float)
    for i in range(len(axes) - 1, -1, -1):
        rides = link > i
        if not rides.any():
            continue
        moved = slide(axes[i], net[:, i], points) if sliding[i] else turn(axes[i], net[:, i], points)
        points = np.where(rides[:, None], moved, points)
    return points


def turn(axis: Line, angle_rad: Array, points_m: Array) -> Array:
    """Points (m, 3) turned about an axis by one angle each (m,)."""
    return axis.point_m + turn_vectors(axis.direction, angle_rad, points_m - axis.point_m)


def turn_vectors(direction: Array, angle_rad: Array, vectors: Array) -> Array:
    """Vectors (m, 3) turned about a direction by one angle each (m,): Rodrigues' formula."""
    cosine, sine = np.cos(angle_rad)[:, None], np.sin(angle_rad)[:, None]
    along = (vectors @ direction)[:, None] * direction
    return along + cosine * (vectors - along) + sine * _cross(direction, vectors)


def slide(axis: Line, distance_m: Array, points_m: Array) -> Array:
    """Points (m, 3) moved along an axis by one distance each (m,)."""
    return points_m + distance_m[:, None] * axis.direction


def _cross(direction: Array, vectors: Array) -> Array:
    """direction x vectors, faster than numpy's general cross product."""
    x, y, z = direction
    return vectors @ np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
