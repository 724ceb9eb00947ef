"""Worlds: an arm, what is hidden in it and how strongly, and the campaigns that its user would measure."""

from dataclasses import dataclass, field
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
    visible: tuple[float, ...] = ()
    """Gap over noise of each hidden effect alone."""
    drawn_again: int = 0
    """Worlds thrown away before this one because nothing of the effect could be seen."""
    answers: list[dict[str, object]] = field(default_factory=list)

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


def hide(session: Session, absorber: Absorber, effect: Effect, gap: float) -> Hidden | None:
    """An effect at the size at which its visible part is ``gap`` times the noise; None if too little can be seen."""
    hidden = Hidden(effect, 0.3)
    for _ in range(12):
        shift = shift_m(session, hidden)
        left = absorber.left(shift)
        if not np.isfinite(left) or left < LEAST_SHARE * raw(shift) or left < 1e-4:
            return None
        if abs(left / gap - 1) < 0.01:
            return hidden if hidden.size < LARGEST and _on_both_flanks(session, hidden) else None
        hidden = Hidden(effect, hidden.size * float(np.clip(gap / left, 0.05, 20.0)))
    return None


def _on_both_flanks(session: Session, hidden: Hidden) -> bool:
    if not isinstance(hidden.effect, Backlash):
        return True
    forward = hidden.effect.flank(session, 1e-3 * hidden.size)[session.measured] > 0
    return bool(min(forward.mean(), 1 - forward.mean()) >= LEAST_FLANK)


def single_world(
    arm: Arm, draw: Draw, gap: float, rng: np.random.Generator, in_motion: bool = False, targets: int | None = None
) -> World:
    """A world with one effect, drawn again until it can be seen.

    Raises:
        ValueError: none of ``TRIES`` draws can be seen on this arm.
    """
    session = rich_session(arm, rng, random_plan(rng, in_motion, targets))
    absorber = Absorber(session)
    for again in range(TRIES):
        effect = draw(arm, rng)
        hidden = hide(session, absorber, effect, gap)
        if hidden is not None:
            visible = (absorber.left(shift_m(session, hidden)),)
            return World(session, random_clutter(arm, rng), (hidden,), visible, again, [effect.answer(session)])
    raise ValueError(f"no draw of {TRIES} can be seen on {arm.key}")


def random_clutter(arm: Arm, rng: np.random.Generator) -> Array:
    return rng.normal(0, CLUTTER, (arm.count, 6))


def needs(effect: str) -> dict[str, object]:
    """What a session must have for an effect to be seen at all: motion, or targets to compare."""
    return {"latency": {"in_motion": True}, "target_slip": {"targets": 3}}.get(effect, {})


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
    write_world(Path(out_dir), world, rng, noise)
    return world


def write_world(
    folder: Path,
    world: World,
    rng: np.random.Generator,
    noise: str = "stated",
    session: Session | None = None,
    history: bool = True,
) -> None:
    """Write the campaign that a user measures in a world (or another session of its arm)."""
    session = session or world.session
    points = world.points_m(session)
    write_campaign(folder, session, points + NOISES[noise](rng, len(points)), rng, history)
