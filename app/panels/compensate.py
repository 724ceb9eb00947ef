"""Compensating poses: paste or send them, see what to command and what it changes, take the file."""

from collections.abc import Callable
from datetime import UTC, datetime

import viser

from app.compensate_bench import CompensateBench, Compensated
from app.compensate_words import intro_words, summary_words, table_words
from app.panels.bring_forward import bringing
from core.errors import InputError
from core.inverse_kinematics import Tolerance

FRAMES = {"robot base": "base", "instrument": "instrument"}
PASTED = "the pasted table"
LONGEST_LABEL = 60
LARGEST_TOLERANCE = 1e3


class CompensatePanel:
    """The tab at the left, and its table at the right."""

    def __init__(self, bench: CompensateBench, ask: Callable, changed: Callable[[], None]) -> None:
        """``changed`` is called after other poses were compensated."""
        self._bench, self._ask, self._changed = bench, ask, changed
        self._drawn: tuple[Compensated | None, bool] | None = None
        self._table: viser.GuiHtmlHandle | None = None

    def build(self, gui: viser.GuiApi) -> None:
        """Fill the tab at the left."""
        self._drawn = None
        self._bring = gui.add_html("")
        gui.add_html(intro_words())
        self._text = gui.add_text("Poses", "", multiline=True)
        fill = gui.add_button("Fill in test poses", hint="An example: the planned test poses, with their joint values.")
        fill.on_click(self._fill)
        self._frame = gui.add_dropdown("Given in", tuple(FRAMES))
        with gui.add_folder("Accept a miss of", expand_by_default=False):
            hint = "0: none but rounding. An arm of fewer than six joints cannot take every orientation."
            self._mm = gui.add_number("Position [mm]", 0.0, min=0.0, max=LARGEST_TOLERANCE, step=1e-4, hint=hint)
            self._mrad = gui.add_number("Orientation [mrad]", 0.0, min=0.0, max=LARGEST_TOLERANCE, step=1e-4, hint=hint)
        start = gui.add_button("Compensate", color="green", icon=viser.Icon.CALCULATOR)
        start.on_click(self._pasted)
        upload = gui.add_upload_button("Compensate a CSV file", mime_type=".csv,text/csv", icon=viser.Icon.UPLOAD)
        upload.on_upload(self._uploaded)
        self._bar = gui.add_progress_bar(0.0, visible=False)
        self._summary = gui.add_html("")
        gui.add_button("Commands (CSV)", icon=viser.Icon.DOWNLOAD).on_click(self._send)

    def build_table(self, gui: viser.GuiApi) -> None:
        """Fill the tab at the right."""
        self._table, self._drawn = gui.add_html(""), None
        self._bring.content = bringing("Commands")

    def refresh(self) -> None:
        """Show the last poses that were compensated."""
        key = self._bench.last, self._bench.outdated
        if self._drawn is not None and self._drawn[0] is key[0] and self._drawn[1] == key[1]:
            return
        self._drawn = key
        self._summary.content = summary_words(*key)
        if self._table is not None:
            self._table.content = table_words(self._bench.last)

    def forget_table(self) -> None:
        """The tab at the right is gone."""
        self._table, self._drawn = None, None
        self._bring.content = ""

    def _fill(self, event: viser.GuiEvent) -> None:
        def job(client: object) -> None:
            self._text.value = self._bench.test_poses_csv()

        self._ask(event, job)

    def _pasted(self, event: viser.GuiEvent) -> None:
        text = self._text.value

        def work() -> None:
            if not isinstance(text, str) or not text.strip():
                raise InputError("No poses are pasted: paste a table with its header, or fill in the test poses.")
            self._compensate(text.strip().encode(errors="replace"), PASTED)

        self._ask(event, lambda client: work())

    def _uploaded(self, event: viser.GuiEvent) -> None:
        file = event.target.value
        name = "".join(c for c in file.name if c.isprintable())[:LONGEST_LABEL] or "the file"
        self._ask(event, lambda client: self._compensate(file.content, name))

    def _compensate(self, data: bytes, name: str) -> None:
        frame, tolerance = FRAMES.get(self._frame.value, "base"), self._tolerance()
        self._bar.visible = True
        try:
            self._bench.compensate(data, name, frame, tolerance, self._progress)
        finally:
            self._bar.visible = False
        self._changed()

    def _progress(self, done: float, text: str) -> None:
        self._bar.value = 100.0 * done

    def _tolerance(self) -> Tolerance | None:
        sizes = self._mm.value, self._mrad.value
        for value in sizes:
            if not (isinstance(value, int | float) and 0 <= value <= LARGEST_TOLERANCE):
                raise InputError(f"an accepted miss of {value!r}, expected a number from 0 to {LARGEST_TOLERANCE:g}")
        exact = Tolerance()
        return Tolerance(max(sizes[0] * 1e-3, exact.position_m), max(sizes[1] * 1e-3, exact.rotation_rad))

    def _send(self, event: viser.GuiEvent) -> None:
        def job(client: viser.ClientHandle | None) -> None:
            last = self._bench.last
            if last is None:
                raise InputError("Nothing is compensated yet: paste poses and press Compensate.")
            if client is not None:
                name = f"{datetime.now(UTC):%Y-%m-%d_%H%M%S}_trueaxis_commands.csv"
                client.send_file_download(name, last.csv.encode(), save_immediately=True)

        self._ask(event, job, operator=False)
