"""``python -m tests.benchmarks withheld``: write the suite, ask the product, print the table."""

import argparse
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from tests.benchmarks.withheld.asking import Load, ask_all
from tests.benchmarks.withheld.cases import KINDS, SEEDS
from tests.benchmarks.withheld.making import chosen, make_suite
from tests.benchmarks.withheld.product import own_product
from tests.benchmarks.withheld.score_table import by_effect, by_part, failures, table
from tests.benchmarks.withheld.scoring import read_outcomes

STEPS = ("all", "make", "ask", "score")


def main(arguments: Sequence[str]) -> None:
    """The command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks withheld", description=__doc__)
    parser.add_argument("step", nargs="?", default="all", choices=STEPS)
    parser.add_argument("--seeds", choices=tuple(SEEDS), default="dev")
    parser.add_argument("--out", type=Path, required=True, help="a folder of its own for each set of seeds")
    parser.add_argument("--only", choices=KINDS)
    parser.add_argument("--limit", type=int)
    parser.add_argument("--processes", type=int, default=2)
    print(run(**vars(parser.parse_args(arguments))))


def run(
    step: str,
    seeds: str,
    out: Path,
    only: str | None = None,
    limit: int | None = None,
    processes: int = 2,
    load: Load = own_product,
) -> str:
    """What a step has to say.

    Args:
        step: ``make`` writes campaigns, ``ask`` has them diagnosed (those that have no verdict yet), ``score`` prints
            the table of what is there, ``all`` does one after the other.
        seeds: ``dev`` or ``test``.
        only: one kind of campaign; None: all.
        limit: at most so many campaigns.
    """
    if step in ("all", "make"):
        cases = chosen(seeds, only, limit)
        make_suite(out, cases, processes)
        kinds = Counter(case.kind for case in cases.values())
        print(f"{len(cases)} campaigns in {out / 'suite'}: {', '.join(f'{n} {k}' for k, n in kinds.items())}")
    if step in ("all", "ask"):
        ask_all(out, load, processes)
    return "" if step in ("make", "ask") else score(out, seeds)


def score(out: Path, seeds: str) -> str:
    """Table, effects one by one, failures; also kept as score.md."""
    outcomes = read_outcomes(out)
    parts = [
        f"Withheld suite, {seeds} seeds, {len(outcomes)} campaigns.",
        table(outcomes),
        "The same, part by part:",
        by_part(outcomes, SEEDS[seeds]),
        "Single effects, alone and among four small ones:",
        by_effect(outcomes),
        "Failures:",
        failures(outcomes),
    ]
    text = "\n\n".join(parts)
    (out / "score.md").write_text(text + "\n")
    return text
