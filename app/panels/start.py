"""The cell: who measures what, with what, on which robot."""

from collections.abc import Callable
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from app.words import block
from app.workbench import Workbench
from core.errors import InputError
from core.session import Session
from core.session_events import Fact, OperatorNamed, Titled
from core.session_library import copy_session, free_path, list_sessions
from core.twin import irb_l6
from core.twin.demo import demo_events

if TYPE_CHECKING:
    import viser

FACTS = ("Robot serial number", "Instrument serial number", "Payload", "Place")


class StartPanel:
    """Names, serial numbers, robot, targets, instrument."""

    def __init__(self, gui: "viser.GuiApi", bench: Workbench, ask: Callable) -> None:
        self._bench, self._ask = bench, ask
        self._shown = bench.session.path.name
        gui.add_html(
            block(
                "<h3>The cell</h3><p>This is the built-in demo cell: a <b>simulated</b> ASEA IRB L6 watched by two "
                "simulated theodolites. Say who measures, then go to <b>2 Measure</b>.</p>",
                "cell-intro",
            )
        )
        state = bench.state
        self._title = gui.add_text("Title", state.title)
        self._who = gui.add_text("Operator", state.operator)
        self._facts = {name: gui.add_text(name, state.facts.get(name, "")) for name in FACTS}
        gui.add_button("Keep these", hint="Write them into the session.").on_click(self._keep)
        self._about = gui.add_html("")
        with gui.add_folder("Sessions"):
            self._sessions = gui.add_dropdown("Session", ("-",))
            actions = gui.add_button_group("Do", ("Open", "New", "Copy"))
            actions.on_click(self._act)
        self._actions = actions

    def refresh(self) -> None:
        """Show what the session holds."""
        self._offer_sessions()
        state = self._bench.state
        rows = "".join(
            f"<tr><td>{escape(name)}</td><td>{escape(value)}</td></tr>"
            for name, value in (
                ("Robot", self._bench.nominal.name),
                ("Instrument", state.instrument.kind),
                ("Stated noise", f"{(state.instrument.sigma_m or 0) * 1e3:.2g} mm, one coordinate"),
                ("Operator", state.operator or "not named yet"),
                *((key, value) for key, value in state.facts.items()),
                *((f"Target {t.name}", f"on link {t.link}") for t in state.targets),
                ("Session file", self._bench.session.path.name),
            )
        )
        warnings = "".join(f"<p class='bad'>{escape(text)}</p>" for text in state.warnings)
        read_only = self._bench.session.why_read_only
        warnings += f"<p class='bad'>Read-only: {escape(read_only)}</p>" if read_only else ""
        self._about.content = block(f"{warnings}<table>{rows}</table>", "cell")

    def _act(self, event: "viser.GuiEvent") -> None:
        asked, name = self._actions.value, self._sessions.value
        folder = self._bench.session.path.parent

        def job(client: object) -> None:
            if asked == "New":
                path = free_path(folder, self._bench.nominal.name)
                self._bench.switch(Session.create(path, demo_events(irb_l6.cell()), self._bench.state.operator))
            elif asked == "Copy":
                copy_session(self._bench.session.path, free_path(folder, self._bench.state.title))
                self._bench.changed()
            elif name != self._bench.session.path.name:
                self._bench.switch(self._chosen(folder, name))

        self._ask(event, job)

    def _chosen(self, folder: Path, name: str) -> Session:
        """Open a session of the folder by its name; whatever else a browser may send is refused."""
        if name not in {summary.path.name for summary in list_sessions(folder)}:
            raise InputError(f"there is no session {name!r} in this folder; choose one of the list")
        return Session.open(folder / name)

    def _offer_sessions(self) -> None:
        names = tuple(summary.path.name for summary in list_sessions(self._bench.session.path.parent)) or ("-",)
        own = self._bench.session.path.name
        if names != tuple(self._sessions.options):
            self._sessions.options = names
        if own in names and own != self._shown:
            self._shown = self._sessions.value = own
            state = self._bench.state
            self._title.value, self._who.value = state.title, state.operator
            for fact, box in self._facts.items():
                box.value = state.facts.get(fact, "")

    def _keep(self, event: "viser.GuiEvent") -> None:
        who, title = self._who.value.strip(), self._title.value.strip()
        facts = {name: box.value.strip() for name, box in self._facts.items()}

        def job(client: object) -> None:
            state = self._bench.state
            events = [OperatorNamed(who)] if who != state.operator else []
            events += [Titled(title)] if title and title != state.title else []
            events += [Fact(name, value) for name, value in facts.items() if value != state.facts.get(name, "")]
            if events:
                self._bench.session.append_all(events, who or None)
                self._bench.changed()

        self._ask(event, job)
