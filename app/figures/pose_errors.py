"""Figures 9 and 10 of the paper: errors of the nominal and the calibrated arm, pose by pose."""

import numpy as np
import plotly.graph_objects as go

from app.figures.sheet import Panel, stacked
from app.figures.style import BLUE, GREY, VERMILLION, WIDE_PX, Trace, thinned
from core.geometry import Array
from core.verification import Errors, Verification

HEIGHT_PX = 330


def position_errors_figure(found: Verification) -> go.Figure:
    """Figure 9: position errors in mm."""
    limit = found.limits.position_m
    pair = (found.nominal.position, found.calibrated.position)
    return _errors_figure(found, pair, "Position error of every pose", "mm", 1e3, limit)


def orientation_errors_figure(found: Verification) -> go.Figure:
    """Figure 10: orientation errors in mrad."""
    limit = found.limits.orientation_rad
    pair = (found.nominal.orientation, found.calibrated.orientation)
    return _errors_figure(found, pair, "Orientation error of every pose", "mrad", 1e3, limit)


def _errors_figure(
    found: Verification, pair: tuple[Errors, Errors], title: str, unit: str, scale: float, limit: float | None
) -> go.Figure:
    """Both models on one logarithmic scale: what calibration takes away is a distance in it."""
    poses = np.array([str(p) for p in found.measured.seen.pose])
    traces: list[Trace] = []
    for errors, name, colour, symbol in zip(
        pair, ("nominal", "calibrated"), (VERMILLION, BLUE), ("square", "circle"), strict=True
    ):
        traces.append(_series(poses, errors, name, colour, symbol, unit, scale))
        traces.append(_level(poses, errors.mean * scale, f"{name}, mean", colour, "dot"))
    if limit is not None:
        traces.append(_level(poses, limit * scale, f"limit, {limit * scale:g} {unit}", GREY, "dash"))
    values = np.concatenate([errors.value for errors in pair]) * scale
    y = {"type": "log", "range": _decades(values, limit, scale), "title_text": f"error [{unit}]", "zeroline": False}
    x = {"type": "category", "title_standoff": 4, "nticks": min(len(poses), 30)}
    panel = Panel(tuple(traces), y | {"dtick": 1}, x)
    figure = stacked(title, (panel,), "pose", HEIGHT_PX, width_px=WIDE_PX)
    figure.layout.margin.b = 76
    return figure


def _series(poses: Array, errors: Errors, name: str, colour: str, symbol: str, unit: str, scale: float) -> go.Scatter:
    drawn = thinned(len(poses), errors.value)
    value, band = errors.value[drawn] * scale, 2 * errors.std[drawn] * scale
    # A bar that would end below zero has no place on a logarithmic scale; it ends at the bottom of the figure.
    down = np.minimum(band, value * (1 - 1e-6))
    return {
        "type": "scatter",
        "x": poses[drawn],
        "y": np.maximum(value, 1e-12),
        "error_y": {"array": band, "arrayminus": down, "symmetric": False, "thickness": 1.2, "width": 3},
        "mode": "markers",
        "marker": {"color": colour, "symbol": symbol, "size": 8 if len(drawn) < 60 else 4},
        "name": name,
        "legendgroup": name,
        "customdata": band,
        "hovertemplate": f"pose %{{x}}: %{{y:.3g}} ± %{{customdata:.2g}} {unit}<extra>{name}</extra>",
    }


def _level(poses: Array, height: float, name: str, colour: str, dash: str) -> Trace:
    """A line over all poses; plotly would put the label of a horizontal line elsewhere on a logarithmic scale."""
    return {
        "type": "scatter",
        "x": [poses[0], poses[-1]],
        "y": [max(height, 1e-12)] * 2,
        "mode": "lines",
        "line": {"color": colour, "width": 1.5, "dash": dash},
        "name": name,
        "hovertemplate": f"%{{y:.3g}}<extra>{name}</extra>",
    }


def _decades(values: Array, limit: float | None, scale: float) -> list[float]:
    """Whole decades that hold all errors, seven of them at most."""
    shown = [float(v) for v in values if v > 0] + ([limit * scale] if limit else [])
    if not shown:
        return [-3.0, 0.0]
    top = np.ceil(np.log10(max(shown)) + 0.05)
    low = np.floor(np.log10(min(shown)) - 0.05)
    return [float(max(low, top - 7)), float(top)]
