"""Small pieces of HTML for the dashboard's panels. Whatever comes from people or files is escaped here."""

from html import escape

import numpy as np

from app.clicks import listening, saying
from app.spots import spot_of
from app.workbench import SweepProgress
from core.findings import Finding
from core.live_sweep import LiveSweep, Verdict
from core.robot import Robot
from core.session_state import Shot, State

STYLE = """<style>
.ta{font-size:13px;line-height:1.45;padding:0 10px;overflow-wrap:anywhere}
.ta h3{margin:0 0 4px;font-size:15px}.ta p{margin:4px 0}
.ta table{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums}
.ta th{font-weight:600;text-align:left;border-bottom:1px solid var(--mantine-color-default-border);padding:2px 5px}
.ta td{padding:2px 5px;border-bottom:1px solid var(--mantine-color-default-border)}
.ta td:first-child{overflow-wrap:normal}
.ta td.n,.ta th.n{text-align:right}.ta tr.now td{font-weight:700;background:rgba(0,114,178,.13)}
.ta .ok{color:#009E73}.ta .doubt{color:#B07A00}.ta .bad{color:#D55E00}.ta .soft{opacity:.7}
.ta code{font-size:12px;user-select:all;overflow-wrap:anywhere}
.ta .verdict{font-size:16px;font-weight:700}
</style>"""
VERDICT_LOOK = {
    Verdict.KEEP: ("ok", "✔ keep", "It lies where the other shots of this sweep let expect it."),
    Verdict.DOUBTFUL: (
        "doubt",
        "? doubtful",
        "Noise alone puts a shot so far out less than once in fifty. Look, then decide.",
    ),
    Verdict.AGAIN: ("bad", "✖ measure again", "Noise alone does not put a shot so far out."),
    Verdict.EARLY: ("soft", "… too early to say", "Five shots of a sweep are needed before one can be judged."),
}


def block(inner: str, test_id: str) -> str:
    """A piece of the page with the common look and an anchor for tests."""
    return f"<div class='ta' data-testid='{escape(test_id)}'>{inner}</div>"


def step_words(state: State, robot: Robot) -> str:
    """What to do now: the command to send, what to aim at, and what comes next."""
    step = state.next_step
    if step is None:
        done = "Every planned shot is done. Go to <b>Solve</b>." if state.shots else "Nothing is planned yet."
        return block(f"<h3>Nothing left to measure</h3><p>{done}</p>", "step")
    row = next(r for r in state.plan.sweeps if (r.joint, r.sweep) == (step.joint, step.sweep))
    commands = ", ".join(_command(robot, k, value) for k, value in enumerate(step.commanded))
    held = robot.coupling_from(step.joint)
    why = (
        f"Joint {held.target} gets its nominal passive motion, so that its motor stands still. "
        if held is not None
        else ""
    )
    return block(
        f"<h3>Joint {step.joint}: stop {step.step + 1} of {row.stops}, target {escape(step.target)}</h3>"
        f"<p>Send the robot to<br><code data-testid='command'>{commands}</code></p>"
        f"<p class='soft'>{why}All other motors are held. Then press <b>Measure</b> (Space).</p>",
        "step",
    )


def sweeps_table(rows: tuple[SweepProgress, ...]) -> str:
    """Table 1 as a living table."""
    body = "".join(
        f"<tr class='{'now' if row.current else ''}'><td>{row.planned.joint}</td><td class='n'>"
        f"{np.rad2deg(row.planned.high - row.planned.low):.0f}°</td><td class='n'>{row.planned.stops}</td>"
        f"<td>{escape(', '.join(row.planned.targets))}</td><td class='n'>{row.done}</td>"
        f"<td class='n'>{max(row.planned.shots - row.done, 0)}</td><td>{_state_of(row)}</td></tr>"
        for row in rows
    )
    numbers = "".join(f"<th class='n'>{name}</th>" for name in ("Done", "To do"))
    head = f"<tr><th>Joint</th><th class='n'>Span</th><th class='n'>Stops</th><th>Targets</th>{numbers}<th></th></tr>"
    return block(f"<table data-testid='table1'>{head}{body}</table>", "sweeps")


def verdict_words(live: LiveSweep, shots: tuple[Shot, ...], joint: int) -> str:
    """The last shot's worth, and what is known if one stops now."""
    if not shots:
        return block("<p class='soft'>No shot of this sweep yet. Press <b>Measure</b>.</p>", "verdict")
    look, words, why = VERDICT_LOOK[live.last]
    text = f"<p class='verdict {look}'>{words}</p><p class='soft'>{why}</p>"
    if live.fit is None:
        text += f"<p>{len(shots)} of at least 4 shots: the axis of joint {joint} is not defined yet.</p>"
    else:
        fit, k = live.fit, len(shots) - 1
        mm = 1e3 * fit.noise_factor
        text += (
            f"<p>Last shot: axial <b>{fit.axial_m[k] * 1e3:+.2f} mm</b>, "
            f"radial <b>{fit.radial_m[k] * 1e3:+.2f} mm</b>; the sweep scatters by {fit.sigma_m * mm:.2f} mm.</p>"
            f"<p>If you stop now: direction of axis {joint} known to "
            f"<b>{_std(fit.direction_std_rad * mm)} mrad</b>, its place to <b>{_std(fit.point_std_m * mm)} mm</b>.</p>"
        )
    return block(text, "verdict")


def findings_words(findings: tuple[Finding, ...]) -> str:
    """Findings as a list, significant ones marked by sign and colour; a click shows where it is."""
    items = "".join(_finding(finding) for finding in findings)
    return block(listening(f"<ul style='padding-left:18px;margin:4px 0'>{items}</ul>"), "findings")


def _finding(finding: Finding) -> str:
    spot = spot_of(finding)
    where = "" if spot is None else saying(spot.word, "Show it in 3-D")
    look, sign = ("bad", "▲") if finding.significant else ("soft", "○")
    return f"<li class='{look}' {where}>{sign} {escape(finding.text)}</li>"


def _command(robot: Robot, k: int, value: float) -> str:
    if robot.joints[k].slides:
        return f"q{k + 1} = {value * 1e3:.3f} mm"
    return f"q{k + 1} = {np.rad2deg(value):.4f}°"


def _state_of(row: SweepProgress) -> str:
    if row.finished:
        return "<span class='ok'>✔ done</span>"
    return "<b>▶ now</b>" if row.current else "<span class='soft'>to do</span>"


def _std(value: float) -> str:
    return f"{value:.2g}" if value < 100 else f"{value:.0f}"
