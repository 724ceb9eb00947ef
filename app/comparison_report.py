"""The report of a comparison with the literature's methods: what it comes to, figures, the table, how it was made."""

from app.figures.comparison import orientation_comparison_figure, position_comparison_figure
from app.report_cells import aligned, number
from app.report_page import Cell, Heading, Page, Plot, Section, ShownTable, page_html
from core.rivals.comparison import Comparison, MethodRow, Reference
from core.rivals.verdict import verdicts
from core.version import VERSION
from core.wording import typeset

METHOD = (
    "A trial is one simulated arm, measured once in every way that the methods ask for. Each method calibrates; "
    "inverse kinematics of its calibrated arm gives the commands for the kept-out poses; the simulated arm goes there "
    "as it really is, with its repeatability, and what the tool misses is the error. Trials with other random numbers "
    "are averaged; all methods see the same ones.",
    "Every method takes the same way from joint axes and drives to a usable arm, so that differences are those of the "
    "identification alone. Tool and joint zeros are tied to the arm in the same way for all.",
)
TERMS = (
    ("Drives as commanded", "The model ends with geometry and zeros: every motor is taken to do what it is told."),
    ("Drives with functions", "Constants of the transmission and coupling functions are fitted as well."),
    ("Positions, full poses", "One target in every pose, or three that give its orientation as well."),
    ("Cramer-Rao bound", "The mean error that remains for the best unbiased use of these points (Fisher information)."),
    ("Error of parameters", "Root mean square over the free lengths and the free angles of the phi-model."),
    ("p95", "The size that 95 of 100 errors do not exceed."),
)


def comparison_html(found: Comparison) -> str:
    """The report as one self-contained page."""
    return page_html(comparison_page(found))


def comparison_page(found: Comparison) -> Page:
    """The report as sections, before it becomes HTML."""
    return Page(
        kind="Comparison of methods",
        title=found.title,
        badge="SIMULATED: no robot was measured",
        summary=tuple(typeset(sentence) for sentence in verdicts(found)),
        facts=(
            ("Trials", str(found.trials)),
            ("Kept-out poses of each", str(found.poses)),
            ("Measured points of each method", str(max(row.points for row in found.rows))),
            ("Software", f"trueaxis {VERSION}"),
        ),
        sections=comparison_sections(found),
    )


def comparison_sections(found: Comparison) -> tuple[Section, ...]:
    """The parts that another report may take over."""
    dots = (
        "Mean over all kept-out poses and trials; bars reach to the 95th percentile. Grey: what to read them against."
    )
    plots = (Plot(position_comparison_figure(found), dots), Plot(orientation_comparison_figure(found), dots))
    return (
        Section("errors", "Errors on kept-out poses", plots=plots, tables=(_references(found.references),)),
        Section("methods", "Method by method", tables=(_errors(found), _sources(found))),
        Section("how", "How it was done", (*METHOD, *found.notes), terms=TERMS),
    )


def _references(references: tuple[Reference, ...]) -> ShownTable:
    headings = (
        Heading("to be read against"),
        Heading("mean position error, mm", numeric=True),
        Heading("mean orientation error, mrad", numeric=True),
        Heading("what it is"),
    )
    group = [
        [
            Cell(one.name),
            number(one.position_m * 1e3, decimals=2),
            number(one.orientation_rad * 1e3, decimals=1),
            Cell(one.note),
        ]
        for one in references
    ]
    return ShownTable("What the errors are to be read against", headings, aligned([group]))


def _errors(found: Comparison) -> ShownTable:
    titles = ("mean, mm", "u", "p95", "max", "mean, mrad", "lengths, mm", "angles, mrad", "time, s")
    headings = (Heading("method"), *(Heading(t, numeric=True) for t in titles))
    note = (
        "mean, p95, max: position errors; u: standard error of their mean over trials. Lengths, angles: errors of the "
        "parameters. Time: median of one calibration on one core."
    )
    lost = [f"{row.label}: {row.failed}" for row in found.rows if row.failed]
    if lost:
        note += f" Trials in which no arm was found that reaches the poses, not averaged: {'; '.join(lost)}."
    groups = [[_error_row(row) for row in found.rows if row.own == own] for own in (True, False)]
    return ShownTable("Errors of every method", headings, aligned([g for g in groups if g]), note, dense=True)


def _error_row(row: MethodRow) -> list[Cell]:
    sizes = row.position_m
    return [
        Cell(row.label),
        *(number(v * 1e3) for v in (sizes.mean, sizes.mean_std, sizes.p95, sizes.max)),
        number(row.orientation_rad.mean * 1e3, decimals=2),
        number(row.length_error_m * 1e3),
        number(row.angle_error_rad * 1e3, decimals=2),
        number(row.seconds),
    ]


def _sources(found: Comparison) -> ShownTable:
    headings = (Heading("method"), Heading("source"), Heading("measured points"), Heading("remark"))
    group = [[Cell(row.label), Cell(row.source), Cell(_measured(row)), Cell(typeset(row.note))] for row in found.rows]
    return ShownTable("Where the methods come from, and how they did", headings, aligned([group]), dense=True)


def _measured(row: MethodRow) -> str:
    return f"{row.points}, {row.data}" if row.points else "none"
