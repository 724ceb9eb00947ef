"""A sweep while it grows: residuals of its shots, and its transmission error so far."""

import numpy as np
import plotly.graph_objects as go

from app.figures.sheet import Panel, stacked
from app.figures.style import BLUE, GREY, ORANGE, VERMILLION, Trace
from core.geometry import Array
from core.live_sweep import LiveSweep, Verdict

COLOURS = {Verdict.KEEP: BLUE, Verdict.DOUBTFUL: ORANGE, Verdict.AGAIN: VERMILLION, Verdict.EARLY: GREY}
SYMBOLS = {Verdict.KEEP: "circle", Verdict.DOUBTFUL: "diamond", Verdict.AGAIN: "x", Verdict.EARLY: "circle-open"}


def live_figure(live: LiveSweep, commanded: Array, joint: int, sliding: bool, width_px: int = 520) -> go.Figure:
    """Axial and radial residuals and the error of the drive (command less actual) against the commanded displacement.

    A joint that slides draws a line: residuals stand across it, in two directions square to each other.

    Args:
        live: the sweep so far.
        commanded: commanded displacement of each shot, rad or m, (k,).
        joint: its number, for the title.
        sliding: whether it slides.
    """
    scale, unit = (1e3, "mm") if sliding else (180 / np.pi, "deg")
    curves = [] if live.fit is None else _curves(live, commanded, scale, unit)
    panels = tuple(Panel((_trace(live, commanded * scale, y, name),), {"title_text": name}) for y, name in curves)
    title, x_title = f"Joint {joint}: this sweep so far", f"commanded displacement [{unit}]"
    return stacked(title, panels or (Panel(()),), x_title, 330, width_px=width_px, legend_rows=0)


def _trace(live: LiveSweep, x: Array, y: Array, name: str) -> Trace:
    colours, symbols = [COLOURS[v] for v in live.verdicts], [SYMBOLS[v] for v in live.verdicts]
    return {
        "type": "scatter",
        "x": x,
        "y": y,
        "mode": "markers",
        "marker": {"color": colours, "symbol": symbols, "size": 8},
        "name": name,
        "showlegend": False,
    }


def _curves(live: LiveSweep, commanded: Array, scale: float, unit: str) -> list[tuple[Array, str]]:
    fit = live.fit
    lag = commanded - commanded[0] - live.displacements.value
    lag = (lag - np.nanmean(lag)) * scale
    names = ("across 1 [mm]", "across 2 [mm]") if fit.sliding else ("axial [mm]", "radial [mm]")
    across = (fit.radial_m, fit.tangential_m) if fit.sliding else (fit.axial_m, fit.radial_m)
    return [*((value * 1e3, name) for value, name in zip(across, names, strict=True)), (lag, f"error [{unit}]")]
