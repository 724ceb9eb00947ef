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
ARC, POSES, AGAIN = 13, 28, 12
"""Points of an arc one way, poses, and how many of them are visited three times."""
BASE = transform(rotation_about(np.array([0.0, 0.0, 1.0]), 0.7), [2.0, 1.0, -0.5])
TARGETS = (("A", 0, (0.16, 0.84, 0.76)), ("B", 0, (-0.14, 0.88, 0.62)), ("C", -1, (0.12, 0.14, 0.62)))
"""Name, link counted from the last one (C: on the second), and place in the drawing of the arm at rest, frame 1, m."""
REACH = np.array([1.2, 0.7, 0.75, 1.1])
LINKS = (
    LinkMass(42.0, (0.02, -0.05, -0.30)),
    LinkMass(18.0, (-0.31, -0.02, 0.0)),
    LinkMass(14.0, (-0.24, 0.0, 0.0)),
    LinkMass(8.0, (0.0, -0.02, 0.05)),
)


def crane_model(joints: int) -> PhiModel:
    """An upright axis, then level ones: shoulder, elbow, wrist."""
    phi, theta = np.array([np.pi / 2, 0.0, 0.0]), np.deg2rad([-90.0, -180.0, -180.0])
    a, alpha = np.array([0.0, -0.69, -0.67]), np.full(3, np.pi / 2)
    n = joints - 1
    return PhiModel(phi[:n], a[:n], np.zeros(n), alpha[:n], theta[:n], np.zeros(joints, dtype=bool))


def crane(joints: int) -> Robot:
    """An arm of three or four turning joints; of four, motors 2 and 3 pass their motion on, as in a parallelogram."""
    limits = ((-2.9, 2.9), (-0.9, 0.9), (-1.0, 1.0), (-1.6, 1.6))
    return robot_from_phi(
        "crane",
        tuple(Joint(JointKind.REVOLUTE, low_high) for low_high in limits[:joints]),
        crane_model(joints),
        tool=PhiTool(phi_rad=np.pi / 2, alpha_rad=-np.pi / 2, gamma_rad=np.pi, h_m=0.12),
        couplings=(Coupling(2, 3, -1.0), Coupling(3, 4, -1.0)) if joints == 4 else (),
        links=LINKS[:joints],
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
def crane_cell(joints: int = 3) -> Cell:
    """Arcs of every joint both ways; poses, some of them visited again."""
    robot, model, reach = crane(joints), crane_model(joints), REACH[:joints]
    places = tuple((name, 2 if link else joints, place) for name, link, place in TARGETS)
    arcs = tuple(
        SweepPlan(joint, -reach[joint - 1], reach[joint - 1], ARC, ("A", "B")) for joint in range(1, joints + 1)
    )
    poses = spread(POSES, reach)
    return Cell(
        title="Simulated crane as drawn",
        robot=robot,
        nominal=model,
        truth=as_drawn(robot, model, places),
        targets=tuple(Target(name, link) for name, link, _ in places),
        protocol=Protocol(arcs, np.vstack([poses, poses[:AGAIN], poses[:AGAIN]]), ("A", "C"), 20.0, both_ways=True),
        instrument=Tracker(SIGMA_M),
        repeatability=Repeatability(mean_translation_m=1e-5),
        stiffness=np.array([6e4, 4e4, 3e4, 8e3])[:joints],
        notes=(("source", "simulated: no such arm was measured"),),
    )


@cache
def scara_cell() -> Cell:
    """The twin's SCARA with nothing wrong, measured both ways, all targets shown by arcs and poses."""
    robot, model = scara.nominal_robot(), scara.nominal_model()
    places = tuple(place for place in scara.TARGETS if place[0] in ("P1", "P4", "P5"))
    reach = np.array([2.1, 2.0, 0.1, 2.7])
    arcs = tuple(SweepPlan(joint, low, high, ARC + 6, ("P1", "P5")) for joint, low, high, *_ in scara.SWEEPS)
    poses = spread(POSES, reach)
    protocol = Protocol(arcs, np.vstack([poses, poses[:AGAIN], poses[:AGAIN]]), ("P1", "P4"), 10.0, both_ways=True)
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
