"""Opening a step at the left brings the tab with its results to the front at the right.

Which tab is open is each browser's own affair and viser has no word for it, so the page itself sees to it: a piece of
the step that nobody sees runs whenever the step is opened. Nothing else changes tabs, so that whoever opens another
one keeps it.
"""

from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import viser

BRING = (
    "const set=event.target.dataset,wanted=set.bring.split('|');"
    "const own=set.anywhere?event.target:event.target.closest('[data-dock-group]');"
    "const look=left=>{const others=[...document.querySelectorAll('[role=tab]')].filter(t=>!own.contains(t));"
    "const found=wanted.map(w=>others.find(t=>t.title===w)).filter(Boolean);"
    "if(!found.length){if(left)setTimeout(look,100,left-1);return}"
    "if(!found.some(t=>t.getAttribute('aria-selected')==='true'))"
    "found[0].dispatchEvent(new KeyboardEvent('keydown',{key:'Enter',bubbles:true}))};"
    "if(own)look(20)"
)
"""A tab may come a moment after the step that wants it, hence the patience."""


def bringing(*labels: str) -> str:
    """An invisible piece of a step; ``labels``: of the tabs with its results, the first one first.

    Where one of them is open already, it stays.
    """
    return f"<i class='ta-appearing' data-bring='{escape('|'.join(labels))}' onanimationstart=\"{BRING}\"></i>"


class Openers:
    """Opens a step for one browser, as something there was clicked."""

    def __init__(self) -> None:
        self._used: dict[int, viser.GuiHtmlHandle] = {}

    def open(self, client: "viser.ClientHandle", *labels: str) -> None:
        """Bring the first of these tabs forward, unless one of them is open already."""
        used = self._used.pop(client.client_id, None)
        if used is not None:
            used.remove()
        words = escape("|".join(labels))
        piece = f"<i class='ta-appearing' data-anywhere='1' data-bring='{words}' onanimationstart=\"{BRING}\"></i>"
        self._used[client.client_id] = client.gui.add_html(piece)

    def left(self, client: "viser.ClientHandle") -> None:
        """A browser is gone."""
        self._used.pop(client.client_id, None)


def bring_forward(gui: "viser.GuiApi", *labels: str) -> None:
    """Let a step bring the tabs of its results forward; to be called within it."""
    gui.add_html(bringing(*labels))
