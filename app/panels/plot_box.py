"""A plot with a sentence under it; before there is anything to draw, a sentence that says what to do."""

from html import escape

import plotly.graph_objects as go
import viser

from app.figures.style import CONFIG, in_theme
from app.words import block

WIDTH_PX = 520
"""Of a plot in the panel at the right, for which heights are meant."""


class PlotBox:
    """One place of a panel."""

    def __init__(self, gui: viser.GuiApi, name: str, empty: str, dark: bool = False) -> None:
        """An empty box.

        Args:
            gui: of the server, within the panel or tab that holds it.
            name: for tests.
            empty: what to do to see something here.
            dark: whether the page is dark.
        """
        self._name, self._empty = name, empty
        self._dark, self._figure = dark, go.Figure(layout={"template": "none"})
        self._plot = gui.add_plotly(self._figure, aspect=0.8, config=CONFIG, visible=False)
        self._words = gui.add_html("")
        self.clear()

    @property
    def drawn(self) -> bool:
        """Whether there is a plot."""
        return self._plot.visible

    def show(self, figure: go.Figure, caption: str = "") -> None:
        """Draw a figure."""
        self._figure = figure
        # Figures are made for a light page.
        self._plot.figure = in_theme(figure, dark=True) if self._dark else figure
        self._plot.aspect = figure.layout.height / WIDTH_PX
        self._plot.visible = True
        self._say(f"<p class='soft'>{escape(caption)}</p>" if caption else "")

    def clear(self, instead: str = "") -> None:
        """Back to the sentence that says what to do, or to another one."""
        self._plot.visible = False
        self._say(f"<p class='soft'>{escape(instead or self._empty)}</p>")

    def show_dark(self, dark: bool) -> None:
        """Draw for a dark or a light page."""
        if dark == self._dark:
            return
        self._dark = dark
        if self._plot.visible:
            self._plot.figure = in_theme(self._figure, dark)

    def _say(self, inner: str) -> None:
        self._words.content = block(inner, self._name)
