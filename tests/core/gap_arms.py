"""Arms, campaigns and placed sims put together by hand, for tests of what the diagnosis of the gap is computed from."""

from collections.abc import Callable
from dataclasses import dataclass, replace

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


@dataclass(frozen=True)
class Day:
    """How much is measured in ``day``."""

    arc: int = 9
    """Points of each arc, there and back again."""
    poses: int = 30
    visits: int = 1
    """How often each pose is visited."""
    reach: float = 1.2
    """Half width of the arcs, rad (m: a tenth)."""
    shots: int = 1
    """Targets seen at each standstill."""


def day(robot: Robot, seed: int, plan: Day = Day(), noise_m: float = 0.0) -> Sim:
    """A sim as a day of measuring shows it: arcs both ways, poses, changing loads, speeds, temperatures.

    The points are where the sim has them, with white noise.
    """
    rng = np.random.default_rng(seed)
    n, targets = robot.joint_count, random_targets(rng, robot)
    reach = np.where(robot.sliding, 0.1, 1.0) * plan.reach
    centre = 0.3 * reach * rng.uniform(-1, 1, n)
    stops = [stop for j in range(n) for stop in _arc(j, centre, reach, plan.arc)]
    drawn = reach * rng.uniform(-1, 1, (plan.poses, n))
    stops += [(POSE, 0, -1, k, drawn[k]) for _ in range(plan.visits) for k in range(plan.poses)]
    phase, joint, step, pose, _ = (np.array(column, dtype=object) for column in zip(*stops, strict=True))
    m = len(stops) * plan.shots
    stop = np.repeat(np.arange(len(stops)), plan.shots)
    commanded = np.array([place for *_, place in stops])
    sense = np.sign(np.diff(commanded, axis=0, prepend=commanded[:1] - 0.1)).astype(int)
    warm = 1 - np.exp(-np.arange(m) / m)
    place = np.where(joint > 0, step, pose).astype(int)
    shot = np.arange(m) % plan.shots
    moving = (joint[stop] > 0)[:, None]
    rows = table(
        commanded[stop],
        (place[stop] + shot) % len(targets),
        phase=phase[stop],
        joint=joint[stop].astype(int),
        sweep=(joint[stop] > 0).astype(int),
        step=step[stop].astype(int),
        pose=np.where(joint[stop] > 0, -1, stop),
        approach=sense[stop],
        time_s=30.0 * np.arange(m),
        temperature_c=21.0 + np.sin(np.arange(m) / 9.0),
        arm_temperature_c=22.0 + 6.0 * warm,
        payload_kg=4.0 * ((joint + place) % 2)[stop].astype(float),
        speed=np.where(moving, rng.uniform(-0.3, 0.3, (m, n)), 0.0),
        torque_nm=rng.uniform(-30, 30, (len(stops), n))[stop],
        readback=commanded[stop] + 1e-3 * rng.normal(size=(m, n)),
    )
    sim = Sim(observe(campaign(robot, targets, rows)), random_motion(rng), _off_axis(rng, len(targets)), np.zeros(3))
    return measured_at(sim, sim.points_m() + noise_m * rng.normal(size=(m, 3)))


def _arc(joint: int, centre: Array, reach: Array, points: int) -> list[tuple[str, int, int, int, Array]]:
    places = np.linspace(-1, 1, points) * reach[joint]
    along = np.eye(len(centre))[joint]
    there = [(SWEEP, joint + 1, k, -1, centre + place * along) for k, place in enumerate(places)]
    return there + there[::-1]


def _off_axis(rng: np.random.Generator, targets: int) -> Array:
    turn = rng.uniform(0, 2 * np.pi, targets)
    return np.stack([0.15 * np.cos(turn), 0.15 * np.sin(turn), rng.uniform(0.05, 0.2, targets)], axis=1)
