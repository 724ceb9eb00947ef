"""What happens to the instrument, the base and the targets while the arm is measured."""

import numpy as np

from core.gap.doings import Doings
from core.gap.effects.candidate import ANGLE, LENGTH, Candidate, Column
from core.gap.observations import Observations
from core.gap.result import Place
from core.gap.sim import Part, Slot

MOMENTS = 28
"""Records that are tried as the one from which something stands elsewhere."""
EDGE = 0.03
CREEP_SHARES = (0.15, 0.5)
BASE_NAMES = tuple(f"turn_about_{a}_rad" for a in "xyz") + tuple(f"shift_along_{a}_m" for a in "xyz")
BASE_SIZES = (ANGLE,) * 3 + (LENGTH,) * 3


def drifts(doings: Doings) -> list[Candidate]:
    """The instrument or the base creeps, evenly or slower and slower."""
    return [_drift(share, 1 + len(CREEP_SHARES)) for share in (None, *CREEP_SHARES)]


def base_shifts(doings: Doings) -> list[Candidate]:
    return [base_shift(record, MOMENTS) for record in moments(doings)]


def target_slips(doings: Doings) -> list[Candidate]:
    out = []
    for t in np.unique(doings.seen.target):
        records = moments(doings, doings.seen.target == t)
        out += [target_slip(doings, int(t), record, len(records)) for record in records]
    return out


def scales(doings: Doings) -> list[Candidate]:
    def columns(doings: Doings) -> list[Column]:
        return [[(Slot(Part.SCALE), np.ones(doings.count))]]

    return [Candidate(Place("scale"), "", ("error_1",), columns, 1, (1e-4,))]


def moments(doings: Doings, of: np.ndarray | None = None) -> list[int]:
    """Records at which a change would show well enough to be looked for, first of a standstill each."""
    seen = doings.seen
    starts = looks(seen, of)
    shares = np.linspace(EDGE, 1 - EDGE, MOMENTS)
    picked = np.unique((shares * len(starts)).astype(int))
    return [int(seen.record[starts[k]]) for k in picked if 0 < k < len(starts)]


def looks(seen: Observations, of: np.ndarray | None = None) -> np.ndarray:
    """The first of the points that are looked at in each standstill: what happened before is seen there."""
    rows = np.arange(seen.count) if of is None else np.flatnonzero(of)
    return rows[np.append(True, np.diff(seen.standstill[rows]) != 0)]


def base_shift(record: int, choices: int) -> Candidate:
    """Everything stands elsewhere from a record on."""

    def columns(doings: Doings) -> list[Column]:
        after = (doings.seen.record >= record).astype(float)
        return [[(Slot(Part.BASE, 0, k), after)] for k in range(6)]

    place = Place("base_shift", record=record)
    return Candidate(place, f"from record {record}", BASE_NAMES, columns, choices, BASE_SIZES)


def target_slip(doings: Doings, target: int, record: int, choices: int) -> Candidate:
    """One target sits elsewhere on its link from a record on."""

    def columns(doings: Doings) -> list[Column]:
        after = (doings.seen.record >= record).astype(float)
        return [[(Slot(Part.TARGET, target, k), after)] for k in range(3)]

    place = Place("target_slip", target=doings.seen.campaign.targets[target].name, record=record)
    names = tuple(f"shift_along_{a}_m" for a in "xyz")
    return Candidate(place, f"from record {record}", names, columns, choices, (LENGTH,) * 3)


def _drift(share: float | None, choices: int) -> Candidate:
    def columns(doings: Doings) -> list[Column]:
        time = doings.seen.time
        law = time if share is None else (1 - np.exp(-time / share)) / (1 - np.exp(-1 / share))
        return [[(Slot(Part.BASE, 0, k), law)] for k in range(6)]

    atom = "evenly" if share is None else f"slower and slower, most of it in the first {100 * share:.0f} % of the time"
    return Candidate(Place("drift"), atom, BASE_NAMES, columns, choices, BASE_SIZES)
