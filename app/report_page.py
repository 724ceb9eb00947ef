"""A report as a page: sections of sentences, tables and figures, and how they become one file of HTML.

The page needs nothing but itself: style, logo, figures and plotly's program are written into it. Everything that comes
from a file is escaped, by the template or here.
"""

import json
from dataclasses import dataclass, field
from functools import lru_cache

import jinja2
import plotly.graph_objects as go
from plotly.offline import get_plotlyjs

from app.figures.style import CONFIG
from app.paths import static_folder
from core.version import VERSION

MOST_ROWS_TOGETHER = 28
"""A table with no more rows than this is not parted by the end of a sheet."""


@dataclass(frozen=True)
class Cell:
    """One cell of a table that is shown."""

    text: str
    tail: str = ""
    """The decimals of a number with their point; they stand in a column of their own, so that points are aligned."""
    tail_width: int = 0
    """Most decimals of any number in this column."""
    numeric: bool = False
    mark: str = ""
    """Name of a style: ``significant``, ``muted``."""
    rows: int = 1
    columns: int = 1
    heading: bool = False


@dataclass(frozen=True)
class Heading:
    """The head of a column."""

    text: str
    help: str = ""
    numeric: bool = False


@dataclass(frozen=True)
class ShownTable:
    """A table as it is shown; each group of rows stays on one sheet of paper."""

    caption: str
    headings: tuple[Heading, ...]
    groups: tuple[tuple[tuple[Cell, ...], ...], ...]
    note: str = ""
    dense: bool = False

    @property
    def style(self) -> str:
        """Names of styles: a short table is kept on one sheet of paper."""
        short = sum(len(group) for group in self.groups) <= MOST_ROWS_TOGETHER
        return " ".join(["table", *(["dense"] if self.dense else []), *(["together"] if short else [])])


@dataclass(frozen=True)
class Plot:
    """A figure with a caption."""

    figure: go.Figure
    caption: str
    switches: tuple[str, ...] = ()
    """Boxes beside the figure, each with what it adds: the trace whose ``meta`` has the sum of 2^k over the ticked
    boxes k as its ``mask`` is shown, and no other that has one."""

    @property
    def json(self) -> str:
        """The figure for a script element: no character of it can end the element."""
        return _harmless(self.figure.to_json())

    @property
    def size(self) -> str:
        return f"width:{self.figure.layout.width}px;height:{self.figure.layout.height}px"


@dataclass(frozen=True)
class Item:
    """One line of a list."""

    text: str
    significant: bool = False


@dataclass(frozen=True)
class Section:
    """A part of the report."""

    id: str
    title: str
    paragraphs: tuple[str, ...] = ()
    items: tuple[Item, ...] = ()
    minor_title: str = ""
    minor_items: tuple[str, ...] = ()
    tables: tuple[ShownTable, ...] = ()
    scene: str = ""
    """A document of HTML that is shown in a frame of its own, as soon as a reader comes to it."""
    plots: tuple[Plot, ...] = ()
    tables_after: tuple[ShownTable, ...] = ()
    terms: tuple[tuple[str, str], ...] = ()

    @property
    def scene_json(self) -> str:
        """The scene for a script element."""
        return _harmless(json.dumps(self.scene))


@dataclass(frozen=True)
class Page:
    """A whole report."""

    kind: str
    title: str
    badge: str
    summary: tuple[str, ...]
    facts: tuple[tuple[str, str], ...]
    sections: tuple[Section, ...]
    figures: tuple[tuple[str, str], ...] = field(default=())
    """Key numbers on top: label and value."""
    lead: str = ""
    """The one sentence that stands before everything else."""

    @property
    def has_scene(self) -> bool:
        return any(section.scene for section in self.sections)


def page_html(page: Page) -> str:
    """The page as one self-contained file."""
    static = static_folder()
    return _template().render(
        page=page,
        version=VERSION,
        css=(static / "report.css").read_text(encoding="utf-8"),
        sheet=_css_string(f"{page.kind}: {page.title}"[:90]),
        logo=(static / "logo.svg").read_text(encoding="utf-8"),
        plotly=_plotly_script() if any(s.plots for s in page.sections) else "",
        config=json.dumps(CONFIG),
    )


@lru_cache(maxsize=1)
def _template() -> jinja2.Template:
    loader = jinja2.FileSystemLoader(static_folder())
    return jinja2.Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True).get_template(
        "report.html.j2"
    )


@lru_cache(maxsize=1)
def _plotly_script() -> str:
    return get_plotlyjs()


def _harmless(text: str) -> str:
    """JSON for a script element: no character of it can end the element."""
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _css_string(text: str) -> str:
    """A string of CSS that holds any text: whatever is not a letter, digit or space is written as its number."""
    return "".join(c if c.isascii() and (c.isalnum() or c == " ") else f"\\{ord(c):x} " for c in text)
