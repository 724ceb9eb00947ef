"""What is shown in 3-D, and from where."""

from collections.abc import Callable
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from app.cell_view import CellView
from app.scene.cameras import fly_to
from app.scene.colours import (
    BLUE,
    ERROR_VECTOR,
    FITTED_AXIS,
    GHOST,
    HIGHLIGHT,
    NOMINAL_AXIS,
    VERMILLION,
    Rgb,
    hex_of,
)
from app.spots import Spot
from app.words import block

if TYPE_CHECKING:
    import viser

MAGNIFICATION = (10, 1000, 10)
EXAGGERATION = (1, 500, 1)
"""Least, most and step of how many times too large residuals and differences are drawn."""
DIFFERENCES = (
    "<h3>Geometry against design</h3>"
    f"<p><span style='color:{hex_of(NOMINAL_AXIS)}'>⬤</span> axes as designed&emsp;"
    f"<span style='color:{hex_of(FITTED_AXIS)}'>⬤</span> as they are&emsp;"
    f"<span style='color:{hex_of(BLUE)}'>⬤</span> Z<sub>φ</sub> of the phi-frames&emsp;"
    f"<span style='color:{hex_of(VERMILLION)}'>⬤</span> significant differences</p>"
    "<p class='soft'>Every link is drawn from where its design begins, so that each shows its own error alone. An "
    "arrow leads from the design to what is there, as many times too large as is written above it; its label has the "
    "true value with its standard uncertainty. Click a finding or a row of the table to come close.</p>"
)
KEY: tuple[tuple[str, Rgb, str], ...] = (
    ("➜", ERROR_VECTOR, "residual of a shot"),
    ("➜", VERMILLION, "gap, or error of a pose, as it is"),
    ("➜", BLUE, "what is left of it"),
    ("━", FITTED_AXIS, "fitted axis"),
    ("━", GHOST, "nominal arm, sight lines"),
    ("◎", HIGHLIGHT, "now, or chosen"),
)
"""What else has a colour in 3-D: sign, colour, meaning."""
SHAPES = "Balls: shots. Diamonds: doubtful shots and test poses. Cages: shots left out."
JOINT = "Joint "
"""Before the number of a joint in the name of its view."""
WIDEST = 720.0
"""Deg or mm, of a slider for a joint without limits."""


class ViewPanel:
    """Switches, magnification, cameras, and the pose that is drawn."""

    def __init__(
        self,
        gui: "viser.GuiApi",
        cell: CellView,
        on_dark: Callable[[bool], None],
        may: Callable[["viser.GuiEvent"], bool],
    ) -> None:
        """``may`` says whether who changed something may do so: what is drawn is drawn for all."""
        self._cell, self._may = cell, may
        names = [camera.name for camera in cell.cameras()]
        joints = tuple(str(number) for number in range(1, len(cell.joints) + 1))
        # Buttons, not a list: whoever has turned the view away goes back to the same one.
        for label, options, prefix in (
            ("Look at", tuple(n for n in names if n.removeprefix(JOINT) not in joints), ""),
            ("Joint", joints, JOINT),
        ):
            group = gui.add_button_group(label, options)
            group.on_click(lambda event, prefix=prefix: self._fly(event, f"{prefix}{event.target.value}"))
        self._ghost = gui.add_checkbox("Nominal arm as a ghost", False)
        self._errors = gui.add_checkbox("Residual vectors", False)
        self._times = self._slider(gui, "Residuals ×", MAGNIFICATION, 200, self._magnify)
        self._geometry = gui.add_checkbox("Geometry against design", False, hint="After solving every joint.")
        self._swell = self._slider(gui, "Differences ×", EXAGGERATION, 20, self._enlarge)
        self._dark = gui.add_checkbox("Dark theme", False)
        self._obey(self._ghost, lambda: setattr(cell.ghost, "visible", bool(self._ghost.value)))
        self._obey(self._errors, lambda: setattr(cell.errors, "visible", bool(self._errors.value)))
        self._obey(self._geometry, self._diagnose)
        self._obey(self._dark, lambda: on_dark(bool(self._dark.value)))
        self._legend = gui.add_html("")
        with gui.add_folder("Pose that is drawn", expand_by_default=False):
            self._scales = [1e3 if joint.slides else 180 / np.pi for joint in cell.joints]
            self._sliders = [self._joint_slider(gui, k) for k in range(len(cell.joints))]
            gui.add_button("Back to the robot's pose").on_click(self._back)

    def tick_dark(self) -> None:
        """Show that the page is dark, where it is drawn anew."""
        self._dark.value = True

    def refresh(self) -> None:
        """Show what the colours of the shots mean, and where the robot stands."""
        if self._cell.drawn is None:
            words = "<p class='soft'>Shots are coloured by their residual once there is a solution.</p>"
        else:
            steps = "".join(
                f"<span style='color:{hex_of(step.colour)}'>⬤</span> {escape(step.text)}&emsp;"
                for step in self._cell.scale.legend()
            )
            words = f"<h3>Radial residual of a shot</h3><p>{steps}</p>"
            words += f"<p>{_key()}</p><p class='soft'>{SHAPES}</p>"
            words += (
                "<p class='soft'>Tubes about the axes: one standard uncertainty, drawn "
                f"{self._cell.tube_exaggeration:g} times too wide.</p>"
            )
        if self._cell.drawn is not None and self._geometry.value:
            words = DIFFERENCES
        self._legend.content = block(words, "legend")
        self._swell.value = int(self._cell.exaggeration)
        for slider, value, scale in zip(self._sliders, self._cell.commanded, self._scales, strict=True):
            slider.value = float(np.clip(round(value * scale, 1), slider.min, slider.max))

    def light(self, spot: Spot) -> Spot | None:
        """Draw what a result speaks of in the colour of attention, or no more if it was; gives what is drawn so."""
        self._geometry.value = bool(spot.parameter)
        self._cell.light(None if spot == self._cell.lit else spot)
        return self._cell.lit

    def _slider(self, gui: "viser.GuiApi", name: str, range_: tuple[float, float, float], at: float, act: Callable):
        """A slider that acts when a browser moves it, not when the program does."""
        slider = gui.add_slider(name, *range_, at)
        self._obey(slider, act, own=False)
        return slider

    def _joint_slider(self, gui: "viser.GuiApi", k: int) -> "viser.GuiSliderHandle[float]":
        joint, scale = self._cell.joints[k], self._scales[k]
        low, high = np.clip(np.array(joint.limits) * scale, -WIDEST, WIDEST).round(1)
        label = f"q{k + 1} [{'mm' if joint.slides else 'deg'}]"
        at = float(np.clip(round(self._cell.commanded[k] * scale, 1), low, high))
        return self._slider(gui, label, (float(low), float(high), 0.1), at, self._pose)

    def _obey(self, handle, act: Callable[[], None], own: bool = True) -> None:
        """Act when somebody changes a control who may; else it goes back. ``own``: also when the program does."""
        accepted = [handle.value]

        def changed(event: "viser.GuiEvent") -> None:
            if event.client is not None and not self._may(event):
                handle.value = accepted[0]
                return
            accepted[0] = handle.value
            if own or event.client is not None:
                act()

        handle.on_update(changed)

    def _fly(self, event: "viser.GuiEvent", name: str) -> None:
        camera = next((c for c in self._cell.cameras() if c.name == name), None)
        if camera is not None and event.client is not None:
            fly_to(event.client, camera)

    def _diagnose(self) -> None:
        self._cell.diagnose(bool(self._geometry.value))
        self.refresh()

    def _enlarge(self) -> None:
        self._cell.exaggeration = _within(self._swell)

    def _magnify(self) -> None:
        self._cell.errors.magnification = _within(self._times)

    def _pose(self) -> None:
        self._cell.follow(tuple(_within(s) / scale for s, scale in zip(self._sliders, self._scales, strict=True)))

    def _back(self, event: "viser.GuiEvent") -> None:
        if self._may(event):
            self._cell.follow_robot()
            self.refresh()


def _within(slider: "viser.GuiSliderHandle") -> float:
    """A slider's value; what a browser sends may be anything."""
    value = slider.value
    known = isinstance(value, int | float) and np.isfinite(value)
    return float(np.clip(value, slider.min, slider.max)) if known else float(slider.min)


def _key() -> str:
    """What the colours of arrows, lines and rings mean."""
    return "&emsp;<wbr>".join(
        f"<span style='white-space:nowrap'><span style='color:{hex_of(colour)}'>{sign}</span> {escape(words)}</span>"
        for sign, colour, words in KEY
    )
