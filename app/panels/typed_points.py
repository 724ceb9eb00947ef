"""Coordinates typed in, pasted or sent as a file, where nobody but a person reads the instrument."""

from collections.abc import Callable

import viser

from app.measure_words import entered_words
from app.uploads import as_file
from app.workbench import Workbench
from core.errors import InputError
from core.point_lines import entered_points
from core.units import LENGTH


class TypedPoints:
    """A box for lines x y z, how the page understands them, and a button for a CSV file."""

    def __init__(self, gui: viser.GuiApi, bench: Workbench) -> None:
        self._bench = bench
        hint = "What the instrument shows, one line a shot: x y z."
        self._box = gui.add_text("x y z", "", multiline=True, hint=hint)
        self._unit = gui.add_dropdown("Unit", LENGTH, initial_value=LENGTH[0])
        self._echo = gui.add_html("")
        for box in (self._box, self._unit):
            box.on_update(lambda _: self._show())
        self._file: viser.GuiUploadButtonHandle | None = None
        self._folder: viser.GuiFolderHandle | None = None

    def build_file(self, gui: viser.GuiApi, ask: Callable) -> None:
        """The button for a file; it stands below Measure, which is used more."""
        hint = (
            "Columns x_mm, y_mm, z_mm; target, q_deg and sigma_mm if you have them. For the open stops of this sweep."
        )
        # viser 1.1.1 shows a button for files whether it is to be visible or not; so its folder is hidden.
        self._folder = gui.add_folder(None)
        with self._folder:
            self._file = gui.add_upload_button(
                "Points of this sweep from a CSV file", icon=viser.Icon.UPLOAD, hint=hint
            )

        def send(event: viser.GuiEvent) -> None:
            upload = self._file.value

            def job(client: viser.ClientHandle | None) -> None:
                with as_file(upload) as path:
                    count = self._bench.typed.enter_file(path)
                if client is not None:
                    text = f"{count} shots from {path.name} are in the session."
                    client.add_notification("Points taken over", text, color="green", auto_close_seconds=6)

            ask(event, job)

        self._file.on_upload(send)

    def refresh(self) -> None:
        """Show it where points are entered by hand."""
        wanted = not self._bench.rig.moves_itself
        for piece in (self._box, self._unit, self._echo, self._folder):
            if piece is not None:
                piece.visible = wanted
        if wanted:
            self._show()

    def take(self) -> tuple[str, str] | None:
        """Text and unit as the page shows them; None: nothing is typed here."""
        return (str(self._box.value), str(self._unit.value)) if not self._bench.rig.moves_itself else None

    def clear(self) -> None:
        """Empty the box for the next shot."""
        if self._box.value:
            self._box.value = ""
        self._show()

    def _show(self) -> None:
        try:
            points = entered_points(str(self._box.value), str(self._unit.value))
        except InputError as wrong:
            self._echo.content = entered_words("", str(wrong), 0)
            return
        last = "" if not points else ", ".join(f"{v * 1e3:.3f}" for v in points[-1].point_m)
        self._echo.content = entered_words(f"the last one at {last} mm", None, len(points))
