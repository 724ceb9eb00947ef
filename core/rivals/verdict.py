"""What a comparison comes to, in words: where this project's methods win, where they lose, and why."""

import numpy as np

from core.rivals.comparison import Comparison, Data, MethodRow, Reference
from core.rivals.observed import Drives

CLOSE = 1.1
"""A mean error within this factor of the Cramer-Rao bound leaves nothing to a better estimator."""
MOST_NAMED = 3
"""Methods that one sentence names."""


def verdicts(found: Comparison) -> tuple[str, ...]:
    """Sentences, the losses not left out."""
    best = found.best_own
    said = [
        f"Of the methods that this project brings, {best.name!r} is the best: mean position error "
        f"{_mm(best)} over {found.poses} kept-out poses and {found.trials} trials."
    ]
    bound = next((r for r in found.references if r.bounds), None)
    if bound is not None:
        said.append(_against(best, bound))
    return (*said, *_losses(found), *_wins(found))


def _against(best: MethodRow, bound: Reference) -> str:
    ratio, slack = best.position_m.mean / bound.position_m, 2 * best.position_m.mean_std / bound.position_m
    said = f"That is {ratio:.2f} times what the Cramer-Rao bound of its points allows"
    if not np.isfinite(slack):
        return f"{said}; a single trial does not tell more."
    if ratio - slack > CLOSE:
        return f"{said}, more than the luck of the trials explains: the estimator could be better."
    return f"{said} (+- {slack:.2f} by the luck of the trials): what limits it are its points, not the estimator."


def _losses(found: Comparison) -> list[str]:
    best, said = found.best_own, []
    same = [row for row in found.better if row.data is best.data]
    other = [row for row in found.better if row.data is not best.data]
    if same:
        said.append(f"It loses on the very same points to {_listed(same)}.")
    if other:
        winner = min(other, key=lambda row: row.position_m.mean)
        ratio = best.position_m.mean / winner.position_m.mean
        said.append(
            f"It loses to methods that were given as many points in other poses: {_listed(other)}. The best of them "
            f"is {ratio:.1f} times as exact. The points make the difference: theirs range over all that the joints can "
            f"do, the {best.data} stay near one pose."
        )
    if not same and not other:
        said.append("No other method is better beyond what the luck of the trials explains.")
    return said


def _wins(found: Comparison) -> list[str]:
    """What the methods as published, without drive functions, are left with."""
    plain = [
        row for row in found.rows if not row.own and row.drives is Drives.AS_COMMANDED and row.data is not Data.NONE
    ]
    behind = [row for row in plain if row.position_m.mean > found.best_own.position_m.mean]
    if not behind:
        return []
    first, last = (pick(behind, key=lambda row: row.position_m.mean) for pick in (min, max))
    return [
        f"It is better than {len(behind)} of {len(plain)} methods that take the drives at their word: those come to "
        f"{_mm(first)} ({first.name}) to {_mm(last)} ({last.name})."
    ]


def _listed(rows: list[MethodRow]) -> str:
    ordered = sorted(rows, key=lambda row: row.position_m.mean)
    named = [f"{row.label} ({_mm(row)})" for row in ordered[:MOST_NAMED]]
    more = len(ordered) - MOST_NAMED
    last = f"; and {more} more, up to {_mm(ordered[-1])}" if more > 0 else ""
    return "; ".join(named) + last


def _mm(row: MethodRow) -> str:
    return f"{row.position_m.mean * 1e3:.2f} mm"
