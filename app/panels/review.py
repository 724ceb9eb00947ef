"""A point that was clicked in 3-D: leave it out for a reason, see at once what that changes, take it back."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import viser

from app.panels.acquire import OWN_WORDS, REASONS, RUNNING
from app.review_words import HINT, chosen_words, effect_words
from app.words import block
from app.workbench import Workbench
from core.errors import InputError
from core.session_events import Judged
from core.solve_figures import changes, figures_of

if TYPE_CHECKING:
    from core.session_state import Shot

NO_REASON = "a point is left out for a reason: choose one, or write your own, then press Exclude and solve again"


class ReviewPanel:
    """Nothing but a hint until a point of a solution is chosen."""

    def __init__(self, gui: viser.GuiApi, bench: Workbench, ask: Callable) -> None:
        self._bench, self._ask = bench, ask
        self._number: int | None = None
        self._hint = gui.add_html("", visible=False)
        self._folder = gui.add_folder("Chosen point", visible=False)
        with self._folder:
            self._words = gui.add_html("")
            self._reason = gui.add_dropdown("Reason", REASONS)
            self._own = gui.add_text("In my words", "", visible=False)
            self._reason.on_update(lambda _: self._show_own())
            self._out = gui.add_button("Exclude and solve again", color="orange", icon=viser.Icon.TRASH_X)
            self._in = gui.add_button("Include and solve again", icon=viser.Icon.ARROW_BACK_UP)
            self._back = gui.add_button("Undo and solve again", icon=viser.Icon.ARROW_BACK_UP)
            self._effect = gui.add_html("")
        self._out.on_click(self._exclude)
        self._in.on_click(self._include)
        self._back.on_click(self._undo)

    def choose(self, number: int | None) -> None:
        """Choose a shot by its number, as by a click in 3-D; None: none."""
        self._number, self._effect.content = number, ""
        self._reason.value, self._own.value = REASONS[0], ""
        self.refresh()

    def refresh(self) -> None:
        """Show the chosen point as the session has it now."""
        found, shot = self._bench.calibration, self._shot()
        self._hint.content = block(HINT, "review-hint")
        self._hint.visible = found is not None and shot is None
        self._folder.visible = found is not None and shot is not None
        if found is None or shot is None:
            return
        self._words.content = chosen_words(shot, found)
        counts, last = shot.counts, self._bench.decisions.undo_event()
        taken_back = isinstance(last, Judged) and shot.id in last.shots
        self._out.visible = self._reason.visible = counts
        self._in.visible = shot.verdict == "excluded" and not taken_back
        self._back.visible = taken_back
        self._show_own()

    def _shot(self) -> "Shot | None":
        return None if self._number is None else self._bench.state.shot(self._number)

    def _show_own(self) -> None:
        self._own.visible = bool(self._reason.visible and self._reason.value == OWN_WORDS)

    def _exclude(self, event: viser.GuiEvent) -> None:
        reason = self._said()

        def act(shot: "Shot") -> str:
            if not reason:
                raise InputError(NO_REASON)
            self._bench.decisions.exclude(shot.id, reason)
            return f"Record {shot.record} left out"

        self._decide(event, act)

    def _include(self, event: viser.GuiEvent) -> None:
        def act(shot: "Shot") -> str:
            self._bench.decisions.include(shot.id)
            return f"Record {shot.record} counts again"

        self._decide(event, act)

    def _undo(self, event: viser.GuiEvent) -> None:
        def act(shot: "Shot") -> str:
            last = self._bench.decisions.undo_event()
            if not isinstance(last, Judged) or shot.id not in last.shots:
                raise InputError("something else was done since; take that back under 2 Measure first")
            self._bench.decisions.undo()
            return f"Decision on record {shot.record} taken back"

        self._decide(event, act)

    def _decide(self, event: viser.GuiEvent, act: "Callable[[Shot], str]") -> None:
        """Decide on the chosen shot, solve again, and tell what that changed and nothing else."""

        def job(client: object) -> None:
            shot = self._shot()
            if shot is None:
                return
            if self._bench.runs.running is not None:
                raise InputError(RUNNING)
            solving = self._bench.solving
            before = solving.calibration
            if before is None or solving.since_solved:
                before = solving.solve()
            what = act(shot)
            self._effect.content = ""
            after = solving.solve()
            self._effect.content = effect_words(what, changes(figures_of(before), figures_of(after)))

        self._ask(event, job)

    def _said(self) -> str:
        """The reason, as it is to be kept; what a browser sends is not to be trusted."""
        if self._reason.value == OWN_WORDS:
            return " ".join(str(self._own.value).split())[:200]
        return self._reason.value if self._reason.value in REASONS[1:] else ""
