"""Arms, campaigns and placed sims put together by hand, for tests of what the diagnosis of the gap is computed from."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from random_arms import random_model, random_motion

from core.gap.observations import Observations, observe
from core.gap.sim import Sim
from core.geometry import Array
from core.kinematics import link_frames
from core.measurements import POSE, SWEEP, Campaign, Instrument, Measurements, Target
from core.robot import Coupling, Joint, JointKind, LinkMass, Robot
from core.robot_builders import DhRow, PhiTool, robot_from_dh, robot_from_phi

TURNS, SLIDES = Joint(JointKind.REVOLUTE), Joint(JointKind.PRISMATIC)
SIGMA_M = 2e-5


def kinds(sliding: tuple[bool, ...]) -> tuple[Joint, ...]:
    return tuple(SLIDES if slides else TURNS for slides in sliding)


def masses(rng: np.random.Generator, count: int) -> tuple[LinkMass, ...]:
    return tuple(LinkMass(kg, tuple(rng.uniform(-0.3, 0.3, 3))) for kg in rng.uniform(1.0, 20.0, count))


def phi_arm(seed: int, sliding: tuple[bool, ...] = (False,) * 4, couplings: tuple[Coupling, ...] = ()) -> Robot:
    """A random arm with a tool, masses, and gravity aslant."""
    rng = np.random.default_rng(seed)
    tool = PhiTool(*rng.uniform(0.4, 1.2, 7))
    model, links = random_model(rng, sliding), masses(rng, len(sliding))
    return robot_from_phi("phi", kinds(sliding), model, tool, couplings, links, (0.6, 0.0, -0.8))


def dh_arm(seed: int, sliding: tuple[bool, ...] = (False,) * 4, couplings: tuple[Coupling, ...] = ()) -> Robot:
    """A random arm whose base frame is not frame 1."""
    rng = np.random.default_rng(seed)
    rows = [DhRow(*row) for row in rng.uniform(-1.5, 1.5, (len(sliding), 4))]
    robot = robot_from_dh("dh", kinds(sliding), rows, couplings, masses(rng, len(sliding)), (0.0, 0.8, -0.6))
    return replace(robot, base_transform=random_motion(rng, 0.5))


ARMS: dict[str, Callable[[int], Robot]] = {
    "phi": lambda seed: phi_arm(seed),
    "phi with a slide": lambda seed: phi_arm(seed, (False, False, True, False)),
    "dh": lambda seed: dh_arm(seed),
    "dh with slides": lambda seed: dh_arm(seed, (False, True, False, True, False)),
    "coupled": lambda seed: phi_arm(seed, (False,) * 4, (Coupling(1, 2, -1.0), Coupling(2, 3, 0.5, False))),
    "coupled slide": lambda seed: dh_arm(seed, (False, True, False), (Coupling(1, 2, 0.3, False),)),
}
"""Ways to describe an arm, with sliding joints and couplings of both kinds."""


def table(
    commanded: Array, target: np.ndarray | None = None, point_m: Array | None = None, **columns: object
) -> Measurements:
    """Rows of poses; other columns as they are given."""
    m = len(commanded)
    made = Measurements(
        record=np.arange(1, m + 1),
        phase=np.full(m, POSE, dtype=object),
        joint=np.zeros(m, dtype=int),
        sweep=np.zeros(m, dtype=int),
        step=np.full(m, -1),
        pose=np.arange(m),
        target=np.zeros(m, dtype=int) if target is None else target,
        commanded=np.asarray(commanded, dtype=float),
        point_m=np.zeros((m, 3)) if point_m is None else point_m,
        covariance_m2=np.tile(SIGMA_M**2 * np.eye(3), (m, 1, 1)),
        check=np.zeros(m, dtype=bool),
        approach=np.zeros((m, commanded.shape[1]), dtype=int),
    )
    return replace(made, **columns)


def campaign(robot: Robot, targets: tuple[Target, ...], rows: Measurements) -> Campaign:
    return Campaign(robot, targets, rows, instrument=Instrument("laser-tracker", SIGMA_M), digest="by hand")


def random_targets(rng: np.random.Generator, robot: Robot) -> tuple[Target, ...]:
    """Two on the last link, one on every link in the middle; no place is known."""
    last = robot.joint_count
    middle = tuple(Target(f"M{link}", link) for link in range(1, last))
    return (Target("A", last), Target("B", last), *middle)


def random_sim(robot: Robot, seed: int, count: int = 12) -> Sim:
    """A sim in random configurations, its base and targets anywhere, its points measured where it has them."""
    rng = np.random.default_rng(seed)
    targets = random_targets(rng, robot)
    commanded = rng.uniform(-1.5, 1.5, (count, robot.joint_count))
    which = np.arange(count) % len(targets)
    seen = observe(campaign(robot, targets, table(commanded, which)))
    sim = Sim(seen, random_motion(rng), rng.uniform(-0.3, 0.3, (len(targets), 3)), rng.normal(size=3))
    return measured_at(sim, sim.points_m())


def measured_at(sim: Sim, point_m: Array) -> Sim:
    """The same sim, held against other measured points."""
    return replace(sim, seen=with_points(sim.seen, point_m), middle_m=point_m.mean(axis=0))


def with_points(seen: Observations, point_m: Array) -> Observations:
    """The same observations with other measured points."""
    rows = seen.campaign.measurements
    everywhere = rows.point_m.copy()
    everywhere[seen.rows] = point_m
    changed = replace(seen.campaign, measurements=replace(rows, point_m=everywhere))
    return Observations(changed, seen.chain, seen.rows, seen.active, seen.net, seen.sim)


def chain_points(sim: Sim, net: Array) -> Array:
    """Where the sim's points are for other net displacements (m, n), by the frames of core.kinematics."""
    seen = sim.seen
    frame = sim.base @ link_frames(seen.chain, net)[np.arange(seen.count), seen.link - 1]
    return (frame[:, :3, :3] @ sim.target_m[seen.target][:, :, None])[:, :, 0] + frame[:, :3, 3]


def net_of_motors(sim: Sim, active: Array) -> Array:
    """What the chain's couplings make of motors, (m, n)."""
    net = active.copy()
    for coupling in sim.seen.chain.couplings:
        net[:, coupling.target - 1] += coupling.gain * active[:, coupling.source - 1]
    return net


def arc_rows(robot: Robot, joint: int, places: Array, centre: Array, sweep: int = 1) -> dict[str, object]:
    """Columns of one sweep of a joint (1..n) through places, forwards or backwards as they come."""
    m = len(places)
    commanded = np.tile(np.asarray(centre, dtype=float), (m, 1))
    commanded[:, joint - 1] = places
    approach = np.zeros((m, robot.joint_count), dtype=int)
    approach[:, joint - 1] = np.sign(places[-1] - places[0])
    return {
        "phase": np.full(m, SWEEP, dtype=object),
        "joint": np.full(m, joint),
        "sweep": np.full(m, sweep),
        "step": np.arange(m),
        "pose": np.full(m, -1),
        "commanded": commanded,
        "approach": approach,
    }
