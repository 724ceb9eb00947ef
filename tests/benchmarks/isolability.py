"""``python -m tests.benchmarks.isolability``: what plans promised, against diagnoses of simulated campaigns.

Simulated arms as drawn, one effect each time at one place: at the limit that was promised for it, at a third of it, and
at the size at which its rivals were named.
"""

import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"

from collections.abc import Iterator  # noqa: E402
from dataclasses import dataclass, replace  # noqa: E402

import numpy as np  # noqa: E402

from core.gap.diagnosis import diagnose  # noqa: E402
from core.gap.isolability import Isolated, isolability  # noqa: E402
from core.gap.result import Place, Verdict  # noqa: E402
from core.twin.cell import Cell  # noqa: E402
from tests.benchmarks.tables import markdown  # noqa: E402
from tests.core.gap_cells import crane_cell, measured, scara_cell  # noqa: E402

SEEDS = (500, 501)
CELLS = {"three joints": crane_cell, "four, coupled": lambda: crane_cell(4), "SCARA": scara_cell}
LEAST, THIRD = "at the limit", "a third of it"


@dataclass(frozen=True)
class Asked:
    """One diagnosis of one simulated campaign."""

    what: str
    found: bool
    """Anything."""
    right: bool
    """The effect itself, alone or within a class."""
    alone: bool


def report() -> str:
    """A table in Markdown."""
    rows = []
    for name, make in CELLS.items():
        asked = list(_asked(make()))
        rows.append(
            [
                name,
                _share([one.right for one in asked if one.what == LEAST]),
                _share([one.found for one in asked if one.what == THIRD]),
                _share([one.alone for one in asked if one.what == "alone"]),
                _share([one.right for one in asked if one.what == "class"]),
                _share([one.alone for one in asked if one.what == "class"]),
            ]
        )
    heads = ("arm", "named at the limit", "anything said at a third", "to be told apart: named alone")
    return markdown((*heads, "to be confused: right one in the class", "of these alone"), rows)


def _asked(cell: Cell) -> Iterator[Asked]:
    clean = measured(cell)
    noise_m = diagnose(clean).noise.used_m
    stated = np.tile(noise_m**2 * np.eye(3), (clean.measurements.count, 1, 1))
    planned = replace(clean, measurements=replace(clean.measurements, covariance_m2=stated))
    told = {one.place: one for one in isolability(planned).effects}
    for place, text, scale in _effects(cell):
        one = told.get(place)
        if one is None or not one.limit.shown:
            continue
        sizes = {LEAST: 1.0, THIRD: 1 / 3, "alone" if one.named else "class": one.rms_m / one.limit.rms_m}
        for what, times in sizes.items():
            for seed in SEEDS:
                yield _diagnosed(cell, one, text.format(one.limit.size * times * scale), what, seed)


def _diagnosed(cell: Cell, one: Isolated, effect: str, what: str, seed: int) -> Asked:
    found = diagnose(measured(cell, effect, seed=seed))
    right = any(twin.same_as(one.place) for cause in found.causes for twin in cause.twins)
    alone = bool(found.causes) and found.causes[0].twins == (found.causes[0].place,)
    return Asked(what, found.verdict is not Verdict.NO_GAP, right, alone and found.causes[0].place.same_as(one.place))


def _effects(cell: Cell) -> Iterator[tuple[Place, str, float]]:
    """Effects of one number, how the simulation asks for them, and how many of its unit make one of SI."""
    for joint, kind in enumerate(cell.robot.joints, 1):
        unit, scale = ("mm", 1e3) if kind.slides else ("deg", 180 / np.pi)
        yield Place("ratio", joint=joint), f"ratio:{joint}:{{:.12f}}", 1.0
        yield Place("backlash", joint=joint), f"backlash:{joint}:{{:.12f}}{unit}", scale
        if not kind.slides:
            yield Place("eccentricity", joint=joint), f"eccentricity:{joint}:{{:.12f}}{unit}", scale
            yield Place("compliance", joint=joint), f"compliance:{joint}:{{:.9f}}urad/Nm", 1e6
    yield Place("coupling", joint=2, source=1), "coupling:1-2:{:.12f}", 1.0
    yield Place("coupling", joint=3, source=2), "coupling:2-3:{:.12f}", 1.0


def _share(right: list[bool]) -> str:
    return f"{sum(right)} of {len(right)}"


if __name__ == "__main__":
    print(report())
