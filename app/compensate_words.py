"""Small pieces of HTML about compensated poses. Whatever comes from people or files is escaped here."""

from html import escape

import numpy as np

from app.compensate_bench import Compensated
from app.words import block
from core.compensation import OK
from core.units import displacement_units, from_si

MOST_ROWS = 200
LONGEST_NAME = 24
REACHED = ("x, mm", "y", "z", "miss without, mm", "mrad", "miss with, µm", "µrad")
INTRO = (
    "<h3>Compensate poses</h3><p>Poses that you want, in; commands that make the calibrated arm take them, out. Paste "
    "a table with its header (commas, or copied from a spreadsheet), or send a CSV file, then press "
    "<b>Compensate</b>.</p>"
    "<p class='soft'>Columns: pose (optional), x_mm, y_mm, z_mm; qw, qx, qy, qz or rx_deg, ry_deg, rz_deg; q1_deg, ... "
    "near which the arm is to stay (optional).</p>"
)


def intro_words() -> str:
    """What to do."""
    return block(INTRO, "compensate-intro")


def summary_words(last: Compensated | None, outdated: bool) -> str:
    """How many poses can be had, and what compensation changes."""
    if last is None:
        return block(
            "<p class='soft'>Nothing is compensated yet. <b>Fill in test poses</b> gives an example.</p>", "compensated"
        )
    ok, count = int(last.found.ok.sum()), len(last.found.status)
    look = "ok" if ok == count else "doubt" if ok else "bad"
    text = f"<p class='verdict {look}' data-testid='compensated-count'>{ok} of {count} poses</p>"
    before, after = last.effect.nominal, last.effect.compensated
    if ok:
        rows = "".join(
            f"<tr><td>{name}</td>{_mean(misses.mean_position_m)}{_mean(misses.mean_rotation_rad)}</tr>"
            for name, misses in (("nominal commands", before), ("compensated commands", after))
        )
        head = "<tr><th>Mean miss, predicted</th><th class='n'>mm</th><th class='n'>mrad</th></tr>"
        text += f"<table>{head}{rows}</table>"
        text += (
            "<p class='soft'>As the calibration predicts it: the first row is what you would miss without it. How well "
            "the prediction holds shows under <b>Verify</b>.</p>"
        )
    if outdated:
        text += "<p class='doubt'>These commands are of an earlier solution: compensate again.</p>"
    return block(text, "compensated")


def table_words(last: Compensated | None) -> str:
    """Commanded and reached, row by row; what cannot be had is named."""
    if last is None:
        return block("", "compensated-table")
    rows = range(min(len(last.found.status), MOST_ROWS))
    more = len(last.found.status) - len(rows)
    note = "<p class='soft'>Orientations to be commanded stand in the file"
    note += f", and {more} more poses.</p>" if more else ".</p>"
    commands = _table(_heads(last), [_command_cells(last, k) for k in rows])
    reached = _table(REACHED, [_reached_cells(last, k) for k in rows])
    return block(
        f"<h3>To be commanded</h3>{commands}<h3 style='margin-top:14px'>Reached, as the calibration predicts it</h3>"
        f"{reached}{note}",
        "compensated-table",
    )


def _heads(last: Compensated) -> tuple[str, ...]:
    robot = last.arm.nominal
    joints = (f"q{i + 1}, {displacement_units(robot.joints[i].slides)[0]}" for i in np.flatnonzero(robot.commanded))
    return "x, mm", "y", "z", *joints


def _table(heads: tuple[str, ...], rows: list[str]) -> str:
    head = "<tr><th>Pose</th>" + "".join(f"<th class='n'>{name}</th>" for name in heads) + "</tr>"
    look = "white-space:nowrap;font-size:11.5px"
    return f"<div style='overflow-x:auto'><table style='{look}'>{head}{''.join(rows)}</table></div>"


def _command_cells(last: Compensated, k: int) -> str:
    if last.found.status[k] != OK:
        said = escape(last.found.status[k])
        return f"<tr><td>{_name(last, k)}</td><td colspan='12' class='bad' style='white-space:normal'>{said}</td></tr>"
    robot = last.arm.nominal
    numbers = [_number(value * 1e3, 2) for value in last.found.pose[k, :3, 3]]
    for i in np.flatnonzero(robot.commanded):
        unit = displacement_units(robot.joints[i].slides)[0]
        numbers.append(_number(from_si(float(last.found.commanded[k, i]), unit), 3))
    return f"<tr><td>{_name(last, k)}</td>{''.join(numbers)}</tr>"


def _reached_cells(last: Compensated, k: int) -> str:
    effect = last.effect
    numbers = [_number(value * 1e3, 2) for value in effect.reached[k, :3, 3]]
    numbers += [_number(effect.nominal.position_m[k] * 1e3, 3), _number(effect.nominal.rotation_rad[k] * 1e3, 3)]
    numbers += [_tiny(effect.compensated.position_m[k] * 1e6), _tiny(effect.compensated.rotation_rad[k] * 1e6)]
    return f"<tr><td>{_name(last, k)}</td>{''.join(numbers)}</tr>"


def _name(last: Compensated, k: int) -> str:
    name = last.table.names[k]
    return escape(name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 1]}…")


def _mean(value: float) -> str:
    if not np.isfinite(value):
        return "<td class='n'>–</td>"
    return "<td class='n'>&lt; 0.001</td>" if value < 1e-6 else f"<td class='n'>{value * 1e3:.3g}</td>"


def _tiny(value: float) -> str:
    """Rounding is not worth its digits."""
    return "<td class='n'>&lt; 0.001</td>" if value < 1e-3 else _number(value, 3)


def _number(value: float, digits: int) -> str:
    return f"<td class='n'>{value:z.{digits}f}</td>" if np.isfinite(value) else "<td class='n'>–</td>"
