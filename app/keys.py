"""The keyboard shortcuts, in one place."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Key:
    """One shortcut."""

    shown: str
    """As a person calls it."""
    hotkey: str
    """As the page is told."""
    does: str


MEASURE = Key("Space", "space", "Measure the next shot")
ENTER = Key("Enter", "enter", "Measure the next shot")
UNDO = Key("Backspace", "backspace", "Undo")
REDO = Key("Y", "Y", "Redo")
AGAIN = Key("R", "R", "Measure the chosen shot, or the last one, again")
SKIP = Key("K", "K", "Skip this shot")
PAUSE = Key("P", "P", "Pause the robot, or let it go on")
STOP = Key("Esc", "escape", "Stop the robot")
SOLVE = Key("S", "S", "Solve")
HELP = Key("H", "H", "Help")
POSE = Key("V", "V", "Measure the next test pose")
KEYS = (MEASURE, ENTER, UNDO, REDO, AGAIN, SKIP, PAUSE, STOP, SOLVE, HELP)
"""Those of this module's steps; other tabs add their own."""
