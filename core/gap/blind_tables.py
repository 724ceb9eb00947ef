"""A blind check as tables for other programs: what was there against what was said, and campaign by campaign."""

import csv
import io

from core.gap.blind_answers import EVERYWHERE, Answer
from core.gap.blind_check import Said
from core.gap.blind_score import Case, Score
from core.gap.place_words import place_words

HEADINGS = ("campaign", "there", "verdict", "said", "probability", "class", "met", "met_up_to_class", "share_closed")


def confusion_csv(score: Score) -> str:
    """One row for every effect that is there, one column for every one that was said of it."""
    table = score.confusion
    counts = (map(int, row) for row in table.counts)
    return _csv([["there", *table.columns], *([name, *row] for name, row in zip(table.rows, counts, strict=True))])


def campaigns_csv(score: Score) -> str:
    """One row a campaign; several effects or causes in one cell are parted by semicolons."""
    return _csv([HEADINGS, *(_row(case) for case in score.cases)])


def answer_words(answer: Answer) -> str:
    """An answer as it was understood: ``backlash, joint 3``."""
    parts = [f"{part} {EVERYWHERE if value is None else value}" for part, value in answer.given]
    return ", ".join([answer.effect, *parts])


def there_words(case: Case) -> str:
    """Everything that is there; what is not asked for stands in brackets."""
    asked = "; ".join(map(answer_words, case.answers)) or "nothing"
    return f"{asked} (and {'; '.join(map(answer_words, case.also))})" if case.also else asked


def said_words(said: Said) -> str:
    """Everything that was said, or why nothing was."""
    if said.verdict is None:
        return said.failure
    return "; ".join(place_words(cause.place) for cause in said.causes) or "nothing"


def _row(case: Case) -> list[object]:
    said = case.said
    return [
        said.name,
        there_words(case),
        "" if said.verdict is None else str(said.verdict),
        said_words(said),
        "; ".join(f"{cause.probability:.3f}" for cause in said.causes),
        "; ".join(" or ".join(map(place_words, cause.places)) for cause in said.causes),
        f"{sum(k is not None for k in case.exact)} of {len(case.answers)}",
        f"{sum(k is not None for k in case.up_to_class)} of {len(case.answers)}",
        f"{case.share_closed:.4f}" if case.answers and case.share_closed == case.share_closed else "",
    ]


def _csv(rows: list) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()
