"""The right side: the sweep that is being measured, and plots and tables of the last solution."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import plotly.graph_objects as go
import viser

from app.figures.deviations import deviations_figure
from app.figures.live import live_figure
from app.figures.residuals import residual_figure
from app.figures.style import CONFIG, in_theme
from app.figures.transmissions import transmission_figure
from app.table_2 import Limits, table_2
from app.words import block
from app.workbench import Workbench
from core.errors import InputError
from core.session_events import Setting

if TYPE_CHECKING:
    from core.calibration import Calibration

WIDTH_PX = 520
LIMITS = {"limit_length_mm": "Limit for lengths [mm]", "limit_angle_deg": "Limit for angles [deg]"}
"""Keys of the session's settings, and what they are called."""


class ResultsPanel:
    """Tabs: live, residuals, drives, geometry."""

    def __init__(self, gui: viser.GuiApi, bench: Workbench, ask: Callable) -> None:
        self._bench, self._ask = bench, ask
        self.drawn: Calibration | None = None
        self._live_key: tuple = ()
        self._dark = False
        panel = gui.add_panel()
        with panel.add_tab("This sweep"):
            self._live = _plot(gui, _empty("Measure a shot to see its residuals here"))
        with panel.add_tab("Residuals"):
            self._sweep = gui.add_dropdown("Sweep", ("-",))
            self._sweep.on_update(lambda _: self._draw_sweep())
            self._residuals = _plot(gui, _empty("Solve to see residuals"))
        with panel.add_tab("Drives"):
            self._joint = gui.add_dropdown("Joint", ("-",))
            self._joint.on_update(lambda _: self._draw_joint())
            self._drive = _plot(gui, _empty("Solve to see what the drives do"))
        with panel.add_tab("Geometry"):
            self._deviations = _plot(gui, _empty("Solve every joint to compare with the design"))
            self._table = gui.add_html(
                block("<p class='soft'>Solve every joint to compare with the design.</p>", "table2")
            )
            self._limits = {
                key: gui.add_number(label, float(bench.state.settings.get(key, 0.0)), min=0.0, max=1e4, step=0.001)
                for key, label in LIMITS.items()
            }
            gui.add_button("Keep limits", hint="0: no limit").on_click(self._keep_limits)
        panel.dock_right()
        panel.set_width(540)

    def show_dark(self, dark: bool) -> None:
        """Draw everything anew for a dark or a light page."""
        self._dark, self._live_key, self.drawn = dark, (), None
        self.refresh()

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
        if self.drawn is not None:
            limits = Limits(*(float(settings.get(key, 0.0)) for key in LIMITS))
            self._table.content = table_2(self.drawn, limits)

    def refresh(self) -> None:
        """Draw what has changed."""
        self._draw_live()
        found = self._bench.calibration
        if found is self.drawn:
            return
        self.drawn = found
        if found is None:
            self._forget()
            return
        sweeps = tuple(f.sweep.name for f in found.found.fits)
        joints = tuple(str(j) for j in found.found.swept)
        _offer(self._sweep, sweeps)
        _offer(self._joint, joints)
        self._draw_sweep()
        self._draw_joint()
        figure = deviations_figure(found)
        self._show(self._deviations, figure or _empty("Solve every joint to compare with the design"))
        self._draw_table()

    def _forget(self) -> None:
        """Empty plots, as before the first solution."""
        self._show(self._residuals, _empty("Solve to see residuals"))
        self._show(self._drive, _empty("Solve to see what the drives do"))
        self._show(self._deviations, _empty("Solve every joint to compare with the design"))
        self._table.content = block("<p class='soft'>Solve every joint to compare with the design.</p>", "table2")

    def _draw_live(self) -> None:
        state = self._bench.state
        last = next((s for s in reversed(state.shots) if s.taken.phase == "sweep"), None)
        key = (None if last is None else last.id, tuple(s.id for s in state.shots if s.counts))
        if key == self._live_key:
            return
        self._live_key = key
        if last is None:
            self._show(self._live, _empty("Measure a shot to see its residuals here"))
            return
        joint = last.taken.joint
        live, shots = self._bench.live(joint, last.taken.sweep)
        command = np.array([s.taken.commanded[joint - 1] for s in shots])
        sliding = bool(self._bench.cell.robot.sliding[joint - 1])
        self._show(self._live, live_figure(live, command, joint, sliding, WIDTH_PX))

    def _draw_sweep(self) -> None:
        found = self.drawn
        if found is not None:
            names = [f.sweep.name for f in found.found.fits]
            if self._sweep.value in names:
                self._show(self._residuals, residual_figure(found, names.index(self._sweep.value)))

    def _draw_joint(self) -> None:
        found = self.drawn
        if found is not None and self._joint.value in {str(j) for j in found.found.swept}:
            self._show(self._drive, transmission_figure(found, int(self._joint.value)))

    def _show(self, plot: viser.GuiPlotlyHandle, figure: go.Figure) -> None:
        plot.figure = in_theme(figure, self._dark)


def _plot(gui: viser.GuiApi, figure: go.Figure) -> viser.GuiPlotlyHandle:
    return gui.add_plotly(figure, aspect=0.8, config=CONFIG)


def _offer(dropdown: viser.GuiDropdownHandle, options: tuple[str, ...]) -> None:
    chosen = dropdown.value
    dropdown.options = options
    dropdown.value = chosen if chosen in options else options[0]


def _empty(text: str) -> go.Figure:
    figure = go.Figure()
    figure.add_annotation(text=text, showarrow=False, font={"size": 14, "color": "#6b7280"})
    figure.update_layout(
        template="none", xaxis={"visible": False}, yaxis={"visible": False}, margin={"l": 10, "r": 10, "t": 10, "b": 10}
    )
    return figure
