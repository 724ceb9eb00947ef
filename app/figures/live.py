"""A sweep while it grows: residuals of its shots, and its transmission error so far."""

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from app.figures.style import BLUE, GREY, VERMILLION, styled
from core.live_sweep import LiveSweep, Verdict

COLOURS = {Verdict.KEEP: BLUE, Verdict.DOUBTFUL: "#E69F00", Verdict.AGAIN: VERMILLION, Verdict.EARLY: GREY}
SYMBOLS = {Verdict.KEEP: "circle", Verdict.DOUBTFUL: "diamond", Verdict.AGAIN: "x", Verdict.EARLY: "circle-open"}


def live_figure(live: LiveSweep, commanded: np.ndarray, joint: int, sliding: bool, width_px: int = 520) -> go.Figure:
    """Axial and radial residuals and the error of the drive (command less actual) against the commanded displacement.

    Args:
        live: the sweep so far.
        commanded: commanded displacement of each shot, rad or m, (k,).
        joint: its number, for the title.
        sliding: whether it slides.
    """
    figure = make_subplots(rows=3, cols=1, shared_xaxes=True, vertical_spacing=0.05)
    scale, unit = (1e3, "mm") if sliding else (180 / np.pi, "deg")
    if live.fit is not None:
        x = commanded * scale
        colours = [COLOURS[v] for v in live.verdicts]
        symbols = [SYMBOLS[v] for v in live.verdicts]
        for row, (values, name) in enumerate(_curves(live, commanded, scale, unit), 1):
            marker = {"color": colours, "symbol": symbols, "size": 8}
            figure.add_scatter(
                x=x, y=values, mode="markers", marker=marker, name=name, row=row, col=1, showlegend=False
            )
            figure.update_yaxes(title_text=name, row=row, col=1, zeroline=True, zerolinecolor="#9aa1ab")
    figure.update_xaxes(title_text=f"commanded displacement [{unit}]", row=3, col=1)
    return styled(figure, f"Joint {joint}: this sweep so far", 330, width_px, legend_rows=0)


def _curves(live: LiveSweep, commanded: np.ndarray, scale: float, unit: str) -> list[tuple[np.ndarray, str]]:
    fit = live.fit
    lag = commanded - commanded[0] - live.displacements.value
    lag = (lag - np.nanmean(lag)) * scale
    return [
        (fit.axial_m * 1e3, "axial [mm]"),
        (fit.radial_m * 1e3, "radial [mm]"),
        (lag, f"error [{unit}]"),
    ]
