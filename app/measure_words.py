"""Small pieces of HTML for the measuring panel. Whatever comes from people or files is escaped here."""

from collections.abc import Mapping, Sequence
from html import escape
from types import MappingProxyType

import numpy as np

from app.clicks import listening, saying
from app.event_words import event_words, stop_words
from app.glossary import term
from app.sweep_progress import SweepProgress
from app.words import block
from core.live_sweep import Verdict
from core.robot import Robot
from core.session_events import Event
from core.session_live import Expected, SweepSoFar
from core.session_plan import PlannedSweep, Step
from core.session_state import Shot, State
from core.wording import decimals_for, display_unit, fixed, two_digits

SWEEP_WORD = "sweep-"
"""What a row of the table says when it is clicked, before joint and sweep: ``sweep-6-1``."""
SHOT_WORD = "shot-"
"""What a shot in the table says when it is clicked, before its id."""
MOST_TOLD = 4
"""Shots of one sweep that are named in the table."""
COPY = (
    "const t=this.dataset.copy,ok=()=>{this.textContent='copied';setTimeout(()=>this.textContent='copy',1500)};"
    "if(navigator.clipboard)navigator.clipboard.writeText(t).then(ok);"
    "else{const a=document.createElement('textarea');a.value=t;document.body.append(a);a.select();"
    "document.execCommand('copy');a.remove();ok()}"
)
"""A page that is not of this machine has no clipboard of its own, hence the second way."""
LOOKS = {
    Verdict.KEEP: ("ok", "✔ keep", "It lies where the other shots of this sweep let expect it."),
    Verdict.DOUBTFUL: (
        "doubt",
        "? doubtful",
        "Noise alone puts a shot so far out less than once in fifty. Look at target and robot; then keep it, measure "
        "it again or exclude it.",
    ),
    Verdict.AGAIN: (
        "bad",
        "✖ measure again",
        "Noise alone does not put a shot so far out. Press R to measure it again, or exclude it with the reason.",
    ),
    Verdict.EARLY: (
        "soft",
        "… too early to say",
        "A few more shots of this sweep are needed before one can be judged.",
    ),
}


def step_words(state: State, robot: Robot, by_hand: bool, expected: Expected | None, aims: Sequence[str] = ()) -> str:
    """What to do now, why, and what comes next.

    Args:
        by_hand: whether a person moves the robot and reads the instrument.
        expected: where the target should be seen.
        aims: sentences about how to aim there.
    """
    step = state.next_step
    if step is None:
        return block(_nothing_left(state), "step")
    row = _row_of(state, step)
    way = (
        f", {term('return pass' if step.sense < 0 else 'forward pass', 'Forward, return pass')}"
        if row.both_ways
        else ""
    )
    return block(
        f"<h3>Joint {step.joint}: stop {step.step + 1} of {row.stops}, target {escape(step.target)}{way}</h3>"
        f"<p>{'Send the robot to' if by_hand else 'The robot goes to'} "
        f"<button class='ta-copy' data-copy='{_plain(robot, step)}' onclick=\"{COPY}\">copy</button><br>"
        f"<code data-testid='command'>{_commands(robot, step)}</code></p>"
        f"{_before(robot, step, by_hand)}{_expected(expected, aims)}"
        f"<p class='soft'>{_why(robot, step)}{_next(state, step, by_hand)}</p>",
        "step",
    )


def sweeps_table(
    rows: tuple[SweepProgress, ...],
    robot: Robot,
    wrong: Mapping[tuple[int, int], Sequence[Shot]] = MappingProxyType({}),
) -> str:
    """Table 1 as a living table; a click on a row goes on there.

    Args:
        rows: one for each sweep.
        robot: the nominal one.
        wrong: by joint and sweep, the shots that are to be measured again; a click chooses one.
    """
    if not rows:
        text = "No sweep is planned. Open <b>1 Cell</b>, <b>Sweeps</b>, and press <b>Suggest all</b>."
        return block(f"<p class='soft'>{text}</p>", "sweeps")
    body = "".join(_table_row(row, robot, wrong.get((row.planned.joint, row.planned.sweep), ())) for row in rows)
    several = any(row.planned.sweep > 1 for row in rows)
    names = (
        ("Joint", "", ""),
        ("Span", "Span", "n"),
        ("Step", "", "n"),
        ("Stops", "Stop", "n"),
        ("Targets", "Target", ""),
        ("Done", "", "n"),
        ("To do", "", "n"),
        ("", "", ""),
    )
    head = "".join(f"<th class='{look}'>{term(name, key) if key else name}</th>" for name, key, look in names)
    hint = "<p class='soft'>Click a row to go on with that sweep" + (", k.2 is sweep 2 of joint k" if several else "")
    return block(listening(f"<table data-testid='table1'><tr>{head}</tr>{body}</table>") + f"{hint}.</p>", "sweeps")


def verdict_words(so_far: SweepSoFar | None, slides: bool, tool_std_m: float | None, state: State) -> str:
    """The last shot's worth, and what is known if one stops now.

    Args:
        so_far: the sweep of the last shot; None: there is no shot.
        slides: whether its joint slides.
        tool_std_m: standard uncertainty of the axis' place at the tool; None: not known.
        state: of the session, for the plan and what the instrument promises.
    """
    stated_m = state.instrument.sigma_m
    if so_far is None:
        return block("<p class='soft'>No shot yet. Press <b>Measure</b>.</p>", "verdict")
    live, count = so_far.live, len(so_far.shots)
    if not count:
        return block("<p class='soft'>No shot of this sweep shows its axis yet. Press <b>Measure</b>.</p>", "verdict")
    look, words, why = LOOKS[live.last]
    text = f"<p class='verdict {look}'>{words}</p><p class='soft'>{why}</p>"
    if live.fit is None:
        return block(text + f"<p>{_not_defined(so_far, slides)}</p>", "verdict")
    fit, k = live.fit, count - 1
    scatter = fit.sigma_m * fit.noise_factor
    shot, digits = so_far.shots[k].taken, decimals_for(scatter * 1e3)
    which = f"{stop_words(shot, state)} of joint {so_far.joint}"
    text += f"<p>{which[:1].upper()}{which[1:]}: {_residuals(so_far, k, digits)}; "
    text += f"{term('predicted', 'Noise σ')} ±{fixed(scatter * 1e3, digits)} mm each"
    text += "" if np.isnan(live.chances[k]) else f", {term('chance', 'Chance')} {_percent(live.chances[k])}"
    text += ".</p>"
    if stated_m is not None and scatter > 1.5 * stated_m and fit.degrees_of_freedom > 8:
        text += (
            f"<p class='soft'>The sweep scatters {scatter / stated_m:.1f} times as much as the "
            f"{term('stated noise', 'Stated noise')} of {two_digits(stated_m * 1e3)} mm: the arm's own "
            "repeatability shows, if <b>Check</b> found the instrument as promised.</p>"
        )
    return block(text + _if_you_stop(so_far, tool_std_m), "verdict")


def undo_words(event: Event | None, state: State) -> str:
    """What an undo would take back."""
    if event is None:
        return block("<p class='soft'>Nothing to undo.</p>", "undo")
    return block(f"<p class='soft'>Undo takes back: {escape(event_words(event, state))}.</p>", "undo")


def shot_words(shot: Shot | None, chosen: bool, state: State) -> str:
    """One shot: which, where, and what became of it."""
    if shot is None:
        return block("<p class='soft'>Nothing is measured yet.</p>", "shot")
    taken = shot.taken
    point = "not seen" if taken.point_m is None else ", ".join(fixed(v * 1e3, 2) for v in taken.point_m) + " mm"
    reason = f" ({escape(shot.reason)})" if shot.reason else ""
    fate = "measured again since" if shot.superseded_by is not None else escape(shot.verdict)
    which = "chosen" if chosen else "the last one; click a point in 3-D to choose another"
    return block(
        f"<p><b>Record {shot.record}</b>, joint {taken.joint}, {stop_words(taken, state)}, "
        f"target {escape(taken.target)}: {which}</p>"
        f"<p>{point}<br><b>{fate}</b>{reason}</p><p class='soft'>{shot.utc[:19].replace('T', ' ')} UTC"
        f"{', ' + escape(shot.by) if shot.by else ''}</p>",
        "shot",
    )


def run_words(running: bool | None, paused: bool | None, done: int, total: int, seconds: float) -> str:
    """What the robot does by itself; nothing while it does nothing."""
    if running is None and paused is None:
        return block("", "run")
    if running is None:
        return block("<p class='doubt'><b>Paused.</b> Press <b>Pause</b> again to go on, or <b>Stop</b>.</p>", "run")
    what = "the whole plan" if running else "this sweep"
    left = f", about {_duration(seconds / done * (total - done))} left" if done else ""
    return block(f"<p class='ok'><b>The robot runs {what}</b>: {done} of {total} shots{left}.</p>", "run")


def entered_words(text: str, error: str | None, count: int) -> str:
    """How the page has understood typed coordinates."""
    if error is not None:
        return block(f"<p class='bad'>{escape(error)}</p>", "entered")
    if not count:
        hint = "One line a shot: x y z, parted by blanks, commas or tabs. Paste as many as there are stops."
        return block(f"<p class='soft'>{hint}</p>", "entered")
    shots = "1 shot" if count == 1 else f"{count} shots"
    return block(f"<p class='ok'>✔ understood as {shots}; {escape(text)}. Press <b>Measure</b>.</p>", "entered")


def _nothing_left(state: State) -> str:
    if not state.plan.sweeps:
        text = "No sweep is planned. Open <b>1 Cell</b>, <b>Sweeps</b>, and press <b>Suggest all</b>."
        return f"<h3>Nothing is planned yet</h3><p>{text}</p>"
    if not state.steps:
        text = "The plan does not fit robot and targets any more: plan the sweeps again under <b>1 Cell</b>."
        return f"<h3>The plan cannot be made</h3><p>{text}</p>"
    skipped = len(state.skipped.keys() - state.done)
    more = f" {skipped} skipped: click its row below to make them after all." if skipped else ""
    return f"<h3>Nothing left to measure</h3><p>Every planned shot is done.{more} Go to <b>3 Solve</b>.</p>"


def _row_of(state: State, step: Step) -> PlannedSweep:
    return next(r for r in state.plan.sweeps if (r.joint, r.sweep) == (step.joint, step.sweep))


def _before(robot: Robot, step: Step, by_hand: bool) -> str:
    """Where to go first, so that the stop is reached in one sense."""
    if step.start is None or not by_hand:
        return ""
    first = _value(robot, step.joint - 1, step.start[step.joint - 1])
    return f"<p>First bring joint {step.joint} to {first}, so that lost motion stays the same.</p>"


def _expected(expected: Expected | None, aims: Sequence[str]) -> str:
    if expected is None:
        return "<p class='soft'>The target was not seen before: aim by eye.</p>"
    place = ", ".join(fixed(v * 1e3, 0 if not expected.by_sweep else 1) for v in expected.point_m)
    source = "by this sweep so far" if expected.by_sweep else "about, by the nominal arm"
    aimed = "".join(f"<br>{escape(aim)}" for aim in aims)
    name = term("Expected", "Expected place")
    return f"<p>{name} at <b data-testid='expected'>{place} mm</b> <span class='soft'>({source})</span>{aimed}</p>"


def _why(robot: Robot, step: Step) -> str:
    held = robot.coupling_from(step.joint)
    if held is None:
        path = "a line along" if robot.joints[step.joint - 1].slides else "an arc about"
        return f"Only joint {step.joint} moves, so the target draws {path} its axis. "
    return (
        f"Joint {held.target} is commanded along by its nominal passive motion, so that its motor stands still; all "
        "other motors are held. "
    )


def _next(state: State, step: Step, by_hand: bool) -> str:
    rest = state.steps[state.position + 1 :] if state.position is not None else ()
    after = next((s for s in rest if s.key not in state.done and s.key not in state.skipped), None)
    now = (
        "Then enter what the instrument shows and press <b>Measure</b>." if by_hand else "Press <b>Measure</b> (Space)."
    )
    if after is None:
        return f"{now} It is the last shot of the plan."
    if after.commanded == step.commanded:
        return f"{now} Next: target {escape(after.target)} at the same stop."
    same = (after.joint, after.sweep) == (step.joint, step.sweep)
    return f"{now} Next: stop {after.step + 1}." if same else f"{now} Next: joint {after.joint}."


def _commands(robot: Robot, step: Step) -> str:
    values = (f"q{k + 1} = {_value(robot, k, value)}" for k, value in enumerate(step.commanded))
    return ", ".join(f"<span class='value'>{value}</span>" for value in values)


def _plain(robot: Robot, step: Step) -> str:
    """The bare numbers, as most controllers take them."""
    scales = [display_unit(joint.slides)[1] for joint in robot.joints]
    return ", ".join(f"{value * scale:.4f}" for value, scale in zip(step.commanded, scales, strict=True))


def _value(robot: Robot, k: int, value: float) -> str:
    if robot.joints[k].slides:
        return f"{value * 1e3:.3f} mm"
    return f"{np.rad2deg(value):.4f}°"


def _table_row(row: SweepProgress, robot: Robot, wrong: Sequence[Shot]) -> str:
    planned = row.planned
    unit, scale = (" mm", 1e3) if robot.joints[planned.joint - 1].slides else ("°", 180 / np.pi)
    span = (planned.high - planned.low) * scale
    step = span / (planned.stops - 1)
    name = f"{planned.joint}" if planned.sweep == 1 else f"{planned.joint}.{planned.sweep}"
    word = f"{SWEEP_WORD}{planned.joint}-{planned.sweep}"
    both = " ⇄" if planned.both_ways else ""
    beside = _beside(row, wrong)
    notes = f"<tr class='more'><td></td><td class='soft' colspan='7'>{beside}</td></tr>" if beside else ""
    look = " ".join(["now"] * row.current + ["led"] * bool(beside))
    return (
        f"<tr class='{look}' {saying(word, 'Go on with this sweep')}><td class='key'>{name}{both}</td>"
        f"<td class='n'>{span:.0f}{unit}</td><td class='n'>{step:.1f}{unit}</td><td class='n'>{planned.stops}</td>"
        f"<td>{escape(', '.join(planned.targets))}</td><td class='n'>{row.done}</td><td class='n'>{row.left}</td>"
        f"<td class='key'>{_state_of(row)}</td></tr>{notes}"
    )


def _state_of(row: SweepProgress) -> str:
    if row.finished:
        return "<span class='ok' title='done'>✔</span>"
    return "<b title='now'>▶</b>" if row.current else ""


def _beside(row: SweepProgress, wrong: Sequence[Shot]) -> str:
    """What of a sweep is not as planned."""
    counts = (row.skipped, "skipped"), (row.extra, "extra"), (row.excluded, "excluded")
    told = [f"{count} {word}" for count, word in counts if count]
    told += [f"and {len(wrong) - MOST_TOLD} more"] if len(wrong) > MOST_TOLD else []
    return ", ".join([*(_wrong_words(shot) for shot in wrong[:MOST_TOLD]), *told])


def _wrong_words(shot: Shot) -> str:
    hint = "Choose this shot, to measure it again or to exclude it"
    return f"<b class='bad' {saying(f'{SHOT_WORD}{shot.id}', hint)}>✖ record {shot.record}</b>"


def _not_defined(so_far: SweepSoFar, slides: bool) -> str:
    """What is missing for an axis."""
    count, lacks, joint = len(so_far.shots), so_far.live.lacks, so_far.joint
    if so_far.live.last is Verdict.AGAIN:
        return f"The axis of joint {joint} was known before this shot, and is not with it."
    least = 3 if slides else 4
    if count < least:
        return f"{count} of at least {least} shots: the axis of joint {joint} is not defined yet."
    if lacks is None:
        return f"The axis of joint {joint} is not defined yet: {escape(so_far.live.waiting_for)}."
    span, needed = np.rad2deg(lacks.span_rad), np.rad2deg(lacks.needed_rad)
    shots = "1 more shot" if lacks.more_shots == 1 else f"{lacks.more_shots} more shots"
    return (
        f"The axis of joint {joint} is not defined yet: with this noise, {count} shots over {span:.1f}° cannot be told "
        f"from a straight line. The {term('arc', 'Arc')} has to reach about <b>{needed:.0f}°</b>: {shots}."
    )


def _residuals(so_far: SweepSoFar, k: int, digits: int) -> str:
    fit = so_far.live.fit
    name = term("off the axis so far", "Axial, radial, tangential")
    if fit.sliding:
        return f"<b>{fixed(np.hypot(fit.radial_m[k], fit.tangential_m[k]) * 1e3, digits)} mm</b> off the line so far"
    axial, radial = (_signed(value[k] * 1e3, digits) for value in (fit.axial_m, fit.radial_m))
    return f"axial <b>{axial} mm</b>, radial <b>{radial} mm</b> {name}"


def _if_you_stop(so_far: SweepSoFar, tool_std_m: float | None) -> str:
    fit = so_far.live.fit
    factor = fit.noise_factor
    direction = f"direction of axis {so_far.joint} known to <b>{_std(fit.direction_std_rad * factor * 1e3)} mrad</b>"
    if fit.sliding:
        return f"<p>If you stop now: {direction}.</p>"
    where = f"position to <b>{_std(fit.point_std_m * factor * 1e3)} mm</b> at the arc"
    if tool_std_m is not None:
        where = f"position to <b>{_std(tool_std_m * 1e3)} mm</b> at the tool"
    return f"<p>If you stop now: {direction}, {where}.</p>"


def _signed(value: float, digits: int) -> str:
    text = fixed(value, digits)
    return text if value < 0 or not text.strip("0.") else f"+{text}"


def _percent(chance: float) -> str:
    return "below 0.01 %" if chance < 1e-4 else f"{100 * chance:.2g} %"


def _std(value: float) -> str:
    return two_digits(value) if value < 100 else f"{value:.0f}"


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"
