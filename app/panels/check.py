"""Checking the instrument: repeated shots at one target that nobody moves, against what the instrument promises."""

from collections.abc import Callable
from html import escape
from typing import TYPE_CHECKING

import viser

from app.words import block
from app.workbench import Workbench

if TYPE_CHECKING:
    from core.session_state import Check

SHOTS = 8
"""Shots of one check: they know their own scatter to about a fifth."""
FINE, POOR = 1.3, 2.0
"""Scatter over promise up to which a check is fine, and beyond which it is poor."""


class CheckPanel:
    """One button and the verdict."""

    def __init__(self, gui: viser.GuiApi, bench: Workbench, ask: Callable) -> None:
        self._bench, self._ask = bench, ask
        gui.add_html(
            block(
                f"<h3>Check the instrument</h3><p>{SHOTS} shots at one target while the arm stands still. "
                "They show whether the instrument keeps its promise before you rely on it.</p>",
                "check-intro",
            )
        )
        names = tuple(target.name for target in bench.state.targets) or ("-",)
        self._target = gui.add_dropdown("Target", names)
        gui.add_button("Check", icon=viser.Icon.TARGET).on_click(self._check)
        self._result = gui.add_html("")

    def refresh(self) -> None:
        """Show the last check."""
        checks = self._bench.state.checks
        promised = self._bench.state.instrument.sigma_m
        words = check_words(checks[-1] if checks else None, promised)
        self._result.content = block(words, "check")

    def _check(self, event: object) -> None:
        target = self._target.value
        self._ask(event, lambda client: self._bench.check_instrument(target, SHOTS))


def check_words(check: "Check | None", promised_sigma_m: float | None) -> str:
    """Green, orange or red, with words: net radial scatter of a check against the promise for one coordinate."""
    scatter = None if check is None else check.net_radial_m
    if check is None or scatter is None:
        return "<p class='soft'>Not checked yet in this session.</p>"
    seen = f"<p>{len(check.shots)} shots at {escape(check.target)}: net radial scatter <b>{scatter * 1e3:.3f} mm</b>"
    if promised_sigma_m is None:
        return f"{seen}; the instrument promises nothing to compare it with.</p>"
    promise = promised_sigma_m * 3**0.5
    seen += f", promised {promise * 1e3:.3f} mm.</p>"
    if scatter <= FINE * promise:
        return f"<p class='verdict ok'>✔ as promised</p>{seen}"
    if scatter <= POOR * promise:
        advice = "Check focus, targets and air, then repeat it."
        return f"<p class='verdict doubt'>? worse than promised</p>{seen}<p>{advice}</p>"
    advice = "Do not measure with it before the cause is found."
    return f"<p class='verdict bad'>✖ far worse than promised</p>{seen}<p>{advice}</p>"
