"""The dashboard: panels, scene, session and jobs put together. The only module that knows them all.

Left: the operator's way in steps. Middle: the cell in 3-D. Right: what the last shot and the last solve say. Callbacks
only ask; the worker acts; whatever changes is drawn anew from the session.
"""

import contextlib
import io
import os
import socket
import threading
from pathlib import Path
from types import SimpleNamespace

import viser

from app import keys
from app.callbacks import guard_callbacks
from app.cell_view import CellView
from app.clicks import Ear
from app.gap_tabs import GapTabs
from app.jobs import Jobs
from app.panels.acquire import AcquirePanel
from app.panels.bring_forward import Openers, bring_forward
from app.panels.check import CheckPanel
from app.panels.export import ExportPanel
from app.panels.help import HelpPanel
from app.panels.results import ResultsPanel
from app.panels.seat import Seat
from app.panels.solve import SolvePanel
from app.panels.start import StartPanel
from app.panels.view import ViewPanel
from app.scene.cameras import Camera, fit_once, fly_to
from app.spots import spot_named
from app.uploads import guard_uploads
from app.verify_tabs import VerifyTabs
from app.words import STYLE
from app.workbench import Workbench
from core.errors import InputError
from core.wording import with_capital

THEME = {"show_logo": False, "show_share_button": False, "brand_color": (0, 114, 178)}
DARK = {"brand_color": (86, 180, 233)}
"""The dark blue would hardly be read on a dark page."""

WAITS = "This is done when the run ends. Pause or Stop ends it sooner."


class Dashboard:
    """A running dashboard on one session."""

    def __init__(self, bench: Workbench, host: str = "127.0.0.1", port: int = 8080) -> None:
        """Start the server.

        Raises:
            InputError: the address cannot be used.
        """
        self.bench, self.jobs = bench, Jobs()
        self.server = _server(host, port)
        self.host, self.port = host, self.server.get_port()
        self.server.gui.configure_theme(**THEME)
        self.seat = Seat(self.server)
        self.server.on_client_connect(self._greet)
        self.openers = Openers()
        self.server.on_client_disconnect(self._gone)
        guard_uploads(self.server, self.seat.may, self._refuse)
        guard_callbacks(self.server, lambda client, sentence: self.say(client, sentence))
        self._dark = False
        self._draw_page()
        bench.on_change(self.refresh)
        # A solution is not kept but computed again, so that a restart brings it back.
        self.jobs.ask(bench.solving.solve_again, lambda sentence: None)
        self.jobs.when_idle(self._think_ahead)

    def _draw_page(self) -> None:
        """Scene and panels for the robot of the session."""
        gui, bench = self.server.gui, self.bench
        self._drawn_for = bench.rig.robot
        self.cell = CellView(self.server, bench)
        self.cell.points.on_click(self._clicked)
        self._look_at_the_cell()
        gui.main_panel.dock_left()
        gui.main_panel.set_width(390)
        gui.add_html(STYLE)
        self.ear = Ear(gui, self._said)
        self.seat.build(gui)
        tabs = gui.add_tab_group()
        with tabs.add_tab("1 Cell"):
            self.start = StartPanel(gui, bench, self.ask)
        with tabs.add_tab("Check"):
            self.check = CheckPanel(gui, bench, self.ask)
        with tabs.add_tab("2 Measure"):
            bring_forward(gui, "This sweep")
            self.acquire = AcquirePanel(gui, bench, self.ask)
        with tabs.add_tab("3 Solve"):
            self.solve = SolvePanel(gui, bench, self.ask)
        with tabs.add_tab("4 Export"):
            self.export = ExportPanel(gui, bench, self.ask)
        with tabs.add_tab("View"):
            self.view = ViewPanel(gui, self.cell, self._darken, self._may)
        with tabs.add_tab("Help"):
            self.help = HelpPanel(gui, (keys.POSE,))
        self.results = ResultsPanel(gui, bench, self.ask)
        self.verify = VerifyTabs(self.server, bench, tabs, self.results.panel, self.cell, self.ask)
        self.gap = GapTabs(self.server, bench, tabs, self.results.panel, self.ask)
        self._hotkeys()
        self._show_all()
        gui.add_html("<i data-testid='app-ready' hidden></i>")

    def ask(self, event: "viser.GuiEvent | None", job, operator: bool = True, at_once: bool = False) -> None:
        """Do a job on behalf of whoever pressed something; watchers are told that they only watch.

        Args:
            event: of the page; None: nobody in particular.
            job: takes the browser that asked, or None.
            operator: whether only who holds the seat may ask for it.
            at_once: do not wait for what is in progress, as for stopping it.
        """
        client = getattr(event, "client", None)
        if operator and not self._may(event):
            return
        if not at_once and client is not None and self.bench.runs.running is not None:
            # Nothing looks worse than a button that does nothing.
            client.add_notification("The robot is at work", WAITS, color="blue", auto_close_seconds=8)
        ask = self.jobs.at_once if at_once else self.jobs.ask
        ask(lambda: job(client), lambda sentence: self.say(client, sentence))

    def _may(self, event: "viser.GuiEvent | None") -> bool:
        """Whether who pressed something may act; watchers are told that they only watch."""
        client = getattr(event, "client", None)
        if client is None or self.seat.may(client.client_id):
            return True
        client.add_notification("You are watching", self.seat.why_not(), color="orange", auto_close_seconds=6)
        return False

    def say(self, client: "viser.ClientHandle | None", sentence: str) -> None:
        """Tell whoever asked, or everybody, what went wrong."""
        for one in [client] if client is not None else self.server.get_clients().values():
            with contextlib.suppress(Exception):
                one.add_notification("This was not done", with_capital(sentence), color="red", auto_close_seconds=15)

    def _refuse(self, client_id: int, sentence: str) -> None:
        """Tell a browser that what it sent is not taken."""
        self.say(self.server.get_clients().get(client_id), sentence)

    def refresh(self) -> None:
        """Draw everything anew from the session; the whole page where the robot is another one."""
        if self.bench.rig.robot is self._drawn_for:
            self._show_all()
            if self.cell.out_of_sight:
                self._look_again()
            return
        self.verify.stop()
        self.gap.stop()
        with self.server.atomic():
            self.server.gui.reset()
            self.server.scene.reset()
            self._draw_page()
            if self._dark:
                self.view.tick_dark()
        self._look_again()

    def _show_all(self) -> None:
        with self.server.atomic():
            # All at once: every batch of messages costs the browser a picture of the scene.
            self.cell.refresh()
            self.start.refresh()
            self.check.refresh()
            self.acquire.refresh()
            self.solve.refresh()
            self.export.refresh()
            self.results.refresh()
            self.verify.refresh()
            self.gap.refresh()
            self.view.refresh()
        self.server.flush()

    def stop(self) -> None:
        """Close server, worker and session."""
        self.bench.runs.stop()
        self.verify.stop()
        self.gap.stop()
        self.seat.close()
        self.jobs.close()
        with contextlib.redirect_stdout(io.StringIO()):
            self.server.stop()
        self.bench.session.close()

    def _darken(self, dark: bool) -> None:
        self._dark = dark
        self.server.gui.configure_theme(dark_mode=dark, **(THEME | DARK if dark else THEME))
        self.results.show_dark(dark)
        self.verify.show_dark(dark)
        self.gap.show_dark(dark)

    def _look_at_the_cell(self) -> None:
        """What a browser sees first: the arm, with its instruments behind."""
        camera, first = self._first_camera(), self.server.initial_camera
        first.position, first.look_at, first.up = (tuple(v) for v in (camera.position_m, camera.look_at_m, camera.up))

    def _greet(self, client: viser.ClientHandle) -> None:
        """Fit what a new browser sees first to its picture."""
        fit_once(client, self._first_camera(), self.server.initial_camera.position)

    def _gone(self, client: viser.ClientHandle) -> None:
        self.results.tabs.left(client.client_id)
        self.openers.left(client)

    def _look_again(self) -> None:
        """Bring all browsers to where the arm is now."""
        self.cell.out_of_sight = False
        for client in self.server.get_clients().values():
            fly_to(client, self._first_camera(), seconds=0.0)

    def _first_camera(self) -> Camera:
        return next(camera for camera in self.cell.cameras() if camera.name == "Arm")

    def _think_ahead(self) -> None:
        """While nobody waits: draw what nobody looks at yet, and have the next solution at hand."""
        self.results.tabs.catch_up()
        self.bench.solving.solve_ahead()

    def _said(self, client: viser.ClientHandle, word: str) -> None:
        """A finding or a row of a table was clicked: show it where it is, and fly there."""
        if self.results.tabs.heard(client.client_id, word):
            return
        for panel in (self.start, self.acquire):
            panel.heard(SimpleNamespace(client=client), word)
        spot = spot_named(word)
        if spot is None:
            self.verify.heard(client, word)
            return
        shown = self.view.light(spot) if self.seat.may(client.client_id) else spot
        camera = self.cell.camera_at(shown)
        if camera is not None:
            fly_to(client, camera)

    def _clicked(self, row: int, client_id: int) -> None:
        """A shot was clicked in 3-D: choose it where it can be judged, and open that step; a second click: none."""
        if not self.seat.may(client_id) or not 0 <= row < len(self.cell.shown_shots):
            return
        number = self.cell.shown_shots[row]
        chosen = None if number == self.cell.chosen else number
        self.cell.choose(chosen)
        self.acquire.choose(chosen)
        self.solve.review.choose(chosen)
        client = self.server.get_clients().get(client_id)
        if chosen is not None and client is not None:
            self.openers.open(client, *(("3 Solve", "2 Measure") if self.bench.calibration else ("2 Measure",)))

    def _hotkeys(self) -> None:
        gui = self.server.gui
        for key, action in (
            (keys.MEASURE, self.acquire.measure),
            (keys.ENTER, self.acquire.measure),
            (keys.UNDO, self.acquire.undo),
            (keys.REDO, self.acquire.redo),
            (keys.AGAIN, self.acquire.measure_again),
            (keys.SKIP, self.acquire.skip),
            (keys.PAUSE, self.acquire.pause),
            (keys.STOP, self.acquire.stop),
            (keys.SOLVE, self.solve.solve),
            (keys.HELP, self.help.open),
        ):
            gui.add_command(key.does, hotkey=key.hotkey).on_trigger(action)


def _server(host: str, port: int) -> viser.ViserServer:
    """A server on exactly this address: viser alone would take the next free port, or hang on a bad host."""
    if not 0 <= port <= 65535:
        raise InputError(f"--port {port}: expected 0 to 65535")
    try:
        with contextlib.closing(socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET)) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, port))
            free = probe.getsockname()[1]
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"--host {host} --port {port}: {reason}; expected a free port of this machine") from None
    with contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host=host, port=port or free, label="trueaxis", verbose=False)
    if server.get_port() != (port or free):
        server.stop()
        raise InputError(f"--port {port}: it was taken while the server started; expected a free port")
    # No visitor may open a public tunnel to this machine.
    server.request_share_url = lambda verbose=True: None
    return server


def run_until(stop: threading.Event, dashboard: Dashboard) -> None:
    """Serve until the event is set."""
    try:
        stop.wait()
    finally:
        dashboard.stop()


def session_folder(asked: Path | None) -> Path:
    """Where sessions are kept: as asked, or in the user's data folder; made if it is not there.

    Raises:
        InputError: it cannot be made.
    """
    folder = asked or Path(os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share") / "trueaxis"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"{folder}: {error.strerror or error}; expected a folder for sessions that can be written"
        ) from None
    return folder
