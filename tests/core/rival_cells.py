"""Simulated cells for tests of the rivals: free poses instead of sweeps, drives with and without errors."""

from dataclasses import replace
from functools import cache

import numpy as np

from core.arm import Arm
from core.arm_jacobian import ArmState
from core.driven_robot import nominal_couplings
from core.estimate import axis_basis
from core.geometry import Array, Line, angle_between
from core.measurements import Campaign
from core.motion_forms import Direct, MotionFunction
from core.rivals.equations import Equations
from core.twin import irb_l6, scara
from core.twin.campaign import simulate_campaign
from core.twin.cell import Cell
from core.twin.noise import Noise

EXACT = Noise(instrument=False, repeatability=False)
CELLS = {"irb_l6": irb_l6.cell, "scara": scara.cell}
HAND = {"irb_l6": ("T1", "T5", "T6"), "scara": ("P1", "P5", "P6")}
"""Three targets on the last link."""


@cache
def cell(name: str, perfect_drives: bool) -> Cell:
    """A cell; with perfect drives every motor does what it is told and couplings have their nominal gains."""
    own = CELLS[name]()
    if not perfect_drives:
        return own
    true, direct = own.truth, Direct()
    drives = tuple(MotionFunction(direct, np.zeros(0), f.offset) for f in true.arm.transmissions)
    arm = Arm(own.robot, true.arm.axes, drives, nominal_couplings(own.robot))
    home = arm.commanded_for(np.zeros(own.robot.joint_count))[0]
    return replace(own, truth=replace(true, arm=arm, home=home), home=None if own.home is None else home)


@cache
def free_poses(
    name: str, perfect_drives: bool, targets: tuple[str, ...], count: int, seed: int, noise: Noise
) -> Campaign:
    """Random poses over three fifths of the joints' ranges, all of them to be fitted."""
    own = cell(name, perfect_drives)
    low, high = np.array([joint.limits for joint in own.robot.joints]).T
    # Not the noise's own random numbers.
    poses = 0.6 * np.random.default_rng((seed, 1)).uniform(low, high, (count, len(low)))
    wanted = replace(own.protocol, sweeps=(), poses=poses, pose_targets=targets)
    found = simulate_campaign(seed, replace(own, protocol=wanted), noise)
    table = found.measurements
    return replace(found, measurements=replace(table, check=np.zeros(table.count, dtype=bool)))


def true_state(own: Cell, target: np.ndarray) -> ArmState:
    """The arm as it is, with some of its targets."""
    arm = own.truth.arm
    plain = tuple(replace(f, offset=0.0) for f in arm.transmissions)
    return ArmState(arm.axes, plain, arm.couplings, own.truth.rest_points_m[target])


def axis_errors(found: tuple[Line, ...], true: tuple[Line, ...], sliding: np.ndarray) -> tuple[float, float]:
    """Largest angle (rad) and largest distance (m, at the true axis' point) between axes that should be the same."""
    angle = max(angle_between(a.direction, b.direction) for a, b in zip(found, true, strict=True))
    turning = [(a, b) for a, b, slides in zip(found, true, sliding, strict=True) if not slides]
    return angle, max(float(np.linalg.norm(a.foot_of(b.point_m) - b.point_m)) for a, b in turning)


def deviations(found: ArmState, true: ArmState, equations: Equations) -> Array:
    """Truth less estimate as the equations lay out local deviations of the estimate, to first order, (size,)."""
    layout, out = equations.layout, np.zeros(equations.size)
    for a, b, place in zip(found.axes, true.axes, layout.axes, strict=True):
        basis = axis_basis(a.direction)
        parts = [basis @ (b.direction - a.direction), basis @ (b.foot_of(a.point_m) - a.point_m)]
        out[place] = np.concatenate(parts)[: place.stop - place.start]
    for one, other, place in zip(
        (*found.transmissions, *found.couplings),
        (*true.transmissions, *true.couplings),
        (*layout.transmissions, *layout.couplings),
        strict=True,
    ):
        if place is not None:
            out[place] = other.coefficients - one.coefficients
    if equations.attachment == true.rest_points_m.size:
        out[layout.targets.start :] = (true.rest_points_m - found.rest_points_m).ravel()
    return out
