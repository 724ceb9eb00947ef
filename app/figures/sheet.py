"""A figure made of panels: one above the other over a common x-axis, or side by side.

The whole figure is handed to plotly at once. Adding traces and setting axes one by one takes ten times as long, and the
operator waits for it after every shot.
"""

from dataclasses import dataclass, field
from itertools import accumulate

import plotly.graph_objects as go

from app.figures.style import WIDTH_PX, Trace, frame

BESIDE_GAP = 0.12
"""Between panels side by side, as a share of the width."""


@dataclass(frozen=True)
class Panel:
    """One pair of axes with what is drawn in it."""

    traces: tuple[Trace, ...]
    y: dict = field(default_factory=dict)
    """Of the y-axis, in plotly's words."""
    x: dict = field(default_factory=dict)
    """Of the x-axis."""
    height: float = 1.0
    """Compared with the other panels."""


def stacked(
    title: str,
    panels: tuple[Panel, ...],
    x_title: str,
    panels_px: int,
    *,
    width_px: int = WIDTH_PX,
    gap: float = 0.05,
    legend_rows: int | None = None,
) -> go.Figure:
    """Panels one above the other, the first on top; only the last one has numbers at its x-axis.

    Args:
        title: of the figure.
        panels: from top to bottom.
        x_title: of the common x-axis.
        panels_px: height of all panels with the gaps between them.
        width_px: of the whole figure.
        gap: between panels, as a share of ``panels_px``.
        legend_rows: lines of the legend; None: as many as its names need.
    """
    last = len(panels)
    domains = _shares([p.height for p in reversed(panels)], gap)[::-1]
    axes = {}
    for k, (panel, domain) in enumerate(zip(panels, domains, strict=True), 1):
        shared = {"title": {"text": x_title, "standoff": 6}} if k == last else {"showticklabels": False}
        if k != last:
            shared["matches"] = _name("x", last)
        axes[f"xaxis{_number(k)}"] = {"anchor": _name("y", k), **shared, **panel.x}
        axes[f"yaxis{_number(k)}"] = {"anchor": _name("x", k), "domain": domain, **panel.y}
    return _figure(title, panels, axes, panels_px, width_px, legend_rows)


def beside(title: str, panels: tuple[Panel, ...], panels_px: int, *, width_px: int = WIDTH_PX) -> go.Figure:
    """Panels side by side, from left to right; arguments as for ``stacked``."""
    axes = {}
    for k, domain in enumerate(_shares([1.0] * len(panels), BESIDE_GAP), 1):
        axes[f"xaxis{_number(k)}"] = {"anchor": _name("y", k), "domain": domain, **panels[k - 1].x}
        axes[f"yaxis{_number(k)}"] = {"anchor": _name("x", k), **panels[k - 1].y}
    return _figure(title, panels, axes, panels_px, width_px, None)


def _figure(
    title: str, panels: tuple[Panel, ...], axes: dict, panels_px: int, width_px: int, legend_rows: int | None
) -> go.Figure:
    traces = [
        {**trace, "xaxis": _name("x", k), "yaxis": _name("y", k)}
        for k, panel in enumerate(panels, 1)
        for trace in panel.traces
    ]
    return go.Figure(data=traces, layout=frame(traces, title, panels_px, width_px, legend_rows) | axes)


def _shares(sizes: list[float], gap: float) -> list[list[float]]:
    """Where each of several things in a row begins and ends, as shares of the whole, with gaps between them."""
    room = (1.0 - gap * (len(sizes) - 1)) / sum(sizes)
    ends = [end * room + k * gap for k, end in enumerate(accumulate(sizes))]
    return [[max(end - size * room, 0.0), min(end, 1.0)] for end, size in zip(ends, sizes, strict=True)]


def _name(letter: str, k: int) -> str:
    return f"{letter}{_number(k)}"


def _number(k: int) -> str:
    """The first axis has no number."""
    return "" if k == 1 else str(k)
