"""The suite on disk: campaigns that a diagnosis may see, answers beside them, and the truth out of its reach.

DIR/suite/NAME/            campaign folders; DIR/suite/answers.json, as ``trueaxis blind-check`` wants them
DIR/fresh/NAME/            another day at the same arm
DIR/truth/NAME.json, .npz  what was made, points without noise
"""

import json
import zlib
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np

from tests.benchmarks.withheld.cases import Case, all_cases
from tests.benchmarks.withheld.folders import write_campaign
from tests.benchmarks.withheld.made import Made, make, truth_of
from tests.benchmarks.withheld.noises import NOISES

PROCESSES = 2


def chosen(seeds: str, only: str | None = None, limit: int | None = None) -> dict[str, Case]:
    """Cases by the name of their folder, which tells nothing."""
    named = {f"c{k:04d}": case for k, case in enumerate(all_cases(seeds), 1)}
    kept = [(name, case) for name, case in named.items() if only in (None, case.kind)]
    return dict(kept[:limit])


def make_suite(folder: Path, cases: dict[str, Case], processes: int = PROCESSES) -> None:
    """Write every case and answers.json."""
    for part in ("suite", "fresh", "truth"):
        (folder / part).mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(processes) as pool:
        answers = dict(pool.map(partial(write_case, folder), cases, cases.values(), chunksize=4))
    text = json.dumps(answers, indent=1)
    (folder / "suite" / "answers.json").write_text(text)


def write_case(folder: Path, name: str, case: Case) -> tuple[str, dict[str, object]]:
    """Write one case; its name and entry of answers.json."""
    made = make(case)
    rng = np.random.default_rng([case.seed, zlib.crc32(b"noise")])
    _write_day(folder / "suite" / name, case, made, rng)
    if made.fresh is not None:
        session, points = made.fresh
        noisy = points + NOISES["stated"](rng, len(points))
        write_campaign(folder / "fresh" / name, session, noisy, rng)
    (folder / "truth" / f"{name}.json").write_text(json.dumps(truth_of(case, made), indent=1))
    np.savez_compressed(
        folder / "truth" / f"{name}.npz",
        point_m=made.point_m,
        nominal_m=made.session.nominal_m[made.session.measured],
        record=made.session.record[made.session.measured],
    )
    return name, {"effects": made.effects} | ({"also": made.also} if made.also else {})


def _write_day(folder: Path, case: Case, made: Made, rng: np.random.Generator) -> None:
    noisy = made.point_m + NOISES[case.noise](rng, len(made.point_m))
    write_campaign(folder, made.session, noisy, rng, history=case.protocol != "no log")
