"""Worlds: an arm, what is hidden in it and how strongly, and the campaigns that its user would measure."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path

import numpy as np

from tests.benchmarks.withheld.absorbed import CLUTTER, Absorber, raw
from tests.benchmarks.withheld.arms import Arm, arm_named
from tests.benchmarks.withheld.chains import Disturbance, seen_points
from tests.benchmarks.withheld.effects.effect import Effect
from tests.benchmarks.withheld.effects.library import NAMED, Draw
from tests.benchmarks.withheld.effects.lost_motion import Backlash
from tests.benchmarks.withheld.folders import write_campaign
from tests.benchmarks.withheld.noises import NOISES
from tests.benchmarks.withheld.protocols import random_plan, rich_session
from tests.benchmarks.withheld.rigid import Array
from tests.benchmarks.withheld.sessions import Session

LEAST_SHARE = 0.04
"""Of an effect's raw size that has to be left when placement and clutter have absorbed what they can."""
LARGEST = 40.0
"""Size beyond which an effect is no arm's any more: centimetres, or tens of milliradians."""
LEAST_FLANK = 0.15
"""Of the points that have to stand on the flank where fewer do, or play is but another zero."""
TRIES = 60


@dataclass(frozen=True)
class Hidden:
    """One effect at a size."""

    effect: Effect
    size: float

    def disturb(self, session: Session) -> Disturbance:
        return self.effect.disturb(session, self.size)


@dataclass(frozen=True)
class World:
    """One arm on one day."""

    session: Session
    clutter: Array
    """Small errors of every link, (n, 6)."""
    hidden: tuple[Hidden, ...] = ()
    drawn_again: int = 0
    """Worlds thrown away before this one because nothing of the effect could be seen."""

    @property
    def answers(self) -> list[dict[str, object]]:
        """What answers.json says of each hidden effect, the strongest first."""
        return [hidden.effect.answer(self.session) for hidden in self.hidden]

    @cached_property
    def visible(self) -> list[float]:
        """Visible part of each hidden effect alone over the noise."""
        absorber = Absorber(self.session)
        return [absorber.left(shift_m(self.session, hidden)) for hidden in self.hidden]

    def points_m(self, session: Session | None = None) -> Array:
        """Points without noise of the measured rows of a session of this arm, (k, 3)."""
        session = session or self.session
        off = self._clutter_of(session)
        for hidden in self.hidden:
            off = off + hidden.disturb(session)
        return seen_points(session.arm.chain, session.q, session.place_m, session.base, off)[session.measured]

    def _clutter_of(self, session: Session) -> Disturbance:
        return Disturbance(link=np.broadcast_to(self.clutter, (len(session.q), *self.clutter.shape)))


def shift_m(session: Session, hidden: Hidden) -> Array:
    """What a hidden effect alone does to the measured points, (k, 3)."""
    off = hidden.disturb(session)
    points = seen_points(session.arm.chain, session.q, session.place_m, session.base, off)
    return (points - session.nominal_m)[session.measured]


def seen(absorber: Absorber, shift: Array) -> float:
    """What is left of an effect, in standard deviations; 0 if that is too small a part of it to count as seen."""
    left = absorber.left(shift)
    return left if np.isfinite(left) and left >= max(LEAST_SHARE * raw(shift), 1e-4) else 0.0


def hide(session: Session, effect: Effect, gap: float, measure: Callable[[Array], float]) -> Hidden | None:
    """An effect at the size at which its measure is ``gap``; None if there is none."""
    best, miss, size = Hidden(effect, 0.3), np.inf, 0.3
    for _ in range(12):
        now = measure(shift_m(session, Hidden(effect, size)))
        if now == 0.0:
            return None
        if abs(now / gap - 1) < miss:
            best, miss = Hidden(effect, size), abs(now / gap - 1)
        if miss < 0.01:
            break
        size *= float(np.clip(gap / now, 0.05, 20.0))
    # Rounding jumps with its step: a few per cent are as near as it comes.
    return best if miss < 0.05 and best.size < LARGEST and _on_both_flanks(session, best) else None


def _on_both_flanks(session: Session, hidden: Hidden) -> bool:
    if not isinstance(hidden.effect, Backlash):
        return True
    forward = hidden.effect.flank(session, 1e-3 * hidden.size)[session.measured] > 0
    return bool(min(forward.mean(), 1 - forward.mean()) >= LEAST_FLANK)


def hide_seen(
    session: Session, absorber: Absorber, draw: Draw, gap: float, rng: np.random.Generator
) -> tuple[Hidden, int]:
    """An effect drawn until it can be seen, and how many were thrown away.

    Raises:
        ValueError: none of ``TRIES`` draws can be seen on this arm.
    """
    for again in range(TRIES):
        hidden = hide(session, draw(session.arm, rng), gap, partial(seen, absorber))
        if hidden is not None:
            return hidden, again
    raise ValueError(f"no draw of {TRIES} can be seen on {session.arm.key}")


def single_world(arm: Arm, draw: Draw, gap: float, rng: np.random.Generator, **wanted: object) -> World:
    """A world with one effect; ``wanted`` of its session, see ``random_plan``.

    Raises:
        ValueError: it cannot be seen on this arm.
    """
    session = rich_session(arm, rng, random_plan(rng, **wanted))
    hidden, again = hide_seen(session, Absorber(session), draw, gap, rng)
    return World(session, random_clutter(arm, rng), (hidden,), again)


def random_clutter(arm: Arm, rng: np.random.Generator) -> Array:
    return rng.normal(0, CLUTTER, (arm.count, 6))


def needs(*effects: str) -> dict[str, object]:
    """What a session must have for effects to be seen at all: motion, or targets to compare.

    An encoder that knows whole steps would read whole steps: there commands are what is written.
    """
    asked = {"latency": {"in_motion": True}, "target_slip": {"targets": 3}, "quantisation": {"readback": False}}
    return {key: value for effect in effects for key, value in asked.get(effect, {}).items()}


def make_campaign(
    arm: str, effect: str | None, snr: float, seed: int, out_dir: Path | str, noise: str = "stated"
) -> World:
    """Write one campaign folder with one hidden effect, or none, and return its world.

    Args:
        arm: a key of ``ARMS``.
        effect: a name of the contract's table; None: nothing is wrong but the clutter of geometry.
        snr: visible part of the effect over the noise, rms a coordinate.
        noise: a key of ``NOISES``.

    Raises:
        ValueError: the effect cannot be seen on this arm (compliance where nothing hangs, for example).
    """
    rng = np.random.default_rng(seed)
    if effect is None:
        world = World(rich_session(arm_named(arm), rng), random_clutter(arm_named(arm), rng))
    else:
        world = single_world(arm_named(arm), NAMED[effect], snr, rng, **needs(effect))
    points = world.points_m()
    write_campaign(Path(out_dir), world.session, points + NOISES[noise](rng, len(points)), rng)
    return world


def fresh_session(session: Session, rng: np.random.Generator) -> Session:
    """Another day at the same arm: other poses, sweeps, order, base and targets, as many of them."""
    plan = random_plan(rng, bool(session.speed.any()), session.targets, session.readback)
    return rich_session(session.arm, rng, plan)
