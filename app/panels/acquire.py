"""Measuring: what to do now, one big button, what the last shot is worth, and the living table of sweeps."""

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import viser

from app.measure_words import (
    SHOT_WORD,
    SWEEP_WORD,
    run_words,
    shot_words,
    step_words,
    sweeps_table,
    undo_words,
    verdict_words,
)
from app.panels.extra_stop import ExtraStop
from app.panels.typed_points import TypedPoints
from app.sweep_progress import SweepProgress, sweep_progress
from app.words import BIG
from app.workbench import Workbench
from core.errors import InputError
from core.live_sweep import Verdict

if TYPE_CHECKING:
    from core.session_state import Shot

UNSAID, OWN_WORDS = "choose a reason", "in my own words"
REASONS = (UNSAID, "target was bumped", "wrong target", "robot had not settled", "sight was blocked", OWN_WORDS)
RUNNING = "The robot is running: press Pause (P) or Stop (Esc) first."


class AcquirePanel:
    """The acquisition, stop by stop."""

    def __init__(self, gui: viser.GuiApi, bench: Workbench, ask: Callable) -> None:
        self._bench, self._ask = bench, ask
        self._chosen: int | None = None
        self._judged: dict[tuple[int, int], tuple[tuple, tuple[Shot, ...]]] = {}
        self._began, self._done, self._total = 0.0, 0, 0
        self._step = gui.add_html("")
        self._typed = TypedPoints(gui, bench)
        gui.add_html(BIG)
        gui.add_button("Measure", color="green", icon=viser.Icon.CROSSHAIR, hint="Space or Enter").on_click(
            self.measure
        )
        self._typed.build_file(gui, self._ask)
        self._verdict = gui.add_html("")
        self._run_group = gui.add_button_group("Robot", ("Run this sweep", "Run all", "Pause", "Stop"))
        self._run_group.on_click(self._run)
        self._bar = gui.add_progress_bar(0.0)
        self._running = gui.add_html("")
        self._history = gui.add_button_group("History", ("Undo", "Redo", "Skip"))
        self._history.on_click(self._changed_mind)
        self._undo = gui.add_html("")
        self._table = gui.add_html("")
        with gui.add_folder("Chosen shot"):
            self._shot = gui.add_html("")
            self._reason = gui.add_dropdown("Reason", REASONS, hint="Of excluding or skipping; kept with the shot.")
            self._words = gui.add_text("In my words", "", visible=False)
            self._reason.on_update(lambda _: setattr(self._words, "visible", self._reason.value == OWN_WORDS))
            self._act_group = gui.add_button_group("This shot", ("Measure again", "Exclude", "Include"))
            self._act_group.on_click(self._act)
        self._extra = ExtraStop(gui, bench, self._ask_at_rest)

    def refresh(self) -> None:
        """Show where the session stands."""
        bench, state = self._bench, self._bench.state
        expected = bench.known.expected()
        self._step.content = step_words(
            state, bench.nominal, not bench.rig.moves_itself, expected, bench.known.aims(expected)
        )
        rows = sweep_progress(bench.state)
        self._table.content = sweeps_table(rows, bench.nominal, self._wrong(rows))
        total = sum(row.planned.shots for row in rows)
        self._bar.value = 100.0 * sum(row.planned.shots - row.left for row in rows) / max(total, 1)
        self._verdict.content = self._last_verdict()
        self._undo.content = undo_words(bench.decisions.undo_event(), state)
        self._run_group.visible = self._bar.visible = bench.rig.moves_itself
        self._show_run()
        chosen = None if self._chosen is None else state.shot(self._chosen)
        self._shot.content = shot_words(chosen or self._last(), chosen is not None, state)
        self._typed.refresh()
        self._extra.refresh()

    def _wrong(self, rows: tuple[SweepProgress, ...]) -> "dict[tuple[int, int], tuple[Shot, ...]]":
        """Shots that are to be measured again, by sweep: in a run nobody reads every verdict."""
        counting: dict[tuple[int, int], list[int]] = {}
        for shot in self._bench.state.shots:
            if shot.counts:
                counting.setdefault((shot.taken.joint, shot.taken.sweep), []).append(shot.id)
        found = {}
        for sweep in {(row.planned.joint, row.planned.sweep) for row in rows} & counting.keys():
            key = (self._bench.session, *counting[sweep])
            if key != self._judged.get(sweep, ((), ()))[0]:
                self._judged[sweep] = key, self._again(*sweep)
            found[sweep] = self._judged[sweep][1]
        return found

    def _again(self, joint: int, sweep: int) -> "tuple[Shot, ...]":
        so_far = self._bench.known.so_far(joint, sweep)
        judged = zip(so_far.shots, so_far.live.verdicts, strict=True)
        return tuple(shot for shot, verdict in judged if verdict is Verdict.AGAIN)

    def choose(self, number: int | None) -> None:
        """Choose a shot, as by a click in 3-D; None: the last one."""
        self._chosen = number
        self.refresh()

    def measure(self, event: object) -> None:
        """Take the next planned shot, or those that were typed in."""
        self._chosen = None
        typed = self._typed.take()
        if typed is None:
            self._ask_at_rest(event, self._bench.shooting.measure)
            return

        def job() -> None:
            self._bench.typed.enter(*typed)
            self._typed.clear()

        self._ask_at_rest(event, job)

    def undo(self, event: object) -> None:
        """Take back the last thing."""
        self._ask_at_rest(event, self._bench.decisions.undo)

    def redo(self, event: object) -> None:
        """Bring back what was taken back last."""
        self._ask_at_rest(event, self._bench.decisions.redo)

    def skip(self, event: object) -> None:
        """Leave out the next shot."""
        reason = self._said()

        def job() -> None:
            self._bench.decisions.skip(reason)
            self._unsay()

        self._ask_at_rest(event, job)

    def measure_again(self, event: object) -> None:
        """Measure the chosen shot, or the last one, again."""
        number, typed = self._number(), self._typed.take()
        if number is None:
            return
        self._chosen = None

        def job() -> None:
            if typed is not None and self._bench.typed.lay_ready(*typed) != 1:
                raise InputError("one shot is measured again, expected one line of coordinates")
            self._bench.shooting.measure_again(number)
            self._typed.clear()

        self._ask_at_rest(event, job)

    def pause(self, event: object) -> None:
        """Pause a run, or go on with one that was paused."""
        if self._bench.runs.running is not None:
            self._now(event, self._bench.runs.pause)
        elif self._bench.runs.paused is not None:
            self._start(event, self._bench.runs.paused)

    def stop(self, event: object) -> None:
        """Stop a run at once, or give up one that was paused."""
        self._now(event, self._bench.runs.stop)

    def heard(self, event: object, word: str) -> None:
        """A row of the table was clicked: go on with that sweep; or a shot in it: choose it."""
        number = word.removeprefix(SHOT_WORD)
        if word.startswith(SHOT_WORD) and number.isdecimal() and self._bench.state.shot(int(number)) is not None:
            self._ask(event, lambda client: self.choose(int(number)))
            return
        joint, _, sweep = word.removeprefix(SWEEP_WORD).partition("-")
        if word.startswith(SWEEP_WORD) and joint.isdecimal() and sweep.isdecimal():
            self._ask_at_rest(event, lambda: self._bench.decisions.go_to(int(joint), int(sweep)))

    def _run(self, event: viser.GuiEvent) -> None:
        asked = self._run_group.value
        if asked == "Stop":
            self.stop(event)
        elif asked == "Pause":
            self.pause(event)
        else:
            self._start(event, asked == "Run all")

    def _start(self, event: object, whole_plan: bool) -> None:
        self._chosen = None

        def progress(done: int, total: int) -> None:
            self._done, self._total = done, total
            self._show_run()

        def job() -> None:
            self._began, self._done, self._total = time.monotonic(), 0, 0
            self._bench.runs.run(whole_plan, progress=progress)

        self._ask_at_rest(event, job)

    def _changed_mind(self, event: viser.GuiEvent) -> None:
        {"Undo": self.undo, "Redo": self.redo, "Skip": self.skip}.get(self._history.value, self.undo)(event)

    def _act(self, event: viser.GuiEvent) -> None:
        asked, number, reason = self._act_group.value, self._number(), self._said()
        if number is None:
            return
        if asked == "Measure again":
            self.measure_again(event)
        elif asked == "Exclude":
            self._ask_at_rest(event, lambda: self._exclude(number, reason))
        else:
            self._ask_at_rest(event, lambda: self._bench.decisions.include(number))

    def _ask_at_rest(self, event: object, act: Callable[[], object]) -> None:
        """Ask for something that cannot be done while the robot runs."""
        if self._bench.runs.running is not None:
            self._ask(event, _refuse(RUNNING), at_once=True)
        else:
            self._ask(event, lambda client: act())

    def _now(self, event: object, act: Callable[[], None]) -> None:
        """Do something at once that must not wait for what is in progress."""
        self._ask(event, lambda client: act(), at_once=True)

    def _exclude(self, number: int, reason: str) -> None:
        if not reason:
            raise InputError("A shot is left out for a reason: choose one, or write your own, then press Exclude.")
        self._bench.decisions.exclude(number, reason)
        self._unsay()

    def _unsay(self) -> None:
        """The next decision has its own reason."""
        self._reason.value, self._words.value = UNSAID, ""

    def _said(self) -> str:
        """The reason, as it is to be kept; what a browser sends is not to be trusted."""
        if self._reason.value == OWN_WORDS:
            return " ".join(str(self._words.value).split())[:200]
        return self._reason.value if self._reason.value in REASONS[1:] else ""

    def _number(self) -> int | None:
        if self._chosen is not None:
            return self._chosen
        last = self._last()
        return None if last is None else last.id

    def _last(self) -> "Shot | None":
        shots = self._bench.state.shots
        return shots[-1] if shots else None

    def _last_verdict(self) -> str:
        last = next((s for s in reversed(self._bench.state.shots) if s.taken.phase == "sweep"), None)
        if last is None:
            return verdict_words(None, False, None, self._bench.state)
        so_far = self._bench.known.so_far(last.taken.joint, last.taken.sweep)
        slides = bool(self._bench.nominal.sliding[last.taken.joint - 1])
        return verdict_words(so_far, slides, self._bench.known.tool_std_m(so_far), self._bench.state)

    def _show_run(self) -> None:
        runs, spent = self._bench.runs, time.monotonic() - self._began
        self._running.content = run_words(runs.running, runs.paused, self._done, self._total, spent)


def _refuse(sentence: str) -> Callable[[object], None]:
    def job(client: object) -> None:
        raise InputError(sentence)

    return job
