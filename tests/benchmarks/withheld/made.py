"""One case turned into points and truth."""

from contextlib import suppress
from dataclasses import asdict, dataclass, field

import numpy as np

from tests.benchmarks.withheld.absorbed import Absorber
from tests.benchmarks.withheld.arms import arm_named
from tests.benchmarks.withheld.cases import Case
from tests.benchmarks.withheld.effects.library import NAMED
from tests.benchmarks.withheld.effects.strangers import STRANGERS
from tests.benchmarks.withheld.mixing import cluttered_world, mixture_world
from tests.benchmarks.withheld.protocols import rich_session
from tests.benchmarks.withheld.rigid import Array
from tests.benchmarks.withheld.sessions import Session
from tests.benchmarks.withheld.thin import LEAST_SEEN, thin_world
from tests.benchmarks.withheld.worlds import World, fresh_session, needs, random_clutter, single_world

PASSING = {"drift", "base_shift", "target_slip", "hvac", "walk"}
"""Events of one day: another day, with base and targets placed anew, knows nothing of them."""
DAYS = 5
"""Sessions tried before a case is given up."""


@dataclass(frozen=True)
class Made:
    """A campaign and what is true of it."""

    session: Session
    point_m: Array
    """Without noise, measured rows, (k, 3)."""
    effects: list[dict[str, object]]
    """Entries of answers.json."""
    also: list[dict[str, object]] = field(default_factory=list)
    """True as well, but too small to be asked for."""
    visible: list[float] = field(default_factory=list)
    """Visible part of each effect over the noise."""
    drawn_again: int = 0
    fresh: tuple[Session, Array] | None = None
    """Another day at the same arm and its points without noise; None where that says nothing."""


def make(case: Case) -> Made:
    """The campaign of a case; the same every time.

    Raises:
        ValueError: the effect cannot be seen on this arm.
    """
    for day in range(DAYS - 1):
        # Where nothing can be seen in one session, another may show it.
        with suppress(ValueError):
            return _make(case, np.random.default_rng([case.seed, day]))
    return _make(case, np.random.default_rng([case.seed, DAYS - 1]))


def _make(case: Case, rng: np.random.Generator) -> Made:
    if case.kind == "physics":
        # MuJoCo is an extra of the tests: only these cases need it.
        from tests.benchmarks.withheld.physics.worlds import physics_made

        return physics_made(arm_named(case.arm), case.effects[0], case.gap, rng)
    world = _world(case, rng)
    answers, also = world.answers, []
    if case.kind == "cluttered":
        answers, also = answers[:1], answers[1:]
    if case.kind == "thin" and (not answers or world.visible[0] < LEAST_SEEN):
        answers, also = [], answers
    return Made(
        world.session, world.points_m(), answers, also, world.visible, world.drawn_again, _fresh(case, world, rng)
    )


def _world(case: Case, rng: np.random.Generator) -> World:
    arm = arm_named(case.arm)
    if case.kind == "nothing":
        return World(rich_session(arm, rng), random_clutter(arm, rng))
    if case.kind == "thin":
        return thin_world(arm, case.protocol, case.effects[0] if case.effects else None, rng)
    if case.kind == "mixture":
        first, second = case.effects
        return mixture_world(arm, (first, second), case.gap, rng)
    if case.kind == "cluttered":
        return cluttered_world(arm, case.effects[0], case.gap, rng)
    draw = STRANGERS[case.effects[0]] if case.kind == "other" else NAMED[case.effects[0]]
    return single_world(arm, draw, case.gap, rng, **needs(*case.effects))


def _fresh(case: Case, world: World, rng: np.random.Generator) -> tuple[Session, Array] | None:
    named = {str(answer["effect"]) for answer in world.answers}
    if case.kind not in ("single", "cluttered", "mixture") or named & PASSING:
        return None
    session = fresh_session(world.session, rng)
    return session, world.points_m(session)


def gap_of(session: Session, point_m: Array) -> float:
    """Visible part of everything wrong in a session, clutter included, over the noise."""
    return Absorber(session).left(point_m - session.nominal_m[session.measured])


def truth_of(case: Case, made: Made) -> dict[str, object]:
    """What goes into truth.json."""
    return {
        **asdict(case),
        "answers": made.effects,
        "also": made.also,
        "visible": made.visible,
        "visible_in_all": gap_of(made.session, made.point_m),
        "drawn_again": made.drawn_again,
        "targets": made.session.targets,
        "points": int(made.session.measured.sum()),
        "records": len(made.session.q),
        "in_motion": bool(made.session.speed.any()),
        "readback": made.session.readback,
    }
