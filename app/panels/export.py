"""Export: one click each, file names that sort."""

from collections.abc import Callable
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import viser

from app.words import block
from app.workbench import Workbench
from core.errors import InputError

if TYPE_CHECKING:
    from core.calibration import Calibration

MIME_SAFE = {"Report (HTML)": "html", "Calibration (JSON)": "json", "Tables (XLSX)": "xlsx", "Points (CSV)": "csv"}


class ExportPanel:
    """Buttons that send a file to the browser that asked."""

    def __init__(self, gui: viser.GuiApi, bench: Workbench, ask: Callable) -> None:
        self._bench, self._ask = bench, ask
        gui.add_html(
            block("<h3>Export</h3><p>Solve first. Each file is sent to this browser's downloads.</p>", "export-intro")
        )
        for label in MIME_SAFE:
            button = gui.add_button(label, icon=viser.Icon.DOWNLOAD)
            button.on_click(lambda event, label=label: self._send(event, label))

    def _send(self, event: viser.GuiEvent, label: str) -> None:
        def job(client: viser.ClientHandle | None) -> None:
            found = self._bench.calibration
            if found is None:
                raise InputError("Nothing is solved yet: go to 3 Solve and press Solve, then export.")
            if client is not None:
                ending = MIME_SAFE[label]
                name = f"{datetime.now(UTC):%Y-%m-%d_%H%M%S}_trueaxis_calibration.{ending}"
                client.send_file_download(name, exported(found, ending), save_immediately=True)

        self._ask(event, job, operator=False)


def exported(found: "Calibration", ending: str) -> bytes:
    """The bytes of an export: html, json, xlsx or csv."""
    from core.report import tables

    if ending == "html":
        from app.report_html import report_html

        return report_html(found).encode()
    if ending == "json":
        from core.calibration_json import calibration_to_json

        return calibration_to_json(found).encode()
    if ending == "csv":
        from core.measurement_writer import measurements_csv

        return measurements_csv(found.campaign).encode()
    return _workbook(tables(found))


def _workbook(all_tables: tuple) -> bytes:
    from io import BytesIO

    import xlsxwriter

    buffer = BytesIO()
    book = xlsxwriter.Workbook(
        buffer, {"in_memory": True, "strings_to_formulas": False, "strings_to_urls": False, "nan_inf_to_errors": True}
    )
    bold = book.add_format({"bold": True})
    for table in all_tables:
        sheet = book.add_worksheet(table.name[:31])
        sheet.write_row(0, 0, [str(c) for c in table.frame.columns], bold)
        for row, values in enumerate(table.frame.astype(object).where(table.frame.notna(), None).values.tolist(), 1):
            sheet.write_row(row, 0, values)
        sheet.autofit()
        sheet.freeze_panes(1, 0)
    book.close()
    return buffer.getvalue()
