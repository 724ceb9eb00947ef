"""Where the base stands and where the targets sit: the only things fitted before real and sim are compared.

For a given direction of the base the rest is linear (base position and unknown targets), so a grid of directions
gives starts that no bad guess can spoil; the best of them are then refined together.
"""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from core.gap.observations import Observations
from core.gap.sim import Part, Sim, Slot, _move
from core.geometry import Array, apply, rigid_fit, transform
from core.kinematics import link_frames

STARTS, REFINED, ROUNDS = 120, 6, 25
SEARCHED_POINTS = 400
WEAK = 1e-9
"""Of the largest curvature: what the points say nothing of stays where it is."""
LOOSE, DAMPED = 1e-4, (1e-6, 1.0)
"""The same while the base's direction is a guess, which must not send targets away along nearly parallel axes; first
and largest damping of the steps from there."""


def place(seen: Observations, weights: Array) -> Sim:
    """The sim with its base and its unknown targets placed by least squares.

    Args:
        weights: of each point, (m,); 0: not fitted.
    """
    if seen.simulated_m is not None:
        return _place_simulated(seen, weights)
    fitted = np.flatnonzero(weights > 0)
    some = fitted[:: max(1, len(fitted) // SEARCHED_POINTS)]
    starts = sorted(
        (_linear_rest(seen.part(some), weights[some], turn) for turn in _directions()), key=lambda found: found[0]
    )
    refined = [_refined(sim, weights[some]) for _, sim in starts[:REFINED]]
    best = min(refined, key=lambda sim: _misfit(sim, weights[some]))
    whole = replace(best, seen=seen, middle_m=seen.point_m.mean(axis=0))
    return replace(_refined(whole.part(fitted), weights[fitted]), seen=seen)


def placement_slots(seen: Observations) -> list[Slot]:
    """The small motions that placing leaves free: the base's, and those of targets whose place is not known."""
    if seen.simulated_m is not None and not seen.campaign.place_simulated:
        return []
    slots = [Slot(Part.BASE, 0, k) for k in range(6)]
    if seen.simulated_m is not None:
        return slots
    return slots + [Slot(Part.TARGET, int(t), k) for t in _unknown_targets(seen) for k in range(3)]


def placement_priors(seen: Observations, slots: list[Slot]) -> Array:
    """Standard uncertainty of each placement motion before any point is seen, rad or m; infinite: free."""
    targets = seen.campaign.targets
    known = {t: target.sigma_m for t, target in enumerate(targets) if target.point_m is not None}
    return np.array([known.get(s.index, np.inf) if s.part is Part.TARGET else np.inf for s in slots])


def _unknown_targets(seen: Observations) -> list[int]:
    return [
        int(t)
        for t in np.unique(seen.target)
        if seen.campaign.targets[t].point_m is None or seen.campaign.targets[t].sigma_m > 0
    ]


def _directions() -> list[Array]:
    return [*Rotation.random(STARTS, random_state=7).as_matrix(), np.eye(3)]


def _likely_places(seen: Observations) -> Array:
    """Where targets are said to be; those of which nobody knows are near the tool, or halfway along their link.

    It matters along parallel axes alone, where nothing tells a higher base from lower targets.
    """
    ends_m, last = seen.chain.link_transforms[:, :3, 3], seen.chain.joint_count
    likely = (
        ends_m[t.link - 1] / (1 if t.link == last else 2) if t.link else np.zeros(3) for t in seen.campaign.targets
    )
    return np.array([t.point_m or tuple(place) for t, place in zip(seen.campaign.targets, likely, strict=True)])


def _linear_rest(seen: Observations, weights: Array, turn: Array) -> tuple[float, Sim]:
    """Base position and unknown targets for one direction of the base, and the misfit."""
    frames = link_frames(seen.chain, seen.net)[np.arange(seen.count), seen.link - 1]
    rotation, origin = turn @ frames[:, :3, :3], frames[:, :3, 3] @ turn.T
    unknown = [t for t in np.unique(seen.target) if seen.campaign.targets[t].point_m is None]
    places = _likely_places(seen)
    rest = seen.point_m - origin - (rotation @ places[seen.target][:, :, None])[:, :, 0]
    columns = np.zeros((seen.count, 3, 3 + 3 * len(unknown)))
    columns[:, :, :3] = np.eye(3)
    for k, t in enumerate(unknown):
        columns[:, :, 3 + 3 * k : 6 + 3 * k] = np.where((seen.target == t)[:, None, None], rotation, 0.0)
    root = np.sqrt(weights)[:, None]
    flat = (columns * root[:, :, None]).reshape(-1, columns.shape[2])
    square = flat.T @ flat
    ridge = np.where(np.arange(len(square)) < 3, WEAK, LOOSE)
    square[np.diag_indices_from(square)] += ridge * max(np.trace(square), 1e-300)
    found = np.linalg.solve(square, flat.T @ (rest * root).ravel())
    for k, t in enumerate(unknown):
        places[t] += found[3 + 3 * k : 6 + 3 * k]
    misfit = float(np.sum(((rest - columns @ found) * root) ** 2))
    return misfit, Sim(seen, transform(turn, found[:3]), places, seen.point_m.mean(axis=0))


def _misfit(sim: Sim, weights: Array) -> float:
    return float(np.sum(weights[:, None] * (sim.seen.point_m - sim.points_m()) ** 2))


def _refined(sim: Sim, weights: Array) -> Sim:
    """Steps of Levenberg and Marquardt on base and targets together."""
    slots = placement_slots(sim.seen)
    priors = placement_priors(sim.seen, slots)
    stated = _likely_places(sim.seen)
    precision = np.where(np.isfinite(priors), 1.0 / np.maximum(priors, 1e-9) ** 2, 0.0)
    misfit, damping = _misfit(sim, weights), DAMPED[0]
    for _ in range(ROUNDS):
        fields = sim.fields(slots)
        square = np.einsum("mck,m,mcl->kl", fields, weights, fields, optimize=True)
        pull = np.einsum("mck,m,mc->k", fields, weights, sim.seen.point_m - sim.points_m(), optimize=True)
        pull -= precision * _away(sim, stated, slots)
        square += np.diag(precision + damping * np.trace(square) / len(square))
        moved = with_placement(sim, slots, np.linalg.solve(square, pull))
        now = _misfit(moved, weights)
        if now < misfit:
            settled = misfit - now < 1e-10 * misfit
            sim, misfit, damping = moved, now, max(damping / 30, WEAK)
            if settled:
                break
        elif damping > DAMPED[1]:
            break
        else:
            damping *= 30
    return sim


def _away(sim: Sim, stated: Array, slots: list[Slot]) -> Array:
    """How far targets are from where they are said to be, (k,)."""
    away = sim.target_m - stated
    return np.array([away[s.index, s.axis] if s.part is Part.TARGET else 0.0 for s in slots])


def with_placement(sim: Sim, slots: list[Slot], step: Array) -> Sim:
    """The sim with its base and targets moved by small motions, (k,)."""
    twist, target_m = np.zeros(6), sim.target_m.copy()
    for slot, value in zip(slots, step, strict=True):
        if slot.part is Part.BASE:
            twist[slot.axis] += value
        elif slot.part is Part.TARGET:
            target_m[slot.index, slot.axis] += value
    corners = np.vstack([np.zeros(3), np.eye(3)])
    moved = _move(np.tile(twist, (4, 1)), corners - sim.middle_m) + sim.middle_m
    motion = transform((moved[1:] - moved[0]).T, moved[0])
    placed = None if sim.simulated_to_instrument is None else motion @ sim.simulated_to_instrument
    return replace(sim, base=motion @ sim.base, target_m=target_m, simulated_to_instrument=placed)


def _place_simulated(seen: Observations, weights: Array) -> Sim:
    """Another simulator's points, placed if the campaign asks for it, with the chain brought to where they are."""
    assert seen.simulated_m is not None
    fitted = weights > 0
    placed = None
    if seen.campaign.place_simulated:
        placed = rigid_fit(seen.simulated_m[fitted], seen.point_m[fitted], weights[fitted])
    points = seen.simulated_m if placed is None else apply(placed, seen.simulated_m)
    table = replace(
        seen.campaign.measurements,
        point_m=_spread(seen, points),
        simulated_point_m=None,
    )
    as_chain = Observations(
        replace(seen.campaign, measurements=table), seen.chain, seen.rows, seen.active, seen.net, seen.sim
    )
    chain = place(as_chain, weights)
    return replace(chain, seen=seen, simulated_to_instrument=placed)


def _spread(seen: Observations, points: Array) -> Array:
    out = seen.campaign.measurements.point_m.copy()
    out[seen.rows] = points
    return out
