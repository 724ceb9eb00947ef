"""The operator's seat: one browser acts, all others watch, and may ask for it."""

import contextlib
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

from app.words import block

if TYPE_CHECKING:
    import viser

ANSWER_S = 15.0
"""Who does not answer for so long has left the desk: the seat is given to who asked."""
AWAY_S = 8.0
"""So long the seat is kept for a browser that went away: it may only be loading the page again."""
ASK, GIVE, KEEP = "Ask for the operator's seat", "Give the seat", "Keep the seat"


class Seat:
    """Who may act. The first browser takes the seat; when it leaves for good, the next one that is there gets it."""

    def __init__(self, server: "viser.ViserServer", answer_s: float = ANSWER_S, away_s: float = AWAY_S) -> None:
        self._server, self._lock = server, threading.RLock()
        self._answer_s, self._away_s = answer_s, away_s
        self._holder: int | None = None
        self._kept: threading.Timer | None = None
        self._asking: tuple[int, threading.Timer, viser.GuiModalHandle] | None = None
        self._notes: dict[int, viser.GuiHtmlHandle] = {}
        self._take: viser.GuiButtonHandle | None = None
        server.on_client_connect(self._came)
        server.on_client_disconnect(self._left)

    def build(self, gui: "viser.GuiApi") -> None:
        """Draw what is shared: the button by which a watcher asks for the seat."""
        self._take = gui.add_button(ASK, hint="Act from this browser; the other one then watches.")
        self._take.on_click(self._asked)
        self._show()

    def may(self, client_id: int) -> bool:
        """Whether this browser holds the seat."""
        return self._holder == client_id or (self._holder is None and self._kept is None)

    def why_not(self) -> str:
        """What a watcher is told."""
        return f"Another browser holds the operator's seat. Press '{ASK}' to act from here."

    def close(self) -> None:
        """Forget who asked and who is waited for."""
        with self._lock:
            self._stop_waiting()
            self._end_asking()

    def _came(self, client: "viser.ClientHandle") -> None:
        with self._lock:
            self._notes[client.client_id] = client.gui.add_html("", order=-1000.0)
            if self._holder is None:
                self._stop_waiting()
                self._holder = client.client_id
        self._show()

    def _left(self, client: "viser.ClientHandle") -> None:
        with self._lock:
            self._notes.pop(client.client_id, None)
            if self._asking is not None and client.client_id in (self._asking[0], self._holder):
                self._end_asking()
            if self._holder == client.client_id:
                self._holder = None
                if self._notes:
                    self._kept = _timer(self._away_s, self._hand_on)
        self._show()

    def _hand_on(self) -> None:
        """The browser that had the seat did not come back."""
        with self._lock:
            self._stop_waiting()
            if self._holder is None:
                self._holder = next(iter(self._notes), None)
        self._show()

    def _asked(self, event: "viser.GuiEvent") -> None:
        client = event.client
        with self._lock:
            if client is None or client.client_id == self._holder or self._asking is not None:
                return
            operator = self._server.get_clients().get(self._holder) if self._holder is not None else None
            if operator is None:
                self._give(client.client_id)
                return
            self._ask(operator, client)

    def _ask(self, operator: "viser.ClientHandle", client: "viser.ClientHandle") -> None:
        """Ask whoever holds the seat; no answer gives it away."""
        asker = client.client_id
        modal = operator.gui.add_modal("Another browser asks for the operator's seat")
        with modal:
            text = f"If you do not answer within {self._answer_s:.0f} seconds, it is given."
            operator.gui.add_html(block(f"<p>{text}</p>", "seat-asked"))
            operator.gui.add_button(GIVE).on_click(lambda _: self._give(asker))
            operator.gui.add_button(KEEP).on_click(lambda _: self._refuse(asker))
        self._asking = asker, _timer(self._answer_s, lambda: self._give(asker)), modal
        client.add_notification("The operator is asked", "Wait for the answer.", auto_close_seconds=self._answer_s)

    def _give(self, asker: int) -> None:
        with self._lock:
            self._end_asking()
            self._stop_waiting()
            before, self._holder = self._holder, asker if asker in self._notes else self._holder
        self._tell(before, "You are watching now", "Another browser has the operator's seat.")
        self._show()

    def _refuse(self, asker: int) -> None:
        with self._lock:
            self._end_asking()
        self._tell(asker, "The operator keeps the seat", "Ask again later; you are watching.")

    def _end_asking(self) -> None:
        if self._asking is not None:
            _, timer, modal = self._asking
            self._asking = None
            timer.cancel()
            # The browser that was asked may be gone.
            with contextlib.suppress(Exception):
                modal.close()

    def _stop_waiting(self) -> None:
        if self._kept is not None:
            self._kept.cancel()
            self._kept = None

    def _tell(self, client_id: int | None, title: str, text: str) -> None:
        client = self._server.get_clients().get(client_id) if client_id is not None else None
        if client is not None and client_id != self._holder:
            client.add_notification(title, text, color="orange", auto_close_seconds=10)

    def _show(self) -> None:
        for client_id, note in list(self._notes.items()):
            operator = client_id == self._holder
            words = "● You hold the operator's seat" if operator else "○ You are watching"
            # A browser may leave while it is told.
            with contextlib.suppress(Exception):
                note.content = block(f"<b class='{'ok' if operator else 'soft'}'>{words}</b>", "seat")
        if self._take is not None:
            self._take.visible = len(self._notes) > 1


def _timer(seconds: float, act: Callable[[], None]) -> threading.Timer:
    timer = threading.Timer(seconds, act)
    timer.daemon = True
    timer.start()
    return timer
