"""The gap between sim and arm: tabs that appear once there are points enough to look for it."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from app.gap_bench import GapBench
from app.gap_view import GapView
from app.panels.gap import GapPanel
from app.panels.late_tab import LateTab
from app.workbench import Workbench

if TYPE_CHECKING:
    import viser

LABEL = "Gap"


class GapTabs:
    """Gap at the left, and its plots at the right."""

    def __init__(
        self,
        server: "viser.ViserServer",
        bench: Workbench,
        left: "viser.GuiTabGroupHandle",
        right: "viser.PanelHandle",
        ask: Callable,
    ) -> None:
        gui = server.gui
        self._gaps = GapBench(bench)
        self.panel = GapPanel(self._gaps, GapView(server), ask, self.refresh)
        self._tab = LateTab(left, LABEL, lambda: self.panel.build(gui), before="4 Export")
        self._plots = LateTab(right, LABEL, lambda: self.panel.build_plots(gui))

    def refresh(self) -> None:
        """Show the tabs where they have something to say, and what they say."""
        there, was = self._gaps.enough or self._gaps.found is not None, self._tab.there
        self._tab.show(there)
        self._plots.show(there)
        if there:
            self.panel.refresh()
        elif was:
            self.panel.forget()

    def stop(self) -> None:
        """End what runs beside the dashboard."""
        if self._tab.there:
            self.panel.forget()

    def show_dark(self, dark: bool) -> None:
        """Draw for a dark or a light page."""
        self.panel.show_dark(dark)
