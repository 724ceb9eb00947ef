"""Help: the way in steps, the keys, every term, in a tab and on a key."""

from html import escape
from typing import TYPE_CHECKING

from app.glossary import TERMS
from app.keys import KEYS, Key
from app.words import block

if TYPE_CHECKING:
    import viser

STEPS = (
    ("1 Cell", "Say who measures. Choose the robot, name targets, instrument and sweeps, or take the demo cell."),
    ("Check", "Shoot one target several times: does the instrument keep its promise?"),
    ("2 Measure", "Send the robot, aim, press Measure. One joint moves at a time, the last joint first."),
    ("3 Solve", "From all shots that count: axes, drives, couplings, parameters, and findings in sentences."),
    ("Residuals, Drives, Axes, Geometry", "On the right: look at what was found, and set limits."),
    ("Verify, Compensate, Gap", "They appear when there is a solution: how well it predicts, and what to do with it."),
    ("4 Export", "The report, the numbers, the tables, the points, the robot: one click each."),
)
QUESTIONS = (
    (
        "Is anything lost if I close the browser?",
        "No. Every shot is on the disk before the page shows it. Open the address again and go on at the same step.",
    ),
    (
        "A shot looks wrong.",
        "Measure it again (R), or click it in 3-D and exclude it with a reason. Nothing is ever deleted; Undo brings "
        "it back.",
    ),
    (
        "Another browser has the operator's seat.",
        "Press 'Ask for the operator's seat'. The operator is asked; without an answer you get it.",
    ),
    (
        "My robot is not the demo's.",
        "1 Cell, New session: send its robot.toml or URDF, choose where points come from, press Begin.",
    ),
    (
        "I have measured already.",
        "1 Cell, New session: send the campaign as a ZIP file, or its three files one after the other.",
    ),
    ("Where are the sessions?", "1 Cell, Sessions: search, open, copy, or save one as a file of its own."),
)


class HelpPanel:
    """One tab, and the same on a key for whoever presses it."""

    def __init__(self, gui: "viser.GuiApi", others: tuple[Key, ...] = ()) -> None:
        self._html = help_words((*KEYS, *others))
        gui.add_html(self._html)

    def open(self, event: "viser.CommandEvent") -> None:
        """Show it in a window, in the browser of who asked alone."""
        client = event.client
        if client is None:
            return
        modal = client.gui.add_modal("Help")
        with modal:
            client.gui.add_html(self._html)
            client.gui.add_button("Close").on_click(lambda _: modal.close())


def help_words(keys: tuple[Key, ...]) -> str:
    """All of it as one piece of the page."""
    steps = "".join(f"<dt>{escape(name)}</dt><dd>{escape(text)}</dd>" for name, text in STEPS)
    asked = "".join(f"<dt>{escape(name)}</dt><dd>{escape(text)}</dd>" for name, text in QUESTIONS)
    rows = "".join(f"<tr><td><b>{escape(key.shown)}</b></td><td>{escape(key.does)}</td></tr>" for key in keys)
    terms = "".join(f"<dt>{escape(name)}</dt><dd>{escape(text)}</dd>" for name, text in TERMS.items())
    return block(
        f"<h3>The way</h3><dl>{steps}</dl><h3>Keys</h3><table data-testid='keys'>{rows}</table>"
        "<p class='soft'>Keys are off while you type in a box. Ctrl+K lists all commands.</p>"
        f"<h3>Questions</h3><dl>{asked}</dl><h3>Terms</h3><dl data-testid='terms'>{terms}</dl>",
        "help",
    )
