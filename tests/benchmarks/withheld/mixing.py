"""Worlds with more than one hidden effect: two of like strength, or one among four small ones."""

import numpy as np

from tests.benchmarks.withheld.absorbed import Absorber
from tests.benchmarks.withheld.arms import Arm
from tests.benchmarks.withheld.effects.library import NAMED
from tests.benchmarks.withheld.protocols import random_plan, rich_session
from tests.benchmarks.withheld.worlds import TRIES, Hidden, World, hide_seen, needs, random_clutter, shift_m

MOST_ALIKE = 0.5
"""Cosine beyond which two effects are hardly two."""
SMALL = 4
"""Effects around the main one."""


def mixture_world(arm: Arm, names: tuple[str, str], gap: float, rng: np.random.Generator) -> World:
    """Two effects that differ, the second 0.4 to 1 of the first.

    Raises:
        ValueError: no two draws of them can be seen and told apart on this arm.
    """
    session = rich_session(arm, rng, random_plan(rng, **needs(*names)))
    absorber, again = Absorber(session), 0
    for _ in range(TRIES):
        first, lost = hide_seen(session, absorber, NAMED[names[0]], gap, rng)
        second, lost_too = hide_seen(session, absorber, NAMED[names[1]], gap * rng.uniform(0.4, 1.0), rng)
        again += lost + lost_too
        if abs(absorber.alike(shift_m(session, first), shift_m(session, second))) < MOST_ALIKE:
            return World(session, random_clutter(arm, rng), (first, second), again)
        again += 1
    raise ValueError(f"{' and '.join(names)} are one and the same on {arm.key}")


def cluttered_world(arm: Arm, name: str, gap: float, rng: np.random.Generator) -> World:
    """One effect first, then four others of 5 to 20 % of its strength each.

    Raises:
        ValueError: the main one cannot be seen on this arm.
    """
    session = rich_session(arm, rng, random_plan(rng, **needs(name)))
    absorber = Absorber(session)
    main, again = hide_seen(session, absorber, NAMED[name], gap, rng)
    around: list[Hidden] = []
    for other in rng.permutation([other for other in NAMED if other != name]):
        if len(around) == SMALL:
            break
        try:
            small, lost = hide_seen(session, absorber, NAMED[str(other)], gap * rng.uniform(0.05, 0.2), rng)
        except ValueError:
            # This arm or session cannot show it: another takes its place.
            continue
        around.append(small)
        again += lost
    return World(session, random_clutter(arm, rng), (main, *around), again)
