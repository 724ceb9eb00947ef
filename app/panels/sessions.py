"""The sessions of the folder: find, open, copy, send away as one file or as a campaign."""

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import viser

from app.cell_words import SESSION_WORD, session_word, sessions_words
from app.exports import stamped
from app.words import block
from app.workbench import Workbench
from core.errors import InputError
from core.session import Session
from core.session_archive import campaign_archive
from core.session_library import SessionSummary, Shelf, copy_session, free_path, summary_of
from core.session_state import State
from core.session_store import SUFFIX

NONE = "-"


class SessionShelf:
    """A search box, the list, and what can be done with one of it."""

    def __init__(self, gui: viser.GuiApi, bench: Workbench, ask: Callable) -> None:
        self._bench, self._ask = bench, ask
        self._listed: object = None
        self._summaries: tuple[SessionSummary, ...] = ()
        self._shelf = Shelf(bench.session.path.parent)
        text = "Every session is one file in one folder; nothing in it is ever deleted. Click one, then press Open."
        gui.add_html(block(f"<p class='soft'>{text}</p>", "sessions-intro"))
        self._words = gui.add_text("Search", "", hint="Words of title, robot, people, serial numbers, notes.")
        self._words.on_update(lambda _: self._list())
        self._table = gui.add_html("")
        self._chosen = gui.add_dropdown("Session", (NONE,))
        self._do = gui.add_button_group("Do", ("Open", "Copy"))
        self._do.on_click(self._act)
        hint = "To keep elsewhere, or to open on another machine."
        gui.add_button("Session as one file", icon=viser.Icon.DOWNLOAD, hint=hint).on_click(self._send_session)
        hint = "campaign.toml, robot.toml and measurements.csv, for the command line and other programs."
        gui.add_button("Campaign folder (ZIP)", icon=viser.Icon.DOWNLOAD, hint=hint).on_click(self._send_campaign)

    def refresh(self) -> None:
        """List the folder anew when another session is open; else only the open one, for reading files takes time."""
        if self._bench.session is self._listed:
            path = self._bench.session.path
            own = summary_of(path, self._bench.state)
            self._summaries = tuple(own if one.path == path else one for one in self._summaries)
            self._table.content = sessions_words(self._summaries, path.name)
        else:
            self._listed = self._bench.session
            self._shelf = Shelf(self._bench.session.path.parent)
            self._list()
            own = self._bench.session.path.name
            if own in self._chosen.options:
                self._chosen.value = own

    def heard(self, event: object, word: str) -> None:
        """A row of the list was clicked: choose that session."""
        if word.startswith(SESSION_WORD):
            self._ask(event, lambda client: self._choose(word))

    def _choose(self, word: str) -> None:
        name = next((name for name in self._chosen.options if session_word(name) == word), None)
        if name is not None:
            self._chosen.value = name

    def _list(self) -> None:
        self._summaries = self._found(str(self._words.value)[:200])
        names = tuple(one.path.name for one in self._summaries) or (NONE,)
        if names != tuple(self._chosen.options):
            self._chosen.options = names
        self._table.content = sessions_words(self._summaries, self._bench.session.path.name)

    def _found(self, words: str) -> tuple[SessionSummary, ...]:
        return self._shelf.summaries(words, (self._bench.session.path, self._bench.state))

    def _act(self, event: viser.GuiEvent) -> None:
        asked, name = self._do.value, self._chosen.value

        def job(client: object) -> None:
            path = self._path(name)
            if asked == "Copy":
                title = next(one.title for one in self._found("") if one.path == path)
                copy_session(path, free_path(path.parent, title))
            elif path != self._bench.session.path:
                self._bench.switch(Session.open(path))
            self._list()

        self._ask(event, job)

    def _state_of(self, path: Path) -> State:
        if path == self._bench.session.path:
            return self._bench.state
        with Session.open(path, read_only=True) as session:
            return session.state

    def _path(self, name: str) -> Path:
        """The session of the folder that has this name; whatever else a browser may send is refused."""
        found = next((one.path for one in self._found("") if one.path.name == name), None)
        if found is None:
            raise InputError(f"there is no session {name!r} in this folder; choose one of the list")
        return found

    def _send_session(self, event: viser.GuiEvent) -> None:
        name = self._chosen.value

        def job(client: viser.ClientHandle | None) -> None:
            path = self._path(name)
            with TemporaryDirectory(prefix="trueaxis-") as folder:
                copy = Path(folder) / path.name
                copy_session(path, copy)
                data = copy.read_bytes()
            if client is not None:
                sent = stamped(path.name.removesuffix(SUFFIX), SUFFIX[1:])
                client.send_file_download(sent, data, save_immediately=True)

        self._ask(event, job, operator=False)

    def _send_campaign(self, event: viser.GuiEvent) -> None:
        chosen = self._chosen.value

        def job(client: viser.ClientHandle | None) -> None:
            path = self._path(chosen)
            name = path.name.removesuffix(SUFFIX)
            data = campaign_archive(self._state_of(path), name)
            if client is not None:
                client.send_file_download(stamped(f"{name}_campaign", "zip"), data, save_immediately=True)

        self._ask(event, job, operator=False)
