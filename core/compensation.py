"""The poses and joint values to be commanded so that the real arm takes the poses that are wanted (figure 5).

    wanted pose --> inverse kinematics of the calibrated arm --> net displacements
                --> passive motions and transmission functions undone, offsets added --> joint commands
                --> nominal direct kinematics --> the pose to be commanded

A controller that takes poses gets the last, one that takes joint values the last but one. Of the branches on which the
calibrated arm reaches a pose the one is taken that is nearest to the nominal solution, so that a small correction
stays a small motion. What the arm cannot do is said, row by row.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from core.calibrated_arm import CalibratedArm
from core.errors import InputError
from core.geometry import Array, invert
from core.inverse_kinematics import JointSolutions, Outcome, Tolerance, inverse_kinematics
from core.kinematics import forward, nominal_net
from core.robot import Robot
from core.units import displacement_units, from_si

FRAMES = ("base", "instrument")
"""Where poses may be given: in the robot's base frame, or in the frame in which points are measured."""
OK = "ok"
FAR_MM = 500.0
"""Nobody cares how far exactly a pose is missed that is missed by more."""


@dataclass(frozen=True)
class Compensation:
    """What to command, a row a pose; NaN where the pose cannot be had."""

    pose: Array
    """To be commanded, T_tool_to_base in the robot's base frame, (m, 4, 4), m."""
    commanded: Array
    """The joint commands for it, rad or m, (m, n)."""
    status: tuple[str, ...]
    """``ok``, or what is wrong and where."""
    solutions: JointSolutions
    """Of the calibrated arm."""

    @property
    def ok(self) -> np.ndarray:
        """Boolean, (m,)."""
        return self.solutions.solved


def compensate(
    arm: CalibratedArm,
    poses: ArrayLike,
    near: ArrayLike | None = None,
    frame: str = "base",
    tolerance: Tolerance | None = None,
) -> Compensation:
    """What to command so that the tool comes to poses.

    Args:
        arm: the calibrated arm.
        poses: wanted, from the tool to the frame, (m, 4, 4), m.
        near: commands near which the arm is to take each pose, which chooses the branch, (m, n), rad or m; None: the
            nominal solution nearest to the arm's marks (or to zero).
        frame: ``base``, the robot's base frame, or ``instrument``.
        tolerance: how far from the wanted pose the tool may end, for arms that cannot take every orientation.

    Raises:
        InputError: the frame is not known, or the poses are not rigid motions.
    """
    if frame not in FRAMES:
        raise InputError(f"there is no frame {frame!r}, expected one of {', '.join(FRAMES)}")
    wanted = np.asarray(poses, dtype=float)
    if frame == "instrument":
        wanted = invert(arm.base) @ wanted
    start = nominal_start(arm, wanted, tolerance) if near is None else nominal_net(arm.nominal, near)
    found = inverse_kinematics(arm.driven(), wanted, start, tolerance)
    commanded = np.where(found.solved[:, None], found.commanded, np.nan)
    pose = np.full(wanted.shape, np.nan)
    pose[found.solved] = forward(arm.nominal, nominal_net(arm.nominal, found.commanded[found.solved]))
    return Compensation(pose, commanded, statuses(arm.nominal, found), found)


def nominal_start(
    arm: CalibratedArm, wanted: Array, tolerance: Tolerance | None = None, near: Array | None = None
) -> Array:
    """Net displacements with which the nominal arm takes poses (m, 4, 4), or comes nearest to them, (m, n).

    Args:
        near: net displacements that choose the branch, (n,) or (m, n); None: zero, or what of it the limits allow.
    """
    robot = arm.nominal_driven()
    if near is None:
        low, high = robot.limits.T
        near = nominal_net(arm.nominal, np.clip(np.zeros(arm.nominal.joint_count), low, high))[0]
    return inverse_kinematics(robot, wanted, near, tolerance).net


def reached(arm: CalibratedArm, commanded: ArrayLike) -> Array:
    """Where commands (m, n) bring the tool of the calibrated arm: T_tool_to_base in the robot's base, (m, 4, 4)."""
    return forward(arm.robot, arm.drives.net(commanded))


def statuses(robot: Robot, found: JointSolutions) -> tuple[str, ...]:
    """Each solution in words."""
    return tuple(_status(robot, found, row) for row in range(len(found.outcome)))


def _status(robot: Robot, found: JointSolutions, row: int) -> str:
    outcome = found.outcome[row]
    if outcome == Outcome.SOLVED:
        return OK
    if outcome == Outcome.BEYOND_LIMITS:
        return f"{outcome}: {_joints_beyond(robot, found.excess[row])}"
    if outcome == Outcome.SINGULAR:
        return f"{outcome}: the pose does not determine the joints"
    away, turned = found.position_error_m[row] * 1e3, found.rotation_error_rad[row] * 1e3
    if away > FAR_MM:
        return f"{outcome}: far out of reach"
    return f"{outcome}: the nearest that was found is {away:.3g} mm and {turned:.3g} mrad away"


def _joints_beyond(robot: Robot, excess: Array) -> str:
    """joint 3 by 1.25 deg, joint 5 by 0.1 deg."""
    said = []
    for i in np.flatnonzero(excess):
        unit = displacement_units(robot.joints[i].slides)[0]
        said.append(f"joint {i + 1} by {from_si(float(excess[i]), unit):.3g} {unit}")
    return ", ".join(said)
