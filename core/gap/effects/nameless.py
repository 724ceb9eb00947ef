"""Smooth functions without a name: of one joint's place, of the sense it came in or the speed it has, of time, of the
configuration, alone or at one joint, of where a point lies in the room.

They stand for whatever the library does not know, and tell where it acts.
"""

import numpy as np

from core.gap.doings import Doings
from core.gap.effects.candidate import ANGLE, LENGTH, Candidate, Column, drive, motors
from core.gap.result import Place
from core.gap.sim import PRODUCTS, Part, Slot
from core.geometry import Array

JOINT, SENSE, SPEED, TURN, TIME = "?joint", "?sense", "?speed", "?turn", "?time"
CONFIGURATION, ROOM, LOAD = "?configuration", "?room", "?load"
BUMPS, TIME_BUMPS, WAVES = 9, 11, 24
SEED = 3
BEND = 1.5e-4
"""Of the room that is taken as likely, m on a metre squared."""


def nameless(doings: Doings) -> list[Candidate]:
    """All of them."""
    out = [_joint(doings, j) for j in motors(doings)]
    if doings.past.complete:
        out += [_sense(doings, j) for j in motors(doings)]
    if doings.speed is not None:
        fastest = np.abs(doings.speed).max(axis=0)
        out += [_speed(doings, j, float(fastest[j])) for j in motors(doings) if fastest[j] > 0]
    out += [_turn(doings, j) for j in motors(doings)]
    if np.ptp(doings.seen.payload_kg) > 0:
        out.append(_load(doings))
    return [*out, _time(), _configuration(doings), _room()]


def _bumps(x: Array, low: float, high: float, count: int) -> Array:
    centres = np.linspace(low, high, count)
    width = max(centres[1] - centres[0], 1e-12)
    return np.exp(-0.5 * ((x[:, None] - centres) / width) ** 2)


def _joint(doings: Doings, joint: int) -> Candidate:
    low, high = doings.active[:, joint].min(), doings.active[:, joint].max()
    own = 3 if doings.seen.chain.sliding[joint] else 0
    size = LENGTH if own else ANGLE

    def columns(doings: Doings) -> list[Column]:
        bumps = _bumps(doings.active[:, joint], low, high, BUMPS)
        return [[(Slot(Part.LINK, joint, own + k), bumps[:, b])] for b in range(BUMPS) for k in range(3)]

    names = tuple(f"bump_{b}_{k}" for b in range(BUMPS) for k in range(3))
    return Candidate(Place(JOINT, joint=joint + 1), "", names, columns, 1, (size,) * len(names))


def _sense(doings: Doings, joint: int) -> Candidate:
    low, high = doings.active[:, joint].min(), doings.active[:, joint].max()

    def columns(doings: Doings) -> list[Column]:
        bumps = doings.sense[:, joint, None] * _bumps(doings.active[:, joint], low, high, BUMPS)
        return [drive(doings, joint, bumps[:, b]) for b in range(BUMPS)]

    names = tuple(f"bump_{b}" for b in range(BUMPS))
    return Candidate(Place(SENSE, joint=joint + 1), "", names, columns, 1, (ANGLE,) * BUMPS)


def _speed(doings: Doings, joint: int, fastest: float) -> Candidate:
    low, high = doings.active[:, joint].min(), doings.active[:, joint].max()

    def columns(doings: Doings) -> list[Column]:
        share = np.zeros(doings.count) if doings.speed is None else doings.speed[:, joint] / fastest
        bumps = share[:, None] * _bumps(doings.active[:, joint], low, high, BUMPS)
        return [drive(doings, joint, bumps[:, b]) for b in range(BUMPS)]

    names = tuple(f"bump_{b}" for b in range(BUMPS))
    return Candidate(Place(SPEED, joint=joint + 1), "", names, columns, 1, (ANGLE,) * BUMPS)


def _time() -> Candidate:
    def columns(doings: Doings) -> list[Column]:
        bumps = _bumps(doings.seen.time, 0.0, 1.0, TIME_BUMPS)
        return [[(Slot(Part.BASE, 0, k), bumps[:, b])] for b in range(TIME_BUMPS) for k in range(6)]

    names = tuple(f"bump_{b}_{k}" for b in range(TIME_BUMPS) for k in range(6))
    return Candidate(
        Place(TIME, variable="time"), "", names, columns, 1, ((ANGLE / 2,) * 3 + (LENGTH,) * 3) * TIME_BUMPS
    )


def swing(times: float) -> Candidate:
    """A base that swings to and fro so many times during all of the measurements."""

    def columns(doings: Doings) -> list[Column]:
        turn = 2 * np.pi * times * doings.seen.time
        return [[(Slot(Part.BASE, 0, k), wave(turn))] for wave in (np.sin, np.cos) for k in range(6)]

    names = tuple(f"{wave}_{k}" for wave in ("sine", "cosine") for k in range(6))
    sizes = ((ANGLE / 2,) * 3 + (LENGTH,) * 3) * 2
    return Candidate(Place(TIME, variable="time"), f"{times:.1f} times to and fro", names, columns, 1, sizes)


def _waves(doings: Doings) -> tuple[Array, Array]:
    rng = np.random.default_rng(SEED)
    span = np.maximum(doings.seen.span, 1e-6)
    low = doings.active.min(axis=0)
    direction = rng.normal(0, 1.8, (WAVES, len(span))) / span
    direction[:, doings.seen.span < 1e-6] = 0.0
    return direction, rng.uniform(0, 2 * np.pi, WAVES) - direction @ low


def _turn(doings: Doings, joint: int) -> Candidate:
    """A joint's error that depends on where others stand as well."""
    direction, phase = _waves(doings)

    def columns(doings: Doings) -> list[Column]:
        waves = np.cos(doings.active @ direction.T + phase)
        return [drive(doings, joint, waves[:, w]) for w in range(WAVES)]

    names = tuple(f"wave_{w}" for w in range(WAVES))
    return Candidate(Place(TURN, joint=joint + 1), "", names, columns, 1, (ANGLE,) * WAVES)


def _room() -> Candidate:
    def columns(doings: Doings) -> list[Column]:
        ones = np.ones(doings.count)
        return [[(Slot(Part.ROOM, p, k), ones)] for p in range(len(PRODUCTS)) for k in range(3)]

    names = tuple(f"bend_{p}_{k}" for p in range(len(PRODUCTS)) for k in range(3))
    return Candidate(Place(ROOM, variable="configuration"), "", names, columns, 1, (BEND,) * len(names))


def _configuration(doings: Doings) -> Candidate:
    direction, phase = _waves(doings)

    def columns(doings: Doings) -> list[Column]:
        waves = np.cos(doings.active @ direction.T + phase)
        return [[(Slot(Part.BASE, 0, 3 + k), waves[:, w])] for w in range(WAVES) for k in range(3)]

    names = tuple(f"wave_{w}_{k}" for w in range(WAVES) for k in range(3))
    return Candidate(Place(CONFIGURATION, variable="configuration"), "", names, columns, 1, (LENGTH,) * len(names))


def _load(doings: Doings) -> Candidate:
    direction, phase = _waves(doings)
    most = max(float(np.abs(doings.seen.payload_kg).max()), 1e-9)

    def columns(doings: Doings) -> list[Column]:
        waves = np.cos(doings.active @ direction[: WAVES // 2].T + phase[: WAVES // 2])
        waves *= doings.seen.payload_kg[:, None] / most
        return [[(Slot(Part.BASE, 0, 3 + k), waves[:, w])] for w in range(WAVES // 2) for k in range(3)]

    names = tuple(f"wave_{w}_{k}" for w in range(WAVES // 2) for k in range(3))
    return Candidate(Place(LOAD, variable="payload"), "", names, columns, 1, (LENGTH,) * len(names))
