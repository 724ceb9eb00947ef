"""Solving on demand, families of functions to choose, and what the solution says in sentences."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import viser

from app.panels.bring_forward import bring_forward
from app.panels.review import ReviewPanel
from app.solve_words import summary_words, unsolved_words
from app.table_2 import limits_of
from app.words import block
from app.workbench import Workbench
from core.errors import InputError
from core.session_events import Setting
from core.session_families import COUPLING_FAMILIES, coupling_key, drive_families, drive_key, with_families
from core.solve_figures import changes

if TYPE_CHECKING:
    from core.calibration import Calibration

AS_DESIGNED = "as in robot.toml"


class SolvePanel:
    """One button, then summary and findings."""

    def __init__(self, gui: viser.GuiApi, bench: Workbench, ask: Callable) -> None:
        self._bench, self._ask = bench, ask
        self._drawn: Calibration | None = None
        self._shown: tuple | None = None
        self._found: Calibration | None = None
        bring_forward(gui, "Residuals", "Drives", "Axes", "Geometry")
        gui.add_html(
            block(
                "<h3>Solve</h3><p>Axes, drives, couplings and the arm's parameters from all shots that count. "
                "Do it as often as you like while measuring; the joints that are missing are named.</p>"
                "<p class='soft'>Next: look at residuals and geometry on the right, then <b>4 Export</b>.</p>",
                "solve-intro",
            )
        )
        gui.add_button("Solve", icon=viser.Icon.CALCULATOR, hint="S").on_click(self.solve)
        self._busy = gui.add_html("")
        self.review = ReviewPanel(gui, bench, ask)
        self._words = gui.add_html("")
        with gui.add_folder("Families of drives and couplings", expand_by_default=False):
            self._families = self._build_families(gui)

    def solve(self, event: object) -> None:
        """Calibrate from what is there; while the robot runs, between two of its shots."""

        def job(client: object) -> None:
            self._busy.content = block("<p class='soft'>Solving …</p>", "solving")
            try:
                self._bench.solving.solve()
            finally:
                self._busy.content = ""

        self._ask(event, job, at_once=self._bench.runs.running is not None)

    def refresh(self) -> None:
        """Show the last solution, if there is one."""
        bench, state = self._bench, self._bench.state
        self.review.refresh()
        for key, box in self._families.items():
            box.value = str(state.settings.get(key, AS_DESIGNED))
        found, since, limits = bench.calibration, bench.solving.since_solved, limits_of(state.settings)
        last = state.solves[-1] if state.solves else None
        shown = since, limits, None if last is None else last.id, bool(state.shots)
        if found is self._found and shown == self._shown:
            return
        self._found, self._shown = found, shown
        if found is None:
            self._words.content = unsolved_words(last, since, len(state.shots))
        else:
            self._words.content = summary_words(found, limits, self._changes(), since)

    def _changes(self) -> tuple:
        solves = self._bench.state.solves
        return changes(solves[-2].solved.figures, solves[-1].solved.figures) if len(solves) > 1 else ()

    def _build_families(self, gui: viser.GuiApi) -> dict[str, viser.GuiDropdownHandle]:
        text = "Which function a drive is given. With auto the most probable one is chosen by evidence; see Drives."
        gui.add_html(block(f"<p class='soft'>{text}</p>", "families-intro"))
        robot = self._bench.nominal
        boxes = {
            drive_key(number): gui.add_dropdown(f"Drive of joint {number}", (AS_DESIGNED, *drive_families(joint)))
            for number, joint in enumerate(robot.joints, 1)
            if robot.commanded[number - 1]
        }
        for coupling in robot.couplings:
            label = f"Coupling {coupling.source} → {coupling.target}"
            boxes[coupling_key(coupling.target)] = gui.add_dropdown(label, (AS_DESIGNED, *COUPLING_FAMILIES))
        for key, box in boxes.items():
            box.on_update(lambda event, key=key: self._choose(event, key))
        return boxes

    def _choose(self, event: viser.GuiEvent, key: str) -> None:
        if event.client is None:
            return
        chosen = self._families[key].value
        value = None if chosen == AS_DESIGNED else chosen

        def job(client: object) -> None:
            if value == self._bench.state.settings.get(key):
                return
            if not isinstance(value, str | None):
                raise InputError(f"{key}: {value!r}, expected the name of a family")
            with_families(self._bench.nominal, {} if value is None else {key: value})
            self._bench.session.append(Setting(key, value))
            self._bench.changed()

        self._ask(event, job)
