"""How far the geometry is off its design: every parameter that was measured, with its uncertainty."""

import numpy as np
import pandas as pd
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from app.figures.style import BLUE, GREY, VERMILLION, WIDE_PX, styled
from core.calibration import Calibration
from core.report import parameters_table

GREEK = {"a": "a", "b": "b", "alpha": "α", "theta": "θ"}


def deviations_figure(calibration: Calibration) -> go.Figure | None:
    """Actual minus nominal of all measured parameters, lengths beside angles; None: the phi-model is not known."""
    table = parameters_table(calibration).frame
    table = table[~table["fixed"]]
    if table.empty:
        return None
    figure = make_subplots(rows=1, cols=2, horizontal_spacing=0.12)
    for column, unit in enumerate(("mm", "deg"), 1):
        part = table[table["unit"] == unit]
        names = [f"{GREEK[row.parameter]}<sub>{row.frame}</sub>" for row in part.itertuples()]
        for significant in (False, True):
            mine = (part["significant"] == significant).to_numpy()
            figure.add_trace(_trace(part, np.array(names, dtype=object), mine, column == 1), row=1, col=column)
        figure.update_yaxes(categoryorder="array", categoryarray=names[::-1], row=1, col=column)
        figure.update_xaxes(title_text=f"actual − nominal [{unit}]", title_standoff=6, row=1, col=column)
    rows = max((table["unit"] == "mm").sum(), (table["unit"] == "deg").sum())
    styled(figure, "Geometry: deviation from the design, with ±2 standard uncertainties", 22 * int(rows) + 12, WIDE_PX)
    figure.update_xaxes(zeroline=True, zerolinecolor=GREY, zerolinewidth=1.5)
    figure.update_yaxes(zeroline=False, tickfont_size=12)
    figure.update_layout(margin={"l": 40})
    return figure


def _trace(part: pd.DataFrame, names: np.ndarray, mine: np.ndarray, first: bool) -> go.Scatter:
    significant = bool(part["significant"].to_numpy()[mine].all()) and mine.any()
    chosen = part[mine]
    return go.Scatter(
        x=chosen["difference"].to_numpy(),
        y=names[mine],
        error_x={"type": "data", "array": 2 * chosen["std"].to_numpy(), "thickness": 1.4, "width": 4},
        mode="markers",
        marker={
            "color": VERMILLION if significant else BLUE,
            "symbol": "triangle-up" if significant else "circle-open",
            "size": 9 if significant else 7,
        },
        name="significant" if significant else "not significant",
        legendgroup="significant" if significant else "not significant",
        showlegend=first,
        hovertemplate="%{y}: %{x:.4f} ± %{error_x.array:.4f} (2u)<extra></extra>",
    )
