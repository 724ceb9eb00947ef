"""The cell: who measures what, with what, on which robot, and in which session."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from app.cell_words import CONDITIONS, about_words, intro_words
from app.panels.cell_setup import InstrumentEntry, SweepEntry, TargetEntryPanel
from app.panels.new_session import NewSession
from app.panels.sessions import SessionShelf
from app.workbench import Workbench
from core.session_conditions import condition_events
from core.session_events import Fact, OperatorNamed, Titled

if TYPE_CHECKING:
    import viser

FACTS = ("Robot serial number", "Instrument serial number", "Place")


class StartPanel:
    """Names, serial numbers, conditions; targets, instrument, sweeps; sessions."""

    def __init__(self, gui: "viser.GuiApi", bench: Workbench, ask: Callable) -> None:
        self._bench, self._ask = bench, ask
        self._session: object = None
        self._intro = gui.add_html("")
        with gui.add_folder("Who and what"):
            self._title = gui.add_text("Title", "")
            self._who = gui.add_text("Operator", "", hint="Every shot and decision is signed with this name.")
            self._facts = {name: gui.add_text(name, "") for name in FACTS}
            self._conditions = {key: gui.add_text(name, "") for key, name in CONDITIONS.items()}
            gui.add_button("Keep these", hint="Write them into the session.").on_click(self._keep)
        with gui.add_folder("Targets", expand_by_default=False):
            self._targets = TargetEntryPanel(gui, bench, ask)
        with gui.add_folder("Instrument and points", expand_by_default=False):
            self._instrument = InstrumentEntry(gui, bench, ask)
        with gui.add_folder("Sweeps", expand_by_default=False):
            self._sweeps = SweepEntry(gui, bench, ask)
        with gui.add_folder("New session", expand_by_default=False):
            self._new = NewSession(gui, bench, ask)
        with gui.add_folder("Sessions", expand_by_default=False):
            self._shelf = SessionShelf(gui, bench, ask)
        self._about = gui.add_html("")

    def refresh(self) -> None:
        """Show what the session holds."""
        self._intro.content = intro_words(self._bench)
        self._about.content = about_words(self._bench)
        if self._bench.session is not self._session:
            self._session = self._bench.session
            self._fill()
        for part in (self._targets, self._instrument, self._sweeps, self._new, self._shelf):
            part.refresh()

    def heard(self, event: object, word: str) -> None:
        """Something of this step was clicked."""
        self._shelf.heard(event, word)

    def _fill(self) -> None:
        """The boxes as the session has them; done once, for what is typed must not be written over."""
        state = self._bench.state
        self._title.value, self._who.value = state.title, state.operator
        for name, box in self._facts.items():
            box.value = state.facts.get(name, "")
        for key, box in self._conditions.items():
            box.value = f"{state.settings[key]:g}" if key in state.settings else ""

    def _keep(self, event: "viser.GuiEvent") -> None:
        who, title = str(self._who.value).strip(), str(self._title.value).strip()
        facts = {name: str(box.value).strip() for name, box in self._facts.items()}
        conditions = {key: str(box.value) for key, box in self._conditions.items()}

        def job(client: object) -> None:
            state = self._bench.state
            events = [OperatorNamed(who)] if who != state.operator else []
            events += [Titled(title)] if title and title != state.title else []
            events += [Fact(name, value) for name, value in facts.items() if value != state.facts.get(name, "")]
            events += condition_events(conditions, state)
            if events:
                self._bench.session.append_all(events, who or None)
                self._bench.changed()

        self._ask(event, job)
