"""The comparison with the literature's methods: mean and 95th percentile of every method, on one logarithmic scale."""

from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from app.figures.sheet import Panel, stacked
from app.figures.style import BLUE, GREEN, GREY, VERMILLION, WIDE_PX, Trace, plain
from core.rivals.comparison import Comparison, ErrorSizes, MethodRow
from core.rivals.observed import Drives

ROW_PX = 19
NAMES_PX = 272
"""Room for the names of the methods."""
LONGEST_NAME = 48
LEGEND_ROWS = 2
GROUPS = (
    ("this project and the paper", BLUE, "circle"),
    ("others, drives with functions", GREEN, "diamond"),
    ("others, drives as commanded", VERMILLION, "square"),
    ("to be read against", GREY, "line-ns-open"),
)
"""Name, colour and symbol of each group."""
OWN, FUNCTIONS, COMMANDED, REFERENCE = range(4)


@dataclass(frozen=True)
class _Line:
    """One line of the figure."""

    name: str
    group: int
    sizes: ErrorSizes


def position_comparison_figure(found: Comparison, width_px: int = WIDE_PX) -> go.Figure:
    """Position errors over the kept-out poses, mm, the smallest on top."""
    lines = [_Line(row.name, _group(row), row.position_m) for row in found.rows]
    lines += [_Line(one.name, REFERENCE, ErrorSizes(one.position_m)) for one in found.references]
    return _figure(lines, "Position error after compensation", "mm", width_px)


def orientation_comparison_figure(found: Comparison, width_px: int = WIDE_PX) -> go.Figure:
    """Orientation errors over the kept-out poses, mrad, the smallest on top."""
    lines = [_Line(row.name, _group(row), row.orientation_rad) for row in found.rows]
    lines += [_Line(one.name, REFERENCE, ErrorSizes(one.orientation_rad)) for one in found.references]
    return _figure(lines, "Orientation error after compensation", "mrad", width_px)


def _group(row: MethodRow) -> int:
    if row.own:
        return OWN
    return FUNCTIONS if row.drives is Drives.FUNCTIONS else COMMANDED


def _figure(lines: list[_Line], title: str, unit: str, width_px: int) -> go.Figure:
    ordered = sorted(lines, key=lambda line: line.sizes.mean)
    traces = tuple(
        _dots([(k, line) for k, line in enumerate(ordered) if line.group == group], *look, unit)
        for group, look in enumerate(GROUPS)
    )
    y = {
        "tickvals": list(range(len(ordered))),
        "ticktext": [plain(line.name, LONGEST_NAME) for line in ordered],
        "range": [len(ordered) - 0.3, -0.7],
        "zeroline": False,
        "ticks": "",
    }
    x = {"type": "log", "tickvals": [step * 10.0**k for k in range(-3, 4) for step in (1, 2, 5)]}
    x_title = f"mean, bar to the 95th percentile [{unit}]"
    height = ROW_PX * len(ordered) + 10
    # In a narrow figure the names of the methods leave room for one entry of the legend a line.
    rows = LEGEND_ROWS if width_px >= WIDE_PX else len(GROUPS)
    figure = stacked(title, (Panel(traces, y, x),), x_title, height, width_px=width_px, legend_rows=rows)
    figure.layout.margin.l = NAMES_PX
    return figure


def _dots(placed: list[tuple[int, _Line]], name: str, colour: str, symbol: str, unit: str) -> Trace:
    mean = np.array([line.sizes.mean for _, line in placed]) * 1e3
    beyond = np.array([line.sizes.p95 - line.sizes.mean for _, line in placed]) * 1e3
    return {
        "type": "scatter",
        "x": mean,
        "y": [k for k, _ in placed],
        "error_x": {
            "array": np.nan_to_num(np.maximum(beyond, 0.0)),
            "arrayminus": np.zeros(len(placed)),
            "symmetric": False,
            "thickness": 1.2,
            "width": 3,
        },
        "mode": "markers",
        "marker": {
            "color": colour,
            "symbol": symbol,
            "size": 9,
            "line": {"width": 1.5 if symbol.endswith("open") else 0},
        },
        "name": name,
        "customdata": [plain(line.name, LONGEST_NAME) for _, line in placed],
        "hovertemplate": f"%{{customdata}}: mean %{{x:.3g}} {unit}<extra>{name}</extra>",
    }
