"""A diagnosis and a blind check in a few lines for a person at a terminal."""

import math
from pathlib import Path

from app.gap_tables import cause_parameters
from core.gap.blind_check import Said
from core.gap.blind_score import Confusion, Score, Share, TopOne
from core.gap.place_words import CALIBRATION, cause_words
from core.gap.result import Cause, GapReport, Rivals
from core.gap.verdict_words import left_sentence, length_words, next_sentence, percent, verdict_sentence

MOST_CAUSES, MOST_NEXT, MOST_WARNINGS, MOST_NAMES = 8, 3, 5, 8


def gap_summary(report: GapReport, folder: Path) -> str:
    """The verdict, what shrinks the gap, what to measure next, and where the files are.

    Args:
        folder: where gap.json and report.html are.
    """
    gap, left, floor = (length_words(v) for v in (report.gap_rms_m, report.left_rms_m, report.noise.floor_rms_m))
    lines = [
        report.campaign.title or "(a campaign without a title)",
        verdict_sentence(report),
        f"  sim      {report.sim}",
        f"  gap      {gap} -> {left} (floor {floor}), rms over points kept out of the fits",
        *_calibration_line(report),
        *(line for number, cause in enumerate(report.causes[:MOST_CAUSES], 1) for line in _cause_lines(number, cause)),
        *([f"  and {more} more causes in the report"] if (more := len(report.causes) - MOST_CAUSES) > 0 else []),
        *([f"  left     {left_sentence(report)}"] if report.causes else []),
        *_listed("next", [next_sentence(one) for one in _ranked(report)], MOST_NEXT),
        *_listed("unknown", list(report.warnings), MOST_WARNINGS),
        "",
        f"Written: {folder / 'gap.json'}, {folder / 'corrected_points.csv'}, {folder / 'report.html'}",
    ]
    return "\n".join(lines)


def _calibration_line(report: GapReport) -> list[str]:
    if not report.causes or not report.calibration_matters:
        return []
    return [f"           {length_words(report.within_calibration_rms_m)} with {CALIBRATION}"]


def blind_summary(said: tuple[Said, ...], score: Score, notes: tuple[str, ...], files: tuple[Path, ...]) -> str:
    """The score of a blind check, its confusion table, and where the files are."""
    sets = score.sets
    rows = [
        ("one effect, first cause", _top(score.single)),
        ("mixtures, first cause", _top(score.mixture)),
        ("mixtures, precision", _both(sets.precision, sets.precision_up_to_class, sets.campaigns)),
        ("mixtures, recall", _both(sets.recall, sets.recall_up_to_class, sets.campaigns)),
        ("mixtures, all found", _share(sets.all_found)),
        ("false alarms on nothing", _share(score.false_alarms)),
        ("no candidate: detected", _share(score.other_detected)),
        ("no candidate: misnamed", _share(score.other_named_wrongly)),
        ("confident wrong names", _share(score.wrong_names)),
        ("Brier", f"{_figure(score.by_name.brier)} ({_figure(score.by_class.brier)} up to class)"),
        ("calibration error", f"{_figure(score.by_name.expected_error)} ({_figure(score.by_class.expected_error)})"),
        ("gap closed", f"median {percent(score.median_closed)}, 10th percentile {percent(score.tenth_closed)}"),
    ]
    failed = [one for one in said if one.verdict is None]
    return "\n".join(
        [
            f"{len(said)} campaigns diagnosed blind, {len(score.cases)} of them scored",
            *(f"  {name:<26}{value}" for name, value in rows),
            "",
            *confusion_lines(score.confusion),
            *(f"Not diagnosed: {one.name}: {one.failure}" for one in failed[:MOST_NAMES]),
            *([f"Not diagnosed: {len(failed) - MOST_NAMES} more"] if len(failed) > MOST_NAMES else []),
            *(f"Note: {note}" for note in notes),
            "",
            f"Written: {', '.join(map(str, files))}",
        ]
    )


def confusion_lines(table: Confusion) -> list[str]:
    """What was there (down) against what was said of it (across), as text; zeros are dots."""
    if not table.rows:
        return []
    heads = [str(k) for k in range(1, len(table.columns) + 1)]
    wide = max(len(name) for name in table.rows)
    lines = ["What was there, and how often it was called:", f"  {'':<{wide}} {''.join(f'{h:>4}' for h in heads)}"]
    for name, row in zip(table.rows, table.counts, strict=True):
        lines.append(f"  {name:<{wide}} {''.join(f'{count or chr(46):>4}' for count in row)}")
    legend = ", ".join(f"{head} {name}" for head, name in zip(heads, table.columns, strict=True))
    return [*lines, f"  {legend}", ""]


def _cause_lines(number: int, cause: Cause) -> list[str]:
    sure = f"probability {percent(cause.probability)}"
    steps = f"{length_words(cause.gap_before_rms_m)} -> {length_words(cause.gap_after_rms_m)}"
    lines = [f"  cause {number}  {cause_words(cause)}: {sure}, {steps}"]
    sizes = cause_parameters(cause)
    return [*lines, f"           {sizes}"] if sizes else lines


def _ranked(report: GapReport) -> list[Rivals]:
    return sorted(report.rivals, key=lambda one: -one.separation)


def _listed(label: str, texts: list[str], most: int) -> list[str]:
    lines = [f"  {label:<8} {text}" for text in texts[:most]]
    more = len(texts) - most
    return [*lines, f"  {label:<8} and {more} more in the report"] if more > 0 else lines


def _top(found: TopOne) -> str:
    if not found.exact.of:
        return "none"
    said = f"{_share(found.exact)} exact, {percent(found.up_to_class.share)} up to class"
    return f"{said}, joint {percent(found.joint.share)}" if found.joint.of else said


def _both(exact: float, up_to_class: float, campaigns: int) -> str:
    return f"{_figure(exact)} exact, {_figure(up_to_class)} up to class" if campaigns else "none"


def _share(share: Share) -> str:
    return f"{percent(share.share)} ({share.count} of {share.of})" if share.of else "none"


def _figure(value: float) -> str:
    return f"{value:.3f}" if math.isfinite(value) else "not known"
