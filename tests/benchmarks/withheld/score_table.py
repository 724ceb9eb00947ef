"""The suite's table: figure, bar, what was reached, of how many."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tests.benchmarks.tables import markdown
from tests.benchmarks.withheld.cases import GAPS
from tests.benchmarks.withheld.matching import UNKNOWN, number, right_in_class
from tests.benchmarks.withheld.noises import NOISES
from tests.benchmarks.withheld.product import Json
from tests.benchmarks.withheld.scoring import (
    ABSTAINED,
    Outcome,
    brier,
    calibration_error,
    probability,
    share,
)

PROMISE = 0.05


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    figure: str
    reached: float
    count: int
    at_least: float | None = None
    at_most: float | None = None

    @property
    def met(self) -> bool | None:
        """None where there is no bar or nothing to hold against it."""
        if not self.count or (self.at_least is None and self.at_most is None):
            return None
        return self.reached >= self.at_least if self.at_least is not None else self.reached <= self.at_most

    def cells(self) -> tuple[str, ...]:
        bar = f">= {self.at_least:g}" if self.at_least is not None else ""
        bar = f"<= {self.at_most:g}" if self.at_most is not None else bar
        met = {None: "", True: "yes", False: "NO"}[self.met]
        return self.figure, bar, f"{self.reached:.3f}" if self.count else "-", str(self.count), met


def rows(outcomes: list[Outcome]) -> list[Row]:
    """Every figure of the suite."""
    parts = (
        _named_rows,
        _sure_rows,
        _nothing_rows,
        _other_rows,
        _mixture_rows,
        _shrink_rows,
        _physics_rows,
        _thin_rows,
    )
    return [row for part in parts for row in part(outcomes)]


def table(outcomes: list[Outcome]) -> str:
    """The rows in Markdown."""
    return markdown(("figure", "bar", "reached", "of", "met"), [row.cells() for row in rows(outcomes)])


def by_part(outcomes: list[Outcome], first_seeds: Sequence[int]) -> str:
    """What was reached on each part of a set: how far rows scatter from seeds to seeds."""
    of_part = np.searchsorted(first_seeds, [outcome.truth["seed"] for outcome in outcomes], side="right") - 1
    parts = [rows([o for o, of in zip(outcomes, of_part, strict=True) if of == k]) for k in range(len(first_seeds))]
    header = ("figure", *(f"from seed {first}" for first in first_seeds))
    return markdown(header, [(row[0].figure, *(one.cells()[2] for one in row)) for row in zip(*parts, strict=True)])


def _of(outcomes: list[Outcome], *kinds: str) -> list[Outcome]:
    return [outcome for outcome in outcomes if outcome.kind in kinds]


def _share(figure: str, among: list[Outcome], right: Callable[[Outcome], bool], **bar: float) -> Row:
    return Row(figure, share(among, right), len(among), **bar)


def _named_rows(outcomes: list[Outcome]) -> Iterator[Row]:
    singles, cluttered = _of(outcomes, "single"), _of(outcomes, "cluttered")
    for gap in GAPS:
        mine = [outcome for outcome in singles if outcome.truth["gap"] == gap]
        yield _share(f"one effect, gap/noise {gap:g}: right up to class", mine, lambda o: o.up_to_class, at_least=0.95)
        yield _share(f"one effect, gap/noise {gap:g}: right by name", mine, lambda o: o.exact, at_least=0.85)
    yield _share("one effect among four small: right up to class", cluttered, lambda o: o.up_to_class, at_least=0.92)
    yield _share("one effect among four small: right by name", cluttered, lambda o: o.exact)
    placed = [outcome for outcome in singles if outcome.has_place]
    yield _share("joint right, one effect", placed, lambda o: o.placed, at_least=0.98)
    placed = [outcome for outcome in cluttered if outcome.has_place]
    yield _share("joint right, among four small", placed, lambda o: o.placed, at_least=0.95)


def _sure_rows(outcomes: list[Outcome]) -> Iterator[Row]:
    true = _of(outcomes, "single", "cluttered", "mixture", "physics")
    yield _share("wrong name with probability > 0.5", true, lambda o: o.wrong_name, at_most=0.02)
    everything = _of(outcomes, "single", "cluttered", "mixture", "physics", "nothing", "other")
    said = [(o, cause) for o in everything for cause in o.named]
    exactly = [(probability(cause), o.is_true(cause, exactly=True)) for o, cause in said]
    in_class = [(probability(cause), o.is_true(cause)) for o, cause in said]
    yield Row("Brier score of the probabilities (by name)", brier(exactly), len(said), at_most=0.08)
    yield Row("expected calibration error (by name)", calibration_error(exactly), len(said), at_most=0.05)
    yield Row("Brier score, up to class", brier(in_class), len(said))
    yield Row("expected calibration error, up to class", calibration_error(in_class), len(said))


def _nothing_rows(outcomes: list[Outcome]) -> Iterator[Row]:
    for noise in NOISES:
        mine = [outcome for outcome in _of(outcomes, "nothing") if outcome.truth["noise"] == noise]
        most = 0.01 if noise == "stated" else 0.05
        yield _share(f"nothing wrong, noise {noise}: something claimed", mine, lambda o: o.claims, at_most=most)
    yield _share("nothing wrong, any noise: a name given", _of(outcomes, "nothing"), lambda o: bool(o.named))


def _other_rows(outcomes: list[Outcome]) -> Iterator[Row]:
    others = _of(outcomes, "other")
    yield _share("out of vocabulary: a name with probability > 0.5", others, lambda o: o.wrong_name, at_most=0.05)
    yield _share("out of vocabulary: joint or variable right", others, lambda o: o.placed, at_least=0.95)
    yield _share("out of vocabulary: unknown, or not all explained", others, _abstained)
    asked = [outcome for outcome in outcomes if outcome.without is not None]
    figure = "effect taken out of the library: unknown, mixture or class"
    yield _share(figure, asked, lambda o: o.noticed_without, at_least=0.95)


def _abstained(outcome: Outcome) -> bool:
    return outcome.word in ABSTAINED or any(cause["effect"] == UNKNOWN for cause in outcome.causes)


def _mixture_rows(outcomes: list[Outcome]) -> Iterator[Row]:
    mixtures = _of(outcomes, "mixture")
    yield _share("two effects: both found, up to class", mixtures, _both_found, at_least=0.95)
    named = [(o, cause) for o in mixtures for cause in o.named]
    right = float(np.mean([o.is_true(cause) for o, cause in named])) if named else float("nan")
    yield Row("two effects: names that are right", right, len(named), at_least=0.85)


def _both_found(outcome: Outcome) -> bool:
    return all(
        any(right_in_class(cause, truth, outcome.records) for cause in outcome.causes) for truth in outcome.answers
    )


def _shrink_rows(outcomes: list[Outcome]) -> Iterator[Row]:
    closed = [o.against_oracle for o in _of(outcomes, "single") if o.against_oracle is not None]
    middle, low = np.quantile(closed, [0.5, 0.1]) if closed else (float("nan"),) * 2
    yield Row("share closed over that of an oracle, median", float(middle), len(closed), at_least=0.97)
    yield Row("share closed over that of an oracle, 10th percentile", float(low), len(closed), at_least=0.90)
    missed = [o.promise_missed_by for o in outcomes if o.promise_missed_by is not None]
    kept = float(np.mean(np.abs(missed) <= PROMISE)) if missed else float("nan")
    yield Row(f"promised closure within {PROMISE:g} of that on another day", kept, len(missed), at_least=0.90)
    another = [o for o in outcomes if o.verdict.realised is not None or o.verdict.not_realised]
    yield _share("another day could not be predicted", another, lambda o: bool(o.verdict.not_realised), at_most=0.0)


def _physics_rows(outcomes: list[Outcome]) -> Iterator[Row]:
    physics = _of(outcomes, "physics")
    played = [outcome for outcome in physics if outcome.answers[0]["effect"] == "backlash"]
    others = [outcome for outcome in physics if outcome.answers[0]["effect"] != "backlash"]
    figure = "MuJoCo: elasticity, flexure, payload right up to class"
    yield _share(figure, others, lambda o: o.up_to_class, at_least=0.95)
    yield _share("MuJoCo: the joint with play", played, lambda o: o.placed, at_least=1.0)


def _thin_rows(outcomes: list[Outcome]) -> Iterator[Row]:
    thin = _of(outcomes, "thin")
    yield _share("thin protocols: a wrong name with probability > 0.5", thin, lambda o: o.wrong_name, at_most=0.0)
    yield _share("crashed, whatever was asked of a campaign", outcomes, lambda o: bool(o.crashed), at_most=0.0)
    rich = [outcome.verdict.seconds for outcome in outcomes if outcome.kind != "thin"]
    yield Row("seconds a campaign, median", float(np.median(rich)) if rich else float("nan"), len(rich), at_most=5.0)
    yield Row("seconds a campaign, longest", max(rich, default=float("nan")), len(rich))


def failures(outcomes: list[Outcome]) -> str:
    """Every campaign on which a figure was lost: truth and what was said."""
    lost = [outcome for outcome in outcomes if failed(outcome)]
    header = ("campaign", "kind", "arm", "gap", "truth", "verdict", "said")
    return markdown(header, [_failure(outcome) for outcome in lost])


def failed(outcome: Outcome) -> bool:
    """Whether a campaign counts against a bar."""
    if outcome.crashed:
        return True
    if outcome.kind == "nothing":
        return outcome.claims
    if outcome.kind == "other":
        return outcome.wrong_name or not outcome.placed
    if outcome.kind == "mixture":
        return not _both_found(outcome)
    if outcome.kind == "thin":
        return outcome.wrong_name
    if outcome.kind == "physics" and outcome.answers[0]["effect"] == "backlash":
        return not outcome.placed
    return not outcome.up_to_class


def _failure(outcome: Outcome) -> tuple[str, ...]:
    truth = outcome.truth
    what = [str(truth["noise"])] if outcome.kind == "nothing" else [words(answer) for answer in outcome.answers]
    what += {"thin": [f"({truth['protocol']})"], "other": [f"({', '.join(truth['effects'])})"]}.get(outcome.kind, [])
    said = "; ".join(f"{words(cause)} p={probability(cause):.2f}{_class(cause)}" for cause in outcome.causes[:4])
    said = f"{said} {outcome.verdict.refused or outcome.crashed[-120:]}".replace("\n", " ").strip()
    return outcome.name, outcome.kind, str(truth["arm"]), f"{truth['gap']:g}", ", ".join(what), outcome.word, said


def words(cause: Json) -> str:
    """A cause in short: ``compliance 3``, ``coupling 2>3``, ``target_slip T1@230``, ``other at 4``."""
    if cause["effect"] == "other":
        where = dict(cause["where"])
        return f"other at {where.get('variable') or number(where)}"
    place = cause.get("variable") or number(cause) or ""
    if "from" in cause:
        place = f"{cause['from']}>{cause['to']}"
    if cause.get("record") is not None:
        place = f"{cause.get('target', '')}@{cause['record']}"
    return f"{cause['effect']} {place}".strip()


def _class(cause: Json) -> str:
    declared = cause.get("class") or []
    others = [words(one) for one in declared if words(one) != words(cause)]
    return f" or {' or '.join(others)}" if others else ""


def by_effect(outcomes: list[Outcome]) -> str:
    """Single effects one by one: how often right, and what was said instead."""
    singles = _of(outcomes, "single", "cluttered")
    lines = []
    for effect in sorted({str(o.answers[0]["effect"]) for o in singles}):
        mine = [o for o in singles if o.answers[0]["effect"] == effect]
        instead = sorted({words(o.top) if o.top else o.word for o in mine if not o.up_to_class})
        counts = f"{sum(o.up_to_class for o in mine)}", f"{sum(o.exact for o in mine)}", f"{len(mine)}"
        lines.append((effect, *counts, ", ".join(instead)))
    return markdown(("effect", "up to class", "by name", "of", "said instead"), lines)
