"""Figures 9 and 10 of the paper: errors of poses, before and after, on one scale."""

from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from app.figures.sheet import Panel, stacked
from app.figures.style import BLUE, GREEN, GREY, VERMILLION, WIDE_PX, Trace, thinned
from core.geometry import Array
from core.pose_loop import PoseLoop
from core.verification import Errors, Verification

HEIGHT_PX = 330
LOOP_HEIGHT_PX = 200
LOOKS = {"before": (VERMILLION, "square"), "after": (BLUE, "circle"), "promised": (GREEN, "diamond-open")}
"""Colour and symbol of series."""


@dataclass(frozen=True)
class Series:
    """Errors of poses under one name."""

    name: str
    look: str
    """Key of ``LOOKS``."""
    place: np.ndarray
    """What each pose is called at the x-axis, strings (k,)."""
    errors: Errors

    @property
    def seen(self) -> "Series":
        """Those that were measured."""
        known = np.isfinite(self.errors.value)
        errors = Errors(self.errors.value[known], self.errors.std[known], self.errors.mean_std)
        return Series(self.name, self.look, self.place[known], errors)


def position_errors_figure(found: Verification) -> go.Figure:
    """Figure 9: position errors in mm."""
    both = found.nominal.position, found.calibrated.position
    return _figure(_models(found, both), "Position error of every pose", "mm", found.limits.position_m, WIDE_PX)


def orientation_errors_figure(found: Verification) -> go.Figure:
    """Figure 10: orientation errors in mrad."""
    both = found.nominal.orientation, found.calibrated.orientation
    return _figure(
        _models(found, both), "Orientation error of every pose", "mrad", found.limits.orientation_rad, WIDE_PX
    )


def loop_figures(loop: PoseLoop, numbers: tuple[int, ...], width_px: int) -> tuple[go.Figure, go.Figure]:
    """Figures 9 and 10 for commanded poses: by nominal and by compensated commands.

    Args:
        loop: what came of the poses.
        numbers: what each wanted pose is called, one a row of ``loop.wanted``.
        width_px: of each figure.
    """
    limits = loop.found.limits
    figures = []
    for kind, unit, limit in (("position", "mm", limits.position_m), ("orientation", "mrad", limits.orientation_rad)):
        series = _attempts(loop, np.array([str(n) for n in numbers]), kind)
        figures.append(_figure(series, f"{kind.capitalize()} error", unit, limit, width_px, LOOP_HEIGHT_PX))
    return figures[0], figures[1]


def _models(found: Verification, both: tuple[Errors, Errors]) -> tuple[Series, ...]:
    poses = np.array([str(p) for p in found.measured.seen.pose])
    return Series("nominal", "before", poses, both[0]), Series("calibrated", "after", poses, both[1])


def _attempts(loop: PoseLoop, names: np.ndarray, kind: str) -> tuple[Series, ...]:
    """Nominal and compensated commands; before any of the latter, what the calibrated model makes of the former."""
    series = []
    for attempts, name, look in (
        (loop.nominal, "nominal command", "before"),
        (loop.compensated, "compensated command", "after"),
    ):
        if attempts.count:
            series.append(Series(name, look, names[attempts.goal], getattr(attempts.errors, kind)))
    if not loop.compensated.count:
        errors = getattr(loop.found.calibrated, kind)
        series.append(Series("promised by the calibration", "promised", names[loop.nominal.goal], errors))
    return tuple(series)


def _figure(
    all_series: tuple[Series, ...],
    title: str,
    unit: str,
    limit: float | None,
    width_px: int,
    height_px: int = HEIGHT_PX,
) -> go.Figure:
    """All series on one logarithmic scale: what calibration takes away is a distance in it."""
    places = np.array(list(dict.fromkeys(str(p) for series in all_series for p in series.place)))
    traces: list[Trace] = []
    for series in all_series:
        traces.append(_dots(series.seen, unit))
        if series.errors.count:
            mean = series.errors.mean * 1e3
            traces.append(_level(places, mean, f"{series.name}, mean", LOOKS[series.look][0], "dot"))
    if limit is not None:
        traces.append(_level(places, limit * 1e3, f"limit, {limit * 1e3:g} {unit}", GREY, "dash"))
    values = np.concatenate([series.seen.errors.value for series in all_series]) * 1e3
    y = {"type": "log", "range": _decades(values, limit), "title_text": f"error [{unit}]", "zeroline": False}
    x = {"type": "category", "categoryorder": "array", "categoryarray": places, "title_standoff": 4}
    panel = Panel(tuple(traces), y | {"dtick": 1}, x | {"nticks": min(len(places), 30)})
    figure = stacked(title, (panel,), "pose", height_px, width_px=width_px)
    figure.layout.margin.b += 12
    return figure


def _dots(series: Series, unit: str) -> Trace:
    colour, symbol = LOOKS[series.look]
    drawn = thinned(len(series.place), series.errors.value)
    value, band = series.errors.value[drawn] * 1e3, 2e3 * series.errors.std[drawn]
    # A bar that would end below zero has no place on a logarithmic scale; it ends at the bottom of the figure.
    down = np.minimum(band, value * (1 - 1e-6))
    return {
        "type": "scatter",
        "x": series.place[drawn],
        "y": np.maximum(value, 1e-12),
        "error_y": {"array": band, "arrayminus": down, "symmetric": False, "thickness": 1.2, "width": 3},
        "mode": "markers",
        "marker": {"color": colour, "symbol": symbol, "size": 8 if len(drawn) < 60 else 4},
        "name": series.name,
        "legendgroup": series.name,
        "customdata": band,
        "hovertemplate": f"pose %{{x}}: %{{y:.3g}} ± %{{customdata:.2g}} {unit}<extra>{series.name}</extra>",
    }


def _level(places: np.ndarray, height: float, name: str, colour: str, dash: str) -> Trace:
    """A line over all poses; plotly would put the label of a horizontal line elsewhere on a logarithmic scale."""
    return {
        "type": "scatter",
        "x": [places[0], places[-1]],
        "y": [max(height, 1e-12)] * 2,
        "mode": "lines",
        "line": {"color": colour, "width": 1.5, "dash": dash},
        "name": name,
        "hovertemplate": f"%{{y:.3g}}<extra>{name}</extra>",
    }


def _decades(values: Array, limit: float | None) -> list[float]:
    """Whole decades that hold all errors, seven of them at most."""
    shown = [float(v) for v in values if v > 0] + ([limit * 1e3] if limit else [])
    if not shown:
        return [-3.0, 0.0]
    top = np.ceil(np.log10(max(shown)) + 0.05)
    low = np.floor(np.log10(min(shown)) - 0.05)
    return [float(max(low, top - 7)), float(top)]
