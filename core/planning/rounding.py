"""Commands that a person can type: tenths of a degree, or of a millimetre."""

import numpy as np

from core.geometry import Array
from core.robot import Robot

STEP_RAD, STEP_M = float(np.deg2rad(0.1)), 1e-4


def command_steps(robot: Robot) -> Array:
    """The unit to which each joint's commands are rounded, rad or m, (n,)."""
    return np.where(robot.sliding, STEP_M, STEP_RAD)


def rounded(robot: Robot, commanded: Array) -> Array:
    """Commands (m, n) to whole steps."""
    steps = command_steps(robot)
    return np.round(commanded / steps) * steps
