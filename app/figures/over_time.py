"""Residuals of all sweeps in the order of time: what drifts, warms up or was bumped shows as a slope or a step."""

import numpy as np
import plotly.graph_objects as go

from app.figures.residuals import rejected_trace, sizes_mm
from app.figures.sheet import Panel, stacked
from app.figures.style import NOISE_BAND, SERIES, SYMBOLS, WIDE_PX, Trace, band, symmetric_range, thinned
from core.calibration import Calibration
from core.geometry import Array

DIRECTIONS = ("axial", "radial", "tangential")
SECONDS = {"s": 1.0, "min": 60.0, "h": 3600.0}


def over_time_figure(calibration: Calibration, width_px: int = WIDE_PX) -> go.Figure:
    """Axial, radial and tangential residuals of every point against the time of its shot, one colour a joint.

    Where times were not recorded, points stand in the order of their records. Of a slide, axial is along it, radial
    away from it; it has nothing tangential.
    """
    residuals = calibration.refinement.residuals
    x, x_title = _when(calibration)
    limits = symmetric_range(*sizes_mm(calibration))
    panels = []
    for k, name in enumerate(DIRECTIONS):
        value = np.asarray(getattr(residuals, f"{name}_m")) * 1e3
        traces = _traces(calibration, x, value, limits[1], k == 0)
        panels.append(Panel(tuple(traces), {"title_text": f"{name} [mm]", "range": limits, "nticks": 5}))
    title = "Residuals of all sweeps over time"
    return stacked(title, tuple(panels), x_title, 104 * len(panels), width_px=width_px, gap=0.045)


def _when(calibration: Calibration) -> tuple[Array, str]:
    """Where each residual stands on the axis of time, and the title of that axis."""
    table, rows = calibration.campaign.measurements, calibration.refinement.residuals.row
    time = None if table.time_s is None else table.time_s[rows]
    if time is None or not np.isfinite(time).all() or np.ptp(time) == 0:
        return table.record[rows].astype(float), "record (times were not kept)"
    since = time - time.min()
    unit = "s" if since.max() < 180 else "min" if since.max() < 3 * 3600 else "h"
    return since / SECONDS[unit], f"time since the first point [{unit}]"


def _traces(calibration: Calibration, x: Array, value: Array, top: float, first: bool) -> list[Trace]:
    residuals = calibration.refinement.residuals
    known, width = np.isfinite(value), np.full(2, 2 * calibration.estimate.noise_m * 1e3)
    traces = [band(np.array([x.min(), x.max()]), -width, width, "±2σ of noise", NOISE_BAND, first)]
    for order, joint in enumerate(dict.fromkeys(residuals.joint.tolist())):
        mine = np.flatnonzero((residuals.joint == joint) & residuals.used & known)
        mine = mine[thinned(len(mine), value[mine])]
        trace = {
            "type": "scatter",
            "x": x[mine],
            "y": value[mine],
            "mode": "markers",
            "marker": {"color": SERIES[order % len(SERIES)], "symbol": SYMBOLS[order % len(SYMBOLS)], "size": 5},
            "name": f"joint {joint}",
            "legendgroup": f"joint {joint}",
            "showlegend": first,
            "hovertemplate": f"%{{x:.1f}}: %{{y:.3f}} mm<extra>joint {joint}</extra>",
        }
        traces.append(trace)
    out = np.flatnonzero(~residuals.used & known)
    return [*traces, rejected_trace(x[out], value[out], top, first)] if len(out) else traces
