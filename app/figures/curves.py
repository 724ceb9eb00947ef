"""An observed curve with the function fitted to it, above what is left: shared by drives and couplings."""

from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from app.figures.sheet import Panel, stacked
from app.figures.style import NOISE_BAND, SERIES, SYMBOLS, Trace, band, symmetric_range, thinned
from core.function_fit import FunctionFit
from core.geometry import Array

COVERAGE = 1.959964
"""Standard deviations of a normal distribution that hold 95 %."""


@dataclass(frozen=True)
class Observed:
    """What one sweep shows, in the unit that is drawn."""

    name: str
    x: Array
    """Displacement, (k,)."""
    before: Array
    """Deviation from a perfect drive, (k,)."""
    after: Array
    """Deviation from the fitted function, (k,)."""
    std: Array
    """Of one stop by the noise of its points, (k,)."""


@dataclass(frozen=True)
class Fitted:
    """The fitted function over the range that was measured, in the unit that is drawn."""

    x: Array
    deviation: Array
    """From a perfect drive."""
    std: Array
    """By the uncertainty of the function's constants."""


def fitted_curve(fit: FunctionFit, low: float, high: float, slope: float, home: bool, scale: float) -> Fitted:
    """A fitted function's deviation from a straight line, with the uncertainty that its constants give it.

    Args:
        fit: the function with the covariance of its constants.
        low, high: range of displacements, rad or m.
        slope: of the perfect drive.
        home: whether the function's value counts from that at zero displacement.
        scale: of the unit that is drawn.
    """
    x = np.linspace(low, high, 181)
    value, _, gradient = fit.form.evaluate(x, fit.coefficients)
    if home:
        at_zero, _, gradient_at_zero = fit.form.evaluate(np.zeros(1), fit.coefficients)
        value, gradient = value - at_zero, gradient - gradient_at_zero
    variance = np.einsum("ij,jk,ik->i", gradient, fit.covariance, gradient)
    return Fitted(x * scale, (value - slope * x) * scale, np.sqrt(np.maximum(variance, 0.0)) * scale)


def curve_figure(title: str, observed: tuple[Observed, ...], fitted: Fitted, x_title: str, unit: str) -> go.Figure:
    """Errors before the fit with the fitted curve, and what is left after it, one above the other."""
    spread = float(np.sqrt(np.mean(np.concatenate([o.std for o in observed]) ** 2)))
    noise = band(fitted.x[[0, -1]], np.full(2, -2 * spread), np.full(2, 2 * spread), "±2σ of a stop", NOISE_BAND)
    limits = symmetric_range(*(o.after for o in observed), np.atleast_1d(2 * spread))
    several = len(observed) > 1
    before, after = zip(*(_both(one, k, several, unit) for k, one in enumerate(observed)), strict=True)
    panels = (
        Panel((*_fit(fitted), *before), {"title_text": f"error [{unit}]", "nticks": 6}, height=0.56),
        Panel((noise, *after), {"title_text": f"left over [{unit}]", "range": limits, "nticks": 5}, height=0.44),
    )
    return stacked(title, panels, x_title, 205, gap=0.07)


def _fit(fitted: Fitted) -> tuple[Trace, ...]:
    """The fitted curve, after its band where it has one."""
    line = {"type": "scatter", "x": fitted.x, "y": fitted.deviation, "mode": "lines", "line": {"width": 1.6}}
    line |= {"name": "fit", "hoverinfo": "skip"}
    if fitted.std.max() <= 0:
        return (line,)
    low, high = fitted.deviation - COVERAGE * fitted.std, fitted.deviation + COVERAGE * fitted.std
    return band(fitted.x, low, high, "95 % band"), line


def _both(one: Observed, index: int, several: bool, unit: str) -> tuple[Trace, Trace]:
    """What one sweep shows before and after the fit."""
    drawn = thinned(len(one.x), one.after)
    common = {
        "type": "scatter",
        "x": one.x[drawn],
        "mode": "markers",
        "marker": {
            "color": SERIES[index % len(SERIES)],
            "symbol": SYMBOLS[index % len(SYMBOLS)],
            "size": 5 if len(drawn) < 300 else 3,
        },
        "name": one.name,
        "legendgroup": one.name,
        "hovertemplate": f"%{{x:.3f}}: %{{y:.4f}} {unit}<extra>{one.name}</extra>",
    }
    before = {**common, "y": one.before[drawn], "showlegend": several}
    return before, {**common, "y": one.after[drawn], "showlegend": False}
