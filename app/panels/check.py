"""Checking the instrument: repeated shots at one target that nobody moves, against what the instrument promises."""

from collections.abc import Callable
from html import escape
from typing import TYPE_CHECKING

import numpy as np
import viser

from app.glossary import term
from app.measure_words import entered_words
from app.words import block
from app.workbench import Workbench
from core.errors import InputError
from core.point_lines import entered_points
from core.units import LENGTH

if TYPE_CHECKING:
    from core.session_state import Check

SHOTS = 8
"""Shots of one check: they know their own scatter to about a sixth."""
FINE, POOR = 2.0, 6.5
"""Standard deviations of the scatter's own uncertainty beyond the promise: fine up to here, poor beyond."""
NO_TARGET = "-"


class CheckPanel:
    """One button and the verdict."""

    def __init__(self, gui: viser.GuiApi, bench: Workbench, ask: Callable) -> None:
        self._bench, self._ask = bench, ask
        gui.add_html(
            block(
                f"<h3>Check the instrument</h3><p>{SHOTS} shots at one target while the arm stands still. "
                "They show whether the instrument keeps its promise before you rely on it.</p>"
                "<p class='soft'>Choose a target far out on the arm. Next: <b>2 Measure</b>.</p>",
                "check-intro",
            )
        )
        self._target = gui.add_dropdown("Target", (NO_TARGET,))
        hint = "What the instrument shows at each shot, one line a shot: x y z."
        self._typed = gui.add_text("Shots x y z", "", multiline=True, hint=hint)
        self._unit = gui.add_dropdown("Coordinates in", LENGTH, initial_value=LENGTH[0])
        self._echo = gui.add_html("")
        for box in (self._typed, self._unit):
            box.on_update(lambda _: self._show_typed())
        gui.add_button("Check", icon=viser.Icon.TARGET).on_click(self._check)
        self._result = gui.add_html("")

    def refresh(self) -> None:
        """Show the last check."""
        state = self._bench.state
        names = tuple(target.name for target in state.targets) or (NO_TARGET,)
        if names != tuple(self._target.options):
            self._target.options = names
        by_hand = not self._bench.rig.moves_itself
        for piece in (self._typed, self._unit, self._echo):
            piece.visible = by_hand
        self._show_typed()
        self._result.content = block(check_words(state.checks, state.instrument.sigma_m), "check")

    def _check(self, event: object) -> None:
        target, typed = self._target.value, (str(self._typed.value), str(self._unit.value))

        def job(client: object) -> None:
            count = SHOTS
            if not self._bench.rig.moves_itself:
                count = self._bench.typed.lay_ready(*typed)
                if count < 2:
                    raise InputError(f"{count} shots are typed, expected two or more lines x y z")
            self._bench.shooting.check_instrument(target, count)
            self._typed.value = ""

        self._ask(event, job)

    def _show_typed(self) -> None:
        try:
            points = entered_points(str(self._typed.value), str(self._unit.value))
        except InputError as wrong:
            self._echo.content = entered_words("", str(wrong), 0)
            return
        if points:
            text = f"<p class='ok'>✔ understood as {len(points)} shots. Press <b>Check</b>.</p>"
        else:
            text = f"<p class='soft'>One line a shot: x y z. {SHOTS} shots or more tell enough.</p>"
        self._echo.content = block(text, "check-entered")


def check_words(checks: "tuple[Check, ...]", promised_sigma_m: float | None) -> str:
    """The last check in words, and those before it."""
    if not checks:
        return "<p class='soft'>Not checked yet in this session.</p>"
    text = one_check_words(checks[-1], promised_sigma_m)
    earlier = "".join(
        f"<li>{len(one.shots)} shots at {escape(one.target)}: {one.net_radial_m * 1e3:.3f} mm</li>"
        for one in checks[-2::-1][:5]
        if one.net_radial_m is not None
    )
    return text + (f"<p class='soft'>Before:</p><ul class='soft'>{earlier}</ul>" if earlier else "")


def one_check_words(check: "Check", promised_sigma_m: float | None) -> str:
    """Green, orange or red, with words: net radial scatter of a check against the promise for one coordinate."""
    scatter = check.net_radial_m
    if scatter is None:
        return "<p class='soft'>One shot tells nothing of the scatter: take more.</p>"
    name = term("net radial scatter", "Net radial repeatability")
    seen = f"<p>{len(check.shots)} shots at {escape(check.target)}: {name} <b>{scatter * 1e3:.3f} mm</b>"
    if promised_sigma_m is None:
        return (
            f"{seen}; the instrument promises nothing to compare it with. State its σ under "
            "<b>1 Cell</b>, <b>Instrument and points</b>.</p>"
        )
    promise = promised_sigma_m * 3**0.5
    seen += f", promised {promise * 1e3:.3f} mm.</p>"
    # A standard deviation of n points in space knows itself to 1 / sqrt(6 (n - 1)).
    own = 1 / np.sqrt(6 * (len(check.shots) - 1))
    if scatter <= (1 + FINE * own) * promise:
        return f"<p class='verdict ok'>✔ as promised</p>{seen}"
    if scatter <= (1 + POOR * own) * promise:
        advice = "Check focus, targets and air, then repeat it."
        return f"<p class='verdict doubt'>? worse than promised</p>{seen}<p>{advice}</p>"
    advice = "Do not measure with it before the cause is found."
    return f"<p class='verdict bad'>✖ far worse than promised</p>{seen}<p>{advice}</p>"
