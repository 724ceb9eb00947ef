"""The operator's seat: one browser acts, all others watch, and may ask for it."""

import threading
from typing import TYPE_CHECKING

from app.words import block

if TYPE_CHECKING:
    import viser


class Seat:
    """Who may act. The first browser takes the seat; when it leaves, the next one that is there gets it."""

    def __init__(self, server: "viser.ViserServer") -> None:
        self._server, self._lock = server, threading.Lock()
        self._holder: int | None = None
        self._notes: dict[int, viser.GuiHtmlHandle] = {}
        server.on_client_connect(self._came)
        server.on_client_disconnect(self._left)

    def build(self, gui: "viser.GuiApi") -> None:
        """Draw what is shared: the button by which a watcher asks for the seat."""
        self._take = gui.add_button(
            "Take the operator's seat", hint="Act from this browser; the other one then watches."
        )
        self._take.on_click(self._taken)

    def may(self, client_id: int) -> bool:
        """Whether this browser holds the seat."""
        return self._holder in (None, client_id)

    def why_not(self) -> str:
        """What a watcher is told."""
        return "Another browser holds the operator's seat. Press 'Take the operator's seat' to act from here."

    def _came(self, client: "viser.ClientHandle") -> None:
        with self._lock:
            if self._holder is None:
                self._holder = client.client_id
            self._notes[client.client_id] = client.gui.add_html("", order=-1000.0)
        self._show()

    def _left(self, client: "viser.ClientHandle") -> None:
        with self._lock:
            self._notes.pop(client.client_id, None)
            if self._holder == client.client_id:
                self._holder = next(iter(self._notes), None)
        self._show()

    def _taken(self, event: "viser.GuiEvent") -> None:
        if event.client is None:
            return
        with self._lock:
            before, self._holder = self._holder, event.client.client_id
        clients = self._server.get_clients()
        if before != self._holder and before in clients:
            clients[before].add_notification(
                "You are watching now",
                "Another browser took the operator's seat.",
                color="orange",
                auto_close_seconds=10,
            )
        self._show()

    def _show(self) -> None:
        for client_id, note in list(self._notes.items()):
            operator = client_id == self._holder
            words = "● You hold the operator's seat" if operator else "○ You are watching"
            note.content = block(f"<b class='{'ok' if operator else 'soft'}'>{words}</b>", "seat")
        self._take.visible = len(self._notes) > 1
