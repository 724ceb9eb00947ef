"""A comparison as text for a terminal."""

from math import isfinite
from pathlib import Path

from core.rivals.comparison import Comparison, MethodRow
from core.rivals.verdict import verdicts

COLUMNS = (("mean", 8), ("p95", 8), ("max", 8), ("mrad", 8), ("lengths", 9), ("angles", 8), ("s", 8))


def comparison_summary(found: Comparison, folder: Path) -> str:
    """The table, what it comes to, and where the files are."""
    width = max(len(row.label) for row in found.rows)
    heads = "".join(f"{name:>{w}}" for name, w in COLUMNS)
    lines = [
        f"{found.title}: {found.trials} trial{'' if found.trials == 1 else 's'}, {found.poses} kept-out poses each",
        "position errors in mm (mean, p95, max), mean orientation error in mrad, errors of the phi-model's lengths",
        "in mm and angles in mrad (rms), seconds of one calibration",
        "",
        f"{'':<{width}}  {'points':<11}{heads}",
    ]
    lines += [f"{row.label:<{width}}  {row.data:<11}{_numbers(row)}" for row in found.rows]
    lines += [
        f"{one.name:<{width}}  {'':<11}{one.position_m * 1e3:>8.2f}{'':16}{one.orientation_rad * 1e3:>8.1f}  {one.note}"
        for one in found.references
    ]
    lost = [f"{row.label}: {row.failed} of {found.trials} trials failed" for row in found.rows if row.failed]
    written = f"Written: {folder / 'comparison.json'}, {folder / 'report.html'}"
    return "\n".join([*lines, *lost, "", *verdicts(found), "", *(f"Note: {n}" for n in found.notes), "", written])


def _numbers(row: MethodRow) -> str:
    sizes = row.position_m
    values = (sizes.mean, sizes.p95, sizes.max, row.orientation_rad.mean, row.length_error_m, row.angle_error_rad)
    shown = [_cell(v * 1e3, 2, w) for v, (_, w) in zip(values, COLUMNS, strict=False)]
    return "".join([*shown, _cell(row.seconds, 3, COLUMNS[-1][1])])


def _cell(value: float, decimals: int, width: int) -> str:
    return f"{value:>{width}.{decimals}f}" if isfinite(value) else " " * width
