"""Which tabs somebody looks at: these are drawn at once, the others as soon as nobody waits.

A browser draws a plot anew whenever it changes, in tabs that nobody sees too, and the operator would wait for all.
"""

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

from app.clicks import appearing

if TYPE_CHECKING:
    import viser

SEEN = "seen:"


class OpenTabs:
    """The tabs of a panel by name, what is still to be drawn in each, and who looks at which."""

    def __init__(self) -> None:
        self._open: dict[int, str] = {}
        self._left: dict[str, Callable[[], None]] = {}
        self._lock = threading.RLock()

    def mark(self, gui: "viser.GuiApi", name: str) -> None:
        """Let a tab say when it is opened; to be called within it."""
        gui.add_html(appearing(f"{SEEN}{name}"))

    def draw(self, name: str, work: Callable[[], None]) -> None:
        """Do the work of a tab: now if somebody looks at it, else later; work that was left before is superseded."""
        with self._lock:
            self._left[name] = work
            if name in self._open.values():
                self._left.pop(name)()

    def heard(self, client_id: int, word: str) -> bool:
        """A browser says something; whether it was that a tab was opened."""
        if not word.startswith(SEEN):
            return False
        with self._lock:
            self._open[client_id] = word.removeprefix(SEEN)
            self._left.pop(self._open[client_id], lambda: None)()
        return True

    def left(self, client_id: int) -> None:
        """A browser is gone."""
        with self._lock:
            self._open.pop(client_id, None)

    def catch_up(self) -> None:
        """Do what is still to be done."""
        with self._lock:
            for name in list(self._left):
                self._left.pop(name)()
