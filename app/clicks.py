"""Pieces of the page that can be clicked and say so to the server: rows of a table, sentences of a list.

HTML that a panel shows can hold no callback. So what is clicked writes its word into a text box that nobody sees, and
the server hears the box.
"""

from collections.abc import Callable
from html import escape
from time import time_ns
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import viser

LONGEST_WORD = 64
HEARD = """<style>div:has(> .ta-ear) + div{display:none}[data-say]{cursor:pointer}
@keyframes ta-appear{}.ta-appearing{animation:ta-appear 1ms;position:absolute}
[data-say]:hover,[data-say]:focus-visible{outline:2px solid #D91E8C;outline-offset:-2px}</style>
<i class='ta-ear' hidden></i>"""
SAY = (
    "const said=event.target.closest('[data-say]');"
    "if(said&&(event.type!=='keydown'||event.key==='Enter')){"
    "const ear=document.querySelector('div:has(> .ta-ear) + div input');"
    "Object.getOwnPropertyDescriptor(HTMLInputElement.prototype,'value').set.call(ear,said.dataset.say+' '+Date.now());"
    "ear.dispatchEvent(new Event('input',{bubbles:true}))}"
)
"""The time makes every click a change, the second one on the same place too."""


def saying(word: str, hint: str) -> str:
    """Attributes of an element that says a word when it is clicked, or when Enter is pressed on it."""
    return f"data-say='{escape(word)}' role='button' tabindex='0' title='{escape(hint)}'"


def listening(inner: str) -> str:
    """A piece of the page of which elements say words."""
    return f'<div onclick="{SAY}" onkeydown="{SAY}">{inner}</div>'


def appearing(word: str) -> str:
    """Something that nobody sees and that says a word whenever the tab that it is in is opened."""
    return f"<i class='ta-appearing' data-say='{escape(word)}' onanimationstart=\"{SAY}\"></i>"


class Ear:
    """The hidden text box; to be made where it is always part of the page, outside of all tabs."""

    def __init__(self, gui: "viser.GuiApi", heard: Callable[["viser.ClientHandle", str], None]) -> None:
        """``heard`` is told who clicked, and the word; what a browser says is not to be trusted."""
        self._heard = heard
        gui.add_html(HEARD)
        self._box = gui.add_text("clicked", f"- {time_ns()}")
        self._box.on_update(self._changed)

    def _changed(self, event: "viser.GuiEvent") -> None:
        said = self._box.value
        if event.client is not None and isinstance(said, str) and len(said) <= LONGEST_WORD:
            self._heard(event.client, said.partition(" ")[0])
