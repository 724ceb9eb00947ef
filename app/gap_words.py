"""What the dashboard says of a gap: pieces of HTML, with whatever comes from files escaped."""

from html import escape

from app.gap_bench import Diagnosed
from app.gap_tables import cause_parameters, probability_words
from app.words import block
from core.gap.place_words import either_of, place_words
from core.gap.result import Cause, GapReport, Verdict
from core.gap.verdict_words import key_numbers, left_sentence, next_sentence, percent, verdict_sentence
from core.wording import typeset

LOOKS = {
    Verdict.NO_GAP: ("ok", "✔ no gap"),
    Verdict.EXPLAINED: ("ok", "✔ explained"),
    Verdict.PARTLY_EXPLAINED: ("doubt", "? partly explained"),
    Verdict.UNEXPLAINED: ("bad", "✖ not explained"),
}
MOST_WARNINGS = 6
NUMBER = " class='n' style='white-space:nowrap'"
INTRO = (
    "<h3>Gap between sim and arm</h3><p>Which effects make the real arm differ from the simulated one, how sure that "
    "is, how far the gap shrinks without them, and what to measure next.</p>"
)


def intro_words() -> str:
    """What this tab is for."""
    return block(INTRO, "gap-intro")


def verdict_words(found: Diagnosed | None, outdated: bool) -> str:
    """The verdict, or what to do to get one."""
    if found is None:
        return block("<p class='soft'>Nothing is diagnosed yet. Press <b>Diagnose</b>.</p>", "gap-verdict")
    report = found.report
    look, words = LOOKS[report.verdict]
    text = f"<p class='verdict {look}'>{words}</p><p>{_text(verdict_sentence(report))}</p>"
    text += f"<p class='soft'>Of {escape(found.of)}.</p>"
    if outdated:
        text += "<p class='doubt'>The session has changed since: diagnose again.</p>"
    return block(text, "gap-verdict")


def numbers_words(report: GapReport) -> str:
    """Gap, what is left, floor."""
    body = "".join(f"<tr><td>{name}</td><td class='n'>{_text(value)}</td></tr>" for name, value in key_numbers(report))
    left = f"<p class='soft'>{_text(left_sentence(report))}</p>" if report.causes else ""
    return block(f"<table>{body}</table>{left}", "gap-numbers")


def causes_words(report: GapReport) -> str:
    """Every cause with its probability, class and size."""
    if not report.causes:
        return ""
    chance = "<abbr title='How probable it is that this is the cause'>Prob.</abbr>"
    alone = "<abbr title='Share of the gap that this cause closes by itself'>Alone</abbr>"
    head = f"<th></th><th>Cause</th><th{NUMBER}>{chance}</th><th{NUMBER}>{alone}</th>"
    body = "".join(_cause_row(number, cause) for number, cause in enumerate(report.causes, 1))
    return block(f"<h3>Causes</h3><table><tr>{head}</tr>{body}</table>", "gap-causes")


def next_words(report: GapReport) -> str:
    """What to measure next, and what these data cannot answer."""
    ranked = sorted(report.rivals, key=lambda one: -one.separation)
    parts = []
    if ranked:
        items = "".join(f"<li>{_text(next_sentence(one))}</li>" for one in ranked)
        parts.append(f"<h3>To measure next</h3><ul style='padding-left:18px;margin:4px 0'>{items}</ul>")
    if report.warnings:
        shown = report.warnings[:MOST_WARNINGS]
        items = "".join(f"<li>{_text(text)}</li>" for text in shown)
        more = len(report.warnings) - len(shown)
        items += f"<li>and {more} more in the report</li>" if more > 0 else ""
        parts.append(f"<h3>Not known</h3><ul class='soft' style='padding-left:18px;margin:4px 0'>{items}</ul>")
    return block("".join(parts), "gap-next") if parts else ""


def working_words(text: str) -> str:
    """What is being done."""
    return block(f"<p class='soft'>{escape(text)} …</p>", "gap-working") if text else ""


def _cause_row(number: int, cause: Cause) -> str:
    others = [place for place in cause.twins if place != cause.place]
    name = f"<b>{_text(place_words(cause.place))}</b>"
    if others:
        name += f"<br><span class='doubt'>or {_text(either_of(others))}</span>"
    size = cause_parameters(cause)
    name += f"<br><span class='soft'>{_text(size)}</span>" if size else ""
    chances = (probability_words(cause.probability), percent(cause.share_closed))
    numbers = "".join(f"<td{NUMBER}>{_text(words)}</td>" for words in chances)
    return f"<tr><td>{number}</td><td>{name}</td>{numbers}</tr>"


def _text(text: str) -> str:
    return escape(typeset(text))
