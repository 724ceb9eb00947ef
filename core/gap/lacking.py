"""What a name leaves unsaid at its own place: next of kin fit nearly as well, and leave notable evidence there.

A hysteresis looks like backlash, a link that bends like a drive that gives, and the reverse; a base that wanders
looks like one that drifts. Their forms are nearly exact, so that where something else still says much at the same
joint, or of the same time, the name is likely that of a relative.
"""

import numpy as np

from core.gap.evidence import Chosen, joined, without
from core.gap.open_set import BY_LOAD, Judge, Stand
from core.gap.result import Place

LEAST = 8.0
"""Log evidence that chance leaves at most."""
SHARES = {
    "backlash": 0.005,
    "base_shift": 0.06,
    "compliance": 0.0016,
    "drift": 0.016,
    "flexure": 0.0016,
    "payload": 0.01,
}
"""Of the evidence for a name: more is left by its relatives alone. From simulated worlds with known causes."""


def lacks(judge: Judge, stand: Stand, others: Chosen) -> bool:
    """Whether a name leaves notably much at its own place.

    Args:
        others: what describes the other causes.
    """
    effect = stand.place.effect
    if effect not in SHARES:
        return False
    here = _variables(judge, stand.place)
    candidates = judge.problem.candidates
    mine = Chosen(stand.groups, stand.sizes)
    known = joined(judge.given, others, mine)
    small = without(judge.found, known.groups)
    near = [g for g in small.groups if judge.variable(candidates[g].place) in here]
    alone = all(g in near or candidates[g].place.effect in BY_LOAD for g in small.groups)
    if alone:
        # Nothing acts elsewhere: what was found here beside the name may be what the name has missed.
        small = without(small, near)
    known = joined(known, small)
    among = [
        k
        for k, one in enumerate(candidates)
        if k not in known.groups and judge.variable(one.place) in here and not one.place.same_as(stand.place)
    ]
    if not among:
        return False
    own = judge.evidence.given(known) - judge.evidence.given(without(known, stand.groups))
    left = judge.evidence.gains(np.array(among), known).evidence - judge.problem.cost[among]
    return bool(left.max() > max(LEAST, SHARES[effect] * own))


def _variables(judge: Judge, place: Place) -> set[str]:
    """The joints at which a name's relatives act: its own; what bends and gives, tilts and turns the next ones too."""
    if place.joint is None or place.effect == "backlash":
        return {judge.variable(place)}
    ends = (0, 1) if place.effect == "flexure" else (-1, 0, 1)
    return {f"joint {place.joint + k}" for k in ends}
