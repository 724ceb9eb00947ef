"""Small pieces of HTML about test poses. Whatever comes from people or files is escaped here."""

from dataclasses import dataclass
from html import escape

import numpy as np

from app.clicks import listening, saying
from app.pose_bench import NextVisit, TestPose
from app.words import block
from core.pose_loop import Attempts, PoseLoop
from core.repeatability import RepeatedPose, repeated_poses
from core.robot import Robot
from core.verification import Errors, overall, pose_verdicts
from core.wording import decimals_for, fixed

MARKS = {
    "pass": "<span class='ok'>✔ pass</span>",
    "fail": "<span class='bad'>✖ fail</span>",
    "undecided": "<span class='doubt'>? undecided</span>",
    "": "",
}
WORD = "pose-"
"""What a row of the table says when it is clicked, before the number of its pose."""


@dataclass(frozen=True)
class PoseRow:
    """A row of the table: a test pose and what came of it."""

    pose: TestPose
    before: int | None
    """Which of the attempts by nominal commands was the last one."""
    after: int | None
    """Which by compensated commands."""


def step_words(visit: NextVisit | None, poses: tuple[TestPose, ...], robot: Robot, solved: bool) -> str:
    """What to do now, why, and what comes next."""
    if not poses:
        text = "No test pose is planned. Open <b>Test poses</b> below and press <b>Plan new poses</b>."
        return block(f"<h3>Verify the arm</h3><p>{text}</p>", "verify-step")
    if visit is None:
        return block(f"<h3>Nothing left to measure</h3><p>{_all_done(poses, solved)}</p>", "verify-step")
    way = "compensated" if visit.compensated else "nominal"
    why = (
        "The command that, by the calibration, brings the arm to the pose that is wanted."
        if visit.compensated
        else "Sent as the nominal arm would be: what you measure shows what the arm misses without a calibration."
    )
    commands = ", ".join(_command(robot, k, value) for k, value in enumerate(visit.commanded))
    targets = ", ".join(map(escape, visit.targets))
    return block(
        f"<h3>Pose {visit.pose.number} of {len(poses)}, {way} command</h3>"
        f"<p>Send the robot to<br><code data-testid='pose-command'>{commands}</code></p>"
        f"<p>Then measure {targets}: press <b>Measure pose</b> (V).</p><p class='soft'>{why} "
        "No test pose is ever used by a calibration.</p>",
        "verify-step",
    )


def summary_words(loop: PoseLoop | None, why_not: str, poses: tuple[TestPose, ...]) -> str:
    """Mean errors before and after, how much better, and whether the limits are kept."""
    if loop is None:
        return block(f"<p class='soft'>{escape(why_not)}</p>", "verify-summary")
    rows = "".join(
        f"<tr><td>{name}</td>{_mean_cell(attempts.errors.position)}"
        f"{_mean_cell(attempts.errors.orientation)}<td class='n'>{attempts.count}</td></tr>"
        for name, attempts in _ways(loop)
        if attempts.count
    )
    head = "<tr><th>Mean error</th><th class='n'>mm</th><th class='n'>mrad</th><th class='n'>poses</th></tr>"
    text = f"<table>{head}{rows}</table>{_better(loop)}{_verdict(loop)}"
    refusals = [pose.refusal for pose in poses if pose.refusal]
    text += "".join(f"<p class='bad'>{escape(_sentence(r))}</p>" for r in refusals[:5])
    text += "".join(f"<p class='soft'>{escape(_sentence(n))}</p>" for n in loop.found.notes)
    if any(pose.outdated for pose in poses):
        text += "<p class='doubt'>Some compensated poses were commanded by an earlier solution; measure them again.</p>"
    return block(text, "verify-summary")


def iso_words(loop: PoseLoop | None, numbers: dict[int | None, int]) -> str:
    """Accuracy and repeatability of poses that were visited more than once, as ISO 9283 defines them.

    Args:
        loop: what came of the poses.
        numbers: what each wanted pose is called, by its index in the loop.
    """
    repeated = () if loop is None else repeated_poses(loop.found)
    if loop is None or not repeated:
        return block("", "pose-iso")
    goals = {
        int(loop.found.measured.seen.pose[a.row[k]]): (int(a.goal[k]), name)
        for name, a in _ways(loop)
        for k in range(a.count)
    }
    rows = "".join(_iso_row(one, *goals[one.poses[0]], numbers) for one in repeated)
    heads = ("visits", "AP, mm", "RP, mm", "AP, mrad", "RP, mrad")
    head = "<tr><th>Pose, command</th>" + "".join(f"<th class='n'>{name}</th>" for name in heads) + "</tr>"
    note = (
        "<p class='soft'>ISO 9283: AP, from the wanted pose to the mean of the visits; RP, mean distance from that "
        "mean and three standard deviations (of turns: three standard deviations about x, y, z). The standard asks "
        "for 30 visits.</p>"
    )
    return block(f"<h3>Repeated poses</h3><table>{head}{rows}</table>{note}", "pose-iso")


def rows_of(loop: PoseLoop | None, poses: tuple[TestPose, ...]) -> tuple[PoseRow, ...]:
    """Every test pose with the last attempt in each way."""
    return tuple(PoseRow(pose, *_last(loop, pose)) for pose in poses)


def table_words(loop: PoseLoop | None, poses: tuple[TestPose, ...], chosen: int | None) -> str:
    """Errors pose by pose; a row can be clicked."""
    if loop is None:
        return block("", "pose-table")
    judged = pose_verdicts((loop.compensated if loop.compensated.count else loop.nominal).errors, loop.found.limits)
    after = bool(loop.compensated.count)
    body = "".join(_row(loop, row, chosen, judged, after) for row in rows_of(loop, poses))
    heads = ("before, mm", "after, mm", "before, mrad", "after, mrad")
    head = "<tr><th>Pose</th>" + "".join(f"<th class='n'>{name}</th>" for name in heads)
    head += "<th>Limits</th></tr>" if judged else "</tr>"
    note = "<p class='soft'>± two standard uncertainties of the measurement. Click a row to see the pose in 3-D.</p>"
    return block(listening(f"<table>{head}{body}</table>") + note, "pose-table")


def _all_done(poses: tuple[TestPose, ...], solved: bool) -> str:
    if not solved:
        return "All poses are measured by nominal commands. <b>Solve</b> to see their errors and to go on compensated."
    if any(pose.compensated_visit is None and pose.compensated is None for pose in poses):
        return "Every pose that the arm can take is measured. Those that it cannot take are named below."
    return "Every pose is measured by nominal and by compensated commands. Choose one below to measure it again."


def _mean_cell(errors: Errors) -> str:
    if not errors.count:
        return "<td class='n'>–</td>"
    return f"<td class='n'><b>{_with(errors.mean, errors.mean_std)}</b></td>"


def _with(value: float, std: float) -> str:
    """A value in mm or mrad with two standard uncertainties."""
    digits = decimals_for(2e3 * std, 3) if np.isfinite(std) else 3
    digits = min(digits, 3)
    return (
        f"{fixed(value * 1e3, digits)} ± {fixed(2e3 * std, digits)}" if np.isfinite(std) else fixed(value * 1e3, digits)
    )


def _better(loop: PoseLoop) -> str:
    if not len(loop.both):
        return ""
    ratios = loop.improvement_position, loop.improvement_orientation
    position, orientation = (f"{ratio:.1f}" if np.isfinite(ratio) else "–" for ratio in ratios)
    return (
        f"<p>Compensation makes the position <b data-testid='better'>{position}</b> times and the orientation "
        f"<b>{orientation}</b> times better, over {len(loop.both)} poses measured in both ways.</p>"
    )


def _verdict(loop: PoseLoop) -> str:
    after = loop.compensated if loop.compensated.count else loop.nominal
    judged = pose_verdicts(after.errors, loop.found.limits)
    if not judged:
        return "<p class='soft'>Set limits below to get pass or fail.</p>"
    name = "compensated" if loop.compensated.count else "nominal"
    return f"<p class='verdict' data-testid='pose-verdict'>{MARKS[overall(judged)]}: {name} commands</p>"


def _row(loop: PoseLoop, row: PoseRow, chosen: int | None, judged: tuple[str, ...], after: bool) -> str:
    cells = ""
    for kind in ("position", "orientation"):
        cells += _cell(loop.nominal, kind, row.before) + _cell(loop.compensated, kind, row.after)
    if judged:
        which = row.after if after else row.before
        cells += f"<td>{'' if which is None else MARKS[judged[which]]}</td>"
    now = " class='now'" if row.pose.number == chosen else ""
    mark = " <span class='doubt'>*</span>" if row.pose.outdated else ""
    say = saying(f"{WORD}{row.pose.number}", "Show this pose in 3-D")
    return f"<tr{now} {say}><td>{row.pose.number}{mark}</td>{cells}</tr>"


def _cell(attempts: Attempts, kind: str, which: int | None) -> str:
    errors: Errors = getattr(attempts.errors, kind)
    if which is None or not np.isfinite(errors.value[which]):
        return "<td class='n'></td>"
    return f"<td class='n'>{_with(errors.value[which], errors.std[which])}</td>"


def _last(loop: PoseLoop | None, pose: TestPose) -> tuple[int | None, int | None]:
    goal = None if loop is None else loop.goal_of(pose.wanted)
    return (None, None) if loop is None or goal is None else (loop.nominal.last(goal), loop.compensated.last(goal))


def _command(robot: Robot, k: int, value: float) -> str:
    if robot.joints[k].slides:
        return f"q{k + 1} = {value * 1e3:.3f} mm"
    return f"q{k + 1} = {np.rad2deg(value):.4f}°"


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."


def _ways(loop: PoseLoop) -> tuple[tuple[str, Attempts], ...]:
    return ("nominal", loop.nominal), ("compensated", loop.compensated)


def _iso_row(one: RepeatedPose, goal: int, way: str, numbers: dict[int | None, int]) -> str:
    accuracy = one.nominal if way == "nominal" else one.calibrated
    values = (accuracy.position_m, one.repeatability_m, accuracy.orientation_rad)
    cells = "".join(f"<td class='n'>{v * 1e3:.2f}</td>" if np.isfinite(v) else "<td class='n'>–</td>" for v in values)
    turns = (
        ", ".join(f"{v * 1e3:.1f}" for v in one.repeatability_rad) if np.isfinite(one.repeatability_rad).all() else "–"
    )
    name = f"{numbers.get(goal, goal + 1)}, {way}"
    return f"<tr><td>{name}</td><td class='n'>{one.visits}</td>{cells}<td class='n'>{turns}</td></tr>"
