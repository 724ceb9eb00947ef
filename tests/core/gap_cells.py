"""Simulated cells that stand exactly as drawn: what is wrong with them is what a test puts in."""

from dataclasses import replace
from functools import cache

import numpy as np

from core.arm import Arm
from core.geometry import Array, rotation_about, transform
from core.measurements import Campaign, Target
from core.motion_forms import Direct, MotionFunction, Proportional
from core.phi_model import PhiModel, axes, frames
from core.robot import Coupling, Joint, JointKind, LinkMass, Robot
from core.robot_builders import PhiTool, robot_from_phi
from core.twin import scara
from core.twin.campaign import NOISY, simulate_campaign
from core.twin.cell import Cell, Truth, attached
from core.twin.effects import parse_effect
from core.twin.instruments import Tracker
from core.twin.noise import Noise, Repeatability
from core.twin.protocol import Protocol, SweepPlan

SIGMA_M = 2e-5
BASE = transform(rotation_about(np.array([0.0, 0.0, 1.0]), 0.7), [2.0, 1.0, -0.5])
TARGETS = (
    ("A", 4, (0.16, 0.84, 0.76)),
    ("B", 4, (-0.14, 0.88, 0.62)),
    ("C", 2, (0.12, 0.14, 0.62)),
)
"""Name, link, and place in the drawing of the arm at rest, frame 1, metres."""


def crane_model() -> PhiModel:
    """An upright axis, then three level ones: shoulder, elbow, wrist."""
    turning = np.zeros(4, dtype=bool)
    phi, theta = np.array([np.pi / 2, 0.0, 0.0]), np.deg2rad([-90.0, -180.0, -180.0])
    return PhiModel(phi, np.array([0.0, -0.69, -0.67]), np.zeros(3), np.full(3, np.pi / 2), theta, turning)


def crane(coupled: bool = True) -> Robot:
    """A palletiser of four turning joints; motors 2 and 3 pass their motion on, as in a parallelogram."""
    limits = ((-2.9, 2.9), (-0.9, 0.9), (-1.0, 1.0), (-1.6, 1.6))
    return robot_from_phi(
        "crane",
        tuple(Joint(JointKind.REVOLUTE, low_high) for low_high in limits),
        crane_model(),
        tool=PhiTool(phi_rad=np.pi / 2, alpha_rad=-np.pi / 2, gamma_rad=np.pi, h_m=0.12),
        couplings=(Coupling(2, 3, -1.0), Coupling(3, 4, -1.0)) if coupled else (),
        links=(
            LinkMass(42.0, (0.02, -0.05, -0.30)),
            LinkMass(18.0, (-0.31, -0.02, 0.0)),
            LinkMass(14.0, (-0.24, 0.0, 0.0)),
            LinkMass(8.0, (0.0, -0.02, 0.05)),
        ),
        gravity_direction=(0.0, 0.0, -1.0),
    )


def as_drawn(robot: Robot, model: PhiModel, places: tuple[tuple[str, int, tuple[float, ...]], ...]) -> Truth:
    """An arm whose axes, drives and couplings are those of the drawing."""
    nothing = MotionFunction(Direct(), np.zeros(0))
    gains = [robot.coupling_into(j) for j in range(1, robot.joint_count + 1)]
    couplings = tuple(
        None if c is None else MotionFunction(Proportional(c.gain, "proportional", "gain"), np.array([c.gain]))
        for c in gains
    )
    arm = Arm(robot, axes(model, BASE), (nothing,) * robot.joint_count, couplings)
    links, points = [link for _, link, _ in places], [place for *_, place in places]
    rest = attached(robot, frames(model, np.zeros(robot.joint_count), BASE), links, points)
    return Truth(arm, BASE, model, rest, np.array(links), np.zeros(robot.joint_count))


def spread(count: int, reach: Array) -> Array:
    """Poses spread evenly (Roberts' additive recurrence), (count, n)."""
    n = len(reach)
    root = np.roots([1.0, *[0.0] * (n - 1), -1.0, -1.0])
    steps = 1 / float(root[np.isreal(root)].real.max()) ** np.arange(1, n + 1)
    return (2 * ((0.5 + np.arange(1, count + 1)[:, None] * steps) % 1.0) - 1) * reach


@cache
def crane_cell(coupled: bool = True, visits: int = 3) -> Cell:
    """Arcs of every joint both ways, the second time with the others elsewhere; poses, some of them visited again."""
    robot = crane(coupled)
    truth = as_drawn(robot, crane_model(), TARGETS)
    reach = np.array([1.2, 0.7, 0.75, 1.1])
    arcs = tuple(SweepPlan(joint, -reach[joint - 1], reach[joint - 1], 17, ("A", "B")) for joint in (1, 2, 3, 4))
    poses = spread(40, reach)
    again = [poses[:15]] * (visits - 1)
    return Cell(
        title="Simulated crane as drawn",
        robot=robot,
        nominal=crane_model(),
        truth=truth,
        targets=tuple(Target(name, link) for name, link, _ in TARGETS),
        protocol=Protocol(arcs, np.vstack([poses, *again]), ("A", "C"), seconds_a_shot=20.0, both_ways=True),
        instrument=Tracker(SIGMA_M),
        repeatability=Repeatability(mean_translation_m=1e-5),
        stiffness=np.array([6e4, 4e4, 3e4, 8e3]),
        notes=(("source", "simulated: no such arm was measured"),),
    )


@cache
def scara_cell() -> Cell:
    """The twin's SCARA with nothing wrong, measured both ways, all targets shown by arcs and poses."""
    robot, model = scara.nominal_robot(), scara.nominal_model()
    places = tuple(place for place in scara.TARGETS if place[0] in ("P1", "P4", "P5"))
    reach = np.array([2.1, 2.0, 0.1, 2.7])
    arcs = tuple(SweepPlan(joint, low, high, 21, ("P1", "P5")) for joint, low, high, *_ in scara.SWEEPS)
    poses = spread(40, reach)
    protocol = Protocol(arcs, np.vstack([poses, poses[:15], poses[:15]]), ("P1", "P4"), 10.0, both_ways=True)
    whole = scara.cell()
    return replace(
        whole,
        truth=as_drawn(robot, model, places),
        nominal=model,
        targets=tuple(Target(name, link) for name, link, _ in places),
        protocol=protocol,
    )


def measured(cell: Cell, *effects: str, seed: int = 1, noise: Noise = NOISY, checks: int = 0) -> Campaign:
    """A campaign with faults; the last of its poses are validation rows."""
    found = simulate_campaign(seed, cell, noise, tuple(parse_effect(text, cell.robot) for text in effects))
    rows = found.measurements
    check = rows.pose >= rows.pose.max() + 1 - checks
    return replace(found, measurements=replace(rows, check=check if checks else np.zeros(rows.count, dtype=bool)))
