"""Cases made by MuJoCo, as strong as asked."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tests.benchmarks.withheld.absorbed import Absorber
from tests.benchmarks.withheld.arms import Arm
from tests.benchmarks.withheld.chains import Disturbance, seen_points
from tests.benchmarks.withheld.loads import Masses, nominal_masses, true_masses, usual_torques
from tests.benchmarks.withheld.made import Made
from tests.benchmarks.withheld.physics.bodies import Springs, build
from tests.benchmarks.withheld.physics.equilibrium import resting_frames
from tests.benchmarks.withheld.physics.play import Track
from tests.benchmarks.withheld.protocols import Plan, random_plan, rich_session
from tests.benchmarks.withheld.rigid import Array
from tests.benchmarks.withheld.sessions import Session
from tests.benchmarks.withheld.worlds import LEAST_FLANK, random_clutter, seen

TRIES = 10
SHORT = Plan(targets=2, sweep_points=300, poses=60, repeated=8, visits=5)
"""Play is stepped in time and so gets fewer moves."""


@dataclass(frozen=True)
class Elastic:
    """What gives way at size 1, about a milliradian at the usual load, under which masses."""

    answer: dict[str, object]
    springs: Callable[[float], Springs]
    masses: Masses


def physics_made(arm: Arm, effect: str, gap: float, rng: np.random.Generator) -> Made:
    """A campaign with ``compliance``, ``flexure``, ``payload`` or ``backlash`` out of MuJoCo.

    Raises:
        ValueError: no draw can be seen on this arm.
    """
    draw = {"compliance": _elastic, "flexure": _elastic, "payload": _payload, "backlash": _play}[effect]
    for again in range(TRIES):
        made = draw(arm, effect, gap, rng)
        if made is not None:
            session, points, answer, visible = made
            return Made(session, points, [answer], [], [visible], again)
    raise ValueError(f"no {effect} of {TRIES} can be seen on {arm.key}")


Drawn = tuple[Session, Array, dict[str, object], float] | None


def _elastic(arm: Arm, effect: str, gap: float, rng: np.random.Generator) -> Drawn:
    session, clutter = rich_session(arm, rng, random_plan(rng)), random_clutter(arm, rng)
    elastic = (_soft_joint if effect == "compliance" else _soft_link)(arm, rng)
    rigid = _rigid_points(session, clutter)

    def shift(size: float) -> Array:
        return _resting_points(session, clutter, elastic.masses, elastic.springs(size)) - rigid

    return _sized(session, rigid, shift, gap, elastic.answer)


def _payload(arm: Arm, effect: str, gap: float, rng: np.random.Generator) -> Drawn:
    """Every joint gives way; the sim knows that, but not what hangs there: the difference of two equilibria."""
    session, clutter = rich_session(arm, rng, random_plan(rng)), random_clutter(arm, rng)
    stiffness = 1 / (4 * arm.softness * rng.uniform(0.8, 1.2, arm.count))
    written = nominal_masses(arm)
    heavier = 1 + float(rng.choice([-1, 1]) * rng.uniform(0.5, 1.0))
    real = Masses(written.links_kg, written.centres_m, heavier, arm.payload_m + rng.normal(0, 0.03, 3))

    def shift(size: float) -> Array:
        springs = Springs(dict(enumerate(stiffness / size)))
        resting = [_resting_points(session, clutter, masses, springs) for masses in (real, written)]
        return resting[0] - resting[1]

    return _sized(session, _rigid_points(session, clutter), shift, gap, {"effect": "payload"})


def _play(arm: Arm, effect: str, gap: float, rng: np.random.Generator) -> Drawn:
    session, clutter = rich_session(arm, rng, SHORT), random_clutter(arm, rng)
    joint, usual = int(rng.integers(arm.count)), usual_torques(arm)
    friction = float(rng.uniform(0.35, 1.3) * max(usual[joint], 0.1 * usual.max()))
    flank = _flanks(session, clutter, true_masses(arm, rng), joint, friction)
    forward = (flank > 0)[session.measured].mean()
    if min(forward, 1 - forward) < LEAST_FLANK:
        return None

    def shift(size: float) -> Array:
        turn = np.zeros(session.q.shape)
        turn[:, joint] = 1e-3 * size * flank
        return _rigid_points(session, clutter, turn) - _rigid_points(session, clutter)

    answer = {"effect": "backlash", "joint": joint + 1}
    return _sized(session, _rigid_points(session, clutter), shift, gap, answer)


def _flanks(session: Session, clutter: Array, masses: Masses, joint: int, friction: float) -> Array:
    """By play of 2 mrad, with the load that each part of the session carries."""
    springs = Springs(loose=joint, friction=friction)
    out = np.empty(len(session.q))
    changes = np.flatnonzero(np.diff(session.payload_kg, prepend=np.nan, append=np.nan) != 0)
    for start, stop in pairwise(changes):
        bodies = build(session.arm, clutter, masses, float(session.payload_kg[start]), springs)
        out[start:stop] = Track(bodies, joint, 1e-3).flanks(session.q[start:stop])
    return out


def _soft_joint(arm: Arm, rng: np.random.Generator) -> Elastic:
    usual = usual_torques(arm)
    joint = int(rng.choice(np.flatnonzero(usual > 0.02 * usual.max())))
    answer = {"effect": "compliance", "joint": joint + 1}
    return Elastic(answer, lambda size: Springs({joint: 1e3 * usual[joint] / size}), true_masses(arm, rng))


def _soft_link(arm: Arm, rng: np.random.Generator) -> Elastic:
    long = np.flatnonzero(np.linalg.norm(arm.chain.links[:-1, :3, 3], axis=1) > 0.09)
    link, usual = int(rng.choice(long)), usual_torques(arm).max()
    twist, side, other = 1e3 * usual * np.array([rng.uniform(2, 6), rng.uniform(0.7, 1.4), rng.uniform(0.7, 1.4)])

    def springs(size: float) -> Springs:
        return Springs(link=link, bending=(twist / size, side / size, other / size))

    return Elastic({"effect": "flexure", "joint": link + 1}, springs, true_masses(arm, rng))


def _resting_points(session: Session, clutter: Array, masses: Masses, springs: Springs) -> Array:
    """Measured points at rest, (k, 3): each load has bodies of its own."""
    rows = np.flatnonzero(session.measured)
    out = np.empty((len(rows), 3))
    for load in np.unique(session.payload_kg[rows]):
        mine = session.payload_kg[rows] == load
        bodies = build(session.arm, clutter, masses, float(load), springs)
        stands, which = np.unique(session.q[rows[mine]], axis=0, return_inverse=True)
        frames = resting_frames(bodies, stands)[which.ravel()]
        local = session.place_m[rows[mine]]
        out[mine] = np.einsum("mij,mj->mi", frames[:, :3, :3], local) + frames[:, :3, 3]
    return out @ session.base[:3, :3].T + session.base[:3, 3]


def _rigid_points(session: Session, clutter: Array, turn: Array | None = None) -> Array:
    link = np.broadcast_to(clutter, (len(session.q), *clutter.shape))
    off = Disturbance(turn=turn, link=link)
    return seen_points(session.arm.chain, session.q, session.place_m, session.base, off)[session.measured]


def _sized(
    session: Session, rigid: Array, shift: Callable[[float], Array], gap: float, answer: dict[str, object]
) -> Drawn:
    """Points with an effect at the size that is asked for; None if it cannot be seen."""
    absorber, size = Absorber(session), 0.5
    for _ in range(4):
        moved = shift(size)
        now = seen(absorber, moved)
        if now == 0.0 or size > 40:
            return None
        if abs(now / gap - 1) < 0.02:
            return session, rigid + moved, answer, now
        size *= gap / now
    return None
