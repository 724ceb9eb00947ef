"""What became of the gap: mean squares that add up, and the points with any choice of causes added to the sim."""

import math
from dataclasses import dataclass

from core.gap.place_words import CALIBRATION, cause_words
from core.gap.result import GapReport
from core.geometry import Array

NOT_SHARED = "not shared out among the causes"
BEYOND, FLOOR = "left, beyond the floor", "floor: noise and the arm's own repeatability"
NEGLIGIBLE = 1e-6
MOST_SWITCHES = 5
"""Their combinations are drawn one by one."""


@dataclass(frozen=True)
class LedgerLine:
    """One part of the mean square of real minus sim, on kept-out points."""

    words: str
    square_m2: float
    share: float
    """Of the whole gap's mean square."""


def ledger(report: GapReport) -> tuple[LedgerLine, ...]:
    """Every cause in the order in which it was added, what is left beyond the floor, and the floor: the sum is the gap.

    Mean squares add up where root mean squares do not. A line may be negative: the cause that it stands for makes
    kept-out points worse, or less is left than the floor lets expect.
    """
    whole, floor = report.gap_rms_m**2, report.noise.floor_rms_m**2
    parts = [(cause_words(c), c.gap_before_rms_m**2 - c.gap_after_rms_m**2) for c in report.causes]
    rest = [(BEYOND, report.left_rms_m**2 - floor), (FLOOR, floor)]
    if report.calibration_matters:
        parts.insert(0, (CALIBRATION, whole - report.within_calibration_rms_m**2))
    together = whole - sum(square for _, square in [*parts, *rest])
    if abs(together) > NEGLIGIBLE * whole:
        parts.append((NOT_SHARED, together))
    share = 1.0 / whole if whole > 0 else math.nan
    return tuple(LedgerLine(words, square, square * share) for words, square in [*parts, *rest])


def closed_share(report: GapReport) -> float:
    """Share of gap^2 - floor^2 that all causes together close, on kept-out points; NaN: there is no gap to close."""
    floor = report.noise.floor_rms_m**2
    gap = report.gap_rms_m**2 - floor
    return 1.0 - (report.left_rms_m**2 - floor) / gap if gap > 0 else math.nan


@dataclass(frozen=True)
class Switch:
    """Causes that are added to the sim together, by hand."""

    words: str
    causes: int
    """Bit k stands for cause k."""


def switches(report: GapReport) -> tuple[Switch, ...]:
    """One switch for every cause; where there are many, the last one stands for all the weaker ones."""
    count = len(report.causes)
    alone = count if count <= MOST_SWITCHES else MOST_SWITCHES - 1
    found = [Switch(cause_words(cause), 1 << k) for k, cause in enumerate(report.causes[:alone])]
    if alone < count:
        found.append(Switch(f"the {count - alone} other causes", (1 << count) - (1 << alone)))
    return tuple(found)


def difference_with(report: GapReport, added: int) -> Array:
    """Real minus sim once some causes are added to the sim, (m, 3), m.

    Args:
        added: bit k stands for cause k. With all of them it is what is left after they were fitted together.
    """
    chosen = [cause for k, cause in enumerate(report.causes) if added >> k & 1]
    if chosen and len(chosen) == len(report.causes):
        return report.left_m
    return report.difference_m - sum(cause.shift_m for cause in chosen)
