"""The right side: the sweep that is being measured, and plots and tables of the last solution."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import viser

from app.captions import all_residuals_caption, coupling_caption, drive_caption, residual_caption
from app.figures.axis_uncertainty import axis_uncertainty_figure
from app.figures.couplings import coupling_figure
from app.figures.deviations import deviations_figure
from app.figures.live import live_figure
from app.figures.over_time import over_time_figure
from app.figures.residuals import residual_figure
from app.figures.transmissions import transmission_figure
from app.panels.open_tabs import OpenTabs
from app.panels.plot_box import WIDTH_PX, PlotBox
from app.table_2 import Limits, table_2
from app.words import block
from app.workbench import Workbench
from core.errors import InputError
from core.session_events import Setting

if TYPE_CHECKING:
    from core.calibration import Calibration

LIMITS = {"limit_length_mm": "Limit for lengths [mm]", "limit_angle_deg": "Limit for angles [deg]"}
"""Keys of the session's settings, and what they are called."""
OVER_TIME = "all sweeps over time"
NEEDS_ALL = "Solve with a sweep of every joint to compare the arm with its design."


class ResultsPanel:
    """Tabs: live, residuals, drives, axes, geometry."""

    def __init__(self, gui: viser.GuiApi, bench: Workbench, ask: Callable) -> None:
        self._bench, self._ask = bench, ask
        self.drawn: Calibration | None = None
        self._live_key: tuple | None = None
        self.tabs = OpenTabs()
        panel = gui.add_panel()
        with panel.add_tab("This sweep"):
            self.tabs.mark(gui, "live")
            self._live = PlotBox(gui, "live", "Measure a shot to see its residuals here.")
        with panel.add_tab("Residuals"):
            self.tabs.mark(gui, "residuals")
            self._sweep = gui.add_dropdown("Show", ("-",))
            self._sweep.on_update(lambda event: self._draw_residuals() if event.client else None)
            self._residuals = PlotBox(gui, "residuals", "Solve to see residuals.")
        with panel.add_tab("Drives"):
            self.tabs.mark(gui, "drives")
            self._curve = gui.add_dropdown("Show", ("-",))
            self._curve.on_update(lambda event: self._draw_curve() if event.client else None)
            self._drive = PlotBox(gui, "drives", "Solve to see what drives and couplings do.")
        with panel.add_tab("Axes"):
            self.tabs.mark(gui, "axes")
            self._axes = PlotBox(gui, "axes", "Solve to see how well every axis is known.")
        with panel.add_tab("Geometry"):
            self.tabs.mark(gui, "geometry")
            self._build_geometry(gui)
        self.panel = panel
        """For tabs of others."""
        panel.dock_right()
        panel.set_width(540)

    def _build_geometry(self, gui: viser.GuiApi) -> None:
        self._deviations = PlotBox(gui, "deviations", NEEDS_ALL)
        self._table = gui.add_html(block("", "table2"))
        settings = self._bench.state.settings
        self._limits = {
            key: gui.add_number(label, float(settings.get(key, 0.0)), min=0.0, max=1e4, step=0.001)
            for key, label in LIMITS.items()
        }
        gui.add_button("Keep limits", hint="0: no limit").on_click(self._keep_limits)

    def show_dark(self, dark: bool) -> None:
        """Draw everything for a dark or a light page."""
        for box in (self._live, self._residuals, self._drive, self._axes, self._deviations):
            box.show_dark(dark)

    def refresh(self) -> None:
        """Draw what has changed."""
        self.tabs.draw("live", self._draw_live)
        found = self._bench.calibration
        if found is self.drawn:
            return
        self.drawn = found
        if found is not None:
            _offer(self._sweep, (*(f.sweep.name for f in found.found.fits), OVER_TIME))
            _offer(self._curve, tuple(_curves(found)))
        self.tabs.draw("residuals", self._draw_residuals)
        self.tabs.draw("drives", self._draw_curve)
        self.tabs.draw("axes", self._draw_axes)
        self.tabs.draw("geometry", self._draw_geometry)

    def _keep_limits(self, event: viser.GuiEvent) -> None:
        asked = {key: box.value for key, box in self._limits.items()}

        def job(client: object) -> None:
            for key, value in asked.items():
                if not (isinstance(value, int | float) and np.isfinite(value) and 0 <= value <= 1e4):
                    raise InputError(f"{LIMITS[key]}: {value!r}, expected a number from 0 (no limit) to 10000")
            self._bench.session.append_all([Setting(key, float(value)) for key, value in asked.items()])
            self._bench.changed()
            self._draw_table()

        self._ask(event, job)

    def _draw_table(self) -> None:
        settings = self._bench.state.settings
        if self.drawn is None:
            self._table.content = block("", "table2")
        else:
            limits = Limits(*(float(settings.get(key, 0.0)) for key in LIMITS))
            self._table.content = table_2(self.drawn, limits)

    def _draw_live(self) -> None:
        state = self._bench.state
        last = next((s for s in reversed(state.shots) if s.taken.phase == "sweep"), None)
        key = (None if last is None else last.id, tuple(s.id for s in state.shots if s.counts))
        if key == self._live_key:
            return
        self._live_key = key
        if last is None:
            self._live.clear()
            return
        joint = last.taken.joint
        so_far = self._bench.known.so_far(joint, last.taken.sweep)
        if so_far.live.fit is None and not self._live.drawn:
            # A plot that is there stays there: plotly fails where one goes away while it is drawn.
            self._live.clear(f"Residuals appear here once the axis of joint {joint} is known: see 2 Measure.")
            return
        command = np.array([s.taken.commanded[joint - 1] for s in so_far.shots])
        sliding = bool(self._bench.nominal.sliding[joint - 1])
        self._live.show(live_figure(so_far.live, command, joint, sliding, WIDTH_PX), so_far.live.waiting_for)

    def _draw_residuals(self) -> None:
        found = self.drawn
        if found is None:
            self._residuals.clear()
            return
        names = [f.sweep.name for f in found.found.fits]
        if self._sweep.value in names:
            index = names.index(self._sweep.value)
            self._residuals.show(residual_figure(found, index), residual_caption(found, index))
        elif self._sweep.value == OVER_TIME:
            self._residuals.show(over_time_figure(found, WIDTH_PX), all_residuals_caption(found))

    def _draw_curve(self) -> None:
        found = self.drawn
        asked = None if found is None else _curves(found).get(self._curve.value)
        if found is None or asked is None:
            self._drive.clear()
            return
        joint, coupled = asked
        if coupled:
            self._drive.show(coupling_figure(found, joint), coupling_caption(found, joint))
        else:
            self._drive.show(transmission_figure(found, joint), drive_caption(found, joint))

    def _draw_axes(self) -> None:
        if self.drawn is None:
            self._axes.clear()
        else:
            self._axes.show(axis_uncertainty_figure(self.drawn, WIDTH_PX))

    def _draw_geometry(self) -> None:
        figure = None if self.drawn is None else deviations_figure(self.drawn)
        if figure is None:
            self._deviations.clear()
        else:
            self._deviations.show(figure)
        self._draw_table()


def _curves(found: "Calibration") -> dict[str, tuple[int, bool]]:
    """What can be shown of drives and couplings: the words of the list, the joint, whether the coupling is meant."""
    drives = {f"joint {j}: drive": (j, False) for j in found.found.swept}
    seen = [j for j, fit in enumerate(found.estimate.couplings, 1) if fit is not None]
    return drives | {f"joint {j}: dragged along by joint {j - 1}": (j, True) for j in seen}


def _offer(dropdown: viser.GuiDropdownHandle, options: tuple[str, ...]) -> None:
    """Give a list other options; what was chosen stays chosen if it is still there."""
    if tuple(dropdown.options) == options:
        return
    chosen = dropdown.value
    dropdown.options = options
    dropdown.value = chosen if chosen in options else options[0]
