"""Where real and sim part: by joint, by direction, and along the order of measurement."""

import numpy as np
import plotly.graph_objects as go

from app.figures.sheet import Panel, beside, stacked
from app.figures.style import BLUE, GREY, VERMILLION, WIDE_PX, Trace, thinned
from core.gap.result import GapReport
from core.geometry import Array

SHARES_PX, RECORDS_PX = 170, 260
SMALLEST_M = 1e-9


def gap_shares_figure(report: GapReport, width_px: int = WIDE_PX) -> go.Figure:
    """Shares of the gap: which joints could account for it, and in which directions it lies."""
    where = report.where
    joints = [str(k) for k in range(1, len(where.by_joint) + 1)]
    panels = [_bars(joints, where.by_joint, "errors of the joint")]
    if where.sweep_directions is not None:
        panels.append(_bars(["axial", "radial", "tangential"], where.sweep_directions, "sweeps, about the joint"))
    if where.pose_directions is not None:
        panels.append(_bars(["x", "y", "z"], where.pose_directions, "poses, instrument's axes"))
    figure = beside("Where the gap lies", tuple(panels), SHARES_PX, width_px=width_px)
    figure.layout.margin.l = 44
    return figure


def gap_records_figure(report: GapReport, width_px: int = WIDE_PX) -> go.Figure:
    """Length of real minus sim of every point in the order of measurement, before and after."""
    record = report.campaign.measurements.record[report.rows]
    before, after = (np.linalg.norm(v, axis=1) * 1e3 for v in (report.difference_m, report.left_m))
    traces = [_points(record, before, "sim as it is", VERMILLION, "square")]
    if report.causes:
        traces.append(_points(record, after, "with all causes added", BLUE, "circle"))
    floor = report.noise.floor_rms_m * 1e3
    traces.append(
        {
            "type": "scatter",
            "x": [record.min(), record.max()],
            "y": [floor, floor],
            "mode": "lines",
            "line": {"color": GREY, "width": 1.5, "dash": "dot"},
            "name": "floor, rms",
            "hovertemplate": "floor %{y:.3g} mm<extra></extra>",
        }
    )
    y = {"type": "log", "title": {"text": "real minus sim [mm]"}, "zeroline": False, "dtick": 1}
    panel = Panel(tuple(traces), y)
    return stacked("Point by point", (panel,), "record", RECORDS_PX, width_px=width_px)


def _bars(names: list[str], shares: Array, title: str) -> Panel:
    trace: Trace = {
        "type": "bar",
        "x": names,
        "y": np.nan_to_num(shares),
        "marker": {"color": BLUE},
        "text": [f"{100 * share:.0f} %" if np.isfinite(share) else "" for share in shares],
        "textposition": "outside",
        "cliponaxis": False,
        "showlegend": False,
        "hovertemplate": "%{x}: %{y:.1%}<extra></extra>",
    }
    top = 1.2 * max(float(np.nanmax([*shares, 0.0])), 0.05)
    y = {"range": [0.0, top], "tickformat": ".0%", "nticks": 5}
    return Panel((trace,), y, {"type": "category", "title": {"text": title, "standoff": 6}})


def _points(record: np.ndarray, length_mm: Array, name: str, colour: str, symbol: str) -> Trace:
    drawn = thinned(len(record), length_mm)
    return {
        "type": "scatter",
        "x": record[drawn],
        "y": np.maximum(length_mm[drawn], SMALLEST_M * 1e3),
        "mode": "markers",
        "marker": {"color": colour, "symbol": symbol, "size": 5 if len(drawn) < 400 else 3, "opacity": 0.8},
        "name": name,
        "hovertemplate": f"record %{{x}}: %{{y:.3g}} mm<extra>{name}</extra>",
    }
