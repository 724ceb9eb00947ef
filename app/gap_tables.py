"""The tables of a diagnosis as the report shows them."""

import math

from app.report_cells import aligned, count, number
from app.report_page import Cell, Heading, ShownTable
from core.gap.ledger import ledger
from core.gap.parameter_units import shown_limit, shown_parameter
from core.gap.place_words import NAMES, effect_name, either_of, place_words
from core.gap.result import Cause, DetectionLimit, GapReport, Parameter
from core.gap.verdict_words import FLOORS, length_words, percent
from core.wording import decimals_for, fixed, with_uncertainty

MOST_OUTLIERS = 60
MOST_PARAMETERS = 4
"""Of one cause, in a cell."""
NOWHERE = "–"
NOT_AT_ALL = "∞"
SAME = 0.01
"""Gaps that differ by less are called the same."""
SOURCES = {
    "replicates": "repeated measurements",
    "residuals": "what a flexible fit leaves; nothing was repeated",
    "statement": "as stated; the data could not check it",
}


def shown_causes(report: GapReport) -> ShownTable:
    """Every cause with its probability, class, size and what it accounts for."""
    headings = (
        Heading("No.", numeric=True),
        Heading("Cause"),
        Heading("Probability", "That effect and place are both right", True),
        Heading("Cannot be told from"),
        Heading("Size", "Estimates with one standard uncertainty"),
        Heading("Before, mm", "Gap before it was added, after all stronger ones", True),
        Heading("After, mm", "Gap once it is added", True),
        Heading("Alone", "Share of gap² − floor² that it closes by itself", True),
        Heading("Last", "The same when it is added after all the others", True),
    )
    group = [_cause_row(number_, cause) for number_, cause in enumerate(report.causes, 1)]
    return ShownTable("Causes, the strongest first", headings, aligned([group]), dense=True)


def shown_ledger(report: GapReport) -> ShownTable:
    """Mean squares that add up to the gap."""
    headings = (Heading("part"), Heading("mean square, mm²", numeric=True), Heading("share", numeric=True))
    lines = ledger(report)
    smallest = min((abs(line.square_m2) * 1e6 for line in lines if line.square_m2), default=1.0)
    decimals = decimals_for(smallest, 4)
    rows = [
        [Cell(line.words), number(line.square_m2 * 1e6, decimals=decimals), Cell(percent(line.share), numeric=True)]
        for line in lines
    ]
    whole = [Cell("the whole gap", heading=True), number(report.gap_rms_m**2 * 1e6, decimals=decimals)]
    total = [*whole, Cell(percent(1.0 if report.gap_rms_m > 0 else math.nan), numeric=True)]
    note = f"Mean squares add up where lengths do not: the root of {_square(report)} mm² is the gap."
    return ShownTable("Where the gap goes", headings, aligned([rows, [total]]), note)


def shown_transfers(report: GapReport) -> ShownTable:
    """Fits on some data, judged on others."""
    headings = (
        Heading("Fitted on"),
        Heading("Predicted"),
        Heading("Points", numeric=True),
        Heading("Gap before, mm", numeric=True),
        Heading("Gap after, mm", numeric=True),
        Heading("Holds"),
    )
    rows = [
        [
            Cell(one.fitted_on),
            Cell(one.predicted),
            count(one.points),
            number(one.gap_before_rms_m * 1e3),
            number(one.gap_after_rms_m * 1e3),
            _holds(one.gap_before_rms_m, one.gap_after_rms_m),
        ]
        for one in report.transfers
    ]
    return ShownTable("The causes elsewhere", headings, aligned([rows]))


def shown_noise(report: GapReport) -> ShownTable:
    """What was found of the noise."""
    noise = report.noise
    stated = "not stated" if noise.stated_m is None else length_words(noise.stated_m)
    tails = "as those of a normal distribution"
    if math.isfinite(noise.tail_degrees):
        tails = f"heavier than normal: Student's, {fixed(noise.tail_degrees, 1)} degrees of freedom"
    rows = [
        ("σ of one coordinate, stated", stated),
        ("σ of one coordinate, used", length_words(noise.used_m)),
        ("known from", f"{SOURCES.get(noise.source, noise.source)} ({fixed(noise.degrees_of_freedom, 0)} dof)"),
        ("tails", tails),
        ("correlation of neighbours", fixed(noise.correlation, 2)),
        ("floor, rms length", f"{length_words(noise.floor_rms_m)}, {FLOORS[noise.floor_source]}"),
    ]
    group = tuple((Cell(name, heading=True), Cell(value)) for name, value in rows)
    return ShownTable("The noise of the measured points", (Heading("quantity"), Heading("value")), (group,))


def shown_limits(report: GapReport) -> tuple[ShownTable, ...]:
    """Effects against joints, and those that sit elsewhere."""
    at_joints = [one for one in report.limits if one.place.joint is not None]
    elsewhere = [one for one in report.limits if one not in at_joints]
    tables = [_limit_grid(report, at_joints)] if at_joints else []
    return (*tables, _limit_list(elsewhere)) if elsewhere else tuple(tables)


def shown_outliers(report: GapReport) -> ShownTable:
    """Points that were left out."""
    headings = (Heading("record", numeric=True), Heading("real minus sim, mm", numeric=True))
    ranked = sorted(report.outliers, key=lambda one: -one.length_m)
    rows = [[count(one.record), number(one.length_m * 1e3)] for one in ranked[:MOST_OUTLIERS]]
    more = len(ranked) - MOST_OUTLIERS
    note = f"And {more} more; all of them are in gap.json." if more > 0 else ""
    return ShownTable("The largest first", headings, aligned([rows]), note)


def probability_words(probability: float) -> str:
    """A probability as per cent; none is said to be impossible or certain."""
    if probability < 0.01:
        return "< 1 %"
    return "> 99 %" if probability > 0.99 else percent(probability)


def cause_parameters(cause: Cause) -> str:
    """The clearest estimates of a cause in units of people, with their uncertainties."""
    ranked = sorted(range(len(cause.parameters)), key=lambda k: -_clearness(cause.parameters[k]))
    shown = [shown_parameter(cause.parameters[k]) for k in sorted(ranked[:MOST_PARAMETERS])]
    words = [f"{one.words} {with_uncertainty(one.value, one.std, one.symbol)}" for one in shown]
    more = len(ranked) - len(shown)
    return "; ".join([*words, *([f"{more} more in gap.json"] if more else [])])


def _clearness(parameter: Parameter) -> float:
    """How many standard uncertainties it is from zero; what has none was chosen and comes first."""
    known = math.isfinite(parameter.std) and parameter.std > 0
    return abs(parameter.value) / parameter.std if known else math.inf


def _cause_row(number_: int, cause: Cause) -> list[Cell]:
    others = [place for place in cause.twins if place != cause.place]
    return [
        count(number_),
        Cell(place_words(cause.place)),
        Cell(probability_words(cause.probability), numeric=True),
        Cell(either_of(others) or NOWHERE, mark="" if others else "muted"),
        Cell(cause_parameters(cause) or NOWHERE),
        number(cause.gap_before_rms_m * 1e3),
        number(cause.gap_after_rms_m * 1e3),
        Cell(percent(cause.share_closed), numeric=True),
        Cell(percent(cause.share_closed_last), numeric=True),
    ]


def _holds(before: float, after: float) -> Cell:
    """Whether the causes make the other data better too."""
    if not (math.isfinite(before) and math.isfinite(after)):
        return Cell("")
    if abs(after - before) <= SAME * before:
        return Cell("the same")
    return Cell("better") if after < before else Cell("worse", mark="significant")


def _limit_grid(report: GapReport, limits: list[DetectionLimit]) -> ShownTable:
    """One row for each effect and unit, and for each joint that may drag others along."""
    joints = range(1, report.campaign.robot.joint_count + 1)
    sizes: dict[tuple, dict[int | None, float]] = {}
    for one in limits:
        size, unit = shown_limit(one)
        sizes.setdefault((_rank(one.place.effect), one.place.source or 0, unit), {})[one.place.joint] = size
    headings = (Heading("effect"), Heading("unit"), *(Heading(f"joint {joint}", numeric=True) for joint in joints))
    group = tuple(
        (Cell(_drags(effect, source)), Cell(unit), *(_size(sizes[row].get(joint)) for joint in joints))
        for row in sorted(sizes)
        for (_, effect), source, unit in [row]
    )
    note = f"{NOT_AT_ALL}: not to be seen at any size, because where base or targets stand absorbs it."
    absorbed = any(cell.text == NOT_AT_ALL for row in group for cell in row)
    return ShownTable("At joints and links", headings, (group,), note if absorbed else "")


def _limit_list(limits: list[DetectionLimit]) -> ShownTable:
    ranked = sorted(limits, key=lambda one: (_rank(one.place.effect), place_words(one.place)))
    headings = (
        Heading("effect"),
        Heading("size", numeric=True),
        Heading("unit"),
        Heading("moves points by, mm", "", True),
    )
    group = tuple(
        (Cell(place_words(one.place)), _size(shown_limit(one)[0]), Cell(shown_limit(one)[1]), _moves(one))
        for one in ranked
    )
    return ShownTable("Elsewhere", headings, (group,))


def _drags(effect: str, source: int) -> str:
    return f"{effect_name(effect)} from joint {source}, to" if source else effect_name(effect)


def _moves(limit: DetectionLimit) -> Cell:
    """What an effect that large does to the points; nothing to be said where no size is large enough."""
    return _size(limit.rms_m * 1e3 if math.isfinite(shown_limit(limit)[0]) else None)


def _size(value: float | None) -> Cell:
    known = value is not None and math.isfinite(value)
    words = NOT_AT_ALL if value == math.inf else ""
    return Cell(fixed(value, decimals_for(value)) if known else words, numeric=True, mark="" if known else "muted")


def _rank(effect: str) -> tuple[int, str]:
    order = list(NAMES)
    return (order.index(effect) if effect in order else len(order), effect)


def _square(report: GapReport) -> str:
    square = report.gap_rms_m**2 * 1e6
    return fixed(square, decimals_for(square / 100, 4))
