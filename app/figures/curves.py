"""An observed curve with the function fitted to it, above what is left: shared by drives and couplings."""

from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from app.figures.style import BLACK, NOISE_BAND, SERIES, SYMBOLS, band, styled, symmetric_range, thinned
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
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.07, row_heights=[0.56, 0.44])
    if fitted.std.max() > 0:
        low, high = fitted.deviation - COVERAGE * fitted.std, fitted.deviation + COVERAGE * fitted.std
        figure.add_trace(band(fitted.x, low, high, "95 % band"), row=1, col=1)
    figure.add_trace(_line(fitted), row=1, col=1)
    spread = float(np.sqrt(np.mean(np.concatenate([o.std for o in observed]) ** 2)))
    noise = band(fitted.x[[0, -1]], np.full(2, -2 * spread), np.full(2, 2 * spread), "±2σ of a stop", NOISE_BAND)
    figure.add_trace(noise, row=2, col=1)
    for index, one in enumerate(observed):
        _add_observed(figure, one, index, len(observed) > 1, unit)
    styled(figure, title, 205)
    limits = symmetric_range(*(o.after for o in observed), np.atleast_1d(2 * spread))
    figure.update_yaxes(title_text=f"error [{unit}]", nticks=6, row=1, col=1)
    figure.update_yaxes(title_text=f"left over [{unit}]", range=limits, nticks=5, row=2, col=1)
    figure.update_xaxes(title_text=x_title, title_standoff=6, row=2, col=1)
    return figure


def _line(fitted: Fitted) -> go.Scatter:
    return go.Scatter(
        x=fitted.x,
        y=fitted.deviation,
        mode="lines",
        line={"color": BLACK, "width": 1.6},
        name="fit",
        hoverinfo="skip",
    )


def _add_observed(figure: go.Figure, one: Observed, index: int, several: bool, unit: str) -> None:
    drawn = thinned(len(one.x), one.after)
    marker = {
        "color": SERIES[index % len(SERIES)],
        "symbol": SYMBOLS[index % len(SYMBOLS)],
        "size": 5 if len(drawn) < 300 else 3,
    }
    for row, values in ((1, one.before), (2, one.after)):
        trace = go.Scatter(
            x=one.x[drawn],
            y=values[drawn],
            mode="markers",
            marker=marker,
            name=one.name,
            legendgroup=one.name,
            showlegend=several and row == 1,
            hovertemplate=f"%{{x:.3f}}: %{{y:.4f}} {unit}<extra>{one.name}</extra>",
        )
        figure.add_trace(trace, row=row, col=1)
