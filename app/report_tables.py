"""The tables of a calibration as the report shows them."""

import re
from collections.abc import Callable

import numpy as np

from app.report_cells import aligned, count, number, uncertainty
from app.report_page import Cell, Heading, ShownTable
from core.calibration import Calibration
from core.report import (
    Table,
    axes_table,
    candidates_table,
    constants_table,
    couplings_table,
    parameters_table,
    rejected_table,
    sweeps_table,
    targets_table,
    transmissions_table,
    zeros_table,
)
from core.wording import decimals_for

GREEK = {"a": "a", "b": "b", "alpha": "α", "theta": "θ"}
FAMILIES = {
    "direct": "direct",
    "ratio": "ratio",
    "first_harmonic": "once a turn",
    "gear": "gear wheel",
    "proportional": "proportional",
    "arctangent": "four-bar linkage",
}
METHODS = {"all points at once": "all points", "joint by joint": "joint by joint"}
MOST_REJECTED = 60
"""Rows of the table of rejected points; the rest is in the CSV file."""


def shown_sweeps(calibration: Calibration) -> ShownTable:
    """Table 1: what was measured, in the order of measurement."""
    table = sweeps_table(calibration)
    headings = (
        Heading("No.", "Order of measurement", True),
        Heading("Joint", numeric=True),
        Heading("Sweep", numeric=True),
        Heading("From", "Commanded displacement at the first stop", True),
        Heading("To", "Commanded displacement at the last stop", True),
        Heading("Span", "Range of the commanded displacement", True),
        Heading("Unit"),
        Heading("Intervals", "Stops less one", True),
        Heading("Points", "Targets x stops"),
        Heading("Extra point", "A second target beyond the next joint, which shows how that joint is dragged along"),
        Heading("Targets", "In the order in which they were measured"),
        Heading("Used", "Points that were fitted", True),
        Heading("Rejected", "Points that stand out and were left out", True),
    )
    rows = [
        [
            count(r.order),
            count(r.joint),
            count(r.sweep),
            number(r.first, decimals=2),
            number(r.last, decimals=2),
            number(r.span, decimals=2),
            Cell(r.unit),
            count(r.intervals),
            Cell(r.points.replace(" x ", " × ")),
            Cell(r.extra_point),
            Cell(r.targets),
            count(r.used),
            count(r.rejected),
        ]
        for r in table.frame.itertuples()
    ]
    return ShownTable(
        "Table 1. Sweeps in the order of measurement", headings, aligned([[row] for row in rows]), table.note
    )


def shown_axes(calibration: Calibration) -> ShownTable:
    """Axes at zero by both methods, one group of rows a joint."""
    table = axes_table(calibration)
    headings = (
        Heading("Joint"),
        Heading("Method", "All points fitted at once: the result. Joint by joint: the start from which it was found"),
        Heading("x [mm]", "A point on the axis, in the instrument's frame", True),
        Heading("y [mm]", numeric=True),
        Heading("z [mm]", numeric=True),
        Heading("u [mm]", "Standard uncertainty of the axis' place, both directions across it together", True),
        Heading("dir x", "Unit vector in the positive sense of motion", True),
        Heading("dir y", numeric=True),
        Heading("dir z", numeric=True),
        Heading("u [mrad]", "Standard uncertainty of the direction, both tilts together", True),
        Heading("axial [mm]", "Root mean square of the residuals along the axis", True),
        Heading("radial [mm]", "Root mean square of the residuals away from the axis", True),
        Heading("Points", "Points on which the row rests", True),
    )
    groups = [
        [_axis_cells(r, k, len(part)) for k, r in enumerate(part.itertuples())]
        for _, part in table.frame.groupby("joint", sort=False)
    ]
    return ShownTable("Table 3. Joint axes", headings, aligned(groups), table.note, dense=True)


def shown_parameters(calibration: Calibration) -> ShownTable:
    """Every parameter of the phi-model: nominal, actual, difference, uncertainty; one group of rows a frame."""
    table = parameters_table(calibration)
    headings = (
        Heading("Frame", "Frame i carries joint i to joint i+1; phi is set once and not measured"),
        Heading("Parameter"),
        Heading("Unit"),
        Heading("Nominal", "The design value", True),
        Heading("Actual", "Estimated from all points at once", True),
        Heading("Difference", "Actual minus nominal", True),
        Heading("u", "Standard uncertainty of the actual value", True),
        Heading("|diff| / u", "Difference in standard uncertainties", True),
        Heading("Verdict", "Significant where the difference exceeds two standard uncertainties"),
        Heading("Joint by joint", "The same, estimated one joint at a time", True),
        Heading("u", "Standard uncertainty of the value joint by joint", True),
    )
    groups = []
    for frame, part in table.frame.groupby("frame"):
        rows = list(part.itertuples())
        name = Cell(f"{frame}  (φ = {rows[0].phi_deg:.6g}°)", rows=len(rows), heading=True)
        groups.append([[name, *_parameter_cells(rows[0])], *(_parameter_cells(r) for r in rows[1:])])
    note = "Fixed: set by the choice of frames, so that it can neither be measured nor be wrong."
    return ShownTable("Table 2. Geometry: nominal and actual", headings, aligned(groups), note)


def shown_drives(calibration: Calibration) -> ShownTable:
    """Families of the drives and the error before and after the fit."""
    table = transmissions_table(calibration)
    return _functions(table, "Table 4. Drives", (Heading("Joint", numeric=True),), lambda r: [count(r.joint)])


def shown_couplings(calibration: Calibration) -> ShownTable:
    """The same of the couplings."""
    table = couplings_table(calibration)
    frame = table.frame.rename(columns={"from": "source", "to": "target"})
    headings = (
        Heading("Joint", "The joint that is dragged along", True),
        Heading("by", "The joint that drags it", True),
        Heading("Nominal gain", "Passive motion for one unit of active motion, by design", True),
    )
    table = Table(table.name, table.title, frame, table.note)
    return _functions(
        table,
        "Table 5. Couplings",
        headings,
        lambda r: [count(r.target), count(r.source), number(r.nominal_gain, decimals=4)],
    )


def shown_constants(calibration: Calibration, kind: str) -> ShownTable:
    """Constants of the transmissions or of the couplings, one group of rows a joint."""
    frame = constants_table(calibration).frame
    frame = frame[frame["kind"] == kind]
    headings = (
        Heading("Joint"),
        Heading("Constant", "As named in the formula"),
        Heading("Unit"),
        Heading("Value", "Estimated from all points at once", True),
        Heading("u", "Standard uncertainty", True),
        Heading("Joint by joint", "The same, estimated one joint at a time", True),
        Heading("u", "Standard uncertainty of the value joint by joint", True),
    )
    groups = []
    for joint, part in frame.groupby("joint"):
        rows = [_constant_cells(r) for r in part.itertuples()]
        groups.append([[Cell(str(joint), rows=len(rows), heading=True), *rows[0]], *rows[1:]])
    return ShownTable("Constants of the functions", headings, aligned(groups))


def shown_candidates(calibration: Calibration, kind: str) -> ShownTable | None:
    """The families that were compared; None where all were set beforehand."""
    frame = candidates_table(calibration).frame
    frame = frame[frame["kind"] == kind]
    if frame.empty:
        return None
    headings = (
        Heading("Joint"),
        Heading("Family"),
        Heading("Constants", "How many were fitted", True),
        Heading("RMS left", "Root mean square of what is left", True),
        Heading("Unit"),
        Heading("χ²", "Sum of squares of what is left, in standard deviations", True),
        Heading("Probability", "Among the families that were tried", True),
        Heading(""),
    )
    groups = []
    for joint, part in frame.groupby("joint"):
        rows = [_candidate_cells(r) for r in part.itertuples()]
        groups.append([[Cell(str(joint), rows=len(rows), heading=True), *rows[0]], *rows[1:]])
    return ShownTable("Families that were compared", headings, aligned(groups))


def shown_zeros(calibration: Calibration) -> ShownTable | None:
    """Readings at the arm's marks and offsets; None where the campaign does not say what the joints read there."""
    if calibration.campaign.home is None:
        return None
    table = zeros_table(calibration)
    headings = (
        Heading("Joint", numeric=True),
        Heading("Command at the marks", "Zero on an arm whose zeros are right", True),
        Heading("Offset", "What the transducer adds, with the error of the drive at zero taken off", True),
        Heading("u", "Standard uncertainty of the offset", True),
        Heading("Unit"),
    )
    rows = [
        [
            count(r.joint),
            number(r.reading_at_marks, decimals=4),
            number(r.offset, r.offset_std, 4),
            uncertainty(r.offset_std),
            Cell(r.unit),
        ]
        for r in table.frame.itertuples()
    ]
    return ShownTable("Table 6. Zeros", headings, aligned([rows]), table.note)


def shown_rejected(calibration: Calibration) -> ShownTable | None:
    """Rejected points with the reason; None: there are none."""
    frame = rejected_table(calibration).frame
    if frame.empty:
        return None
    headings = (
        Heading("Record", "Its number in the measurements", True),
        Heading("Joint", numeric=True),
        Heading("Target"),
        Heading("Distance [mm]", "From where the calibrated arm has the point", True),
        Heading("Reason"),
    )
    first = frame.head(MOST_REJECTED)
    rows = [
        [count(r.record), count(r.joint), Cell(r.target), number(r.residual_mm, decimals=2), Cell(r.reason)]
        for r in first.itertuples()
    ]
    note = f"The first {len(first)} of {len(frame)}." if len(first) < len(frame) else ""
    return ShownTable("Rejected points", headings, aligned([[row] for row in rows]), note)


def shown_targets(calibration: Calibration) -> ShownTable:
    """Where the targets are when every joint is at zero."""
    headings = (
        Heading("Target"),
        Heading("Link", "It moves with the joints up to this one", True),
        *(Heading(f"{axis} [mm]", numeric=True) for axis in "xyz"),
        Heading("u [mm]", "Standard uncertainty, all three directions together", True),
    )
    rows = [
        [
            Cell(r.target),
            count(r.link),
            *(number(v, r.std_mm) for v in (r.x_mm, r.y_mm, r.z_mm)),
            uncertainty(r.std_mm),
        ]
        for r in targets_table(calibration).frame.itertuples()
    ]
    note = "In the instrument's frame, as estimated with the axes."
    return ShownTable("Targets with every joint at zero", headings, aligned([rows]), note)


def family_words(name: str) -> str:
    """A family's name as a person says it."""
    orders = name.removeprefix("harmonics_")
    return f"1 to {orders} times a turn" if orders != name else FAMILIES.get(name, name)


def reason_words(reason: str) -> str:
    """Why a family was chosen, with families as a person says them."""
    said = re.sub(r"\b(first_harmonic|harmonics_\d+)\b", lambda name: family_words(name[0]), reason)
    return said.replace("1e+06 times more so", "over a million times more so")


def _axis_cells(r: tuple, index: int, rows: int) -> list[Cell]:
    first = [Cell(f"{r.joint}{' (slides)' if r.kind == 'prismatic' else ''}", rows=rows, heading=True)]
    place = [number(v, r.point_std_mm) for v in (r.x_mm, r.y_mm, r.z_mm)]
    if not np.isfinite(r.x_mm):
        place = [Cell("no place of its own", mark="muted", columns=3)]
    # One coordinate of a direction is known better than 1: show the digits that its tilt can change.
    digits = decimals_for(r.direction_std_rad, 6)
    return [
        *(first if index == 0 else []),
        Cell(METHODS[r.method]),
        *place,
        uncertainty(r.point_std_mm),
        *(number(v, decimals=digits) for v in (r.direction_x, r.direction_y, r.direction_z)),
        uncertainty(r.direction_std_rad * 1e3),
        number(r.rms_axial_mm),
        number(r.rms_radial_mm),
        count(r.points),
    ]


def _parameter_cells(r: tuple) -> list[Cell]:
    name = [Cell(GREEK[r.parameter]), Cell(r.unit)]
    if r.fixed:
        nominal, actual = number(r.nominal, decimals=2), number(r.actual, decimals=2)
        return [
            *name,
            nominal,
            actual,
            Cell("fixed by convention", mark="muted", columns=4),
            number(np.nan),
            number(np.nan),
        ]
    mark = "significant" if r.significant else ""
    return [
        *name,
        number(r.nominal, r.std),
        number(r.actual, r.std),
        number(r.difference, r.std),
        uncertainty(r.std),
        number(r.significance, decimals=2),
        Cell("▲ significant" if r.significant else "○ within 2 u", mark=mark),
        number(r.joint_by_joint, r.joint_by_joint_std),
        uncertainty(r.joint_by_joint_std),
    ]


def _constant_cells(r: tuple) -> list[Cell]:
    return [
        Cell(r.constant),
        Cell("" if r.unit == "1" else r.unit),
        number(r.value, r.std, 5),
        uncertainty(r.std),
        number(r.joint_by_joint, r.joint_by_joint_std, 5),
        uncertainty(r.joint_by_joint_std),
    ]


def _candidate_cells(r: tuple) -> list[Cell]:
    return [
        Cell(family_words(r.family)),
        count(r.constants),
        number(r.rms, decimals=4),
        Cell(r.unit),
        number(r.chi_square, decimals=1),
        Cell(f"{r.probability:.1%}" if r.probability >= 1e-3 else "< 0.1%", numeric=True),
        Cell("chosen" if r.chosen else ""),
    ]


def _functions(
    table: Table, caption: str, first: tuple[Heading, ...], cells: Callable[[tuple], list[Cell]]
) -> ShownTable:
    headings = (
        *first,
        Heading("Family", "What kind of error the function describes"),
        Heading("Formula", "x: displacement of the joint in rad (m where it slides)"),
        Heading("RMS before", "Root mean square error of a perfect drive, best constant taken off", True),
        Heading("RMS after", "Root mean square of what the fitted function leaves", True),
        Heading("Unit"),
        Heading("Chosen because"),
    )
    rows = [[*cells(r), *_function_cells(r)] for r in table.frame.itertuples()]
    return ShownTable(caption, headings, aligned([[row] for row in rows]), table.note)


def _function_cells(r: tuple) -> list[Cell]:
    digits = decimals_for(r.rms_after)
    return [
        Cell(family_words(r.family)),
        Cell(r.formula, mark="formula"),
        number(r.rms_before, decimals=digits),
        number(r.rms_after, decimals=digits),
        Cell(r.unit),
        Cell(reason_words(r.reason)),
    ]


def is_empty(table: ShownTable | None) -> bool:
    """Whether a table has no rows to show."""
    return table is None or not any(table.groups)
