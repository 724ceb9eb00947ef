"""Effects against joints: how much of the gap each would close alone, and which of them cannot be told apart."""

from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from app.figures.sheet import Panel, stacked
from app.figures.style import GREY, WIDE_PX, Trace, plain
from core.gap.place_words import NAMES, effect_name, place_words
from core.gap.result import Cell, GapReport, Place

ROW_PX = 22
FULL = (0.05, 0.1, 0.25, 0.5, 1.0)
STRONG = 0.5
"""From this part of the full colour on a cell is so dark that white is read on it."""
SCALE = [[0.0, "rgba(0, 114, 178, 0.07)"], [1.0, "rgba(0, 114, 178, 1)"]]
"""Sees the page through, so that it serves on dark and light ones."""
NOWHERE = "–"
"""The column of effects that sit at no joint."""


@dataclass(frozen=True)
class Grid:
    """The cells of the map by effect and joint; of several at one place (couplings) the one that closes most."""

    effects: tuple[str, ...]
    columns: tuple[str, ...]
    cells: dict[tuple[str, str], Cell]

    def spot(self, place: Place) -> tuple[str, str] | None:
        """Column and row of a place, as drawn; None: it is not in the map."""
        key = (place.effect, column_of(place))
        return (key[1], effect_name(place.effect)) if place.effect in self.effects and key[1] in self.columns else None


def gap_map_figure(report: GapReport, width_px: int = WIDE_PX) -> go.Figure | None:
    """The map; None: there is nothing to show in it."""
    grid = _grid(report)
    if not grid.effects:
        return None
    full = _full(grid)
    traces = [_shares(grid, full), *_links(report, grid), *_marks(report, grid, full)]
    names = [effect_name(effect) for effect in grid.effects]
    y = {"type": "category", "categoryorder": "array", "categoryarray": names, "autorange": "reversed"}
    x = {"type": "category", "categoryorder": "array", "categoryarray": list(grid.columns), "showgrid": False}
    panel = Panel(tuple(traces), y | {"showgrid": False, "zeroline": False, "ticks": ""}, x | {"ticks": ""})
    title = "Share of the gap that each effect would close alone"
    axis = "joint, or the link or frame behind it (– : no joint)"
    figure = stacked(title, (panel,), axis, ROW_PX * len(names) + 8, width_px=width_px, legend_rows=0)
    figure.layout.margin.l = 150
    figure.layout.margin.r = 70
    return figure


def column_of(place: Place) -> str:
    """The column in which a place stands."""
    where = place.joint if place.frame is None else place.frame
    return NOWHERE if where is None else str(where)


def _grid(report: GapReport) -> Grid:
    cells: dict[tuple[str, str], Cell] = {}
    for cell in report.evidence_map:
        key = (cell.place.effect, column_of(cell.place))
        if key not in cells or cell.share_closed > cells[key].share_closed:
            cells[key] = cell
    there = {effect for effect, _ in cells}
    if there:
        there = {place.effect for place in _places(report)}
    effects = [*(e for e in NAMES if e in there), *sorted(there - set(NAMES))]
    columns = [str(k) for k in range(1, report.campaign.robot.joint_count + 1)]
    others = [NOWHERE] if NOWHERE in {column_of(place) for place in _places(report)} else []
    return Grid(tuple(effects), tuple([*columns, *others]), cells)


def _places(report: GapReport) -> list[Place]:
    """Every place that has a cell or is a cause, or a twin of one."""
    causes = [place for cause in report.causes for place in (cause.place, *cause.twins)]
    return [*(cell.place for cell in report.evidence_map), *causes]


def _full(grid: Grid) -> float:
    """The share that is drawn in full colour: where all effects close little, the best of them are still to be seen."""
    best = max((np.nan_to_num(cell.share_closed) for cell in grid.cells.values()), default=0.0)
    return next((share for share in FULL if best <= share), 1.0)


def _shares(grid: Grid, full: float) -> Trace:
    share = np.full((len(grid.effects), len(grid.columns)), np.nan)
    words = np.full(share.shape, "", dtype=object)
    for i, effect in enumerate(grid.effects):
        for j, column in enumerate(grid.columns):
            cell = grid.cells.get((effect, column))
            if cell is not None:
                share[i, j] = np.clip(np.nan_to_num(cell.share_closed), 0.0, 1.0)
                words[i, j] = f"{plain(place_words(cell.place), 60)}<br>log odds {cell.evidence:.1f}"
    return {
        "type": "heatmap",
        "x": list(grid.columns),
        "y": [effect_name(effect) for effect in grid.effects],
        "z": share,
        "customdata": words,
        "zmin": 0.0,
        "zmax": full,
        "colorscale": SCALE,
        "xgap": 2,
        "ygap": 2,
        "hoverongaps": False,
        "colorbar": {"tickformat": ".0%", "thickness": 10, "len": 1.0, "outlinewidth": 0, "tickfont": {"size": 10}},
        "hovertemplate": "%{customdata}<br>closes %{z:.0%} of the gap alone<extra></extra>",
    }


def _links(report: GapReport, grid: Grid) -> list[Trace]:
    """A line from every cause to each of its twins."""
    out: list[Trace] = []
    for cause in report.causes:
        ends = [grid.spot(place) for place in cause.twins]
        for end in ends[1:]:
            if ends[0] is not None and end is not None:
                out.append(
                    {
                        "type": "scatter",
                        "x": [ends[0][0], end[0]],
                        "y": [ends[0][1], end[1]],
                        "mode": "lines",
                        "line": {"color": GREY, "width": 1.5, "dash": "dot"},
                        "hoverinfo": "skip",
                        "showlegend": False,
                    }
                )
    return out


def _marks(report: GapReport, grid: Grid, full: float) -> list[Trace]:
    """The numbers of causes where they stand; with a question mark where only a twin of them does."""
    numbers: dict[tuple[str, str], list[str]] = {}
    certain, dark = set(), set()
    for number, cause in enumerate(report.causes, 1):
        for place in cause.twins or (cause.place,):
            spot = grid.spot(place)
            if spot is None:
                continue
            numbers.setdefault(spot, []).append(str(number))
            cell = grid.cells.get((place.effect, spot[0]))
            if cell is not None and cell.share_closed >= STRONG * full:
                dark.add(spot)
            if place == cause.place:
                certain.add(spot)
    texts = {spot: f"{','.join(all_)}{'' if spot in certain else '?'}" for spot, all_ in numbers.items()}
    groups = ((dark, {"color": "white"}), (texts.keys() - dark, {}))
    return [_texts({s: t for s, t in texts.items() if s in group}, look) for group, look in groups]


def _texts(marks: dict[tuple[str, str], str], look: dict) -> Trace:
    return {
        "type": "scatter",
        "x": [column for column, _ in marks],
        "y": [row for _, row in marks],
        "text": [f"<b>{text}</b>" for text in marks.values()],
        "mode": "text",
        "textfont": {"size": [13 if len(text) < 4 else 10 for text in marks.values()] or 13, **look},
        "hoverinfo": "skip",
        "showlegend": False,
    }
