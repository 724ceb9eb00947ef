"""Whether probabilities mean what they say: how often it was right against how sure it was."""

import numpy as np
import plotly.graph_objects as go

from app.figures.sheet import Panel, stacked
from app.figures.style import BLUE, GREY, WIDTH_PX, Trace
from core.geometry import Array

HEIGHT_PX = 240


def reliability_figure(said: Array, right: Array, count: np.ndarray, counted: str, title: str) -> go.Figure:
    """Share of right ones over the probability said; the diagonal is where they should be.

    Args:
        said: mean probability in each bin, (k,).
        right: share of right ones, (k,).
        count: how many fell in it, (k,); bars show two standard deviations of their share.
        counted: what they are, in the plural.
        title: of the figure.
    """
    known = np.asarray(count) > 0
    said, right, count = (np.asarray(v)[known] for v in (said, right, count))
    spread = 2 * np.sqrt(np.clip(right * (1 - right), 0.0, None) / np.maximum(count, 1))
    ideal: Trace = {
        "type": "scatter",
        "x": [0, 1],
        "y": [0, 1],
        "mode": "lines",
        "line": {"color": GREY, "width": 1.5, "dash": "dot"},
        "name": "as it should be",
        "hoverinfo": "skip",
    }
    found: Trace = {
        "type": "scatter",
        "x": said,
        "y": right,
        "error_y": {"type": "data", "array": spread, "thickness": 1.2, "width": 3},
        "customdata": count,
        "mode": "lines+markers",
        "marker": {"color": BLUE, "size": 8},
        "line": {"color": BLUE, "width": 1.5},
        "name": f"in bins of {counted}",
        "hovertemplate": f"said %{{x:.0%}}, right %{{y:.0%}} of %{{customdata}} {counted}<extra></extra>",
    }
    ends = {"range": [-0.03, 1.05], "tickformat": ".0%", "dtick": 0.2}
    panel = Panel((ideal, found), {**ends, "title": {"text": "right"}}, ends)
    return stacked(title, (panel,), "probability said", HEIGHT_PX, width_px=WIDTH_PX)
