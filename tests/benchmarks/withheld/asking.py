"""Asking the product about every campaign of a suite, and only then, with the answers open, what an oracle needs.

DIR/verdicts/NAME.json     said without any answer
DIR/oracle/NAME.json       said when told the cause (single effects)
DIR/without/NAME.json      said with the effect taken out of the library (single effects well above noise)
"""

import json
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

from tests.benchmarks.withheld.product import Json, Product, Verdict, ask, own_product

Load = Callable[[], Product]
LEAST_FORGOTTEN_GAP = 2.0
"""Of single effects whose library entry is taken away: the rest need not be noticed at all."""


@dataclass(frozen=True)
class Question:
    """One diagnosis to be made, and where its verdict goes."""

    folder: Path
    to: Path
    fresh: Path | None = None
    told: tuple[Json, ...] = ()
    without: tuple[str, ...] = ()

    def put(self, load: Load) -> None:
        """Ask, and write what was said."""
        how: Json = ({"told": list(self.told)} if self.told else {}) | (
            {"without": self.without} if self.without else {}
        )
        ask(load(), self.folder, self.fresh, **how).write(self.to)


def ask_all(folder: Path, load: Load = own_product, processes: int = 2, say: Callable[[str], None] = print) -> None:
    """First every verdict, then the answers, then the oracle and the library with holes."""
    _put(list(_blind(folder)), load, processes, say)
    _put(list(_told(folder)), load, processes, say)
    if load().can_forget:
        _put(list(_forgetful(folder)), load, processes, say)
    else:
        say("the product takes no 'without': nothing is taken out of its library")


def campaigns(folder: Path) -> list[Path]:
    """Folders of the suite's campaigns."""
    return sorted(path for path in (folder / "suite").iterdir() if path.is_dir())


def _blind(folder: Path) -> Iterator[Question]:
    for campaign in campaigns(folder):
        fresh = folder / "fresh" / campaign.name
        yield Question(campaign, _to(folder, "verdicts", campaign), fresh if fresh.is_dir() else None)


def _told(folder: Path) -> Iterator[Question]:
    for campaign, truth in _singles(folder):
        yield Question(campaign, _to(folder, "oracle", campaign), told=tuple(truth["answers"]))


def _forgetful(folder: Path) -> Iterator[Question]:
    for campaign, truth in _singles(folder):
        if truth["gap"] > LEAST_FORGOTTEN_GAP:
            forgotten = (str(truth["answers"][0]["effect"]),)
            yield Question(campaign, _to(folder, "without", campaign), without=forgotten)


def _singles(folder: Path) -> Iterator[tuple[Path, Json]]:
    for campaign in campaigns(folder):
        truth = json.loads((folder / "truth" / f"{campaign.name}.json").read_text())
        if truth["kind"] == "single":
            yield campaign, truth


def _to(folder: Path, part: str, campaign: Path) -> Path:
    (folder / part).mkdir(exist_ok=True)
    return folder / part / f"{campaign.name}.json"


def _put(questions: list[Question], load: Load, processes: int, say: Callable[[str], None]) -> None:
    """Ask what has not been asked yet."""
    open_ones = [question for question in questions if not question.to.exists()]
    if not open_ones:
        return
    with ProcessPoolExecutor(processes) as pool:
        waiting = [pool.submit(question.put, load) for question in open_ones]
        for done, future in enumerate(as_completed(waiting), 1):
            future.result()
            if done % 20 == 0 or done == len(waiting):
                say(f"{open_ones[0].to.parent.name}: {done} of {len(waiting)}")


def read_verdicts(folder: Path, part: str) -> dict[str, Verdict]:
    """Verdicts of one kind by campaign."""
    return {path.stem: Verdict.read(path) for path in sorted((folder / part).glob("*.json"))}
