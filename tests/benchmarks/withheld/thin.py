"""Protocols too thin for some questions: an honest program answers what it can and says what it cannot."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tests.benchmarks.withheld.absorbed import SIGMA_M
from tests.benchmarks.withheld.arms import Arm
from tests.benchmarks.withheld.effects.library import NAMED
from tests.benchmarks.withheld.protocols import Plan, pose_job, random_plan, rich_session, spread_poses, sweep_job
from tests.benchmarks.withheld.rigid import Array
from tests.benchmarks.withheld.sessions import Diary, Session, random_base, random_places
from tests.benchmarks.withheld.worlds import TRIES, World, hide, random_clutter

LEAST_SEEN = 0.3
"""Of the noise: an effect below it is not there as far as these data can tell."""
RAW_GAP = 8.0
"""Rms of a thin world's effect over the noise, whether it can be seen or not."""


def one_sweep(arm: Arm, rng: np.random.Generator) -> Session:
    """A single joint, once there and back."""
    plan, joint = Plan(targets=1, sweep_points=60 * arm.count), int(rng.integers(arm.count))
    diary = Diary(arm, rng)
    sweep_job(arm, rng, arm.homes[0], joint, 1, plan)(diary)
    return diary.session(random_places(rng, 1), random_base(rng))


def two_poses(arm: Arm, rng: np.random.Generator) -> Session:
    """Two poses with three targets: hardly more than base and targets need."""
    plan, diary = Plan(targets=3), Diary(arm, rng)
    places = spread_poses(arm, rng, arm.homes, 2)
    pose_job(arm, rng, places, [(0, 0), (1, 1)], plan)(diary)
    return diary.session(random_places(rng, 3), random_base(rng))


def on_axis(arm: Arm, rng: np.random.Generator) -> Session:
    """Every target on the last axis, which shows nothing of the last joint."""
    plan = random_plan(rng)
    session = rich_session(arm, rng, plan)
    last = np.linalg.inv(arm.chain.links[-1])
    heights = np.linspace(0.05, 0.15, plan.targets)
    # On the last joint's axis, in the frame at the last link's end.
    places = heights[:, None] * last[:3, 2] + last[:3, 3]
    return replace(session, places_m=places)


def held_joints(arm: Arm, rng: np.random.Generator) -> Session:
    """Two joints never move."""
    held = tuple(int(j) for j in rng.permutation(np.arange(1, arm.count))[: 2 if arm.count > 4 else 1])
    return rich_session(arm, rng, Plan(held=held))


def no_repeats(arm: Arm, rng: np.random.Generator) -> Session:
    """Every pose once."""
    return rich_session(arm, rng, Plan(targets=1, sweep_points=500, poses=150, repeated=0))


def no_log(arm: Arm, rng: np.random.Generator) -> Session:
    """Rich, but neither moves nor senses of approach will be written."""
    return rich_session(arm, rng)


THIN: dict[str, Callable[[Arm, np.random.Generator], Session]] = {
    "one sweep": one_sweep,
    "two poses": two_poses,
    "no log": no_log,
    "on axis": on_axis,
    "held joints": held_joints,
    "no repeats": no_repeats,
}


def thin_world(arm: Arm, protocol: str, name: str | None, rng: np.random.Generator) -> World:
    """An effect (or none) under a thin protocol, at a fixed size of its raw gap.

    Raises:
        ValueError: the effect does nothing at all in this session.
    """
    session = THIN[protocol](arm, rng)
    if name is None:
        return World(session, random_clutter(arm, rng))
    for again in range(TRIES):
        hidden = hide(session, NAMED[name](arm, rng), RAW_GAP, _rms)
        if hidden is not None:
            return World(session, random_clutter(arm, rng), (hidden,), again)
    raise ValueError(f"{name} does nothing under {protocol} on {arm.key}")


def _rms(shift: Array) -> float:
    size = float(np.sqrt((shift**2).mean()) / SIGMA_M)
    return size if size > 1e-4 else 0.0
