"""The report of a diagnosis on one page: where sim and real part, why, how far that shrinks, what is not known."""

import numpy as np

from app.figures.gap_map import gap_map_figure
from app.figures.gap_steps import gap_steps_figure
from app.figures.gap_vectors import gap_vectors_figure
from app.figures.gap_where import gap_records_figure, gap_shares_figure
from app.figures.reliability import reliability_figure
from app.gap_tables import (
    shown_causes,
    shown_ledger,
    shown_limits,
    shown_noise,
    shown_outliers,
    shown_transfers,
)
from app.report_page import Item, Page, Plot, Section, page_html
from core.gap.ledger import switches
from core.gap.place_words import MEANINGS, effect_name
from core.gap.result import UNKNOWN, GapReport, Verdict
from core.gap.verdict_words import (
    capital,
    cause_sentence,
    key_numbers,
    left_sentence,
    next_sentence,
    verdict_sentence,
)
from core.version import VERSION
from core.wording import is_simulated, typeset

VERDICTS = {
    Verdict.EXPLAINED: "explained",
    Verdict.PARTLY_EXPLAINED: "partly explained",
    Verdict.UNEXPLAINED: "not explained",
    Verdict.NO_GAP: "no gap",
}
METHOD = (
    "Every effect that the program knows is an exact model of what it would do to each measured point, at every place "
    "where it could sit. Beside them stand nameless ones, smooth functions of a joint, of time or of the "
    "configuration, so that something unknown is found and located rather than given the name of something else. "
    "The noise is estimated first, from repeated measurements where there are any; nothing is claimed that noise "
    "alone would show in a protocol like this one.",
    "Where the base stands, and where targets sit whose places are not known, is fitted in every comparison, before "
    "and after: that is not counted as a gap. All lengths called gap are root mean square lengths of real minus sim "
    "over points that were kept out of the fit.",
)
TERMS = (
    ("Gap", "Root mean square length of real minus sim over points kept out of every fit, in mm."),
    ("Floor", "What the gap would be if the sim were perfect: noise of the instrument, repeatability of the arm."),
    ("Share closed", "How much of gap² − floor² goes away: alone, or when it is added after all the other causes."),
    ("Probability", "That effect and place are both right."),
    (
        "Class",
        "Causes that move these points in ways too much alike to be told apart; which of them it is, is not known.",
    ),
    ("Log odds", "How strongly the data speak for the effect against none, natural logarithm; 5 is strong."),
)
KEPT_OUT = "Kept out"
MOST_IN_SUMMARY = 5


def gap_html(report: GapReport) -> str:
    """The report as one self-contained page."""
    return page_html(gap_page(report))


def gap_page(report: GapReport) -> Page:
    """The report as sections, before it becomes HTML."""
    campaign = report.campaign
    sections = (
        _shrinks(report),
        _causes(report),
        _space(report),
        _where(report),
        _transfer(report),
        _unknown(report),
        _next(report),
        _noise(report),
        _limits(report),
        _outliers(report),
        _reliability(report),
        Section("method", "Method and terms", METHOD, terms=(*TERMS, *_meanings(report))),
    )
    return Page(
        kind="Sim-to-real gap",
        title=campaign.title or campaign.robot.name,
        badge="SIMULATED: no robot was measured" if is_simulated(campaign) else "",
        summary=_summary(report),
        facts=_facts(report),
        sections=tuple(s for s in sections if s is not None),
        figures=_key_numbers(report),
        lead=typeset(verdict_sentence(report)),
    )


def _summary(report: GapReport) -> tuple[str, ...]:
    lines = [cause_sentence(cause) for cause in report.causes[:MOST_IN_SUMMARY]]
    if len(report.causes) > MOST_IN_SUMMARY:
        lines.append(f"{len(report.causes) - MOST_IN_SUMMARY} more causes are in the table.")
    if report.verdict is not Verdict.NO_GAP:
        lines += [left_sentence(report), f"Worst region: {_sentence(report.where.worst_region)}"]
    if report.rivals:
        lines.append(f"To measure next: {_sentence(report.rivals[0].next_measurement)}")
    if report.warnings:
        count = len(report.warnings)
        lines.append(f"{count} question{'s' if count > 1 else ''} these data cannot answer; see what is not known.")
    return tuple(typeset(line) for line in lines)


def _key_numbers(report: GapReport) -> tuple[tuple[str, str], ...]:
    points = ("Points", f"{len(report.rows)}")
    return (("Verdict", VERDICTS[report.verdict]), *key_numbers(report), points)


def _facts(report: GapReport) -> tuple[tuple[str, str], ...]:
    campaign = report.campaign
    return (
        ("Robot", campaign.robot.name),
        ("The sim", report.sim),
        ("Instrument", campaign.instrument.kind.replace("-", " ")),
        ("Joint values", campaign.joint_values),
        (KEPT_OUT, report.hold_out),
        ("Computed in", f"{report.seconds:.1f} s, at most {report.peak_memory_mb:.0f} MB"),
        ("Software", f"trueaxis {VERSION}"),
        ("SHA-256 of input", campaign.digest or "not read from files"),
    )


def _shrinks(report: GapReport) -> Section:
    note = "Every bar holds the causes above it. Dotted: the floor. What has no name cannot be put into a sim."
    plot = Plot(gap_steps_figure(report), note)
    text = (
        f"Kept out of the fits: {report.hold_out.strip().rstrip('.')}.",
        *([left_sentence(report)] if report.causes else []),
    )
    return Section("shrinks", "How far it shrinks", _typeset(text), plots=(plot,), tables_after=(shown_ledger(report),))


def _causes(report: GapReport) -> Section:
    figure = gap_map_figure(report)
    caption = (
        "The number is that of the cause in the table; a number with a question mark, joined by a line, marks what "
        "these data cannot tell from it. Empty: it could not be tested with these data."
    )
    plots = () if figure is None else (Plot(figure, caption),)
    if not report.causes:
        said = "No effect is named." if report.verdict is not Verdict.NO_GAP else "Nothing asks for a cause."
        return Section("causes", "Which effects", (said,), plots=plots)
    return Section("causes", "Which effects", tables=(shown_causes(report),), plots=plots)


def _space(report: GapReport) -> Section | None:
    figure = None if report.verdict is Verdict.NO_GAP else gap_vectors_figure(report)
    if figure is None:
        return None
    caption = "Arrows begin where the sim has a point and end where it was measured, magnified."
    names = tuple(switch.words for switch in switches(report))
    if names:
        caption += " Tick a cause to add it to the sim: what is left of the arrows is what it does not explain."
    text = (_sentence(report.where.worst_region),) if report.where.worst_region else ()
    plot = Plot(figure, f"{caption} Turn with the mouse.", names)
    return Section("space", "The worst region", _typeset(text), plots=(plot,))


def _where(report: GapReport) -> Section:
    plots = [Plot(gap_records_figure(report), "Fitted on all points; outliers are shown as well.")]
    shares = (*report.where.by_joint, *(() if report.verdict is Verdict.NO_GAP else (1.0,)))
    if report.verdict is not Verdict.NO_GAP or np.any(np.asarray(shares) > 0):
        caption = "Shares of the gap beyond the floor. About a joint: along its axis, away from it, along the arc."
        plots.insert(0, Plot(gap_shares_figure(report), caption))
    return Section("where", "Where it lies", plots=tuple(plots))


def _transfer(report: GapReport) -> Section | None:
    if not report.transfers:
        return None
    text = (
        "The hardest test of a cause: fitted on one kind of data, it must explain another. A wrong cause that only "
        "looks right fails one of these.",
    )
    return Section("transfer", "Does it hold elsewhere", text, tables=(shown_transfers(report),))


def _unknown(report: GapReport) -> Section | None:
    items = [Item(_sentence(text), True) for text in report.warnings]
    for number, cause in enumerate(report.causes, 1):
        if cause.place.effect == UNKNOWN:
            items.append(Item(f"Cause {number} is located, not named: no effect that is known describes it.", True))
        elif len(cause.twins) > 1:
            items.append(Item(f"Cause {number} is one of {len(cause.twins)} that these data cannot tell apart.", True))
    items += [Item(_sentence(text)) for text in report.notes]
    if not items:
        return None
    return Section("unknown", "What is not known", items=tuple(Item(typeset(i.text), i.significant) for i in items))


def _next(report: GapReport) -> Section | None:
    if not report.rivals:
        return None
    text = ("Some causes are open. These measurements would decide between them, the strongest first.",)
    ranked = sorted(report.rivals, key=lambda one: -one.separation)
    items = tuple(Item(typeset(_sentence(next_sentence(one))), one.separation > 0) for one in ranked)
    return Section("next", "What to measure next", text, items=items)


def _noise(report: GapReport) -> Section:
    return Section("noise", "Noise and floor", tables=(shown_noise(report),))


def _limits(report: GapReport) -> Section | None:
    if not report.limits:
        return None
    text = ("The smallest size of each effect that these data would have shown, had it acted alone.",)
    return Section("limits", "What would have been seen", text, tables=shown_limits(report))


def _outliers(report: GapReport) -> Section | None:
    if not report.outliers:
        return None
    text = ("They stand so far out that noise alone would not put them there, and were left out of every fit.",)
    return Section("outliers", "Points left out", text, tables=(shown_outliers(report),))


def _reliability(report: GapReport) -> Section | None:
    found = report.reliability
    if found is None or not np.any(found.worlds > 0):
        return None
    title = "How often such probabilities were right"
    figure = reliability_figure(found.said, found.right, found.worlds, "worlds", title)
    text = (
        "The same program diagnosed simulated worlds of this robot and protocol in which the cause was known. "
        "Bars are ±2 standard deviations of a share of so many.",
    )
    return Section("reliability", "Can the probabilities be believed", text, plots=(Plot(figure, ""),))


def _meanings(report: GapReport) -> tuple[tuple[str, str], ...]:
    """What the effects mean that this page names."""
    named = {place.effect for cause in report.causes for place in (cause.place, *cause.twins)}
    named |= {place.effect for one in report.rivals for place in one.places}
    named |= {cell.place.effect for cell in report.evidence_map}
    return tuple((capital(effect_name(effect)), text) for effect, text in MEANINGS.items() if effect in named)


def _typeset(lines: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(typeset(line) for line in lines)


def _sentence(text: str) -> str:
    """A text as a sentence of its own."""
    text = capital(text.strip())
    return text if not text or text[-1] in ".!?" else f"{text}."
