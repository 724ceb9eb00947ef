"""How far the geometry is off its design: every parameter that was measured, with its uncertainty."""

import numpy as np
import pandas as pd
import plotly.graph_objects as go

from app.figures.sheet import Panel, beside
from app.figures.style import BLUE, GREY, VERMILLION, WIDE_PX, Trace
from core.calibration import Calibration
from core.report import parameters_table

GREEK = {"a": "a", "b": "b", "alpha": "α", "theta": "θ"}


def deviations_figure(calibration: Calibration) -> go.Figure | None:
    """Actual minus nominal of all measured parameters, lengths beside angles; None: the phi-model is not known."""
    table = parameters_table(calibration).frame
    table = table[~table["fixed"]]
    if table.empty:
        return None
    panels = tuple(_panel(table[table["unit"] == unit], unit, first=unit == "mm") for unit in ("mm", "deg"))
    rows = max((table["unit"] == "mm").sum(), (table["unit"] == "deg").sum())
    title = "Deviation from the design, ±2 standard uncertainties"
    figure = beside(title, panels, 22 * int(rows) + 12, width_px=WIDE_PX)
    figure.layout.margin.l = 40
    return figure


def _panel(part: pd.DataFrame, unit: str, first: bool) -> Panel:
    """The parameters that are lengths, or those that are angles."""
    names = np.array([f"{GREEK[row.parameter]}<sub>{row.frame}</sub>" for row in part.itertuples()], dtype=object)
    traces = tuple(
        _trace(part, names, (part["significant"] == significant).to_numpy(), first) for significant in (False, True)
    )
    y = {"categoryorder": "array", "categoryarray": names[::-1], "zeroline": False, "tickfont_size": 12}
    x = {"title": {"text": f"actual − nominal [{unit}]", "standoff": 6}, "zeroline": True}
    return Panel(traces, y, x | {"zerolinecolor": GREY, "zerolinewidth": 1.5})


def _trace(part: pd.DataFrame, names: np.ndarray, mine: np.ndarray, first: bool) -> Trace:
    significant = bool(part["significant"].to_numpy()[mine].all()) and mine.any()
    chosen = part[mine]
    name = "significant" if significant else "not significant"
    return {
        "type": "scatter",
        "x": chosen["difference"].to_numpy(),
        "y": names[mine],
        "error_x": {"type": "data", "array": 2 * chosen["std"].to_numpy(), "thickness": 1.4, "width": 4},
        "mode": "markers",
        "marker": {
            "color": VERMILLION if significant else BLUE,
            "symbol": "triangle-up" if significant else "circle-open",
            "size": 9 if significant else 7,
        },
        "name": name,
        "legendgroup": name,
        "showlegend": first,
        "hovertemplate": "%{y}: %{x:.4f} ± %{error_x.array:.4f} (2u)<extra></extra>",
    }
