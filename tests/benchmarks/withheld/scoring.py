"""The figures of the suite: what was said against what is true."""

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from tests.benchmarks.withheld.asking import campaigns, read_verdicts
from tests.benchmarks.withheld.cases import one_and_the_same
from tests.benchmarks.withheld.matching import UNKNOWN, is_right, members, right_in_class, right_place
from tests.benchmarks.withheld.product import Json, Verdict

SURE = 0.5
ABSTAINED = ("unexplained", "partly_explained")


@dataclass(frozen=True)
class Outcome:
    """One campaign: truth and verdict."""

    name: str
    truth: Json
    verdict: Verdict
    oracle: Verdict | None = None
    without: Verdict | None = None

    @property
    def kind(self) -> str:
        return str(self.truth["kind"])

    @property
    def answers(self) -> list[Json]:
        return list(self.truth["answers"])

    @property
    def records(self) -> int:
        return int(self.truth["records"])

    @property
    def causes(self) -> list[Json]:
        """Strongest first; empty where nothing was said."""
        return causes_of(self.verdict)

    @property
    def top(self) -> Json | None:
        return self.causes[0] if self.causes else None

    @property
    def word(self) -> str:
        """The verdict in one word."""
        if self.verdict.gap is None:
            return "refused" if self.verdict.refused else "crashed"
        return str(self.verdict.gap["verdict"])

    @property
    def crashed(self) -> str:
        """Of whatever was asked: blind, with the cause told, with it forgotten."""
        asked = (self.verdict, self.oracle, self.without)
        return next((one.crashed for one in asked if one is not None and one.crashed), "")

    @property
    def named(self) -> list[Json]:
        """Causes with a name of the table."""
        return [cause for cause in self.causes if cause.get("effect") != UNKNOWN]

    @cached_property
    def exact(self) -> bool:
        """First cause: effect and place of the (first) truth."""
        return self.top is not None and is_right(self.top, self.answers[0], self.records)

    @cached_property
    def up_to_class(self) -> bool:
        return self.top is not None and right_in_class(self.top, self.answers[0], self.records)

    @property
    def placed(self) -> bool:
        return self.top is not None and right_place(self.top, self.answers[0])

    @property
    def has_place(self) -> bool:
        """Whether the (first) truth sits at a joint or link; a frame lies between two."""
        return bool({"joint", "to"} & set(self.answers[0]))

    @property
    def claims(self) -> bool:
        """Whether anything beyond noise was claimed."""
        return bool(self.causes) or self.word in ("explained", *ABSTAINED)

    @property
    def wrong_name(self) -> bool:
        """A first cause by name, more likely than not, whose declared class holds nothing that is true."""
        if self.top is None or self.top["effect"] == UNKNOWN or probability(self.top) <= SURE:
            return False
        return not self.is_true(self.top)

    def is_true(self, cause: Json, exactly: bool = False) -> bool:
        """Whether a cause is among all that is true, the small things included."""
        match = is_right if exactly else right_in_class
        return any(match(cause, truth, self.records) for truth in (*self.answers, *self.truth["also"]))

    @property
    def against_oracle(self) -> float | None:
        """Share closed on kept-out points over that of an oracle that was told the cause."""
        possible = closed_square(self.oracle) if self.oracle else None
        if possible is None or possible <= 0.0:
            return None
        return (closed_square(self.verdict) or 0.0) / possible

    @property
    def promise_missed_by(self) -> float | None:
        """Promised less realised closure on another day; None where nothing was promised or measured."""
        closed, realised = closed_square(self.verdict), self.verdict.realised
        if closed is None or realised is None or not self.causes:
            return None
        gap, floor = self.verdict.gap["gap_rms_mm"], self.verdict.gap["floor_rms_mm"]
        return closed / (gap**2 - floor**2) - realised if floor is not None and gap > floor else None

    @property
    def noticed_without(self) -> bool:
        """With the effect out of the library: unknown, several causes, a class, or no great certainty.

        Where two effects are one and the same on an arm, the name of the other is right: it is of the class.
        """
        assert self.without is not None
        causes = causes_of(self.without)
        if self.without.gap is None:
            return False
        if not causes or self.without.gap["verdict"] in ABSTAINED or len(causes) > 1:
            return self.without.gap["verdict"] != "no_gap"
        if one_and_the_same(str(self.truth["arm"]), str(causes[0]["effect"]), str(self.answers[0]["effect"])):
            return True
        return causes[0]["effect"] == UNKNOWN or len(members(causes[0])) > 2 or probability(causes[0]) <= SURE


def causes_of(verdict: Verdict) -> list[Json]:
    return list(verdict.gap["causes"]) if verdict.gap else []


def probability(cause: Json) -> float:
    return float(cause.get("probability") or 0.0)


def closed_square(verdict: Verdict) -> float | None:
    """gap^2 - left^2 on kept-out points, mm^2; None where one of them is not known."""
    if verdict.gap is None or verdict.gap["gap_rms_mm"] is None or verdict.gap["left_rms_mm"] is None:
        return None
    return float(verdict.gap["gap_rms_mm"]) ** 2 - float(verdict.gap["left_rms_mm"]) ** 2


def read_outcomes(folder: Path) -> list[Outcome]:
    """Every campaign that has a verdict, with its truth."""
    said, oracle, without = (read_verdicts(folder, part) for part in ("verdicts", "oracle", "without"))
    return [
        Outcome(
            campaign.name,
            json.loads((folder / "truth" / f"{campaign.name}.json").read_text()),
            said[campaign.name],
            oracle.get(campaign.name),
            without.get(campaign.name),
        )
        for campaign in campaigns(folder)
        if campaign.name in said
    ]


def share(outcomes: Iterable[Outcome], right: Callable[[Outcome], bool]) -> float:
    """Share of outcomes that are right; NaN of none."""
    marks = [right(outcome) for outcome in outcomes]
    return float(np.mean(marks)) if marks else float("nan")


def brier(pairs: list[tuple[float, bool]]) -> float:
    """Mean square of probability less truth."""
    return float(np.mean([(p - right) ** 2 for p, right in pairs])) if pairs else float("nan")


def calibration_error(pairs: list[tuple[float, bool]], bins: int = 10) -> float:
    """Expected calibration error: |mean probability - share right| by tenths of probability, weighted by counts."""
    if not pairs:
        return float("nan")
    p, right = np.array([pair[0] for pair in pairs]), np.array([pair[1] for pair in pairs], dtype=float)
    which = np.minimum((p * bins).astype(int), bins - 1)
    apart = [abs(np.sum((p - right)[which == k])) for k in range(bins)]
    return float(np.sum(apart) / len(pairs))
