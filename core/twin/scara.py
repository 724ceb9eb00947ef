"""A simulated SCARA arm (turn, turn, slide, turn; all axes parallel) under a laser tracker.

No real arm stands behind it: it shows what the paper's method does where Denavit and Hartenberg's notation fails (all
axes parallel), with a sliding joint, long ranges and an exact instrument. Its commands count from its own zeros.
"""

from functools import lru_cache

import numpy as np

from core.arm import Arm
from core.geometry import Array, rotation_about, transform
from core.measurements import Target
from core.motion_forms import Harmonics, MotionFunction, Proportional
from core.phi_model import PhiModel, axes, frames
from core.robot import Joint, JointKind, LinkMass, Robot
from core.robot_builders import PhiTool, robot_from_phi
from core.twin.cell import Cell, Truth, attached
from core.twin.instruments import Tracker
from core.twin.noise import Repeatability
from core.twin.protocol import Protocol, SweepPlan

PHI_RAD = np.full(3, np.pi / 2)
SLIDING = np.array([False, False, True, False])
SLIDE_RATIO = 1.0015
"""Commanded travel for one unit of actual travel of joint 3."""
TRACKER_SIGMA_M = 0.02e-3

TARGETS = (
    ("P1", 4, (0.14, 0.71, -0.15)),
    ("P2", 3, (0.05, 0.42, 0.28)),
    ("P3", 2, (0.06, 0.62, 0.07)),
    ("P4", 1, (0.05, 0.30, 0.06)),
    ("P5", 4, (-0.09, 0.74, -0.17)),
    ("P6", 4, (0.01, 0.55, -0.12)),
)
"""Name, link, and place in the drawing of the arm at rest, frame 1, metres."""

SWEEPS = (
    (4, -2.9, 2.9, 40, ("P1",)),
    (3, -0.11, 0.11, 30, ("P1",)),
    (2, -2.2, 2.2, 36, ("P3",)),
    (1, -2.3, 2.3, 40, ("P4",)),
)
"""Joint, lowest and highest displacement in rad or m, positions, targets."""


def nominal_model() -> PhiModel:
    """Arms of 350 mm and 300 mm; the sliding joint moves up."""
    half_turn = np.full(3, np.pi)
    return PhiModel(PHI_RAD, np.array([0.35, 0.0, 0.30]), np.zeros(3), np.full(3, np.pi / 2), half_turn, SLIDING)


def actual_model() -> PhiModel:
    """The same with small errors where the axes fix the parameter."""
    return PhiModel(
        PHI_RAD,
        a_m=np.array([0.35062, 0.0, 0.29948]),
        b_m=np.array([0.0, 0.0, 0.00021]),
        alpha_rad=np.pi / 2 + np.array([0.0011, -0.0016, 0.0009]),
        theta_rad=np.pi + np.array([-0.0008, 0.0013, -0.0019]),
        sliding=SLIDING,
    )


def actual_base() -> Array:
    """From the actual frame 1 to the tracker, (4, 4): 2 m away, turned, not quite level."""
    turn = rotation_about([0.0, 0.0, 1.0], 2.1) @ rotation_about([0.6, 0.8, 0.0], 0.004)
    return transform(turn, [1.9, -0.8, -0.45])


@lru_cache
def nominal_robot() -> Robot:
    """The arm as drawn; the tool's point lies 0.1 m below frame 4."""
    limits = ((-2.6, 2.6), (-2.5, 2.5), (-0.15, 0.15), (-np.pi, np.pi))
    turning = ("first_harmonic", "first_harmonic", "ratio", "first_harmonic")
    return robot_from_phi(
        "SCARA 650",
        tuple(
            Joint(JointKind.PRISMATIC if slides else JointKind.REVOLUTE, low_high, None, form)
            for slides, low_high, form in zip(SLIDING, limits, turning, strict=True)
        ),
        nominal_model(),
        tool=PhiTool(phi_rad=np.pi / 2, alpha_rad=-np.pi / 2, gamma_rad=np.pi, h_m=-0.1),
        links=(
            LinkMass(9.0, (0.0, 0.18, 0.0)),
            LinkMass(6.0, (0.0, 0.15, 0.0)),
            LinkMass(1.5, (0.0, 0.30, 0.05)),
            LinkMass(0.5, (0.0, 0.0, -0.08)),
        ),
        gravity_direction=(0.0, 0.0, -1.0),
    )


def true_arm() -> Arm:
    """The arm as it is, in the tracker's frame; no transducer offsets, no couplings."""
    harmonic = Harmonics(1)
    drives = (
        MotionFunction(harmonic, np.array([0.0009, -0.0004])),
        MotionFunction(harmonic, np.array([-0.0013, 0.0007])),
        MotionFunction(Proportional(), np.array([SLIDE_RATIO])),
        MotionFunction(harmonic, np.array([0.0021, 0.0012])),
    )
    return Arm(nominal_robot(), axes(actual_model(), actual_base()), drives, (None, None, None, None))


def truth() -> Truth:
    """The arm as it is, with its targets."""
    arm, phi, base = true_arm(), actual_model(), actual_base()
    links, places = [link for _, link, _ in TARGETS], [place for _, _, place in TARGETS]
    points = attached(nominal_robot(), frames(phi, np.zeros(4), base), links, places)
    return Truth(arm, base, phi, points, np.array(links), arm.commanded_for(np.zeros(4))[0])


def protocol() -> Protocol:
    """Long sweeps from the last joint to the first, then ten check poses."""
    sweeps = tuple(SweepPlan(*plan) for plan in SWEEPS)
    # Poses spread evenly over the ranges of the sweeps (Roberts' additive recurrence).
    steps = 1 / 1.1673039782614187 ** np.arange(1, 5)
    spread = (0.5 + np.arange(1, 11)[:, None] * steps) % 1.0
    reach = np.array([2.1, 2.0, 0.1, 2.7])
    return Protocol(sweeps, (2 * spread - 1) * reach, ("P1", "P5", "P6"), seconds_a_shot=6.0)


@lru_cache
def cell() -> Cell:
    """The whole simulated cell."""
    return Cell(
        title="Simulated SCARA under a laser tracker",
        robot=nominal_robot(),
        nominal=nominal_model(),
        truth=truth(),
        targets=tuple(Target(name, link) for name, link, _ in TARGETS),
        protocol=protocol(),
        instrument=Tracker(TRACKER_SIGMA_M),
        repeatability=Repeatability(mean_translation_m=0.01e-3),
        stiffness=np.array([3e4, 2e4, 4e5, 2e3]),
        notes=(("source", "simulated: no such arm was built or measured"),),
    )
