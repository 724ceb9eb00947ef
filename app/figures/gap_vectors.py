"""Real minus sim in space: arrows from where the sim has a point to where it was measured, magnified.

Traces are drawn for every choice of switches, each of which adds a cause to the sim; their ``meta`` says which are on,
so that the page shows those of one choice and hides the others.
"""

import numpy as np
import plotly.graph_objects as go

from app.figures.style import BLUE, GREY, LIGHT, SKY, VERMILLION, WIDE_PX, Trace, thinned
from core.gap.ledger import difference_with, switches
from core.gap.result import GapReport
from core.gap.verdict_words import length_words
from core.geometry import Array

MOST_ARROWS, MOST_POINTS = 100, 500
LENGTH_SHARE, HEAD_SHARE = 0.12, 0.014
"""Of the size of the cloud of points that the long arrows, and the heads of all, take."""
HEIGHT_PX = 520
GRID = "#aab1bb"
"""To be seen on light and on dark pages."""


def gap_vectors_figure(report: GapReport, width_px: int = WIDE_PX, shown: int = 0) -> go.Figure | None:
    """The worst region, with the other points as dots; None: there is no such region.

    Args:
        report: the diagnosis.
        width_px: of the figure.
        shown: which switches are on in what is seen first: bit k, switch k.
    """
    if len(report.where.worst_rows) == 0:
        return None
    sim = report.campaign.measurements.point_m[report.rows] - report.difference_m
    drawn = report.where.worst_rows
    drawn = drawn[thinned(len(drawn), np.linalg.norm(report.difference_m[drawn], axis=1), MOST_ARROWS)]
    factor = magnification(sim, report.difference_m[drawn])
    head_mm = HEAD_SHARE * float(np.linalg.norm(np.ptp(sim, axis=0))) * 1e3
    all_switches = switches(report)
    traces = [_dots(sim)]
    for on in range(2 ** len(all_switches)):
        causes = sum(switch.causes for k, switch in enumerate(all_switches) if on >> k & 1)
        left = difference_with(report, causes)[drawn]
        colour = VERMILLION if on == 0 else BLUE if on == 2 ** len(all_switches) - 1 else SKY
        records = report.campaign.measurements.record[report.rows[drawn]]
        arrows = _arrows(sim[drawn], left, records, factor, head_mm, colour)
        traces += [{**trace, "visible": on == shown, "meta": {"mask": on}} for trace in arrows]
    layout = {
        "template": LIGHT,
        "title": {"text": f"<b>Real minus sim in the worst region, × {factor:g}</b>"},
        "width": width_px,
        "height": HEIGHT_PX,
        "margin": {"l": 0, "r": 0, "t": 32, "b": 0},
        "legend": {"x": 0.01, "y": 0.99, "xref": "paper", "yref": "paper", "yanchor": "top", "font": {"size": 12}},
        "scene": {
            **{f"{axis}axis": _axis(axis) for axis in "xyz"},
            "aspectmode": "data",
            "camera": {"eye": {"x": 1.25, "y": -1.25, "z": 0.75}, "center": {"x": 0, "y": 0, "z": -0.16}},
        },
    }
    return go.Figure(data=traces, layout=layout)


def magnification(sim_m: Array, difference_m: Array) -> float:
    """How many times too long arrows are, 1, 2 or 5 times 10^k: long ones are seen, and none fills the figure."""
    size = float(np.linalg.norm(np.ptp(sim_m, axis=0)))
    length = float(np.quantile(np.linalg.norm(difference_m, axis=1), 0.95))
    if not (size > 0 and length > 0):
        return 1.0
    wanted = LENGTH_SHARE * size / length
    power = 10.0 ** np.floor(np.log10(wanted))
    return max(1.0, float(next(step for step in (5.0, 2.0, 1.0) if step * power <= wanted * (1 + 1e-9)) * power))


def _dots(sim_m: Array) -> Trace:
    return {
        "type": "scatter3d",
        **_coordinates(sim_m[thinned(len(sim_m), most=MOST_POINTS)]),
        "mode": "markers",
        "marker": {"size": 1.6, "color": GREY, "opacity": 0.5},
        "hoverinfo": "skip",
        "showlegend": False,
    }


def _arrows(
    start_m: Array, left_m: Array, records: np.ndarray, factor: float, head_mm: float, colour: str
) -> list[Trace]:
    """Shafts, parted by gaps, and heads."""
    length = np.linalg.norm(left_m, axis=1)
    tips = start_m + factor * left_m
    words = [f"record {record}: {one * 1e3:.3f} mm" for record, one in zip(records, length, strict=True)]
    gaps = np.full_like(tips, np.nan)
    shafts = {
        "type": "scatter3d",
        **_coordinates(np.stack([start_m, tips, gaps], axis=1).reshape(-1, 3)),
        "mode": "lines",
        "line": {"color": colour, "width": 4},
        "name": f"{length_words(float(np.sqrt(np.mean(length**2))))} rms over these {len(length)} points",
        "showlegend": True,
        "text": np.repeat(words, 3),
        "hovertemplate": "%{text}<extra></extra>",
    }
    direction = left_m / np.maximum(length, 1e-12)[:, None]
    heads = {
        "type": "cone",
        **_coordinates(tips),
        **dict(zip("uvw", direction.T.round(4), strict=True)),
        "anchor": "tip",
        "sizemode": "raw",
        "sizeref": head_mm,
        "colorscale": [[0, colour], [1, colour]],
        "showscale": False,
        "hoverinfo": "skip",
    }
    return [shafts, heads]


def _coordinates(points_m: Array) -> Trace:
    return dict(zip("xyz", (points_m * 1e3).T.round(2), strict=True))


def _axis(name: str) -> dict:
    return {
        "title": {"text": f"{name} [mm]"},
        "showbackground": False,
        "showline": True,
        "linecolor": GRID,
        "gridcolor": GRID,
        "zeroline": False,
        "tickfont": {"size": 10},
        "nticks": 6,
    }
