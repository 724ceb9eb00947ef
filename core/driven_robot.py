"""A chain with its drives: which displacements are free, what they make of the rest, and which commands they take.

The chain (a ``Robot``) says where the tool is for net displacements; the drives (an ``Arm``) say which net
displacements are possible and what has to be commanded for them. A joint without a motor follows its coupling, so
the free numbers are the net displacements of the joints that have one.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from core.arm import Arm
from core.geometry import Array
from core.motion_forms import MotionFunction, coupling_form, transmission_form
from core.robot import JointKind, Robot

FEW_JOINTS_WEIGHT = 0.01
"""Of rotations for an arm that cannot take every one: its position comes first."""
LIMIT_SLACK = 1e-9
"""Commands this far beyond a limit are rounding, rad or m."""


@dataclass(frozen=True, eq=False)
class DrivenRobot:
    """Geometry and drives of one arm; compared by identity."""

    chain: Robot
    """Where the tool is for net displacements, in the frame in which poses are asked for."""
    drives: Arm
    """What commands make of net displacements, and back; its nominal robot has the limits of the commands."""

    @cached_property
    def free(self) -> np.ndarray:
        """Indices of the joints with a motor of their own, (k,)."""
        return np.flatnonzero(self.chain.commanded)

    @cached_property
    def limits(self) -> Array:
        """Lowest and highest command of every joint, (n, 2); passive joints have none."""
        ends = [
            (-np.inf, np.inf) if joint.kind is JointKind.PASSIVE else joint.limits for joint in self.drives.robot.joints
        ]
        return np.array(ends, dtype=float)

    @cached_property
    def turning(self) -> np.ndarray:
        """Which joints with a motor turn, so that a whole turn brings the chain back to the same place, (n,)."""
        return self.chain.commanded & ~self.chain.sliding

    @cached_property
    def reach_m(self) -> float:
        """A length by which positions and rotations are weighed against each other: the size of the chain."""
        steps = np.linalg.norm(self.chain.link_transforms[:, :3, 3], axis=1)
        return float(max(steps.sum(), 0.01))

    @property
    def turn_weight(self) -> float:
        """How much a radian weighs against a reach; little where not every orientation can be had anyway."""
        return 1.0 if len(self.free) >= 6 else FEW_JOINTS_WEIGHT

    @property
    def shoulder_m(self) -> Array:
        """A point that no joint but a slide moves: on the first axis, (3,)."""
        return self.chain.base_transform[:3, 3]

    @cached_property
    def longest_m(self) -> float:
        """No pose is farther from the shoulder than this; infinite where a slide has no limits."""
        slides = self.limits[self.chain.sliding]
        return float(self.reach_m + np.abs(slides).max(axis=1, initial=0.0).sum() + 0.1 * self.reach_m)

    @cached_property
    def middle(self) -> Array:
        """The middle of the limits where a joint has both, else 0, as net displacements, (n,)."""
        finite = np.isfinite(self.limits).all(axis=1)
        ends = np.where(finite[:, None], self.limits, 0.0)
        return self.net(ends.mean(axis=1)[None, self.free])[0]

    def net(self, free: Array) -> Array:
        """Net displacements of all joints (m, n) for those of the joints with a motor (m, k)."""
        if len(self.free) == self.chain.joint_count:
            return free
        return self._net_and_slopes(free)[0]

    def slopes(self, free: Array) -> Array | None:
        """How all net displacements change with the free ones, (m, n, k); None where all are free."""
        if len(self.free) == self.chain.joint_count:
            return None
        return self._net_and_slopes(free)[1]

    def commands(self, net: ArrayLike) -> Array:
        """The commands for net displacements, (m, n)."""
        return self.drives.commanded_for(net)

    def excess(self, commanded: Array) -> Array:
        """How far commands are beyond their limits, 0 within, (m, n)."""
        low, high = self.limits.T
        beyond = np.maximum(np.maximum(low - commanded, commanded - high), 0.0)
        return np.where(beyond > LIMIT_SLACK, beyond, 0.0)

    def _net_and_slopes(self, free: Array) -> tuple[Array, Array]:
        m, n, k = len(free), self.chain.joint_count, len(self.free)
        net, active = np.zeros((m, n)), np.zeros((m, n))
        by_free, active_by_free = np.zeros((m, n, k)), np.zeros((m, n, k))
        net[:, self.free] = free
        by_free[:, self.free, np.arange(k)] = 1.0
        for i, coupling in enumerate(self.drives.couplings):
            passive, slope = np.zeros(m), np.zeros((m, k))
            if coupling is not None:
                passive = coupling(active[:, i - 1])
                slope = _slope(coupling, active[:, i - 1])[:, None] * active_by_free[:, i - 1]
            if self.chain.commanded[i]:
                active[:, i], active_by_free[:, i] = net[:, i] - passive, by_free[:, i] - slope
            else:
                net[:, i], by_free[:, i] = passive, slope
        return net, by_free


def nominal_driven(robot: Robot) -> DrivenRobot:
    """A robot whose drives do exactly what they are told, couplings with their nominal gains."""
    direct = MotionFunction(transmission_form("direct"), np.zeros(0))
    return DrivenRobot(
        robot,
        Arm(robot, robot.axes_at_zero(), (direct,) * robot.joint_count, nominal_couplings(robot)),
    )


def nominal_couplings(robot: Robot) -> tuple[MotionFunction | None, ...]:
    """The coupling into each joint with its nominal gain."""
    return tuple(
        None if c is None else MotionFunction(coupling_form("proportional", c.gain), np.array([c.gain]))
        for c in map(robot.coupling_into, range(1, robot.joint_count + 1))
    )


def _slope(function: MotionFunction, x: Array) -> Array:
    return function.form.evaluate(x, function.coefficients)[1]
