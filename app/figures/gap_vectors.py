"""Real minus sim in space: arrows from where the sim has a point to where it was measured, magnified.

One trace is drawn for every choice of causes that are added to the sim; its ``meta`` says which, so that the page's
switches show one and hide the others.
"""

import numpy as np
import plotly.graph_objects as go

from app.figures.style import BLUE, GREY, LIGHT, SKY, VERMILLION, WIDE_PX, Trace, thinned
from core.gap.place_words import cause_words
from core.gap.result import GapReport
from core.geometry import Array

MOST_ARROWS, MOST_POINTS = 100, 500
MOST_SWITCHES = 5
"""Each doubles the number of traces."""
LENGTH_SHARE = 0.12
"""Of the size of the cloud of points that the long arrows take."""
HEIGHT_PX = 520
GRID = "rgba(128, 136, 148, 0.35)"


def switch_names(report: GapReport) -> tuple[str, ...]:
    """What each switch adds to the sim."""
    return tuple(cause_words(cause) for cause in report.causes[:MOST_SWITCHES])


def gap_vectors_figure(report: GapReport, width_px: int = WIDE_PX) -> go.Figure | None:
    """The worst region, with the other points as dots; None: there is no such region."""
    if len(report.where.worst_rows) == 0:
        return None
    sim = report.campaign.measurements.point_m[report.rows] - report.difference_m
    drawn = report.where.worst_rows
    drawn = drawn[thinned(len(drawn), np.linalg.norm(report.difference_m[drawn], axis=1), MOST_ARROWS)]
    factor = magnification(sim, report.difference_m[drawn])
    count = len(switch_names(report))
    traces = [_dots(sim), *(_arrows(report, sim, drawn, mask, count, factor) for mask in range(2**count))]
    layout = {
        "template": LIGHT,
        "title": {"text": f"<b>Real minus sim in the worst region, × {factor:g}</b>"},
        "width": width_px,
        "height": HEIGHT_PX,
        "margin": {"l": 0, "r": 0, "t": 32, "b": 0},
        "showlegend": False,
        "scene": {
            **{f"{axis}axis": _axis(axis) for axis in "xyz"},
            "aspectmode": "data",
            "camera": {"eye": {"x": 1.3, "y": -1.3, "z": 0.8}},
        },
    }
    return go.Figure(data=traces, layout=layout)


def added(report: GapReport, mask: int) -> Array:
    """Real minus sim once the causes of a mask are added: bit k, cause k; all of them: as fitted together, (m, 3), m."""
    chosen = [cause for k, cause in enumerate(report.causes) if mask >> k & 1]
    if chosen and len(chosen) == len(report.causes):
        return report.left_m
    return report.difference_m - sum(cause.shift_m for cause in chosen)


def magnification(sim_m: Array, difference_m: Array) -> float:
    """How many times too long arrows are, so that long ones are seen and none fills the figure: 1, 2 or 5 times 10^k."""
    size = float(np.linalg.norm(np.ptp(sim_m, axis=0)))
    length = float(np.quantile(np.linalg.norm(difference_m, axis=1), 0.95))
    if not (size > 0 and length > 0):
        return 1.0
    wanted = LENGTH_SHARE * size / length
    power = 10.0 ** np.floor(np.log10(wanted))
    return max(1.0, float(next(step for step in (5.0, 2.0, 1.0) if step * power <= wanted * (1 + 1e-9)) * power))


def _dots(sim_m: Array) -> Trace:
    kept = sim_m[thinned(len(sim_m), most=MOST_POINTS)] * 1e3
    return {
        "type": "scatter3d",
        **dict(zip("xyz", kept.T.round(2), strict=True)),
        "mode": "markers",
        "marker": {"size": 1.6, "color": GREY, "opacity": 0.5},
        "hoverinfo": "skip",
    }


def _arrows(report: GapReport, sim_m: Array, drawn: np.ndarray, mask: int, count: int, factor: float) -> Trace:
    """Lines with a dot at the measured end, parted by gaps."""
    left = added(report, mask)[drawn]
    ends = np.full((len(drawn), 3, 3), np.nan)
    ends[:, 0], ends[:, 1] = sim_m[drawn], sim_m[drawn] + factor * left
    lengths = np.repeat(np.linalg.norm(left, axis=1) * 1e3, 3)
    records = np.repeat(report.campaign.measurements.record[report.rows[drawn]], 3)
    colour = VERMILLION if mask == 0 else BLUE if mask == 2**count - 1 else SKY
    return {
        "type": "scatter3d",
        **dict(zip("xyz", (ends.reshape(-1, 3) * 1e3).T.round(2), strict=True)),
        "mode": "lines+markers",
        "line": {"color": colour, "width": 4},
        "marker": {"size": np.tile([0.0, 3.5, 0.0], len(drawn)), "color": colour, "line": {"width": 0}},
        "customdata": np.stack([records, lengths.round(4)], axis=1),
        "hovertemplate": "record %{customdata[0]}: %{customdata[1]:.3f} mm<extra></extra>",
        "visible": mask == 0,
        "meta": {"mask": mask},
    }


def _axis(name: str) -> dict:
    return {
        "title": {"text": f"{name} [mm]"},
        "showbackground": False,
        "gridcolor": GRID,
        "zeroline": False,
        "tickfont": {"size": 10},
        "nticks": 6,
    }
