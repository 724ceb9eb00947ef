"""A new session: on the demo cell, on the robot at hand, or on a robot or campaign that comes as files."""

from collections.abc import Callable
from pathlib import Path

import viser

from app.cell_words import tray_words
from app.rigs import SETTING, Source, rig_for, source_events
from app.uploads import as_file
from app.workbench import Workbench
from core.cell_setup import new_cell_events, same_cell_events
from core.errors import InputError
from core.import_tray import Tray
from core.robot import Robot
from core.session import Session
from core.session_archive import archive_events
from core.session_events import Event, InstrumentChosen, Setting
from core.session_library import free_path, import_session
from core.session_store import SUFFIX
from core.twin import irb_l6, scara
from core.twin.demo import demo_events

DEMOS = {"demo: ASEA IRB L6, two theodolites": irb_l6.cell, "demo: SCARA, laser tracker": scara.cell}
SAME, FILES = "the robot of this session", "the robot in the files"
BY_HAND, SIMULATED = "entered by hand or from files", "simulated, for practice"
SIMULATED_INSTRUMENT = InstrumentChosen("laser-tracker", 5e-5, {"model": "simulated"})


class NewSession:
    """Files, a choice of robots, and a button."""

    def __init__(self, gui: viser.GuiApi, bench: Workbench, ask: Callable) -> None:
        self._bench, self._ask = bench, ask
        self._tray = Tray()
        hint = "robot.toml, a URDF, campaign.toml, measurements.csv, a campaign as .zip, or a session as .trueaxis."
        self._upload = gui.add_upload_button("Files of a robot, campaign or session", icon=viser.Icon.UPLOAD, hint=hint)
        self._upload.on_upload(self._send)
        self._words = gui.add_html("")
        self._base = gui.add_dropdown("Base link", ("-",), visible=False, hint="Where the arm stands on the floor.")
        self._tip = gui.add_dropdown("Tip link", ("-",), visible=False, hint="Where the arm ends.")
        for box in (self._base, self._tip):
            box.on_update(lambda _: self._show())
        self._open = gui.add_button("Open the campaign", visible=False)
        self._open.on_click(self._open_campaign)
        self._robot = gui.add_dropdown("Robot", (*DEMOS, SAME, FILES))
        self._robot.on_update(lambda _: self._show_points())
        self._points = gui.add_dropdown("Points are", (BY_HAND, SIMULATED), visible=False)
        self._title = gui.add_text("Title", "", hint="Nothing: the robot's name.")
        gui.add_button("Begin", icon=viser.Icon.PLUS, hint="This session stays in the list.").on_click(self._begin)
        self._show()

    def refresh(self) -> None:
        """Nothing here depends on the session at hand."""

    def _send(self, event: viser.GuiEvent) -> None:
        upload = self._upload.value

        def job(client: object) -> None:
            name = upload.name.casefold()
            if name.endswith(SUFFIX):
                with as_file(upload) as path:
                    self._bench.switch(Session.open(import_session(path, self._folder)))
            elif name.endswith(".zip"):
                with as_file(upload) as path:
                    self._begin_with(_by_hand(archive_events(upload.content, path.name)), path.stem)
            else:
                self._tray = self._tray.added(upload.name, upload.content)
                self._offer()

        self._ask(event, job)

    def _offer(self) -> None:
        """Offer what the files make."""
        starts, ends = self._tray.urdf_ends
        for box, links in ((self._base, starts), (self._tip, ends)):
            box.visible = bool(links)
            box.options = links or ("-",)
            box.value = (links or ("-",))[0]
        self._open.visible = self._tray.campaign is not None and not self._tray.missing()
        self._robot.value = FILES
        self._show_points()
        self._show()

    def _show(self) -> None:
        robot, wrong = None, ""
        if self._tray.files and not self._tray.missing():
            try:
                robot = self._robot_of_files()
            except InputError as refused:
                wrong = str(refused)
        self._words.content = tray_words(self._tray, robot, wrong)

    def _show_points(self) -> None:
        """The other cells have their points from where they always had them."""
        self._points.visible = self._robot.value == FILES

    def _robot_of_files(self) -> Robot:
        return self._tray.robot(_link(self._base), _link(self._tip))

    def _begin(self, event: object) -> None:
        asked, points, title = self._robot.value, self._points.value, str(self._title.value).strip()
        base, tip = _link(self._base), _link(self._tip)

        def job(client: object) -> None:
            if asked in DEMOS:
                events = demo_events(DEMOS[asked]())
            elif asked == SAME:
                events = same_cell_events(self._bench.state)
                events += [Setting(SETTING, str(self._bench.rig.source))]
            else:
                events = self._own_events(base, tip, title, simulated=points == SIMULATED)
            self._begin_with(events, title or self._bench.nominal.name)

        self._ask(event, job)

    def _own_events(self, base: str, tip: str, title: str, simulated: bool) -> list[Event]:
        chosen, robot = self._tray.robot_event(base, tip), self._tray.robot(base, tip)
        instrument = SIMULATED_INSTRUMENT if simulated else InstrumentChosen("other")
        events = new_cell_events(chosen, robot, title or robot.name, instrument)
        return [*events, *source_events(Source.SIMULATED if simulated else Source.BY_HAND, robot.name)]

    def _open_campaign(self, event: object) -> None:
        def job(client: object) -> None:
            self._begin_with(_by_hand(self._tray.campaign_events()), "campaign")

        self._ask(event, job)

    def _begin_with(self, events: list[Event], name: str) -> None:
        """Make the session and go on with it; the files have served."""
        title = next((event.title for event in events if hasattr(event, "title")), "") or name
        session = Session.create(free_path(self._folder, title), events, self._bench.state.operator)
        try:
            _check_rig(session)
        except InputError:
            session.close()
            session.path.unlink()
            raise
        self._tray = Tray()
        self._show()
        # Last, because it may draw the whole page anew.
        self._bench.switch(session)

    @property
    def _folder(self) -> Path:
        return self._bench.session.path.parent


def _by_hand(events: list[Event]) -> list[Event]:
    """A campaign that was measured goes on by hand, whatever robot it was measured on."""
    return [*events, Setting(SETTING, str(Source.BY_HAND))]


def _check_rig(session: Session) -> None:
    """A simulated arm that cannot be made is told at once, not when somebody wants to measure."""
    if session.state.settings.get(SETTING) == Source.SIMULATED and rig_for(session.state, 1).cell is None:
        raise InputError("no arm of this robot can be simulated, as it has a single joint or slides only")


def _link(box: viser.GuiDropdownHandle) -> str:
    return box.value if box.visible and box.value in box.options else ""
