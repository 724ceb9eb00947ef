"""The verdict of a diagnosis in sentences for somebody who has to decide what to do."""

import math

from core.gap.ledger import closed_share
from core.gap.place_words import CALIBRATION, cause_words, either_of, listed
from core.gap.result import NEAR_FLOOR, UNKNOWN, Cause, GapReport, Rivals, Verdict
from core.wording import fixed

FLOORS = {
    "repeats": "as repeated measurements scatter",
    "sigma": "as stated of the instrument, or found by a calibration; no measurement was repeated to check it",
    "unknown": "estimated from what no model explains; nothing was repeated",
}

MOST_NAMED = 3
"""Causes that one sentence can hold."""


def verdict_sentence(report: GapReport) -> str:
    """What is known of the gap, in one sentence. Texts from files are in it as they are."""
    gap, left, floor = (length_words(v) for v in (report.gap_rms_m, report.left_rms_m, report.noise.floor_rms_m))
    match report.verdict:
        case Verdict.NO_GAP if report.calibration_matters:
            return (
                f"No gap beyond what the calibration itself leaves uncertain: on points kept out of the fits real and "
                f"sim differ by {gap}, {left} once the calibration is moved within its own uncertainty, where noise "
                f"alone would leave {floor}."
            )
        case Verdict.NO_GAP if report.gap_rms_m > NEAR_FLOOR * report.noise.floor_rms_m:
            return (
                f"No gap can be shown: on points kept out of the fits real and sim differ by {gap} where noise alone "
                f"would leave {floor}, but these data are too few or too one-sided to tell a gap from where the base "
                "and the targets stand."
            )
        case Verdict.NO_GAP:
            return (
                f"No gap beyond the noise: real and sim differ by {gap}, and {floor} is what noise and the arm's own "
                "repeatability leave even with a perfect sim."
            )
        case Verdict.UNEXPLAINED:
            return (
                f"A gap of {gap} stands out of the noise ({floor}){_located(report)}, "
                "and no effect that is known to the program accounts for it."
            )
        case Verdict.PARTLY_EXPLAINED:
            return (
                f"{_causes(report)} {_takes(report)} the gap from {gap} to {left}; "
                f"what is left stands out of the noise ({floor}) and has no name{_located(report)}."
            )
    near = report.left_rms_m <= NEAR_FLOOR * report.noise.floor_rms_m
    end = f"which is down to the noise ({floor})" if near else f"while noise alone would leave {floor}"
    return f"{_causes(report)} {_takes(report)} the gap from {gap} to {left}, {end}."


def length_words(length_m: float) -> str:
    """A length in mm with three digits that count: 0.0312 mm, 4.51 mm."""
    size = abs(length_m) * 1e3
    if not math.isfinite(size):
        return "an unknown length"
    decimals = 3 if size == 0 else min(max(2 - math.floor(math.log10(size)), 1), 5)
    return f"{fixed(length_m * 1e3, decimals)} mm"


def percent(share: float) -> str:
    """A share as per cent, with a decimal next to none and all; what is not known is said to be so."""
    if not math.isfinite(share):
        return "not known"
    near = 0.0005 < abs(share) < 0.01 or 0.0005 < abs(1 - share) < 0.01
    return f"{fixed(100 * share, 1 if near else 0)} %"


def cause_sentence(cause: Cause) -> str:
    """A cause, how sure it is, and what it accounts for."""
    words = cause_words(cause)
    apart = " (these data cannot tell which)" if len(cause.twins) > 1 else ""
    change = f"{length_words(cause.gap_before_rms_m)} to {length_words(cause.gap_after_rms_m)}"
    return (
        f"{capital(words)}{apart}: probability {percent(cause.probability)}, {change}; "
        f"{percent(cause.share_closed)} of the gap alone, {percent(cause.share_closed_last)} when added last."
    )


def key_numbers(report: GapReport) -> list[tuple[str, str]]:
    """The gap, what is left of it and the floor under it, by name and in words."""
    closed = closed_share(report)
    unnamed = len(_named(report)) < len(report.causes)
    rows = [("Gap", length_words(report.gap_rms_m))]
    if report.calibration_matters:
        rows.append(("Calibration moved", length_words(report.within_calibration_rms_m)))
    rows.append(("Left with the named causes" if unnamed else "Left", length_words(report.left_rms_m)))
    rows.append(("Floor", length_words(report.noise.floor_rms_m)))
    if report.causes and math.isfinite(closed):
        rows.append(("Share closed", percent(closed)))
    return rows


def left_sentence(report: GapReport) -> str:
    """Whether what is left is noise, and how that was judged."""
    test = report.left_test
    judged = f" ({test.name}, {_chance(test.p_value)})" if math.isfinite(test.p_value) else f" ({test.name})"
    left = length_words(report.left_rms_m)
    if test.left_is_noise:
        return f"What is left, {left}, cannot be told from noise{judged if test.name else ''}."
    return f"What is left, {left}, is not noise alone{judged if test.name else ''}."


def next_sentence(rivals: Rivals) -> str:
    """What to measure to tell rivals apart, and how well that would do it."""
    if rivals.separation <= 0:
        return f"{capital(either_of(rivals.places))}: {rivals.next_measurement}"
    return (
        f"{capital(either_of(rivals.places))}: {rivals.next_measurement.rstrip('. ')} "
        f"(expected to set them {rivals.separation:.1f} standard deviations apart)"
    )


def capital(text: str) -> str:
    """The text with a capital letter at its front."""
    return text[:1].upper() + text[1:]


def _chance(p_value: float) -> str:
    return "p < 0.0001" if p_value < 1e-4 else f"p = {p_value:.2g}"


def _named(report: GapReport) -> list[Cause]:
    """The causes that the corrected sim has: what has no name is in what they leave."""
    return [cause for cause in report.causes if cause.place.effect != UNKNOWN]


def _causes(report: GapReport) -> str:
    named = _named(report)
    words = [cause_words(cause) for cause in named[:MOST_NAMED]]
    more = len(named) - len(words)
    words += [f"{more} other cause{'s' if more > 1 else ''}"] if more else []
    words += [CALIBRATION] if words and report.calibration_matters else []
    if len(words) > 1 and any(len(cause.twins) > 1 for cause in named):
        # Alternatives within a list need a stronger mark between its parts.
        words = ["; ".join([*words[:-1], f"and {words[-1]}"])]
    return capital(listed(words)) or "Nothing"


def _takes(report: GapReport) -> str:
    return "take" if len(_named(report)) + report.calibration_matters > 1 else "takes"


def _located(report: GapReport) -> str:
    """Where an unknown sits, if that is known."""
    places = [f"an {cause_words(c)}" for c in report.causes if c.place.effect == UNKNOWN]
    return f" ({listed(places)})" if places else ""
