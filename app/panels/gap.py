"""The gap between sim and arm: one button, then the verdict, what shrinks it, and what to measure next."""

from collections.abc import Callable
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import viser

from app.beside import STOPPED
from app.figures.gap_map import gap_map_figure
from app.figures.gap_steps import gap_steps_figure
from app.figures.gap_vectors import gap_vectors_figure
from app.figures.gap_where import gap_records_figure
from app.gap_bench import Diagnosed, Finished, GapBench
from app.gap_view import GapView
from app.gap_words import causes_words, intro_words, next_words, numbers_words, verdict_words, working_words
from app.panels.bring_forward import bring_forward
from app.panels.plot_box import WIDTH_PX, PlotBox
from core.errors import InputError
from core.gap.ledger import Switch, switches
from core.gap.result import GapReport

if TYPE_CHECKING:
    import plotly.graph_objects as go

NOMINAL, CALIBRATED = "the nominal arm", "the last solution"
FILES = {"Report (HTML)": "html", "gap.json": "json"}
LARGEST_UPLOAD = 64_000_000
LONGEST_LABEL = 60


class GapPanel:
    """The tab at the left, and its plots at the right."""

    def __init__(self, gaps: GapBench, view: GapView, ask: Callable, changed: Callable[[], None]) -> None:
        """``changed`` is called after another diagnosis was made."""
        self._gaps, self._view, self._ask, self._changed = gaps, view, ask, changed
        self._drawn: Diagnosed | None = None
        self._plotted: Diagnosed | None = None
        self._switches: list[tuple[Switch, viser.GuiCheckboxHandle]] = []
        self._plots: dict[str, PlotBox] = {}
        self._dark = False
        self._there = False

    def build(self, gui: viser.GuiApi) -> None:
        """Fill the tab at the left."""
        bring_forward(gui, "Gap")
        self._gui, self._drawn, self._switches, self._there = gui, None, [], True
        gui.add_html(intro_words())
        self._sim = gui.add_dropdown("The sim is", (NOMINAL, CALIBRATED))
        gui.add_button("Diagnose", icon=viser.Icon.STETHOSCOPE).on_click(self._diagnose)
        self._stop = gui.add_button("Stop", color="red", visible=False)
        self._stop.on_click(lambda event: self._ask(event, lambda client: self._gaps.stop(), at_once=True))
        self._bar = gui.add_progress_bar(0.0, visible=False, animated=True)
        self._working = gui.add_html("")
        self._verdict = gui.add_html("")
        self._numbers = gui.add_html("")
        self._add = gui.add_folder("Add this effect to the sim", visible=False)
        self._causes, self._next = gui.add_html(""), gui.add_html("")
        self._files = [self._file_button(label, ending) for label, ending in FILES.items()]
        with gui.add_folder("Another campaign", expand_by_default=False):
            hint = "campaign.toml, robot.toml and measurements.csv in a ZIP file; it is compared with its own sim."
            upload = gui.add_upload_button("Diagnose a campaign (ZIP)", mime_type=".zip,application/zip", hint=hint)
            upload.on_upload(self._uploaded)

    def build_plots(self, gui: viser.GuiApi) -> None:
        """Fill the tab at the right."""
        self._plotted = None
        self._plots = {
            "steps": PlotBox(gui, "gap-steps", "Diagnose to see how far the gap shrinks.", self._dark),
            "map": PlotBox(gui, "gap-map", "", self._dark),
            "space": PlotBox(gui, "gap-space", "", self._dark),
            "records": PlotBox(gui, "gap-records", "", self._dark),
        }

    def show_dark(self, dark: bool) -> None:
        """Draw for a dark or a light page, also plots that come later."""
        self._dark = dark
        for box in self._plots.values():
            box.show_dark(dark)

    def refresh(self) -> None:
        """Show the last diagnosis of this session."""
        found = self._gaps.found
        self._verdict.content = "" if self._first else verdict_words(found, self._gaps.outdated)
        for button in self._files:
            button.visible = found is not None
        if found is not self._drawn:
            self._drawn = found
            self._numbers.content = "" if found is None else numbers_words(found.report)
            self._causes.content = "" if found is None else causes_words(found.report)
            self._next.content = "" if found is None else next_words(found.report)
            self._offer(() if found is None else switches(found.report))
            self._draw_scene()
        if self._plots and found is not self._plotted:
            self._plotted = found
            self._draw_plots()

    def forget(self) -> None:
        """The tab is gone: take the arrows out of the scene, and give up what is being made."""
        self._there, self._drawn = False, None
        self._gaps.stop()
        self._view.show(None, 0)

    @property
    def _first(self) -> bool:
        """Whether the first diagnosis is being made: there is nothing to say yet, and nothing to press."""
        return self._gaps.running and self._gaps.found is None

    @property
    def _on(self) -> int:
        """Which switches are on: bit k, switch k."""
        return sum(1 << k for k, (_, box) in enumerate(self._switches) if box.value)

    def _file_button(self, label: str, ending: str) -> viser.GuiButtonHandle:
        button = self._gui.add_button(label, icon=viser.Icon.DOWNLOAD, visible=False)
        button.on_click(lambda event: self._send(event, ending))
        return button

    def _diagnose(self, event: viser.GuiEvent) -> None:
        calibrated = self._sim.value == CALIBRATED
        self._begin(event, lambda finished: self._gaps.diagnose(calibrated, self._progress, finished))

    def _uploaded(self, event: viser.GuiEvent) -> None:
        file = event.target.value
        name = "".join(c for c in file.name if c.isprintable())[:LONGEST_LABEL] or "the file"

        def begin(finished: Finished) -> None:
            if len(file.content) > LARGEST_UPLOAD:
                raise InputError(f"{name} has {len(file.content) / 1e6:.0f} MB, expected at most 64 MB")
            self._gaps.diagnose_archive(file.content, name, self._progress, finished)

        self._begin(event, begin)

    def _begin(self, event: viser.GuiEvent, begin: Callable[[Finished], None]) -> None:
        """Begin a diagnosis; the queue of jobs is free again at once, and hears of the end."""

        def ended(why_not: str) -> None:
            self._ask(event, lambda client: self._ended(why_not), operator=False)

        def job(client: object) -> None:
            begin(ended)
            self._show_working(True)

        self._ask(event, job)

    def _ended(self, why_not: str) -> None:
        if not self._there:
            return
        self._show_working(False)
        self._changed()
        if why_not not in ("", STOPPED):
            raise InputError(why_not)

    def _show_working(self, working: bool) -> None:
        self._bar.visible = self._stop.visible = working
        self._bar.value = 0.0
        self._working.content = working_words("starting") if working else ""
        self.refresh()

    def _progress(self, done: float, text: str) -> None:
        if not self._there:
            return
        self._bar.value = 100.0 * min(max(done, 0.0), 1.0)
        self._working.content = working_words(text)

    def _offer(self, offered: tuple[Switch, ...]) -> None:
        for _, box in self._switches:
            box.remove()
        with self._add:
            self._switches = [(switch, self._gui.add_checkbox(_label(switch.words), False)) for switch in offered]
        for _, box in self._switches:
            box.on_update(lambda event: self._switched())
        self._add.visible = bool(offered)

    def _switched(self) -> None:
        self._draw_scene()
        found = self._drawn
        if found is not None and "space" in self._plots:
            self._show("space", gap_vectors_figure(found.report, WIDTH_PX, self._on))

    def _draw_scene(self) -> None:
        """Arrows stand among the session's points; those of another campaign have no place there."""
        found = self._drawn
        shown = None if found is None or found.shots is None else found.report
        self._view.show(shown, sum(switch.causes for switch, box in self._switches if box.value))

    def _draw_plots(self) -> None:
        report = None if self._plotted is None else self._plotted.report
        self._show("steps", report and gap_steps_figure(report, WIDTH_PX))
        caption = "Numbers: the causes of the table; with a question mark: not to be told from it by these data."
        self._show("map", report and gap_map_figure(report, WIDTH_PX), caption)
        self._show("space", report and gap_vectors_figure(report, WIDTH_PX, self._on))
        self._show("records", report and gap_records_figure(report, WIDTH_PX))

    def _show(self, name: str, figure: "go.Figure | None", caption: str = "") -> None:
        if figure is None:
            self._plots[name].clear()
        else:
            self._plots[name].show(figure, caption)

    def _send(self, event: viser.GuiEvent, ending: str) -> None:
        def job(client: viser.ClientHandle | None) -> None:
            found = self._gaps.found
            if found is None:
                raise InputError("Nothing is diagnosed yet: press Diagnose first.")
            if client is not None:
                name = f"{datetime.now(UTC):%Y-%m-%d_%H%M%S}_trueaxis_gap.{ending}"
                client.send_file_download(name, written(found.report, ending), save_immediately=True)

        self._ask(event, job, operator=False)


def written(report: GapReport, ending: str) -> bytes:
    """The bytes of a file: html or json."""
    if ending == "html":
        from app.gap_report import gap_html

        return gap_html(report).encode()
    from core.gap.gap_json import gap_to_json

    return gap_to_json(report).encode()


def _label(name: str) -> str:
    return name if len(name) <= LONGEST_LABEL else f"{name[: LONGEST_LABEL - 1]}…"
