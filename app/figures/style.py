"""The common look of all figures: sizes, colours, fonts, thinning, and what plotly's tool bar may show.

Colours are those of Okabe and Ito (2008, "Color Universal Design"): told apart by colour-blind eyes and, with the
markers that always go with them, in grey print.
"""

from collections.abc import Mapping, Sequence
from html import escape

import numpy as np
import plotly.graph_objects as go

from core.geometry import Array

Trace = dict[str, object]
"""A trace as plotly writes it; whole figures are made of them at once, because traces added one by one take long."""

WIDTH_PX = 340
"""Of one small figure; two stand side by side on A4 paper."""
TOP_PX = 32
"""Height of the title."""
WIDE_PX = 690
"""Of a figure over the whole width of the paper."""
MOST_POINTS = 2000
"""Of one trace; beyond that markers cover each other and the page gets slow."""

BLACK, BLUE, VERMILLION, GREEN = "#1b1f24", "#0072B2", "#D55E00", "#009E73"
ORANGE, SKY, PURPLE, GREY = "#E69F00", "#56B4E9", "#CC79A7", "#6b7280"
SERIES = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK)
SYMBOLS = ("circle", "square", "diamond", "triangle-up", "triangle-down", "pentagon", "hexagon")
BAND = "rgba(86, 180, 233, 0.24)"
NOISE_BAND = "rgba(107, 114, 128, 0.16)"
FONT = "system-ui, 'Segoe UI', 'Helvetica Neue', 'Liberation Sans', Arial, sans-serif"

CONFIG = {
    "displaylogo": False,
    "showEditInChartStudio": False,
    "showSendToCloud": False,
    "modeBarButtonsToRemove": ["select2d", "lasso2d", "autoScale2d"],
    "toImageButtonOptions": {"format": "svg"},
}
"""For ``Plotly.newPlot``."""


DARK_INK = "#d6d6d6"
CLEAR = "rgba(0, 0, 0, 0)"


def _look(ink: str, frame: str, grid: str) -> go.layout.Template:
    """What all figures on one kind of ground share; plotly in the browser fills it in."""
    axis = {"showline": True, "linecolor": frame, "gridcolor": grid, "ticks": "outside", "ticklen": 4, "mirror": True}
    axis |= {"tickcolor": frame, "title_font_size": 11, "tickfont_size": 10.5, "automargin": False}
    layout = {
        "font": {"family": FONT, "size": 11, "color": ink},
        "title": {"x": 0.0, "xref": "container", "xanchor": "left", "y": 1.0, "yref": "container", "yanchor": "top"},
        "title_pad": {"t": 7, "l": 4},
        "title_font_size": 13,
        # The page shows through, so that a figure needs to know neither its colour nor its frame.
        "paper_bgcolor": CLEAR,
        "plot_bgcolor": CLEAR,
        "legend": {"orientation": "h", "x": 0.01, "xref": "container", "xanchor": "left"},
        "legend_y": 0.0,
        "legend_yref": "container",
        "legend_yanchor": "bottom",
        "legend_font_size": 10.5,
        "legend_tracegroupgap": 0,
        "hoverlabel_font_size": 11,
        "xaxis": {**axis, "zeroline": False},
        "yaxis": {**axis, "zeroline": True, "zerolinecolor": frame, "zerolinewidth": 1},
    }
    return go.layout.Template(layout=layout, data={"scatter": [{"line": {"color": ink}}]})


LIGHT, DARK = _look(BLACK, "#9aa1ab", "#e4e7eb"), _look(DARK_INK, "#8b929c", "#3c3f44")
"""Looks on a light and on a dark page. A line without a colour of its own is drawn in that of the text."""


def in_theme(figure: go.Figure, dark: bool) -> go.Figure:
    """A figure for a page with a light or a dark theme, changed in place."""
    figure.layout.template = DARK if dark else LIGHT
    return figure


def plain(text: str, longest: int = 24) -> str:
    """Text from a file, cut if it is long, to be shown as it is: plotly reads a little HTML in its labels."""
    short = text if len(text) <= longest else f"{text[: longest - 1]}…"
    return escape(short, quote=False)


def styled(
    figure: go.Figure, title: str, panels_px: int, width_px: int = WIDTH_PX, legend_rows: int | None = None
) -> go.Figure:
    """Give a figure the common look and its size; it is changed in place, and returned. For arguments see ``frame``."""
    figure.update_layout(frame(list(figure.data), title, panels_px, width_px, legend_rows))
    return figure


def frame(
    traces: Sequence[Mapping | go.Scatter], title: str, panels_px: int, width_px: int, legend_rows: int | None = None
) -> dict:
    """Layout that every figure has: look, title, size and margins.

    Args:
        traces: of the figure, for the length of its legend.
        title: free of markup that is not meant.
        panels_px: height of the panels, without title, axis and legend.
        width_px: of the whole figure.
        legend_rows: lines of the legend; None: as many as its names need.
    """
    rows = lines_of_legend(traces, width_px) if legend_rows is None else legend_rows
    bottom = 46 + 18 * rows
    return {
        "template": LIGHT,
        "title": {"text": f"<b>{title}</b>"},
        "width": width_px,
        "height": TOP_PX + panels_px + bottom,
        "margin": {"l": 56, "r": 10, "t": TOP_PX, "b": bottom, "autoexpand": False},
    }


def lines_of_legend(traces: Sequence[Mapping | go.Scatter], width_px: int) -> int:
    """How many lines the legend of traces takes, by the widths of their names."""
    lines, at = 1, 0.0
    for trace in traces:
        if "showlegend" in trace and trace["showlegend"] is False:
            continue
        name = trace["name"] if "name" in trace else None  # noqa: SIM401 (traces of plotly have no get)
        width = 48 + 6.3 * len(name or "")
        if at > 0 and at + width > width_px - 8:
            lines, at = lines + 1, 0.0
        at += width
    return lines


def thinned(count: int, keep: Array | None = None, most: int = MOST_POINTS) -> np.ndarray:
    """Which of many points are drawn: evenly spread ones, and those with the largest ``keep``; sorted indices.

    Args:
        count: how many there are.
        keep: size of each, (count,); the largest twentieth of what is drawn is never left out.
        most: how many may be drawn.
    """
    if count <= most:
        return np.arange(count)
    special = 0 if keep is None else most // 20
    chosen = np.linspace(0, count - 1, most - special).round().astype(int)
    if keep is not None:
        chosen = np.concatenate([chosen, np.argsort(-np.abs(keep))[:special]])
    return np.unique(chosen)


def symmetric_range(*values: Array, share: float = 1.12) -> list[float]:
    """A range about zero that holds all finite values."""
    sizes = [float(np.max(np.abs(v[np.isfinite(v)]), initial=0.0)) for v in map(np.atleast_1d, values)]
    top = max([*sizes, 1e-9]) * share
    return [-top, top]


def band(x: Array, low: Array, high: Array, name: str, colour: str = BAND, show: bool = True) -> Trace:
    """A filled band between two curves over ascending x."""
    return {
        "type": "scatter",
        "x": np.concatenate([x, x[::-1]]),
        "y": np.concatenate([high, low[::-1]]),
        "fill": "toself",
        "fillcolor": colour,
        "line": {"width": 0},
        "mode": "lines",
        "name": name,
        "legendgroup": name,
        "showlegend": show,
        "hoverinfo": "skip",
    }
