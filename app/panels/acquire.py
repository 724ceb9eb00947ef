"""Measuring: what to do now, one big button, what the last shot is worth, and the living table of sweeps."""

from collections.abc import Callable
from html import escape
from typing import TYPE_CHECKING

import viser

from app.words import block, step_words, sweeps_table, verdict_words
from app.workbench import Workbench

if TYPE_CHECKING:
    from core.session_state import Shot

REASONS = ("target was bumped", "wrong target", "robot had not settled", "sight was blocked", "other")


class AcquirePanel:
    """The acquisition, stop by stop."""

    def __init__(self, gui: viser.GuiApi, bench: Workbench, ask: Callable) -> None:
        self._bench, self._ask = bench, ask
        self._chosen: int | None = None
        self._step = gui.add_html("")
        gui.add_button("Measure", color="green", icon=viser.Icon.CROSSHAIR, hint="Space").on_click(self.measure)
        self._verdict = gui.add_html("")
        run = gui.add_button_group("Demo robot", ("Run this sweep", "Run all", "Stop"))
        run.on_click(self._run)
        self._bar = gui.add_progress_bar(0.0)
        history = gui.add_button_group("History", ("Undo", "Redo", "Skip stop"))
        history.on_click(self._history)
        self._table = gui.add_html("")
        with gui.add_folder("Chosen shot"):
            self._shot = gui.add_html("")
            self._reason = gui.add_dropdown("Reason", REASONS)
            act = gui.add_button_group("This shot", ("Measure again", "Exclude", "Include"))
            act.on_click(self._act)
        self._run_group, self._history_group, self._act_group = run, history, act

    def refresh(self) -> None:
        """Show where the session stands."""
        state = self._bench.state
        self._step.content = step_words(state, self._bench.nominal)
        rows = self._bench.progress()
        self._table.content = sweeps_table(rows)
        total = sum(r.planned.shots for r in rows)
        self._bar.value = 100.0 * sum(min(r.done, r.planned.shots) for r in rows) / max(total, 1)
        last = next((s for s in reversed(state.shots) if s.taken.phase == "sweep"), None)
        if last is None:
            self._verdict.content = block(
                "<p class='soft'>No shot yet. Press <b>Measure</b>, or let the robot run.</p>", "verdict"
            )
        else:
            live, shots = self._bench.live(last.taken.joint, last.taken.sweep)
            self._verdict.content = verdict_words(live, shots, last.taken.joint)
        if self._chosen is None and last is not None:
            self._show_shot(last, chosen=False)
        elif self._chosen is not None:
            shot = state.shot(self._chosen)
            if shot is not None:
                self._show_shot(shot, chosen=True)

    def choose(self, number: int) -> None:
        """Choose a shot, as by a click in 3-D."""
        self._chosen = number
        self.refresh()

    def measure(self, event: object) -> None:
        """Take the next planned shot."""
        self._chosen = None
        self._ask(event, lambda client: self._bench.measure())

    def undo(self, event: object) -> None:
        """Take back the last thing."""
        self._ask(event, lambda client: self._bench.undo())

    def measure_again(self, event: object) -> None:
        """Measure the chosen shot, or the last one, again."""
        number = self._number()
        if number is not None:
            self._chosen = None
            self._ask(event, lambda client: self._bench.measure_again(number))

    def _run(self, event: viser.GuiEvent) -> None:
        asked = self._run_group.value
        if asked == "Stop":
            self._bench.stop()
            return
        self._chosen = None
        self._ask(event, lambda client: self._bench.run(asked == "Run all"))

    def _history(self, event: viser.GuiEvent) -> None:
        asked = self._history_group.value
        actions = {
            "Undo": self._bench.undo,
            "Redo": self._bench.redo,
            "Skip stop": lambda: self._bench.skip("skipped by the operator"),
        }
        self._ask(event, lambda client: actions[asked]())

    def _act(self, event: viser.GuiEvent) -> None:
        asked, number, reason = self._act_group.value, self._number(), self._reason.value
        if number is None:
            return
        if asked == "Measure again":
            self.measure_again(event)
        elif asked == "Exclude":
            reason = reason if reason in REASONS else "other"
            self._ask(event, lambda client: self._bench.exclude(number, reason))
        else:
            self._ask(event, lambda client: self._bench.include(number))

    def _number(self) -> int | None:
        shots = self._bench.state.shots
        return self._chosen if self._chosen is not None else (shots[-1].id if shots else None)

    def _show_shot(self, shot: "Shot", chosen: bool) -> None:
        taken = shot.taken
        point = "not seen" if taken.point_m is None else ", ".join(f"{v * 1e3:.2f}" for v in taken.point_m) + " mm"
        reason = f" ({escape(shot.reason)})" if shot.reason else ""
        which = "chosen" if chosen else "the last one; click a point in 3-D to choose another"
        self._shot.content = block(
            f"<p><b>Record {shot.record}</b>, joint {taken.joint}, stop {taken.step + 1}, "
            f"target {escape(taken.target)}: {which}</p>"
            f"<p>{point}<br><b>{escape(shot.verdict)}</b>{reason}</p>",
            "shot",
        )
