"""Residuals of one sweep: measured minus predicted along the axis, away from it and along the arc."""

from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from app.figures.sheet import Panel, stacked
from app.figures.style import NOISE_BAND, SERIES, SYMBOLS, VERMILLION, Trace, band, plain, symmetric_range, thinned
from core.calibration import Calibration
from core.geometry import Array
from core.report import sweep_rows
from core.sweep_fits import SweepFit
from core.wording import display_unit


@dataclass(frozen=True)
class Direction:
    """Residuals of a sweep in one direction, mm."""

    title: str
    value: Array
    sigma: float
    """Standard deviation by the estimated noise, root mean square over the points."""


def residual_figure(calibration: Calibration, index: int) -> go.Figure:
    """The residuals of sweep ``index`` (0.., in the order of measurement) over the commanded displacement."""
    found, rows = list(sweep_rows(calibration))[index]
    directions = _directions(calibration, found, rows)
    limits = symmetric_range(*sizes_mm(calibration))
    unit, scale = display_unit(calibration.campaign.robot.joints[found.sweep.joint - 1].slides)
    x = found.sweep.commanded[found.sweep.stop, found.sweep.joint - 1] * scale
    used = calibration.refinement.residuals.used[rows]
    ends, panels = np.array([x.min(), x.max()]), []
    for row, direction in enumerate(directions):
        width = np.full(2, 2 * direction.sigma)
        noise = band(ends, -width, width, "±2σ expected", NOISE_BAND, row == 0)
        points = _points(calibration, found, x, direction.value, used, limits[1], row == 0)
        panels.append(Panel((noise, *points), {"title_text": direction.title, "range": limits, "nticks": 5}))
    title = f"Joint {found.sweep.joint}, sweep {found.sweep.number}"
    return stacked(title, tuple(panels), f"commanded [{unit}]", 104 * len(directions), gap=0.045)


def thinned_sweeps(calibration: Calibration) -> tuple[str, ...]:
    """Sweeps of which not every point is drawn."""
    many = [f.sweep for f in calibration.found.fits]
    return tuple(s.name for s in many if np.unique(s.target, return_counts=True)[1].max() > len(thinned(10**6)))


def _directions(calibration: Calibration, found: SweepFit, rows: slice) -> tuple[Direction, ...]:
    """Residuals with what the noise, as estimated, lets expect of them."""
    residuals, fit = calibration.refinement.residuals, found.fit
    axis = fit.line.direction
    away = found.sweep.point_m - fit.line.point_m
    away = away - np.outer(away @ axis, axis)
    radius = np.linalg.norm(away, axis=1)
    outward = away / np.maximum(radius, 1e-12)[:, None]
    covariance = calibration.refinement.noise.covariance(found.sweep.covariance_m2)
    excess = calibration.refinement.arc_excess[found.sweep.joint - 1]
    along = _sigma_mm(covariance, np.broadcast_to(axis, away.shape))
    axial, radial = residuals.axial_m[rows] * 1e3, residuals.radial_m[rows] * 1e3
    if fit.sliding:
        total = np.sqrt(np.mean(np.trace(covariance, axis1=1, axis2=2))) * 1e3
        return (
            Direction("along [mm]", axial, float(np.hypot(along, excess * 1e3))),
            Direction("away [mm]", radial, float(np.sqrt(max(total**2 - along**2, 0.0)))),
        )
    turned = np.sqrt(np.mean((excess * radius) ** 2)) * 1e3
    tangential = _sigma_mm(covariance, np.cross(axis, outward))
    return (
        Direction("axial [mm]", axial, along),
        Direction("radial [mm]", radial, _sigma_mm(covariance, outward)),
        Direction("tangential [mm]", residuals.tangential_m[rows] * 1e3, float(np.hypot(tangential, turned))),
    )


def _sigma_mm(covariance: Array, direction: Array) -> float:
    return float(np.sqrt(np.mean(np.einsum("mi,mij,mj->m", direction, covariance, direction)))) * 1e3


def sizes_mm(calibration: Calibration) -> tuple[Array, ...]:
    """Everything that the common range of all sweeps must hold: used points, and the expected scatter, mm."""
    residuals = calibration.refinement.residuals
    used = residuals.used
    shown = [v[used] * 1e3 for v in (residuals.axial_m, residuals.radial_m, residuals.tangential_m)]
    return (*shown, np.array([2 * calibration.estimate.noise_m * 1e3]))


def _points(
    calibration: Calibration, found: SweepFit, x: Array, value: Array, used: np.ndarray, top: float, first: bool
) -> list[Trace]:
    """The points of each target, and those that were rejected."""
    traces = []
    for order, target in enumerate(dict.fromkeys(found.sweep.target.tolist())):
        mine = np.flatnonzero((found.sweep.target == target) & used)
        mine = mine[thinned(len(mine), value[mine])]
        name = plain(calibration.campaign.targets[target].name)
        trace = {
            "type": "scatter",
            "x": x[mine],
            "y": value[mine],
            "mode": "markers",
            "marker": {
                "color": SERIES[order % len(SERIES)],
                "symbol": SYMBOLS[order % len(SYMBOLS)],
                "size": 5 if len(mine) < 300 else 3,
            },
            "name": name,
            "legendgroup": f"target {order}",
            "showlegend": first,
            "hovertemplate": f"%{{x:.2f}}: %{{y:.3f}} mm<extra>{name}</extra>",
        }
        traces.append(trace)
    out = np.flatnonzero(~used)
    return [*traces, rejected_trace(x[out], value[out], top, first)] if len(out) else traces


def rejected_trace(x: Array, value: Array, top: float, first: bool) -> Trace:
    """Rejected points as crosses; those beyond the range stand at its edge."""
    drawn = thinned(len(x), value)
    return {
        "type": "scatter",
        "x": x[drawn],
        "y": np.clip(value[drawn], -0.93 * top, 0.93 * top),
        "customdata": value[drawn],
        "mode": "markers",
        "marker": {"color": VERMILLION, "symbol": "x-open", "size": 8, "line": {"width": 1.5}},
        "name": "rejected",
        "legendgroup": "rejected",
        "showlegend": first,
        "hovertemplate": "%{x:.2f}: %{customdata:.3f} mm<extra>rejected</extra>",
    }
