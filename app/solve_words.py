"""Small pieces of HTML about a solution. Whatever comes from people or files is escaped here."""

import re
from html import escape

from app.glossary import term
from app.table_2 import Limits, limit_counts
from app.words import block, findings_words
from core.calibration import APART, Calibration
from core.session_state import Solve
from core.solve_figures import Change
from core.wording import fixed

MOST_CHANGES, MOST_REJECTIONS = 6, 8
NAMES = {"a": "a", "b": "b", "alpha": "α", "theta": "θ"}


def summary_words(found: Calibration, limits: Limits, changes: tuple[Change, ...], since: int) -> str:
    """What a solution says in short, what changed since the one before, and what came after it.

    Args:
        limits: that the operator has set.
        changes: from the solution before; empty: there was none, or nothing changed.
        since: shots and decisions after this solution.
    """
    used = int(found.refinement.residuals.used.sum())
    text = _since(since)
    text += (
        f"<p data-testid='solution'><b>{used}</b> points used, <b>{len(found.rejected)}</b> "
        f"{term('rejected', 'Rejected')}; one coordinate scatters by "
        f"<b data-testid='noise'>{found.estimate.noise_m * 1e3:.3f} mm</b>.</p>"
    )
    if found.not_swept:
        missing = ", ".join(map(str, found.not_swept))
        text += f"<p class='doubt'>Not swept yet: joint {missing}. The geometry needs them all.</p>"
    if not found.refinement.tied:
        text += f"<p class='doubt'>{escape(APART[:1].upper() + APART[1:])}.</p>"
    text += _rejections(found) + _limits(found, limits) + _changes(changes)
    return block(text, "solution-box") + findings_words(found.findings)


def unsolved_words(last: Solve | None, since: int, shots: int) -> str:
    """What to say as long as there is no solution at hand."""
    if last is None:
        text = "Nothing is solved yet. "
        text += "One finished sweep is enough to begin." if shots else "Measure a sweep first, under <b>2 Measure</b>."
        return block(f"<p class='soft'>{text}</p>", "solution")
    who = f" by {escape(last.by)}" if last.by else ""
    when = escape(last.utc[:16].replace("T", " "))
    return block(f"{_since(since)}<p class='soft'>Last solved {when} UTC{who}; press <b>Solve</b>.</p>", "solution")


def changes_list(changes: tuple[Change, ...]) -> str:
    """What is not as it was, the most telling first; empty: nothing."""
    if not changes:
        return ""
    items = "".join(f"<li>{_change(change)}</li>" for change in changes[:MOST_CHANGES])
    more = f"<li>and {len(changes) - MOST_CHANGES} more</li>" if len(changes) > MOST_CHANGES else ""
    return f"<ul data-testid='changes' style='padding-left:18px;margin:4px 0'>{items}{more}</ul>"


def _since(since: int) -> str:
    if not since:
        return ""
    count = "One shot or decision" if since == 1 else f"{since} shots or decisions"
    return f"<p class='doubt' data-testid='stale'>{count} since the last solution: solve again.</p>"


def _rejections(found: Calibration) -> str:
    told = "".join(
        f"<p class='doubt'>Record {one.record} left out: {escape(one.reason)}.</p>"
        for one in found.rejected[:MOST_REJECTIONS]
    )
    more = len(found.rejected) - MOST_REJECTIONS
    return told + (f"<p class='doubt'>And {more} more.</p>" if more > 0 else "")


def _limits(found: Calibration, limits: Limits) -> str:
    """How many parameters keep the operator's limits."""
    counts = limit_counts(found, limits)
    if counts is None:
        return ""
    kept, broken, undecided = counts
    look = "bad" if broken else ("doubt" if undecided else "ok")
    return (
        f"<p class='{look}' data-testid='limits'>Limits: <b>{kept}</b> parameters within, <b>{broken}</b> beyond, "
        f"<b>{undecided}</b> undecided; see <b>Geometry</b>.</p>"
    )


def _changes(changes: tuple[Change, ...]) -> str:
    if not changes:
        return ""
    return f"<details><summary>What changed since the last solution</summary>{changes_list(changes)}</details>"


def _change(change: Change) -> str:
    name = _name(change.name)
    if change.before is None:
        return f"{name} is known now: {_value(change.after, change.unit)}"
    if change.after is None:
        return f"{name} is no longer known"
    moved = "" if change.in_std == float("inf") else f" ({change.in_std:.1f} u)"
    return f"{name}: {_value(change.before, change.unit)} → {_value(change.after, change.unit)}{moved}"


def _name(name: str) -> str:
    """``alpha2`` as the tables have it, α₂; other names as they are."""
    found = re.fullmatch(r"(a|b|alpha|theta)(\d+)", name)
    return f"{NAMES[found[1]]}<sub>{found[2]}</sub>" if found else escape(name)


def _value(value: str | float | None, unit: str) -> str:
    if isinstance(value, str):
        return escape(value.replace("_", " "))
    if not unit:
        return f"{value:g}"
    return f"{fixed(value, 3)} {unit}"
