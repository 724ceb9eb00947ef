"""How well every axis is known: by all points at once, and joint by joint."""

import numpy as np
import plotly.graph_objects as go

from app.figures.sheet import Panel, stacked
from app.figures.style import BLUE, GREY, WIDTH_PX, Trace
from core.calibration import Calibration
from core.geometry import Array


def axis_uncertainty_figure(calibration: Calibration, width_px: int = WIDTH_PX) -> go.Figure:
    """Standard uncertainties of direction and place of the axes that were swept, on logarithmic scales."""
    joints = calibration.found.swept
    panels = []
    for k, (title, scale) in enumerate((("direction u [mrad]", 1e3), ("place u [mm]", 1e3))):
        pairs = ((calibration.joint_by_joint, "joint by joint"), (calibration.estimate, "all points at once"))
        traces = tuple(
            _trace(joints, np.array([estimate.axis_std(j)[k] for j in joints]) * scale, name, k == 0)
            for estimate, name in pairs
        )
        y = {"title_text": title, "type": "log", "dtick": "D2", "zeroline": False}
        panels.append(Panel(traces, y, {"type": "category"}))
    return stacked("How well the axes are known", tuple(panels), "joint", 190, width_px=width_px, gap=0.07)


def _trace(joints: tuple[int, ...], value: Array, name: str, first: bool) -> Trace:
    best = name == "all points at once"
    known = np.flatnonzero(np.isfinite(value) & (value > 0))
    return {
        "type": "scatter",
        "x": [str(joints[k]) for k in known],
        "y": value[known],
        "mode": "markers",
        "marker": {"color": BLUE if best else GREY, "symbol": "circle" if best else "square-open", "size": 9},
        "name": name,
        "legendgroup": name,
        "showlegend": first,
        "hovertemplate": f"joint %{{x}}: %{{y:.2g}}<extra>{name}</extra>",
    }
