"""What a joint loses when its motor turns round: at once (backlash), or over some way (hysteresis)."""

import numpy as np

from core.gap.doings import Doings
from core.gap.effects.candidate import ANGLE, Candidate, Column, drive, motors, unit
from core.gap.result import Place
from core.geometry import Array

FRICTION_SHARES = (0.03, 0.1, 0.2, 0.35, 0.5, 0.7, 0.9)
"""Of the largest load: below it friction holds the joint behind its motor, above it gravity decides."""
BUILD_UP_RAD, BUILD_UP_M = (0.05, 0.15, 0.5), (0.005, 0.015, 0.05)
LEAST_LOAD = 0.1
"""Loads below this turn nothing, N m or N."""
BEGAN = "at_rest_before_it_first_moved"
"""Where in its play a joint stood when the campaign began, nobody knows."""


def backlashes(doings: Doings) -> list[Candidate]:
    """g = q + b/2 on the upper flank, q - b/2 on the lower, which flank by motor or by gravity."""
    if not doings.past.complete:
        return []
    out = []
    for j in motors(doings):
        load = None if doings.drive_load is None else np.abs(doings.drive_load[:, j]).max()
        levels = [np.inf]
        if load is not None and load > LEAST_LOAD:
            levels += [float(share * load) for share in FRICTION_SHARES]
        out += [_backlash(doings, j, level, len(levels)) for level in levels]
    return out


def hystereses(doings: Doings) -> list[Candidate]:
    """A loss that grows with the way since the motor turned round, and with the load.

    What was built up before is lost as the motor turns, or it is given back along the way (``gives_back``).
    """
    if not doings.past.complete:
        return []
    return [_hysteresis(doings, j, gives_back) for j in motors(doings) for gives_back in (False, True)]


def _backlash(doings: Doings, joint: int, friction: float, choices: int) -> Candidate:
    def side(doings: Doings) -> Array:
        return -doings.sense[:, joint] if np.isinf(friction) else doings.past.flank(joint, friction)

    began = bool((side(doings) == 0).any())

    def columns(doings: Doings) -> list[Column]:
        which = side(doings)
        return [drive(doings, joint, one) for one in (which / 2, (which == 0).astype(float))[: 1 + began]]

    of = unit(doings, joint)
    load = "N" if of == "m" else "N m"
    atom = "taken up by the motor" if np.isinf(friction) else f"taken up by loads above {friction:.3g} {load}"
    names = (f"gap_{of}", f"{BEGAN}_{of}")[: 1 + began]
    return Candidate(Place("backlash", joint=joint + 1), atom, names, columns, choices, (ANGLE,) * len(names))


def _hysteresis(doings: Doings, joint: int, gives_back: bool) -> Candidate:
    of = unit(doings, joint)
    ways = BUILD_UP_M if of == "m" else BUILD_UP_RAD
    heavy = 0.0 if doings.drive_load is None else float(np.abs(doings.drive_load[:, joint]).max())
    began = bool((doings.sense[:, joint] == 0).any())

    def not_yet(doings: Doings, way: float) -> Array:
        sense = doings.sense[:, joint]
        if gives_back:
            # Half of it after a long way on the other side: there it is what the other form says.
            return (sense - doings.past.dragged(joint, way)) / 2
        return sense * np.exp(-doings.travel[:, joint] / way)

    def columns(doings: Doings) -> list[Column]:
        sense = doings.sense[:, joint]
        out = [drive(doings, joint, -sense / 2)]
        out += [drive(doings, joint, -not_yet(doings, way) / 2) for way in ways]
        if heavy > LEAST_LOAD and doings.drive_load is not None:
            out.append(drive(doings, joint, -sense / 2 * np.abs(doings.drive_load[:, joint]) / heavy))
        return [*out, drive(doings, joint, (sense == 0).astype(float))] if began else out

    names = [f"loss_{of}"] + [f"not_yet_after_{1e3 * way:g}_{'mm' if of == 'm' else 'mrad'}_{of}" for way in ways]
    if heavy > LEAST_LOAD:
        names.append(f"with_load_{of}")
    names += [f"{BEGAN}_{of}"] * began
    atom = "given back along the way" if gives_back else "lost at once"
    return Candidate(Place("hysteresis", joint=joint + 1), atom, tuple(names), columns, 2, (ANGLE,) * len(names))
