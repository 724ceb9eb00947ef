"""Small pieces of HTML about one shot of a solution, and what leaving it out does."""

from html import escape

import numpy as np

from app.solve_words import changes_list
from app.words import block
from core.calibration import Calibration
from core.session_state import Shot
from core.solve_figures import Change
from core.wording import fixed

HINT = "<p class='soft'>Click a point in 3-D to leave it out and see what that changes.</p>"


def chosen_words(shot: Shot, found: Calibration) -> str:
    """Which shot is chosen, how far the solution misses it, and whether it counts."""
    taken = shot.taken
    text = f"<p><b>Record {shot.record}</b>: joint {taken.joint}, stop {taken.step + 1}, target {escape(taken.target)}"
    text += f"{_residual(shot.record, found)}</p>"
    if shot.verdict == "excluded":
        reason = f": {escape(shot.reason)}" if shot.reason else ""
        text += f"<p class='bad'><b>Excluded</b>{reason}. It is kept, but no fit uses it.</p>"
    elif shot.superseded_by is not None:
        text += "<p class='doubt'>It was measured again; the newer shot counts.</p>"
    return block(text, "chosen")


def effect_words(what: str, changed: tuple[Change, ...]) -> str:
    """What a decision did to the solution; ``what``: the decision, for the heading."""
    rest = "Everything else" if changed else "Every number"
    text = f"<h3>{escape(what)}: what changed</h3>{changes_list(changed)}"
    text += f"<p class='soft'>{rest} moved by less than a tenth of its uncertainty u.</p>"
    return block(text, "effect")


def _residual(record: int, found: Calibration) -> str:
    residuals = found.refinement.residuals
    rows = np.flatnonzero(found.campaign.measurements.record[residuals.row] == record)
    if len(rows) == 0:
        return ". It is not in the solution"
    parts = [
        f"{name} {_signed(float(values[rows[0]]) * 1e3)}"
        for name, values in (
            ("axial", residuals.axial_m),
            ("radial", residuals.radial_m),
            ("tangential", residuals.tangential_m),
        )
    ]
    used = "" if residuals.used[rows[0]] else "; the fit has rejected it"
    return f".<br>Residual {', '.join(parts)} mm{used}"


def _signed(value: float) -> str:
    text = fixed(value, 2)
    return text if value < 0 or float(text) == 0 else f"+{text}"
