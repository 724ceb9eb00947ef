"""What a careful user measures: sweeps both ways from two configurations, poses, repeats, in an order of chance.

About 700 to 1100 points. Loads come and go in five blocks with pauses between, joints are interleaved within them,
and the first sweep is measured again at the end: effects of time and of joints can be told apart.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tests.benchmarks.withheld.arms import Arm
from tests.benchmarks.withheld.rigid import Array
from tests.benchmarks.withheld.sessions import PAUSE_S, Diary, Session, random_base, random_places

Job = Callable[[Diary], None]


@dataclass(frozen=True)
class Plan:
    """How much is measured."""

    targets: int = 2
    sweep_points: int = 400
    """Over all sweeps."""
    poses: int = 90
    repeated: int = 12
    """Poses that are visited again."""
    visits: int = 6
    """How often in all."""
    in_motion: bool = False
    """Whether each joint is also measured while it moves."""
    crowded: int = 10
    """Poses in a row between sweeps."""
    held: tuple[int, ...] = ()
    """Joints that never move, from 0; not the first."""
    readback: bool = False
    """Whether joints are read back rather than taken as commanded."""


def random_plan(
    rng: np.random.Generator, in_motion: bool = False, targets: int | None = None, readback: bool | None = None
) -> Plan:
    """One of the ways to measure richly; some measure in motion or read joints back though nothing calls for it."""
    several = int(rng.choice([1, 2, 2, 3, 3])) if targets is None else targets
    return Plan(
        targets=several,
        sweep_points={1: 540, 2: 420, 3: 400}[several],
        poses={1: 110, 2: 90, 3: 80}[several],
        in_motion=in_motion or bool(rng.random() < 0.3),
        readback=bool(rng.random() < 0.2) if readback is None else readback,
    )


def rich_session(arm: Arm, rng: np.random.Generator, plan: Plan | None = None) -> Session:
    """A session by a plan; everything else is chance."""
    plan = plan or random_plan(rng)
    homes = arm.homes + rng.uniform(-0.12, 0.12, arm.homes.shape) * arm.reach
    homes[1, list(plan.held)] = homes[0, list(plan.held)]
    first = sweep_job(arm, rng, homes[0], 0, 1, plan)
    unloaded, loaded = _jobs(arm, rng, homes, plan)
    blocks = [*_blocks(rng, unloaded, 3), *_blocks(rng, loaded, 2)]
    diary = Diary(arm, rng)
    diary.move(homes[0])
    first(diary)
    for k, load in zip((0, 3, 1, 4, 2), (0.0, 1.0, 0.0, 1.0, 0.0), strict=True):
        if load * arm.payload_kg != diary.payload:
            diary.wait(PAUSE_S * rng.uniform(1.1, 2.0))
            diary.payload = load * arm.payload_kg
        for job in blocks[k]:
            job(diary)
    sweep_job(arm, rng, homes[0], 0, 2, plan)(diary)
    return diary.session(random_places(rng, plan.targets), random_base(rng), plan.readback)


def _jobs(arm: Arm, rng: np.random.Generator, homes: Array, plan: Plan) -> tuple[list[Job], list[Job]]:
    """What is measured without and with the load."""
    free = [j for j in range(arm.count) if j not in plan.held]
    unloaded = [sweep_job(arm, rng, homes[0], j, 1, plan) for j in free[1:]]
    loaded = [sweep_job(arm, rng, homes[1], j, 3, plan) for j in free]
    if plan.in_motion:
        unloaded += [_moving_job(arm, rng, homes[0], j, 4, plan) for j in free]
    places = spread_poses(arm, rng, homes, plan.poses)
    places[:, list(plan.held)] = homes[0, list(plan.held)]
    carried = rng.random(plan.poses) < 0.5
    visits = np.concatenate([np.arange(plan.poses), np.repeat(np.arange(plan.repeated), plan.visits - 1)])
    visits = rng.permutation(visits)
    for with_load, jobs in ((False, unloaded), (True, loaded)):
        mine = [(int(k), int(which)) for k, which in enumerate(visits) if carried[which] == with_load]
        for start in range(0, len(mine), plan.crowded):
            jobs.append(pose_job(arm, rng, places, mine[start : start + plan.crowded], plan))
    return unloaded, loaded


def _blocks(rng: np.random.Generator, jobs: list[Job], count: int) -> list[list[Job]]:
    order = rng.permutation(len(jobs))
    return [[jobs[k] for k in part] for part in np.array_split(order, count)]


def spread_poses(arm: Arm, rng: np.random.Generator, homes: Array, count: int) -> Array:
    """Poses about the two configurations, (count, n)."""
    middle = homes.mean(axis=0)
    wide = np.maximum(0.85 * arm.reach, 0.5 * np.abs(homes[1] - homes[0]))
    return _inside(arm, middle + rng.uniform(-1, 1, (count, arm.count)) * wide)


def _inside(arm: Arm, q: Array) -> Array:
    low, high = arm.limits.T
    margin = 1e-3 * (high - low)
    return np.clip(q, low + margin, high - margin)


def sweep_job(arm: Arm, rng: np.random.Generator, home: Array, joint: int, number: int, plan: Plan) -> Job:
    """One joint there and back over the same uneven steps, past both ends so that senses are sure."""
    count = max(8, plan.sweep_points // (2 * (2 * arm.count + 1)))
    values = _uneven(rng, *_span(arm, home, joint), count)
    over = 0.06 * arm.reach[joint]
    target = int(rng.integers(plan.targets))

    def measure(diary: Diary) -> None:
        diary.move(_with(home, joint, values[0] - over))
        for step, value in enumerate(values):
            diary.point(_with(home, joint, value), "sweep", [target], joint, number, step)
        diary.move(_with(home, joint, values[-1] + over))
        for step in range(count - 1, -1, -1):
            diary.point(_with(home, joint, values[step]), "sweep", [target], joint, number, step)

    return measure


def _moving_job(arm: Arm, rng: np.random.Generator, home: Array, joint: int, number: int, plan: Plan) -> Job:
    """The same, measured while the joint swings through like a pendulum, there and back."""
    low, high = _span(arm, home, joint)
    middle, half = (low + high) / 2, (high - low) / 2
    omega = rng.uniform(0.25, 0.6)
    target = int(rng.integers(plan.targets))
    phases = np.linspace(-0.42 * np.pi, 0.42 * np.pi, 9)

    def measure(diary: Diary) -> None:
        diary.move(_with(home, joint, low))
        for sign in (1.0, -1.0):
            for step, phase in enumerate(phases):
                value, speed = middle + sign * half * np.sin(phase), sign * half * omega * np.cos(phase)
                bend = -sign * half * omega**2 * np.sin(phase)
                unit = np.eye(arm.count)[joint]
                at = step if sign > 0 else len(phases) - 1 - step
                # On the way back other values are passed at the same phase: steps of their own.
                shown = at if sign > 0 else len(phases) + at
                diary.passing(_with(home, joint, value), unit * speed, unit * bend, joint, number, shown, target)
            diary.move(_with(home, joint, high if sign > 0 else low))

    return measure


def pose_job(arm: Arm, rng: np.random.Generator, places: Array, visits: list[tuple[int, int]], plan: Plan) -> Job:
    """Poses one after the other, each reached from a place at a known distance, all targets measured."""

    def measure(diary: Diary) -> None:
        for pose, which in visits:
            away = np.exp(rng.uniform(np.log(0.02), np.log(0.8), arm.count)) * arm.reach
            away[list(plan.held)] = 0.0
            diary.move(_inside(arm, places[which] + away * rng.choice([-1.0, 1.0], arm.count)))
            diary.point(places[which], "pose", list(range(plan.targets)), pose=pose)

    return measure


def _span(arm: Arm, home: Array, joint: int) -> tuple[float, float]:
    low, high = arm.limits[joint]
    over = 0.08 * arm.reach[joint]
    return max(home[joint] - arm.reach[joint], low + over), min(home[joint] + arm.reach[joint], high - over)


def _uneven(rng: np.random.Generator, low: float, high: float, count: int) -> Array:
    """Steps that differ by a quarter, so that no ripple hides between them."""
    values = np.linspace(low, high, count)
    values[1:-1] += rng.uniform(-0.25, 0.25, count - 2) * (values[1] - values[0])
    return values


def _with(home: Array, joint: int, value: float) -> Array:
    out = home.copy()
    out[joint] = value
    return out
