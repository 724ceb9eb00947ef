"""Verifying the arm: test poses by nominal and by compensated commands, what was measured there, before and after."""

from collections.abc import Callable
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import viser

from app.figures.pose_errors import loop_figures
from app.panels.bring_forward import bring_forward
from app.panels.plot_box import WIDTH_PX, PlotBox
from app.panels.typed_points import TypedPoints
from app.pose_bench import LIMITS, NextVisit, PoseBench, TestPose
from app.pose_view import PoseView, Shown
from app.pose_words import WORD, iso_words, step_words, summary_words, table_words
from app.scene.cameras import fly_to, near
from app.workbench import Workbench
from core.errors import InputError

if TYPE_CHECKING:
    from core.pose_loop import PoseLoop
    from core.verification import Verification

IN_TURN, NOMINAL, COMPENSATED = "nominal first, then compensated", "nominal", "compensated"
WAYS = {IN_TURN: None, NOMINAL: False, COMPENSATED: True}
NONE = "none"
FIT = "so that it fits"
FACTORS = (FIT, "1", "2", "5", "10", "20", "50", "100", "200", "500")
CLOSE_M = 0.35
"""What is seen about a pose after flying there."""
FILES = {"Verification (HTML)": "html", "Verification (JSON)": "json"}
LABELS = {"limit_pose_mm": "Position [mm]", "limit_pose_mrad": "Orientation [mrad]"}


class VerifyPanel:
    """The tab at the left, and its plots at the right."""

    def __init__(
        self, bench: Workbench, poses: PoseBench, view: PoseView, ask: Callable, show_shots: Callable[[bool], None]
    ) -> None:
        """``show_shots`` shows or hides the shots in 3-D, which may stand before the poses."""
        self._bench, self._poses, self._view, self._ask = bench, poses, view, ask
        self._show_shots = show_shots
        self._chosen: int | None = None
        self._drawn: tuple = ()
        self._scene: tuple = ()
        self._plots: tuple[PlotBox, PlotBox] | None = None
        self._dark = False
        view.on_click(self._clicked)

    def build(self, gui: viser.GuiApi) -> None:
        """Fill the tab at the left."""
        bring_forward(gui, "Poses")
        self._step = gui.add_html("")
        self._typed = TypedPoints(gui, self._bench)
        gui.add_button("Measure pose", color="green", icon=viser.Icon.CROSSHAIR, hint="V").on_click(self.measure)
        self._way = gui.add_dropdown("Commands", tuple(WAYS), initial_value=IN_TURN)
        self._way.on_update(lambda event: self.refresh())
        self._run_group = gui.add_button_group("Robot", ("Run all poses", "Stop"))
        self._run_group.on_click(self._run)
        self._bar = gui.add_progress_bar(0.0)
        self._history = gui.add_button_group("History", ("Undo", "Redo"))
        self._history.on_click(self._undo_or_redo)
        self._summary = gui.add_html("")
        self._build_chosen(gui)
        self._build_limits(gui)
        with gui.add_folder("Test poses", expand_by_default=False):
            self._count = gui.add_number("How many", 12, min=1, max=1000, step=1)
            hint = "At random within the swept ranges; poses that were measured stay."
            gui.add_button("Plan new poses", hint=hint).on_click(self._plan)
        for label, ending in FILES.items():
            button = gui.add_button(label, icon=viser.Icon.DOWNLOAD)
            button.on_click(lambda event, ending=ending: self._send(event, ending))

    def build_plots(self, gui: viser.GuiApi) -> None:
        """Fill the tab at the right."""
        self._plots = (
            PlotBox(gui, "pose-positions", "Measure a test pose to see its error.", self._dark),
            PlotBox(gui, "pose-orientations", "", self._dark),
        )
        self._table, self._iso = gui.add_html(""), gui.add_html("")
        self._drawn = ()

    def show_dark(self, dark: bool) -> None:
        """Draw for a dark or a light page, also plots that come later."""
        self._dark = dark
        for box in self._plots or ():
            box.show_dark(dark)

    def refresh(self) -> None:
        """Show where the verification stands."""
        poses, (loop, why) = self._poses.poses(), self._poses.loop()
        way = WAYS.get(self._way.value)
        visit, solved = self._poses.next_visit(way), self._poses.arm is not None
        self._typed.refresh()
        self._run_group.visible = self._bench.rig.moves_itself
        self._step.content = step_words(visit, poses, self._bench.nominal, solved)
        done = sum((p.nominal_visit is not None) + (p.compensated_visit is not None) for p in poses)
        self._bar.value = 100.0 * done / max(2 * len(poses), 1)
        self._summary.content = summary_words(loop, why, poses)
        self._offer(poses)
        if self._plots is not None:
            self._draw_plots(loop, poses)
        self._draw_scene(loop, poses)

    def forget(self) -> None:
        """Take the poses out of the scene."""
        self._scene = ()
        self._show_shots(True)
        self._view.show(None, Shown.NONE, None, None)

    def heard(self, client: viser.ClientHandle, word: str) -> None:
        """A row of the table was clicked."""
        if word.startswith(WORD) and word[len(WORD) :].isdecimal():
            self._choose(int(word[len(WORD) :]), client)

    def measure(self, event: object) -> None:
        """Make the next open visit."""
        way, typed = WAYS.get(self._way.value), self._typed.take()

        def job(client: object) -> None:
            visit = self._poses.next_visit(way)
            if visit is None:
                raise InputError("No visit is open: choose a pose to measure it again, or plan new poses.")
            self._make(visit, typed)

        self._ask(event, job)

    def _make(self, visit: NextVisit, typed: tuple[str, str] | None) -> None:
        """Make a visit, by the robot or by what a person has typed."""
        if typed is None:
            self._poses.measure(visit)
        else:
            self._poses.measure_entered(visit, *typed)
            self._typed.clear()

    def _build_chosen(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Chosen pose and errors in 3-D"):
            self._pose = gui.add_dropdown("Pose", (NONE,))
            self._pose.on_update(self._picked)
            self._shown = gui.add_dropdown("Errors", tuple(Shown), initial_value=Shown.BOTH)
            self._factor = gui.add_dropdown("Magnified ×", FACTORS, initial_value=FIT)
            self._shots = gui.add_checkbox("Shots", True, hint="Hide them if they stand before the poses.")
            self._shots.on_update(lambda event: self._show_shots(bool(self._shots.value)))
            for box in (self._shown, self._factor):
                box.on_update(lambda event: self._draw_scene(self._poses.loop()[0], self._poses.poses()))
            self._again = gui.add_button_group("Measure again", ("nominal", "compensated"))
            self._again.on_click(self._measure_again)

    def _build_limits(self, gui: viser.GuiApi) -> None:
        settings = self._bench.state.settings
        with gui.add_folder("Limits of errors"):
            self._limits = {
                key: gui.add_number(label, float(settings.get(key, 0.0)), min=0.0, max=1e4, step=0.001)
                for key, label in LABELS.items()
            }
            gui.add_button("Keep limits", hint="0: no limit").on_click(self._keep_limits)

    def _run(self, event: viser.GuiEvent) -> None:
        if self._run_group.value == "Stop":
            self._ask(event, lambda client: self._bench.runs.stop(), at_once=True)
            return
        way = WAYS.get(self._way.value)
        self._ask(event, lambda client: self._poses.run(way))

    def _undo_or_redo(self, event: viser.GuiEvent) -> None:
        act = self._bench.decisions.undo if self._history.value == "Undo" else self._bench.decisions.redo
        self._ask(event, lambda client: act())

    def _measure_again(self, event: viser.GuiEvent) -> None:
        chosen, compensated, typed = self._chosen, self._again.value == "compensated", self._typed.take()

        def job(client: object) -> None:
            pose = next((p for p in self._poses.poses() if p.number == chosen), None)
            if pose is None:
                raise InputError("No pose is chosen: click one in 3-D or in the table, or choose it in the list.")
            self._make(self._poses.visit_of(pose, compensated), typed)

        self._ask(event, job)

    def _keep_limits(self, event: viser.GuiEvent) -> None:
        asked = {key: self._limits[key].value for key in LIMITS}
        self._ask(event, lambda client: self._poses.keep_limits(asked))

    def _plan(self, event: viser.GuiEvent) -> None:
        asked = self._count.value

        def job(client: object) -> None:
            if not isinstance(asked, int | float) or asked != asked or asked != int(asked):
                raise InputError(f"{asked!r} poses, expected a whole number")
            self._poses.plan(int(asked))

        self._ask(event, job)

    def _send(self, event: viser.GuiEvent, ending: str) -> None:
        def job(client: viser.ClientHandle | None) -> None:
            loop, why = self._poses.loop()
            if loop is None:
                raise InputError(why)
            if client is not None:
                name = f"{datetime.now(UTC):%Y-%m-%d_%H%M%S}_trueaxis_verification.{ending}"
                client.send_file_download(name, verification_file(loop.found, ending), save_immediately=True)

        self._ask(event, job, operator=False)

    def _clicked(self, goal: int, client_id: int) -> None:
        """A place was clicked in 3-D."""
        loop = self._poses.loop()[0]
        for pose in self._poses.poses():
            if loop is not None and loop.goal_of(pose.wanted) == goal:
                self._choose(pose.number, None)

    def _picked(self, event: viser.GuiEvent) -> None:
        """A pose was picked in the list; what the program itself writes there comes without a client."""
        if event.client is not None:
            self._choose(int(self._pose.value) if str(self._pose.value).isdecimal() else None, event.client)

    def _choose(self, number: int | None, client: viser.ClientHandle | None) -> None:
        poses, loop = self._poses.poses(), self._poses.loop()[0]
        pose = next((p for p in poses if p.number == number), None)
        self._chosen = None if pose is None else pose.number
        self._offer(poses)
        if self._plots is not None:
            self._table.content = table_words(loop, poses, self._chosen)
        self._draw_scene(loop, poses)
        goal = None if loop is None or pose is None else loop.goal_of(pose.wanted)
        place = None if loop is None or goal is None else self._view.place_m(loop, goal)
        if client is not None and place is not None:
            way = client.camera.position - client.camera.look_at
            fly_to(client, near(f"Pose {number}", place, way, CLOSE_M))

    def _offer(self, poses: tuple[TestPose, ...]) -> None:
        options = (NONE, *(str(pose.number) for pose in poses))
        if options != tuple(self._pose.options):
            self._pose.options = options
        chosen = NONE if self._chosen is None else str(self._chosen)
        wanted = chosen if chosen in options else NONE
        if self._pose.value != wanted:
            self._pose.value = wanted

    def _draw_plots(self, loop: "PoseLoop | None", poses: tuple[TestPose, ...]) -> None:
        assert self._plots is not None
        self._table.content = table_words(loop, poses, self._chosen)
        key = (id(loop), tuple(pose.wanted for pose in poses))
        if key == self._drawn:
            return
        self._drawn = key
        numbers = {} if loop is None else {loop.goal_of(pose.wanted): pose.number for pose in poses}
        self._iso.content = iso_words(loop, numbers)
        if loop is None:
            for box in self._plots:
                box.clear()
            return
        figures = loop_figures(loop, tuple(numbers.get(k, 0) for k in range(len(loop.wanted))), WIDTH_PX)
        for box, figure in zip(self._plots, figures, strict=True):
            box.show(figure)

    def _draw_scene(self, loop: "PoseLoop | None", poses: tuple[TestPose, ...]) -> None:
        shown = Shown(self._shown.value) if self._shown.value in tuple(Shown) else Shown.BOTH
        factor = float(self._factor.value) if self._factor.value in FACTORS[1:] else None
        pose = next((p for p in poses if p.number == self._chosen), None)
        goal = None if loop is None or pose is None else loop.goal_of(pose.wanted)
        key = (id(loop), shown, factor, goal)
        if key != self._scene:
            self._scene = key
            self._view.show(loop, shown, factor, goal)


def verification_file(found: "Verification", ending: str) -> bytes:
    """The bytes of a verification: html or json."""
    if ending == "html":
        from app.verification_report import verification_html

        return verification_html(found).encode()
    from core.verification_json import verification_to_json

    return verification_to_json(found).encode()
