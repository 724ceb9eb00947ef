"""What a grid of candidates finds roughly, found sharply: the order of a mesh, the moment of a shift."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from core.gap.doings import Doings
from core.gap.effects import drives, instrument, thermal
from core.gap.effects.candidate import Candidate
from core.gap.effects.thermal import Thermal, WarmUp, warmed
from core.gap.encoder_steps import settled_steps
from core.gap.library import joint_alone
from core.gap.sim import Part, Sim, Slot
from core.geometry import Array

FINER, FEWEST = 25, 4
WARM_UP = (0.02, 3.0)
"""The range of time constants of warming up, as shares of the whole time."""
OF_THE_BASE = frozenset({"drift", "base_shift", "thermal"})
"""What moves everything as time goes by."""


def sharpened(
    sim: Sim, doings: Doings, chosen: Sequence[Candidate], left_m: Array, own_m: Sequence[Array], weight: Array
) -> list[Candidate]:
    """Better atoms for chosen candidates.

    Args:
        left_m: residuals after everything chosen, (m, 3).
        own_m: what each chosen candidate moves, (m, 3) each.
        weight: of each point, 1/m^2, 0: left out, (m,).
    """
    out = []
    # Points beside a moment that was missed look like outliers: they are what it is found by.
    every = doings.seen.fitted * np.where(weight > 0, weight, weight.max())
    for candidate, own in zip(chosen, own_m, strict=True):
        place = candidate.place
        if drives.order_of(candidate) is not None:
            # Between two orders of the grid both are chosen: each is found anew without the other.
            near = [part for one, part in zip(chosen, own_m, strict=True) if _neighbours(doings, one, candidate)]
            out += _periodic(sim, doings, candidate, left_m + sum(near), weight)
        elif isinstance(candidate, Thermal):
            # Two laws of one link stand for one in between: both are found anew without the other.
            same = [part for one, part in zip(chosen, own_m, strict=True) if one.place.same_as(place)]
            out += _warmed(sim, doings, candidate, left_m + sum(same), weight)
        elif isinstance(candidate, drives.EncoderSteps):
            # A point on the wrong side of an edge looks like an outlier: it is what edges are found by.
            out.append(settled_steps(sim, doings, candidate, left_m + own, every))
        elif place.effect == "base_shift":
            out.append(_shift(sim, doings, place.record, left_m + own, every, None))
        elif place.effect == "target_slip":
            names = [target.name for target in doings.seen.campaign.targets]
            out.append(_shift(sim, doings, place.record, left_m + own, every, names.index(place.target)))
    timed = [own for candidate, own in zip(chosen, own_m, strict=True) if candidate.place.effect in OF_THE_BASE]
    if timed:
        # A great shift between two moments of the grid looks like anything else that time does.
        out.append(_shift(sim, doings, None, left_m + sum(timed), every, None))
    return out


def _neighbours(doings: Doings, one: Candidate, other: Candidate) -> bool:
    """Whether two periodic errors are one that lies between orders of the grid, or the same."""
    if not one.place.same_as(other.place):
        return False
    apart = abs(drives.order_of(one) - drives.order_of(other))
    return apart < 1.5 * drives.order_step(doings, other.place.joint - 1)


def _periodic(sim: Sim, doings: Doings, candidate: Candidate, aim_m: Array, weight: Array) -> list[Candidate]:
    """The order between the neighbours on the grid at which a periodic error explains most, under all its names."""
    joint, order = candidate.place.joint - 1, drives.order_of(candidate)
    part = candidate.columns(doings)[0][0][0].part
    told = doings.uncoupled if part is Part.JOINT else doings
    field = sim.fields([Slot(part, joint)])
    x = told.active[:, joint]
    orders = order + drives.order_step(told, joint) * np.linspace(-1.0, 1.0, FINER)
    orders = orders[orders > (0.0 if told.seen.chain.sliding[joint] else 1.5)]
    gains = [_explained([np.sin(k * x), np.cos(k * x)], field, aim_m, weight) for k in orders]
    found = drives.periodic(candidate, told, float(orders[int(np.argmax(gains))]))
    return [replace(joint_alone(one), choices=one.choices) for one in found] if part is Part.JOINT else found


def _warmed(sim: Sim, doings: Doings, candidate: Thermal, aim_m: Array, weight: Array) -> list[Candidate]:
    """The time constant with which links explain most as they warm up, for each of them and all."""
    elapsed = doings.elapsed_s
    if elapsed is None or not np.ptp(elapsed) > 0:
        return []
    constants = np.ptp(elapsed) * np.geomspace(*WARM_UP, thermal.SHARPER)
    laws = [WarmUp(float(c), at_work) for c in constants for at_work in (False, True)[: 1 + doings.rested]]
    rises = [law(doings) for law in laws]
    grown = _grown(sim, doings, candidate)
    gains = [_explained([rise], grown, aim_m, weight) for rise in rises]
    return warmed(doings, laws[int(np.argmax(gains))])


def _grown(sim: Sim, doings: Doings, candidate: Thermal) -> Array:
    """What each number of thermal growth moves where everything is warm, (m, 3, k)."""
    links = [int(name.split("_")[3]) - 1 for name in candidate.names if name.startswith("growth_of_link")]
    steps = doings.seen.chain.link_transforms[:, :3, 3]
    fields = [sim.fields([Slot(Part.BEYOND, i, 3 + c) for c in range(3)]) @ steps[i] for i in links]
    return np.stack(fields, axis=2)


def _shift(sim: Sim, doings: Doings, record: int | None, aim_m: Array, weight: Array, target: int | None) -> Candidate:
    """The record at which the change explains most: between the neighbours on the grid, or anywhere."""
    seen = doings.seen
    slots = (
        [Slot(Part.BASE, 0, k) for k in range(6)]
        if target is None
        else [Slot(Part.TARGET, target, k) for k in range(3)]
    )
    fields = sim.fields(slots) * np.sqrt(weight)[:, None, None]
    aim = aim_m * np.sqrt(weight)[:, None]
    squares = np.cumsum(np.einsum("mck,mcl->mkl", fields, fields)[::-1], axis=0)[::-1]
    pulls = np.cumsum(np.einsum("mck,mc->mk", fields, aim)[::-1], axis=0)[::-1]
    # What happened while nobody looked is told from the record on at which it was seen.
    rows = np.arange(seen.count) if target is None else np.flatnonzero(seen.target == target)
    # What only a few points on one side speak for is no change, but an outlier among them.
    edge = max(min(FEWEST, (len(rows) - 1) // 2), 1)
    starts = rows[edge : len(rows) - edge + 1]
    if record is not None:
        near = np.abs(seen.record[starts] - record) <= np.ptp(seen.record) * 2.0 / instrument.MOMENTS
        starts = starts[near] if near.any() else starts
    # The part before the change is free as well: placement has already met both halves in the middle.
    before, pulls_before = squares[0] - squares[starts], pulls[0] - pulls[starts]
    ridge = 1e-9 * np.trace(squares[0]) * np.eye(len(slots))
    gains = _gain(squares[starts] + ridge, pulls[starts]) + _gain(before + ridge, pulls_before)
    best = int(seen.record[starts[int(np.argmax(gains))]])
    if target is None:
        return instrument.base_shift(best, instrument.MOMENTS)
    return instrument.target_slip(doings, target, best, instrument.MOMENTS)


def _gain(square: Array, pull: Array) -> Array:
    return np.einsum("rk,rk->r", pull, np.linalg.solve(square, pull[:, :, None])[:, :, 0])


def _explained(features: list[Array], fields: Array, aim_m: Array, weight: Array) -> float:
    """Energy that features, and constants beside them, explain by what they move: fields (m, 3, k)."""
    parts = [fields * f[:, None, None] for f in (*features, np.ones_like(features[0]))]
    columns = np.concatenate(parts, axis=2)
    flat = (columns * np.sqrt(weight)[:, None, None]).reshape(-1, columns.shape[2])
    aim = (aim_m * np.sqrt(weight)[:, None]).ravel()
    square = flat.T @ flat
    pull = flat.T @ aim
    return float(pull @ np.linalg.solve(square + 1e-12 * np.trace(square) * np.eye(len(square)), pull))
