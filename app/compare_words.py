"""Small pieces of HTML about the comparison of methods."""

from html import escape

import numpy as np

from app.words import block
from core.rivals.comparison import Comparison, MethodRow
from core.rivals.verdict import verdicts
from core.wording import typeset

INTRO = (
    "<h3>Compare methods</h3><p>This project's ways to calibrate and the literature's, on the same <b>simulated</b> "
    "IRB L6 with the same number of measured points and the same noise, judged on poses that none has seen. It is "
    "about the methods and not about your session.</p><p class='soft'>It runs beside the dashboard, some seconds a "
    "trial; more trials average luck out.</p>"
)


def intro_words() -> str:
    """What it is, and what to do."""
    return block(INTRO, "compare-intro")


def progress_words(done: int, trials: int) -> str:
    """How far it is."""
    return block(f"<p class='soft'>Trial {min(done + 1, trials)} of {trials} …</p>", "compare-progress")


def verdict_words(found: Comparison | None, why_not: str) -> str:
    """What the comparison comes to, also where this project loses."""
    text = f"<p class='bad'>{escape(why_not)}</p>" if why_not else ""
    if found is None:
        return block(text or "<p class='soft'>Press <b>Compare</b>.</p>", "compare-verdict")
    count = f"<p><b>{found.trials}</b> trial{'' if found.trials == 1 else 's'}, {found.poses} kept-out poses each.</p>"
    sentences = "".join(f"<p>{escape(typeset(sentence))}</p>" for sentence in verdicts(found))
    return block(text + count + sentences, "compare-verdict")


def table_words(found: Comparison | None) -> str:
    """Every method, the smallest error first, then what to read it against."""
    if found is None:
        return block("", "compare-table")
    heads = ("mean, mm", "p95", "mean, mrad", "lengths, mm", "s")
    head = "<tr><th>Method</th>" + "".join(f"<th class='n'>{name}</th>" for name in heads) + "</tr>"
    ordered = sorted(found.rows, key=lambda row: row.position_m.mean)
    body = "".join(_row(row) for row in ordered)
    against = "".join(
        f"<tr><td>{escape(one.name)}</td>{_number(one.position_m * 1e3, 2)}<td></td>"
        f"{_number(one.orientation_rad * 1e3, 1)}<td></td><td></td></tr>"
        for one in found.references
    )
    note = (
        "<p class='soft'>Position errors (mean, 95th percentile) and mean orientation errors over the kept-out poses; "
        "rms error of the phi-model's lengths; seconds of one calibration. Bold: this project's and the paper's.</p>"
    )
    notes = "".join(f"<p class='soft'>{escape(typeset(one))}</p>" for one in found.notes)
    look = "font-size:12px"
    table = f"<table style='{look}'>{head}{body}<tr><th>To be read against</th></tr>{against}</table>"
    return block(table + note + notes, "compare-table")


def _row(row: MethodRow) -> str:
    name = escape(f"{row.label} ({row.data})" if row.points else row.label)
    numbers = (
        _number(row.position_m.mean * 1e3, 2),
        _number(row.position_m.p95 * 1e3, 2),
        _number(row.orientation_rad.mean * 1e3, 1),
        _number(row.length_error_m * 1e3, 2),
        _number(row.seconds, 2),
    )
    return f"<tr><td>{f'<b>{name}</b>' if row.own else name}</td>{''.join(numbers)}</tr>"


def _number(value: float, digits: int) -> str:
    return f"<td class='n'>{value:.{digits}f}</td>" if np.isfinite(value) else "<td></td>"
