"""Solving on demand, and what the solution says in sentences."""

from collections.abc import Callable
from html import escape
from typing import TYPE_CHECKING

import viser

from app.words import block, findings_words
from app.workbench import Workbench

if TYPE_CHECKING:
    from core.calibration import Calibration


class SolvePanel:
    """One button, then summary and findings."""

    def __init__(self, gui: viser.GuiApi, bench: Workbench, ask: Callable) -> None:
        self._bench, self._ask = bench, ask
        self._drawn: Calibration | None = None
        gui.add_html(
            block(
                "<h3>Solve</h3><p>Axes, drives, couplings and the arm's parameters from all shots that count. "
                "Do it as often as you like while measuring; the joints that are missing are named.</p>",
                "solve-intro",
            )
        )
        gui.add_button("Solve", icon=viser.Icon.CALCULATOR, hint="S").on_click(self.solve)
        self._words = gui.add_html("")

    def solve(self, event: object) -> None:
        """Calibrate from what is there."""
        self._ask(event, lambda client: self._bench.solve())

    def refresh(self) -> None:
        """Show the last solution, if there is one."""
        found = self._bench.calibration
        if found is None:
            text = "Nothing is solved yet. One finished sweep is enough to begin."
            self._words.content = block(f"<p class='soft'>{text}</p>", "solution")
        elif found is not self._drawn:
            self._drawn = found
            self._words.content = _summary(found, self._bench.previous)


def _summary(found: "Calibration", before: "Calibration | None") -> str:
    used = int(found.refinement.residuals.used.sum())
    text = (
        f"<p data-testid='solution'><b>{used}</b> points used, <b>{len(found.rejected)}</b> rejected; "
        f"one coordinate scatters by <b data-testid='noise'>{found.estimate.noise_m * 1e3:.3f} mm</b>.</p>"
    )
    if before is not None:
        change = (found.estimate.noise_m - before.estimate.noise_m) * 1e3
        text += f"<p class='soft'>Since the last solution: noise {change:+.3f} mm.</p>"
    if found.not_swept:
        missing = ", ".join(map(str, found.not_swept))
        text += f"<p class='doubt'>Not swept yet: joint {missing}. The geometry needs them all.</p>"
    for rejection in found.rejected:
        text += f"<p class='doubt'>Record {rejection.record} left out: {escape(rejection.reason)}.</p>"
    return block(text, "solution-box") + findings_words(found.findings)
