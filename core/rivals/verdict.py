"""What a comparison comes to, in words: where this project's methods win, where they lose, and why."""

import numpy as np

from core.rivals.comparison import Comparison, Data, MethodRow, Reference, smaller
from core.rivals.observed import Drives

CLOSE = 1.1
"""A mean error within this factor of the Cramer-Rao bound leaves nothing to a better estimator."""
MOST_NAMED = 3
"""Methods that one sentence names."""


def verdicts(found: Comparison) -> tuple[str, ...]:
    """Sentences, the losses not left out."""
    said = []
    for data in Data:
        own = _best([row for row in found.rows if row.own and row.data is data])
        if own is not None:
            said += _on_the_same(found, own)
    sweeps = _best([row for row in found.rows if row.own and row.data is Data.SWEEPS])
    if sweeps is not None:
        said += [*_against_free_poses(found, sweeps), *_without_functions(found, sweeps)]
    return tuple(said)


def _on_the_same(found: Comparison, own: MethodRow) -> list[str]:
    """One of this project's methods among those that were given the same points."""
    said = [
        f"From the {own.data} this project's best is {own.name!r}: mean position error {_mm(own)} over {found.poses} "
        f"kept-out poses{'' if found.trials == 1 else f' in each of {found.trials} trials'}."
    ]
    bound = next((r for r in found.references if r.bounds), None)
    if bound is not None and own.data is Data.SWEEPS:
        said.append(_against_bound(own, bound))
    others = [row for row in found.rows if not row.own and row.data is own.data]
    better = [row for row in others if smaller(row.position_m, own.position_m)]
    if better:
        said.append(f"On the very same points it loses to {_listed(better)}.")
    elif others:
        level = [row for row in others if not smaller(own.position_m, row.position_m)]
        beside = f", {len(level)} as good within the luck of the trials" if level else ""
        said.append(f"None of {len(others)} other methods on the same points is better{beside}.")
    return said


def _against_bound(own: MethodRow, bound: Reference) -> str:
    ratio, slack = own.position_m.mean / bound.position_m, 2 * own.position_m.mean_std / bound.position_m
    said = f"That is {ratio:.2f} times what the Cramer-Rao bound of its points allows"
    if not np.isfinite(slack):
        return f"{said}; a single trial does not tell more."
    if ratio - slack > CLOSE:
        return f"{said}, more than the luck of the trials explains: the estimator could be better."
    return f"{said} (+- {slack:.2f} by the luck of the trials): what limits it are its points, not the estimator."


def _against_free_poses(found: Comparison, sweeps: MethodRow) -> list[str]:
    """Sweeps beside as many points in free poses."""
    free = [row for row in found.rows if row.data in (Data.POINTS, Data.POSES)]
    better = [row for row in free if smaller(row.position_m, sweeps.position_m)]
    if not better:
        return []
    ratio = sweeps.position_m.mean / min(row.position_m.mean for row in better)
    return [
        f"The sweeps lose to as many points in free poses: {len(better)} of {len(free)} methods that were given those "
        f"are better, the best {ratio:.1f} times: {_listed(better)}. Points that range over all that the joints can do "
        "tell more than sweeps about one pose."
    ]


def _without_functions(found: Comparison, sweeps: MethodRow) -> list[str]:
    """What the methods as published, without drive functions, are left with."""
    plain = [
        row for row in found.rows if not row.own and row.drives is Drives.AS_COMMANDED and row.data is not Data.NONE
    ]
    behind = [row for row in plain if smaller(sweeps.position_m, row.position_m)]
    if not behind:
        return []
    first, last = (pick(behind, key=lambda row: row.position_m.mean) for pick in (min, max))
    return [
        f"The sweeps are better than {len(behind)} of {len(plain)} methods that take the drives at their word, free "
        f"poses included: those come to {_mm(first)} ({first.name}) to {_mm(last)} ({last.name})."
    ]


def _best(rows: list[MethodRow]) -> MethodRow | None:
    return min(rows, key=lambda row: row.position_m.mean, default=None)


def _listed(rows: list[MethodRow]) -> str:
    ordered = sorted(rows, key=lambda row: row.position_m.mean)
    named = [f"{row.label} ({_mm(row)})" for row in ordered[:MOST_NAMED]]
    more = len(ordered) - MOST_NAMED
    last = f"; and {more} more, up to {_mm(ordered[-1])}" if more > 0 else ""
    return "; ".join(named) + last


def _mm(row: MethodRow) -> str:
    return f"{row.position_m.mean * 1e3:.2f} mm"
