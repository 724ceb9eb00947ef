"""The gap as it shrinks: as it is, with each cause added to the sim, and the floor under it."""

from textwrap import wrap

import numpy as np
import plotly.graph_objects as go

from app.figures.sheet import Panel, stacked
from app.figures.style import BLUE, GREY, SKY, VERMILLION, WIDE_PX, Trace, plain
from core.gap.place_words import CALIBRATION, cause_words
from core.gap.result import UNKNOWN, GapReport
from core.gap.verdict_words import length_words

ROW_PX = 36
VALUE_PX = 68
"""Of the value behind a bar."""
LABEL_PX = 7
"""Of one letter of a label, about."""
MOST_CAUSES = 8
"""With a bar of their own."""
SAME = 0.02
"""Lengths that differ by less are drawn as one."""
TOGETHER, NAMED_ONLY = "Left with all of them", "Left by the corrected sim: causes that have a name"
FLOOR_NAMES = {
    "repeats": "Floor: repeated measurements scatter so",
    "sigma": "Floor: the noise as stated",
    "unknown": "Floor: estimated from the residuals",
}


def gap_steps_figure(report: GapReport, width_px: int = WIDE_PX) -> go.Figure:
    """Rms length of real minus sim on kept-out points, one bar a step, from top to bottom."""
    causes = report.causes if len(report.causes) <= MOST_CAUSES else report.causes[: MOST_CAUSES - 1]
    names, steps = [f"Sim as it is: {report.sim}"], [report.gap_rms_m]
    if report.calibration_matters:
        names.append(f"+ {CALIBRATION}")
        steps.append(report.within_calibration_rms_m)
    names += [f"+ {cause_words(cause)}" for cause in causes]
    steps += [cause.gap_after_rms_m for cause in causes]
    if len(causes) < len(report.causes):
        names.append(f"+ {len(report.causes) - len(causes)} other causes")
        steps.append(report.causes[-1].gap_after_rms_m)
    if abs(report.left_rms_m - steps[-1]) > SAME * report.left_rms_m:
        unnamed = any(cause.place.effect == UNKNOWN for cause in report.causes)
        names.append(NAMED_ONLY if unnamed else TOGETHER)
        steps.append(report.left_rms_m)
    names = _apart([_lines(name, width_px // 17) for name in [*names, FLOOR_NAMES[report.noise.floor_source]]])
    values = np.array([*steps, report.noise.floor_rms_m]) * 1e3
    colours = [VERMILLION, *([SKY] * (len(steps) - 2)), *([BLUE] if len(steps) > 1 else []), GREY]
    bars: Trace = {
        "type": "bar",
        "orientation": "h",
        "x": values,
        "y": names,
        "marker": {"color": colours},
        "text": [length_words(value * 1e-3) for value in values],
        "textposition": "outside",
        "cliponaxis": False,
        "showlegend": False,
        "hovertemplate": "%{y}: %{text}<extra></extra>",
    }
    floor: Trace = {
        "type": "scatter",
        "x": [values[-1]] * 2,
        "y": [names[0], names[-1]],
        "mode": "lines",
        "line": {"color": GREY, "width": 1.5, "dash": "dot"},
        "showlegend": False,
        "hoverinfo": "skip",
    }
    left_px = 16 + LABEL_PX * max(len(line) for name in names for line in name.split("<br>"))
    bars_px = max(width_px - left_px - 10, 2 * VALUE_PX)
    top = float(np.nanmax([*values, 1e-9])) * bars_px / (bars_px - VALUE_PX)
    y = {"type": "category", "autorange": "reversed", "zeroline": False, "ticks": "", "tickfont_size": 11.5}
    panel = Panel((bars, floor), y, {"range": [0.0, top], "nticks": 6})
    title = "How far the gap shrinks, on points that were kept out of the fit"
    figure = stacked(title, (panel,), "rms length [mm]", ROW_PX * len(names) + 14, width_px=width_px, legend_rows=0)
    figure.layout.margin.l = left_px
    figure.layout.bargap = 0.3
    return figure


def _lines(name: str, longest: int) -> str:
    """A label on two lines of so many letters at most, cut if it is longer."""
    lines = wrap(name, longest, max_lines=2, placeholder=" …") or [""]
    return "<br>".join(plain(line, longest) for line in lines)


def _apart(names: list[str]) -> list[str]:
    """Names that differ, for a scale of categories: what was cut to the same text gets a blank more."""
    out: list[str] = []
    for name in names:
        while name in out:
            name += "\u2009"
        out.append(name)
    return out
