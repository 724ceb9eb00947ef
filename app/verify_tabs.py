"""What comes after a solution: tabs that appear when there is something for them."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from app import keys
from app.cell_view import CellView
from app.compare_bench import CompareBench
from app.compensate_bench import CompensateBench
from app.panels.compare import ComparePanel
from app.panels.compensate import CompensatePanel
from app.panels.late_tab import LateTab
from app.panels.verify import VerifyPanel
from app.pose_bench import PoseBench
from app.pose_view import PoseView
from app.workbench import Workbench
from core.twin import irb_l6

if TYPE_CHECKING:
    import viser

BEFORE = ("Gap", "4 Export")
"""Tabs that come after these."""


class VerifyTabs:
    """Verify, Compensate and Compare at the left; Poses, Commands and Methods at the right."""

    def __init__(
        self,
        server: "viser.ViserServer",
        bench: Workbench,
        left: "viser.GuiTabGroupHandle",
        right: "viser.PanelHandle",
        cell: CellView,
        ask: Callable,
    ) -> None:
        gui, self._cell = server.gui, cell
        self._poses = PoseBench(bench)
        self.verify = VerifyPanel(bench, self._poses, PoseView(server), ask, self._show_shots)
        self._tab = LateTab(left, "Verify", lambda: self.verify.build(gui), before=BEFORE)
        self._plots = LateTab(right, "Poses", lambda: self.verify.build_plots(gui))
        self._compensated = CompensateBench(self._poses)
        self.compensate = CompensatePanel(self._compensated, ask, self._refresh_compensation)
        self._second_tab = LateTab(left, "Compensate", lambda: self.compensate.build(gui), before=BEFORE)
        self._commands = LateTab(right, "Commands", lambda: self.compensate.build_table(gui))
        self._bench, self._compared = bench, CompareBench()
        self.compare = ComparePanel(self._compared, ask, self._refresh_comparison)
        self._third_tab = LateTab(left, "Compare", lambda: self.compare.build(gui), before=BEFORE)
        self._methods = LateTab(right, "Methods", lambda: self.compare.build_plots(gui))
        gui.add_command(keys.POSE.does, hotkey=keys.POSE.hotkey).on_trigger(self._measure)

    def refresh(self) -> None:
        """Show the tabs that have something to say, and what they say."""
        there = self._poses.arm is not None or self._poses.loop()[0] is not None
        there = there or any(pose.nominal_visit or pose.compensated_visit for pose in self._poses.poses())
        was = self._tab.there
        self._tab.show(there)
        self._plots.show(there)
        if there:
            self.verify.refresh()
        elif was:
            self.verify.forget()
        self._refresh_compensation()
        self._refresh_comparison()

    def stop(self) -> None:
        """End what runs beside the dashboard."""
        self.compare.forget()

    def show_dark(self, dark: bool) -> None:
        """Draw for a dark or a light page."""
        self.verify.show_dark(dark)
        self.compare.show_dark(dark)

    def heard(self, client: "viser.ClientHandle", word: str) -> None:
        """Something of the page was clicked."""
        if self._plots.there:
            self.verify.heard(client, word)

    def _refresh_compensation(self) -> None:
        there = self._poses.arm is not None
        if not there:
            self._compensated.forget()
        self._second_tab.show(there)
        table = self._compensated.last is not None
        if self._commands.there and not table:
            self.compensate.forget_table()
        self._commands.show(table)
        if there:
            self.compensate.refresh()

    def _refresh_comparison(self) -> None:
        there = self._poses.arm is not None and self._bench.rig.cell is irb_l6.cell()
        if self._third_tab.there and not there:
            self.compare.forget()
        self._third_tab.show(there)
        plots = there and self._compared.found is not None
        if self._methods.there and not plots:
            self.compare.forget_plots()
        self._methods.show(plots)
        if there:
            self.compare.refresh()

    def _show_shots(self, shown: bool) -> None:
        self._cell.points.visible = shown

    def _measure(self, event: object) -> None:
        if self._tab.there:
            self.verify.measure(event)
