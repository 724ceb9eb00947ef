"""A simulated cell around the paper's ASEA IRB L6: targets, two theodolites, the order of table 1.

What the paper gives: which joint moves how far with how many points (table 1), the instrument's net radial error of
0.19 mm, the arm's repeatability of 0.34 mm and 0.0033 rad, the stations about 3 m away. What is chosen here: where
the targets are stuck on, the second station's place, the twelve test poses, times, temperatures.
"""

from functools import lru_cache

import numpy as np

from core.geometry import apply, invert
from core.measurements import Target
from core.phi_model import frames
from core.theodolite import Theodolite
from core.twin.cell import Cell, Truth, attached
from core.twin.instruments import TheodolitePair
from core.twin.irb_l6_arm import TURNING, actual_base, actual_model, nominal_model, nominal_robot, true_arm
from core.twin.noise import Repeatability
from core.twin.protocol import Protocol, SweepPlan

RIGHT_STATION_M = (0.0, 6.0, 0.0)
SIGMA_ANGLE_RAD = 2.5e-5
"""Of every angle of both theodolites (5.2 arc seconds): 0.19 mm root mean square over the points of the sweeps."""

REPEATABILITY = Repeatability(mean_translation_m=0.34e-3, mean_rotation_rad=0.0033)

TARGETS = (
    ("T1", 6, (0.15, 0.96, 0.55)),
    ("T2", 4, (0.06, 0.82, 0.81)),
    ("T3", 3, (0.08, 0.50, 0.74)),
    ("T4", 2, (0.10, 0.12, 0.60)),
    ("T5", 6, (-0.13, 1.00, 0.53)),
    ("T6", 6, (0.02, 0.78, 0.48)),
)
"""Name, link, and place in the drawing of the arm at rest, frame 1, metres."""

SWEEPS = (
    (6, 50.0, 17, ("T1",)),
    (5, 60.0, 16, ("T1",)),
    (4, 90.0, 16, ("T2", "T1")),
    (3, 45.0, 16, ("T3",)),
    (2, 45.0, 16, ("T4", "T3")),
    (1, 48.0, 16, ("T1",)),
)
"""Table 1: joint, span in degrees, positions, and the targets seen at each (the second one for the dependency)."""

TEST_POSES_DEG = (
    (-18, -10, -4, -4, -2, 20),
    (-20, 19, 6, 32, -5, -13),
    (13, 7, 12, -26, -21, 13),
    (-15, 12, 18, 20, 6, 10),
    (20, -1, 13, 21, 26, -20),
    (18, 0, -2, 16, 7, -3),
    (13, -9, -15, -27, -28, -20),
    (0, -1, 8, -22, 14, -15),
    (-17, 18, 8, -8, -28, 16),
    (3, -20, -17, -23, -28, 9),
    (4, -7, -3, -39, -6, 16),
    (-21, 7, 8, -24, -12, -15),
)
"""Twelve test poses: how far each motor is from home, within the ranges of the sweeps."""


def protocol() -> Protocol:
    """Table 1, centred on home, then the test poses with three targets on the end-effector."""
    sweeps = tuple(
        SweepPlan(joint, -np.deg2rad(span) / 2, np.deg2rad(span) / 2, points, targets)
        for joint, span, points, targets in SWEEPS
    )
    return Protocol(sweeps, np.deg2rad(np.array(TEST_POSES_DEG, dtype=float)), ("T1", "T5", "T6"))


def truth() -> Truth:
    """The arm as it is, with its targets; the tables' axis lines place it in the left-hand theodolite's frame."""
    arm, phi, base = true_arm(), actual_model(), actual_base()
    links, places = [link for _, link, _ in TARGETS], [place for _, _, place in TARGETS]
    points = attached(nominal_robot(), frames(phi, np.zeros(len(TURNING)), base), links, places)
    return Truth(arm, base, phi, points, np.array(links), arm.commanded_for(np.zeros(6))[0])


def theodolites() -> TheodolitePair:
    """The left-hand one is the origin; places and orientations are taken as known exactly."""
    left = Theodolite(np.zeros(3), np.eye(3), SIGMA_ANGLE_RAD, SIGMA_ANGLE_RAD)
    right = Theodolite(np.array(RIGHT_STATION_M), np.eye(3), SIGMA_ANGLE_RAD, SIGMA_ANGLE_RAD)
    return TheodolitePair(left, right, sigma_m=0.00011)


def targets_of(true: Truth) -> tuple[Target, ...]:
    """The targets; of those on the end-effector the places are known, as of a tool that was measured by itself."""
    places = apply(invert(true.frames_at_rest()[-1]), true.rest_points_m)
    return tuple(
        Target(name, link, tuple(round(float(v), 9) for v in place) if link == len(TURNING) else None)
        for (name, link, _), place in zip(TARGETS, places, strict=True)
    )


@lru_cache
def cell() -> Cell:
    """The whole simulated cell."""
    true = truth()
    return Cell(
        title="Simulated ASEA IRB L6 under two theodolites",
        robot=nominal_robot(),
        nominal=nominal_model(),
        truth=true,
        targets=targets_of(true),
        protocol=protocol(),
        instrument=theodolites(),
        repeatability=REPEATABILITY,
        home=true.home,
        stiffness=np.array([6e4, 4e4, 3e4, 8e3, 5e3, 4e3]),
        notes=(
            ("source", "simulated: no robot was measured"),
            ("geometry", "table 2 and section 4 of Sultan and Wager"),
            (
                "choices",
                "transducer offsets, signs within the functions, targets and stations are the simulation's own",
            ),
        ),
    )
