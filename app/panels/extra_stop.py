"""Stops beside the plan: more points where a curve bends, or where a shot was doubtful."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from app.words import block
from app.workbench import Workbench
from core.errors import InputError
from core.wording import display_unit

if TYPE_CHECKING:
    import viser

INTRO = "One more stop of a sweep, wherever you like: all its targets are measured there. It counts like the others."


class ExtraStop:
    """A folder with the sweep, the joint's command, and a button."""

    def __init__(
        self, gui: "viser.GuiApi", bench: Workbench, ask: Callable[[object, Callable[[], object]], None]
    ) -> None:
        self._bench, self._ask = bench, ask
        with gui.add_folder("Extra stop", expand_by_default=False):
            gui.add_html(block(f"<p class='soft'>{INTRO}</p>", "extra-intro"))
            self._sweep = gui.add_dropdown("Sweep", ("-",))
            self._at = gui.add_number("Command [° or mm]", 0.0, step=0.001)
            gui.add_button("Measure extra stop").on_click(self._measure)

    def refresh(self) -> None:
        """Offer the sweeps of the plan."""
        names = tuple(_name(row.joint, row.sweep) for row in self._bench.state.plan.sweeps) or ("-",)
        if names != tuple(self._sweep.options):
            self._sweep.options = names

    def _measure(self, event: object) -> None:
        name, at = self._sweep.value, self._at.value

        def act() -> None:
            row = next((r for r in self._bench.state.plan.sweeps if _name(r.joint, r.sweep) == name), None)
            if row is None:
                raise InputError("no sweep is planned, expected one to add a stop to")
            if not isinstance(at, int | float) or not np.isfinite(at):
                raise InputError(f"the command is {at!r}, expected a number")
            scale = display_unit(bool(self._bench.nominal.sliding[row.joint - 1]))[1]
            self._bench.shooting.measure_extra(row.joint, row.sweep, at / scale)

        self._ask(event, act)


def _name(joint: int, sweep: int) -> str:
    return f"joint {joint}, sweep {sweep}"
