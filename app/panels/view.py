"""What is shown in 3-D, and from where."""

from collections.abc import Callable
from html import escape
from typing import TYPE_CHECKING

from app.cell_view import CellView
from app.scene.cameras import fly_to
from app.scene.colours import hex_of
from app.words import block

if TYPE_CHECKING:
    import viser

MAGNIFICATIONS = ("50", "100", "200", "500", "1000")


class ViewPanel:
    """Switches, magnification, cameras, and the keys."""

    def __init__(self, gui: "viser.GuiApi", cell: CellView, on_dark: Callable[[bool], None]) -> None:
        self._cell = cell
        names = tuple(camera.name for camera in cell.cameras())
        self._camera = gui.add_dropdown("Look at", names, initial_value=names[0])
        self._camera.on_update(self._fly)
        self._ghost = gui.add_checkbox("Nominal arm as a ghost", False)
        self._ghost.on_update(lambda _: setattr(cell.ghost, "visible", bool(self._ghost.value)))
        self._errors = gui.add_checkbox("Residual vectors", False)
        self._errors.on_update(lambda _: setattr(cell.errors, "visible", bool(self._errors.value)))
        self._times = gui.add_dropdown("Residuals magnified", MAGNIFICATIONS, initial_value="200")
        self._times.on_update(self._magnify)
        self._geometry = gui.add_checkbox("Geometry against design", False, hint="After solving every joint.")
        self._geometry.on_update(lambda _: cell.diagnose(bool(self._geometry.value)))
        self._swell = gui.add_dropdown("Differences enlarged", ("10", "20", "50", "100"), initial_value="20")
        self._swell.on_update(self._enlarge)
        self._dark = gui.add_checkbox("Dark theme", False)
        self._dark.on_update(lambda _: on_dark(bool(self._dark.value)))
        self._legend = gui.add_html("")
        keys = (
            ("Space", "Measure the next shot"),
            ("R", "Measure the chosen shot again"),
            ("Backspace", "Undo"),
            ("S", "Solve"),
        )
        rows = "".join(f"<tr><td><b>{key}</b></td><td>{what}</td></tr>" for key, what in keys)
        gui.add_html(
            block(
                f"<h3>Keys</h3><table>{rows}</table><p class='soft'>Keys are off while you type in a box.</p>", "keys"
            )
        )

    def refresh(self) -> None:
        """Show what the colours of the shots mean."""
        if self._cell.drawn is None:
            words = "<p class='soft'>Shots are coloured by their residual once there is a solution.</p>"
        else:
            steps = "".join(
                f"<span style='color:{hex_of(step.colour)}'>⬤</span> {escape(step.text)}&emsp;"
                for step in self._cell.scale.legend()
            )
            words = f"<h3>Radial residual of a shot</h3><p>{steps}</p>"
        self._legend.content = block(words, "legend")

    def _fly(self, event: "viser.GuiEvent") -> None:
        camera = next((c for c in self._cell.cameras() if c.name == self._camera.value), None)
        if camera is not None and event.client is not None:
            fly_to(event.client, camera)

    def _enlarge(self, event: "viser.GuiEvent") -> None:
        if self._swell.value.isdigit():
            self._cell.diagnose(bool(self._geometry.value), float(self._swell.value))

    def _magnify(self, event: "viser.GuiEvent") -> None:
        if self._times.value in MAGNIFICATIONS:
            self._cell.errors.magnification = float(self._times.value)
