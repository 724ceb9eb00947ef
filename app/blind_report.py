"""The report of a blind check: what was there against what was said."""

import numpy as np

from app.figures.reliability import reliability_figure
from app.report_page import Cell, Heading, Page, Plot, Section, ShownTable, page_html
from core.gap.blind_json import score_record
from core.gap.blind_score import Case, Confusion, Score, Share, TopOne
from core.gap.blind_tables import said_words, there_words
from core.gap.place_words import effect_name
from core.gap.verdict_words import percent
from core.version import VERSION

MOST_ROWS = 1000
RULE = (
    "Every campaign was diagnosed from its own folder alone. What was said was written down, and was on the disk, "
    "before the answers were opened; blind.json holds it with its SHA-256.",
)


def blind_html(score: Score, notes: tuple[str, ...] = ()) -> str:
    """The report as one self-contained page."""
    return page_html(blind_page(score, notes))


def blind_page(score: Score, notes: tuple[str, ...] = ()) -> Page:
    """The report as sections, before it becomes HTML."""
    missed = [case for case in score.cases if not _right(case)]
    sections = (
        Section("score", "Score", tables=(_score_table(score),)),
        _confusion(score.confusion),
        _probabilities(score),
        Section("missed", "What went wrong", tables=(_cases("Campaigns with an error", missed),)) if missed else None,
        Section("all", "Campaign by campaign", tables=(_cases("All campaigns", list(score.cases)),)),
        Section("method", "What is counted", RULE, terms=_terms(score)),
    )
    return Page(
        kind="Blind check",
        title=f"{len(score.cases)} campaigns",
        badge="",
        summary=(*notes, *(f"Not diagnosed: {name}." for name in score.not_diagnosed[:20])),
        facts=(("Software", f"trueaxis {VERSION}"),),
        sections=tuple(section for section in sections if section is not None),
        figures=_key_numbers(score),
        lead=_lead(score),
    )


def _lead(score: Score) -> str:
    single, alarms = score.single, score.false_alarms
    parts = []
    if single.exact.of:
        parts.append(
            f"of {single.exact.of} campaigns with one effect it was named rightly in {single.exact.count}, "
            f"and in {single.up_to_class.count} up to causes that were declared inseparable"
        )
    if alarms.of:
        parts.append(f"of {alarms.of} with nothing wrong {alarms.count} raised an alarm")
    text = "; ".join(parts) or "no campaign had one effect or none"
    return f"{text[:1].upper()}{text[1:]}."


def _key_numbers(score: Score) -> tuple[tuple[str, str], ...]:
    shown = [
        ("Exact, one effect", percent(score.single.exact.share), score.single.exact.of),
        ("Up to class", percent(score.single.up_to_class.share), score.single.up_to_class.of),
        ("Joint", percent(score.single.joint.share), score.single.joint.of),
        ("False alarms", percent(score.false_alarms.share), score.false_alarms.of),
        ("Confident wrong names", percent(score.wrong_names.share), score.wrong_names.of),
        ("Brier", _figure(score.by_name.brier), score.by_name.claims),
        ("Gap closed, median", percent(score.median_closed), int(np.isfinite(score.median_closed))),
    ]
    return tuple((label, value) for label, value, of in shown if of)


def _score_table(score: Score) -> ShownTable:
    sets = score.sets
    rows = [
        *_top_rows("one effect", score.single),
        *_top_rows("mixtures", score.mixture),
        ("mixtures: precision of the set", _figure(sets.precision), sets.campaigns),
        ("mixtures: precision, up to class", _figure(sets.precision_up_to_class), sets.campaigns),
        ("mixtures: recall of the set", _figure(sets.recall), sets.campaigns),
        ("mixtures: recall, up to class", _figure(sets.recall_up_to_class), sets.campaigns),
        ("mixtures: all found, up to class", *_share(sets.all_found)),
        ("nothing wrong: false alarms", *_share(score.false_alarms)),
        ("no candidate: detected", *_share(score.other_detected)),
        ("no candidate: single wrong name", *_share(score.other_named_wrongly)),
        ("confident wrong names, after abstention", *_share(score.wrong_names)),
        ("Brier score", _figure(score.by_name.brier), score.by_name.claims),
        ("Brier score, up to class", _figure(score.by_class.brier), score.by_class.claims),
        ("expected calibration error", _figure(score.by_name.expected_error), score.by_name.claims),
        ("expected calibration error, up to class", _figure(score.by_class.expected_error), score.by_class.claims),
        ("share of the gap closed, median", percent(score.median_closed), ""),
        ("share of the gap closed, 10th percentile", percent(score.tenth_closed), ""),
    ]
    headings = (Heading("figure"), Heading("value", numeric=True), Heading("of", numeric=True))
    group = tuple((Cell(n), Cell(v, numeric=True), Cell(str(of), numeric=True)) for n, v, of in rows if of != 0)
    return ShownTable("Figures, and of how many campaigns or claims", headings, (group,))


def _confusion(table: Confusion) -> Section | None:
    """Columns go by number, so that all of them fit on a sheet."""
    if not table.rows:
        return None
    numbers = {name: str(k) for k, name in enumerate(table.columns, 1)}
    headings = (Heading("there"), *(Heading(numbers[name], effect_name(name), True) for name in table.columns))
    group = tuple(
        (
            Cell(f"{numbers.get(name, '')} {effect_name(name)}".strip(), heading=True),
            *(Cell(str(n) if n else "·", numeric=True, mark="" if n else "muted") for n in row),
        )
        for name, row in zip(table.rows, table.counts, strict=True)
    )
    legend = ", ".join(f"{number} {effect_name(name)}" for name, number in numbers.items())
    note = "Of one effect the strongest cause; of mixtures the cause that met each effect, by name or by its class."
    shown = ShownTable("What was there, and what it was called", headings, (group,), f"Called: {legend}. {note}", True)
    return Section("confusion", "Confusion table", tables=(shown,))


def _probabilities(score: Score) -> Section | None:
    if not score.by_name.claims:
        return None
    plots = tuple(
        Plot(reliability_figure(one.said, one.right, one.count, "claims", title), caption)
        for one, title, caption in (
            (score.by_name, "Effect and place", "Right: the name itself. Bars: ±2 standard deviations."),
            (score.by_class, "Up to class", "Right: one of the declared class. Bars: ±2 standard deviations."),
        )
    )
    return Section("probabilities", "Do the probabilities mean what they say", plots=plots)


def _cases(caption: str, cases: list[Case]) -> ShownTable:
    headings = tuple(Heading(text) for text in ("campaign", "there", "verdict", "said", "probability", "class"))
    group = tuple(_case_row(case) for case in cases[:MOST_ROWS])
    more = len(cases) - MOST_ROWS
    note = f"And {more} more; all of them are in campaigns.csv." if more > 0 else ""
    return ShownTable(caption, headings, (group,), note, dense=True)


def _case_row(case: Case) -> tuple[Cell, ...]:
    said = case.said
    verdict = "not diagnosed" if said.verdict is None else str(said.verdict).replace("_", " ")
    twins = "; ".join(str(len(cause.places)) for cause in said.causes)
    chances = "; ".join(percent(cause.probability) for cause in said.causes)
    texts = (said.name, there_words(case), verdict, said_words(said), chances, twins)
    return tuple(Cell(text, mark="" if _right(case) or k != 3 else "significant") for k, text in enumerate(texts))


def _right(case: Case) -> bool:
    """Whether nothing is to be held against what was said."""
    if case.said.verdict is None or case.wrong_names:
        return False
    if case.empty:
        return not case.alarmed
    return case.detected if case.beyond else all(k is not None for k in case.up_to_class)


def _terms(score: Score) -> tuple[tuple[str, str], ...]:
    meanings = score_record(score)["definitions"]
    return tuple((name.replace("_", " "), f"{text[:1].upper()}{text[1:]}.") for name, text in meanings.items())


def _top_rows(name: str, found: TopOne) -> list[tuple]:
    return [
        (f"{name}: first cause right, exactly", *_share(found.exact)),
        (f"{name}: first cause right, up to class", *_share(found.up_to_class)),
        (f"{name}: joint of the first cause right", *_share(found.joint)),
    ]


def _share(share: Share) -> tuple[str, int]:
    return percent(share.share), share.of


def _figure(value: float) -> str:
    return f"{value:.3f}" if np.isfinite(value) else "not known"
