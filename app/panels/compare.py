"""Comparing methods on the simulated arm: one button, then what it comes to, figures and the table."""

from collections.abc import Callable

import viser

from app.compare_bench import MOST_TRIALS, CompareBench
from app.compare_words import intro_words, progress_words, table_words, verdict_words
from app.figures.comparison import orientation_comparison_figure, position_comparison_figure
from app.panels.bring_forward import bringing
from app.panels.plot_box import WIDTH_PX, PlotBox
from core.errors import InputError
from core.rivals.comparison import Comparison

TRIALS = 5


class ComparePanel:
    """The tab at the left, and its figures at the right."""

    def __init__(self, bench: CompareBench, ask: Callable, changed: Callable[[], None]) -> None:
        """``changed`` is called after another comparison was made."""
        self._bench, self._ask, self._changed = bench, ask, changed
        self._why_not = ""
        self._drawn: Comparison | None = None
        self._boxes: tuple[PlotBox, PlotBox] | None = None
        self._dark = False
        self._there = False

    def build(self, gui: viser.GuiApi) -> None:
        """Fill the tab at the left."""
        self._there = True
        self._bring = gui.add_html("")
        gui.add_html(intro_words())
        self._trials = gui.add_number("Trials", TRIALS, min=1, max=MOST_TRIALS, step=1)
        gui.add_button("Compare", color="green", icon=viser.Icon.SCALE).on_click(self._compare)
        self._stop = gui.add_button("Stop", color="red", visible=False)
        self._stop.on_click(lambda event: self._ask(event, lambda client: self._bench.stop(), at_once=True))
        self._bar = gui.add_progress_bar(0.0, visible=False)
        self._progress = gui.add_html("")
        self._verdict = gui.add_html(verdict_words(self._bench.found, self._why_not))

    def build_plots(self, gui: viser.GuiApi) -> None:
        """Fill the tab at the right."""
        names = ("compare-positions", "compare-orientations")
        self._boxes = tuple(PlotBox(gui, name, "", self._dark) for name in names)
        self._table = gui.add_html("")
        self._drawn = None
        self._bring.content = bringing("Methods")

    def forget(self) -> None:
        """The tab at the left is gone, and with it what is being made."""
        self._there = False
        self._bench.stop()

    def forget_plots(self) -> None:
        """The tab at the right is gone."""
        self._boxes = None
        self._bring.content = ""

    def show_dark(self, dark: bool) -> None:
        """Draw for a dark or a light page, also plots that come later."""
        self._dark = dark
        for box in self._boxes or ():
            box.show_dark(dark)

    def refresh(self) -> None:
        """Show the last comparison."""
        found = self._bench.found
        self._verdict.content = verdict_words(found, self._why_not)
        if self._boxes is None or found is None or found is self._drawn:
            return
        self._drawn = found
        self._boxes[0].show(position_comparison_figure(found, WIDTH_PX))
        self._boxes[1].show(orientation_comparison_figure(found, WIDTH_PX))
        self._table.content = table_words(found)

    def _compare(self, event: viser.GuiEvent) -> None:
        asked = self._trials.value

        def job(client: object) -> None:
            if not isinstance(asked, int | float) or asked != asked or asked != int(asked):
                raise InputError(f"{asked!r} trials, expected a whole number")
            trials = int(asked)
            self._bench.compare(trials, lambda done: self._show_progress(done, trials), self._finished)
            self._why_not = ""
            self._show_running(True)
            self._show_progress(0, trials)

        self._ask(event, job)

    def _show_progress(self, done: int, trials: int) -> None:
        if not self._there:
            return
        self._bar.value = 100.0 * done / trials
        self._progress.content = progress_words(done, trials)

    def _show_running(self, running: bool) -> None:
        self._bar.visible = self._stop.visible = running
        if not running:
            self._progress.content = ""

    def _finished(self, why_not: str) -> None:
        self._why_not = why_not
        if self._there:
            self._show_running(False)
            self._changed()
