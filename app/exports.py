"""What a session gives away, one file at a time: the report, numbers, tables, points, the calibrated robot."""

import io
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from core.calibration import Calibration

DATE = (1980, 1, 1, 0, 0, 0)
"""Of files in archives, so that the same calibration gives the same bytes."""


@dataclass(frozen=True)
class Export:
    """One kind of file that a calibration can be sent as."""

    label: str
    """On its button."""
    ending: str
    what: str
    """In file names."""
    hint: str
    made: "Callable[[Calibration], bytes]"


def stamped(what: str, ending: str) -> str:
    """A file name that sorts by the time when it was made."""
    return f"{datetime.now(UTC):%Y-%m-%d_%H%M%S}_{what}.{ending}"


def _html(found: "Calibration") -> bytes:
    from app.report_html import report_html

    return report_html(found).encode()


def _json(found: "Calibration") -> bytes:
    from core.calibration_json import calibration_to_json

    return calibration_to_json(found).encode()


def _csv(found: "Calibration") -> bytes:
    from core.measurement_writer import measurements_csv

    return measurements_csv(found.campaign).encode()


def _tables(found: "Calibration") -> bytes:
    from core.report import tables

    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as archive:
        for table in tables(found):
            entry = zipfile.ZipInfo(f"{table.name}.csv", DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, table.frame.to_csv(index=False))
    return data.getvalue()


def _xlsx(found: "Calibration") -> bytes:
    import xlsxwriter

    from core.report import tables

    buffer = io.BytesIO()
    plain = {"in_memory": True, "strings_to_formulas": False, "strings_to_urls": False, "nan_inf_to_errors": True}
    book = xlsxwriter.Workbook(buffer, plain)
    bold = book.add_format({"bold": True})
    for table in tables(found):
        sheet = book.add_worksheet(table.name[:31])
        sheet.write_row(0, 0, [str(c) for c in table.frame.columns], bold)
        for row, values in enumerate(table.frame.astype(object).where(table.frame.notna(), None).values.tolist(), 1):
            sheet.write_row(row, 0, values)
        sheet.autofit()
        sheet.freeze_panes(1, 0)
    book.close()
    return buffer.getvalue()


def _urdf(found: "Calibration") -> bytes:
    from core.calibrated_arm import calibrated_arm
    from core.robot_export import urdf_text

    return urdf_text(calibrated_arm(found).robot).encode()


def _mjcf(found: "Calibration") -> bytes:
    from core.calibrated_arm import calibrated_arm
    from core.robot_export import mjcf_text

    return mjcf_text(calibrated_arm(found).robot).encode()


def _dh(found: "Calibration") -> bytes:
    from core.calibrated_arm import calibrated_arm
    from core.dh_export import dh_json

    return dh_json(calibrated_arm(found).robot).encode()


RESULTS = (
    Export("Report (HTML)", "html", "trueaxis_calibration", "Opens without a network, and prints well.", _html),
    Export(
        "Calibration (JSON)", "json", "trueaxis_calibration", "All estimates with uncertainties, for programs.", _json
    ),
    Export("Tables (XLSX)", "xlsx", "trueaxis_calibration", "One sheet a table.", _xlsx),
    Export("Points (CSV)", "csv", "trueaxis_calibration", "Every shot that counts, with its command.", _csv),
    Export("Tables (CSV in a ZIP)", "zip", "trueaxis_tables", "One file a table.", _tables),
)
"""What was found."""
ROBOTS = (
    Export("Robot (URDF)", "urdf", "trueaxis_robot", "The calibrated arm: links and joints.", _urdf),
    Export("Robot (MJCF)", "xml", "trueaxis_robot", "The calibrated arm for MuJoCo.", _mjcf),
    Export("Robot (Denavit-Hartenberg)", "json", "trueaxis_robot_dh", "Standard rows.", _dh),
)
"""The calibrated arm for other tools; it needs a sweep of every joint."""
