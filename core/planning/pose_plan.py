"""Free poses: out of thousands that the arm may take and the instrument can see, those that tell the most."""

import numpy as np

from core.errors import InputError
from core.geometry import Array
from core.planning.exchange import choose
from core.planning.information import whitened
from core.planning.prior import vague
from core.planning.rounding import rounded
from core.planning.site import Site
from core.planning.visibility import visible

POOL = 3000
"""Poses to choose from, at least ten for each that is wanted."""
ROUNDS = 40
MARGIN = 0.02
"""Share of a joint's range that is kept off its stops at either end."""
SPARE_FREEDOMS = 30
"""Measured coordinates beyond the unknowns, so that the noise can be judged."""


def pose_plan(site: Site, shots: int, rng: np.random.Generator, loss: Array | None = None) -> tuple[Array, np.ndarray]:
    """Choose free poses, one sighting each.

    Args:
        shots: how many.
        loss: of the I-criterion (``Required.loss``); None: D.

    Returns:
        Commands (shots, n) in an order that travels little, and the target that each sights, (shots,).

    Raises:
        InputError: too few shots for all unknowns, or too few poses that can be seen.
    """
    least = least_poses(site)
    if shots < least:
        raise InputError(f"{shots} free poses do not show {site.layout.size} unknowns, expected at least {least}")
    commanded, target = pose_pool(site, max(POOL, 10 * shots), rng)
    chosen = choose(whitened(site, commanded, target), shots, vague(site), rng, loss).index
    order = chosen[travel_order(site, commanded[chosen])]
    return commanded[order], target[order]


def pose_pool(site: Site, count: int, rng: np.random.Generator) -> tuple[Array, np.ndarray]:
    """Random poses that can be taken and seen: commands (count, n), and a target for each, (count,).

    Raises:
        InputError: hardly any target can be seen.
    """
    low, high = site.limits.T
    span = high - low
    seeable = np.flatnonzero(site.placed)
    commands, targets, found = [], [], 0
    for _ in range(ROUNDS):
        q = rounded(site.robot, rng.uniform(low + MARGIN * span, high - MARGIN * span, (count, len(low))))
        target = rng.choice(seeable, count)
        seen = visible(site, q, target)
        commands.append(q[seen])
        targets.append(target[seen])
        found += int(seen.sum())
        if found >= count:
            return np.concatenate(commands)[:count], np.concatenate(targets)[:count]
    raise InputError(
        f"of {ROUNDS * count} random poses {found} show a target to every station, expected {count}: stations stand "
        "too far, too near, or on the wrong side"
    )


def least_poses(site: Site) -> int:
    """How many sightings show all unknowns of the arm and of one target, with some to spare for the noise."""
    of_arm = site.layout.targets.start
    return int(np.ceil((of_arm + 3 + SPARE_FREEDOMS) / 3))


def travel_order(site: Site, commanded: Array) -> np.ndarray:
    """An order of commands (m, n) that goes from the marks always to the nearest pose that is left, (m,)."""
    span = np.where(site.limits[:, 1] > site.limits[:, 0], np.ptp(site.limits, axis=1), 1.0)
    left, here, order = np.arange(len(commanded)), site.centre, []
    while len(left):
        nearest = int(np.argmin(np.abs((commanded[left] - here) / span).max(axis=1)))
        order.append(left[nearest])
        here = commanded[left[nearest]]
        left = np.delete(left, nearest)
    return np.array(order, dtype=int)
