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
    "const wanted=event.target.dataset.bring.split('|'),own=event.target.closest('[data-dock-group]');"
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


def bring_forward(gui: "viser.GuiApi", *labels: str) -> None:
    """Let a step bring the tabs of its results forward; to be called within it."""
    gui.add_html(bringing(*labels))
