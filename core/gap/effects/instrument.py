"""What happens to the instrument, the base and the targets while the arm is measured."""

import numpy as np

from core.gap.doings import Doings
from core.gap.effects.candidate import ANGLE, LENGTH, Candidate, Column
from core.gap.observations import Observations
from core.gap.result import Place
from core.gap.sim import Part, Slot
from core.geometry import Array

MOMENTS = 28
"""Records that are tried as the one from which something stands elsewhere."""
EDGE = 0.03
UNEVEN = 0.1
"""Of the error of a length unit: so much more or less of it lies along the line of sight."""
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
    """Of all lengths alike; or a little more or less along the line of sight, where depth is found in another way."""

    def columns(doings: Doings) -> list[Column]:
        return [[(Slot(Part.SCALE), np.ones(doings.count))]]

    def with_depth(doings: Doings) -> list[Column]:
        return [*columns(doings), [(Slot(Part.DEPTH), np.ones(doings.count))]]

    uneven, size = ("error_1", "more_along_the_line_of_sight_1"), (1e-4, UNEVEN * 1e-4)
    out = [Candidate(Place("scale"), "", ("error_1",), columns, 2, (1e-4,))]
    if _from_outside(doings.seen.point_m):
        out.append(Candidate(Place("scale"), "uneven", uneven, with_depth, 2, size))
    return out


def _from_outside(point_m: Array) -> bool:
    """Whether the instrument, where its frame begins, stands outside of the points it sees, (m, 3)."""
    middle = point_m.mean(axis=0)
    return bool(np.linalg.norm(middle) > np.linalg.norm(point_m - middle, axis=1).max())


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
