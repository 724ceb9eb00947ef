"""The report of a verification: figures 9 and 10, tables, and what has to be known to read them."""

import numpy as np

from app.figures.pose_errors import loop_figures, orientation_errors_figure, position_errors_figure
from app.figures.style import WIDE_PX
from app.report_cells import aligned, count, number
from app.report_page import Cell, Heading, Page, Plot, Section, ShownTable, page_html
from core.end_effector import judged_points
from core.pose_loop import pose_loop
from core.repeatability import DistanceAccuracy, RepeatedPose, distance_accuracy, repeated_poses
from core.verification import Errors, ModelErrors, Verification, calibrated_verdict, verdicts
from core.version import VERSION
from core.wording import fixed, is_simulated, typeset

MARKS = {"pass": "", "fail": "significant", "undecided": "muted"}
MOST_ROWS = 500
METHOD = (
    "For every pose record that shows three or more targets on the last link, not on one line, or a 6-D target, the "
    "pose of the tool is measured: three or more targets are a rigid body whose shape follows from the pose records "
    "alone, fitted to its points weighted by their covariances. It is compared with the pose that each model predicts "
    "for the same commands. A record that shows fewer targets has a position error alone, that of the middle of its "
    "targets. No pose record was used in the calibration.",
    "Both models stand on the base frame that the calibration found. Position error: the distance between the measured "
    "and the predicted origin of the tool. Orientation error: the angle of the rotation between them. Both contain "
    "what the arm does differently on every visit; their uncertainties are those of the measurement.",
)
LOOP = (
    "A pose is wanted where the nominal arm would have the tool for some commands. Sent as they are, these show what "
    "the arm misses without a calibration; the compensated commands show what is left with it.",
)
TERMS = (
    ("AP", "Pose accuracy (ISO 9283): from the mean of repeated visits to where the model has the pose."),
    ("RP", "Pose repeatability (ISO 9283): mean distance from the mean of the visits plus three standard deviations."),
    ("AD", "Distance accuracy (ISO 9283): measured less predicted distance between two poses; no base frame is in it."),
    ("p95", "The size that 95 of 100 errors do not exceed."),
    (
        "Pass, fail, undecided",
        "Within the limit with two standard uncertainties more; beyond it with two less; neither (ISO 14253-1).",
    ),
)


def verification_html(found: Verification) -> str:
    """The report as one self-contained page."""
    return page_html(verification_page(found))


def verification_page(found: Verification) -> Page:
    """The report as sections, before it becomes HTML."""
    campaign = found.campaign
    sections = (
        _errors(found),
        _loop(found),
        _poses(found),
        _iso(found),
        Section("method", "Method", METHOD, terms=TERMS),
    )
    return Page(
        kind="Verification report",
        title=campaign.title or campaign.robot.name,
        badge="SIMULATED: no robot was measured" if is_simulated(campaign) else "",
        summary=summary(found),
        facts=_facts(found),
        sections=tuple(s for s in sections if s is not None),
        figures=_key_numbers(found),
    )


def summary(found: Verification) -> tuple[str, ...]:
    """What was found, in a few sentences."""
    lines = [
        f"Mean position error over {found.nominal.position.count} poses: {_length(found.nominal.position)} nominal, "
        f"{_length(found.calibrated.position)} calibrated.",
        f"Mean orientation error: {_angle(found.nominal.orientation)} nominal, "
        f"{_angle(found.calibrated.orientation)} calibrated."
        if found.nominal.orientation.count
        else "No orientation was measured.",
    ]
    verdict = calibrated_verdict(found)
    if verdict:
        lines.append(f"Against the limits the calibrated arm: {verdict}.")
    return (*lines, *(f"{typeset(n[0].upper() + n[1:])}." for n in found.notes))


def _length(errors: Errors) -> str:
    return f"{fixed(errors.mean * 1e3, 2)} mm"


def _angle(errors: Errors) -> str:
    return f"{fixed(errors.mean, 4)} rad" if errors.count else "not measured"


def _key_numbers(found: Verification) -> tuple[tuple[str, str], ...]:
    better = found.improvement_position, found.improvement_orientation
    numbers = [
        ("Position, nominal", _length(found.nominal.position)),
        ("Position, calibrated", _length(found.calibrated.position)),
        ("Orientation, nominal", _angle(found.nominal.orientation)),
        ("Orientation, calibrated", _angle(found.calibrated.orientation)),
        ("Improvement", " / ".join(f"{b:.1f}" if np.isfinite(b) else "-" for b in better)),
        ("Poses", str(found.nominal.position.count)),
    ]
    verdict = calibrated_verdict(found)
    return (*numbers, ("Within the limits", verdict)) if verdict else tuple(numbers)


def _facts(found: Verification) -> tuple[tuple[str, str], ...]:
    campaign, measured = found.campaign, found.measured
    names = ", ".join(campaign.targets[t].name for t in measured.seen.target)
    return (
        ("Robot", campaign.robot.name),
        ("Instrument", campaign.instrument.kind),
        ("Judged point", judged_points(measured)),
        ("Targets", f"{names}; place on the link known: {', '.join(measured.anchors) or 'none'}"),
        ("Calibrated with", found.arm.source or "(a campaign without a title)"),
        ("Software", f"trueaxis {VERSION}"),
        ("SHA-256 of input", campaign.digest or "not read from files"),
        ("SHA-256 of calibration's input", found.arm.digest or "not known"),
    )


def _errors(found: Verification) -> Section:
    bars = "Bars are ±2 standard uncertainties of the measurement, dotted lines the means."
    plots = [Plot(position_errors_figure(found), f"As figure 9 of Sultan and Wager. {bars}")]
    if found.nominal.orientation.count:
        plots.append(Plot(orientation_errors_figure(found), f"As figure 10 of Sultan and Wager. {bars}"))
    return Section("errors", "Errors of the arm", plots=tuple(plots), tables=(_summary_table(found),))


def _summary_table(found: Verification) -> ShownTable:
    headings = [Heading("error"), Heading("model")]
    headings += [Heading(t, numeric=True) for t in ("mean", "u of mean", "rms", "p95", "max", "n")]
    groups = [
        [_summary_row(name, model, errors, scale) for model, errors in pair]
        for name, scale, pair in (
            ("position, mm", 1e3, tuple((name, model.position) for name, model in _models(found))),
            ("orientation, mrad", 1e3, tuple((name, model.orientation) for name, model in _models(found))),
        )
    ]
    return ShownTable("Errors over all poses", tuple(headings), aligned(groups))


def _summary_row(name: str, model: str, errors: Errors, scale: float) -> list[Cell]:
    values = (errors.mean, errors.mean_std, errors.rms, errors.p95, errors.max)
    return [Cell(name), Cell(model), *(number(v * scale) for v in values), count(errors.count)]


def _loop(found: Verification) -> Section | None:
    """Poses that were commanded compensated, beside the same by nominal commands."""
    loop = pose_loop(found)
    if not loop.compensated.count:
        return None
    figures = loop_figures(loop, tuple(range(1, len(loop.wanted) + 1)), WIDE_PX)
    plots = tuple(Plot(figure, "Measured less wanted pose; bars are ±2 standard uncertainties.") for figure in figures)
    headings = [Heading("error"), Heading("command")]
    headings += [Heading(t, numeric=True) for t in ("mean", "u of mean", "rms", "p95", "max", "n")]
    both = (("nominal", loop.nominal), ("compensated", loop.compensated))
    groups = [
        [_summary_row(words, name, getattr(attempts.errors, kind), 1e3) for name, attempts in both if attempts.count]
        for kind, words in (("position", "position, mm"), ("orientation", "orientation, mrad"))
    ]
    table = ShownTable("Wanted poses: commanded, measured, compared", tuple(headings), aligned(groups))
    return Section("loop", "Compensated commands", LOOP, plots=plots, tables=(table,))


def _poses(found: Verification) -> Section:
    judged = {
        "position": verdicts(found.calibrated.position, found.limits.position_m),
        "orientation": verdicts(found.calibrated.orientation, found.limits.orientation_rad),
    }
    titles = ["nominal, mm", "calibrated, mm", "u, mm", "nominal, mrad", "calibrated, mrad", "u, mrad"]
    headings = [Heading(t, numeric=True) for t in ("pose", "targets", *titles)]
    headings += [Heading(name) for name, each in judged.items() if each]
    rows = np.arange(found.nominal.position.count)
    note = ""
    if len(rows) > MOST_ROWS:
        rows = np.sort(np.argsort(-found.calibrated.position.value)[:MOST_ROWS])
        note = f"The {MOST_ROWS} poses with the largest position errors; all of them are in verification.json."
    group = [_pose_row(found, int(k), judged) for k in rows]
    caption = "Errors pose by pose; u: standard uncertainty of the calibrated arm's error"
    table = ShownTable(caption, tuple(headings), aligned([group]), note)
    return Section("poses", "Pose by pose", tables=(table,))


def _pose_row(found: Verification, k: int, judged: dict[str, tuple[str, ...]]) -> list[Cell]:
    cells = [count(int(found.measured.seen.pose[k])), count(int(found.measured.seen.points.seen[k].sum()))]
    for nominal, calibrated in (
        (found.nominal.position, found.calibrated.position),
        (found.nominal.orientation, found.calibrated.orientation),
    ):
        cells += [number(v * 1e3) for v in (nominal.value[k], calibrated.value[k], calibrated.std[k])]
    return [*cells, *(Cell(each[k], mark=MARKS[each[k]]) for each in judged.values() if each)]


def _iso(found: Verification) -> Section | None:
    distances = [(name, distance_accuracy(found, model)) for name, model in _models(found)]
    repeated = repeated_poses(found)
    tables = []
    if distances[0][1] is not None:
        tables.append(_distance_table(distances))
    if repeated:
        tables.append(_repeated_table(repeated))
    if not tables:
        return None
    missing = () if repeated else ("No pose was visited twice, so repeatability (RP) cannot be told.",)
    return Section("iso", "Distances and repeatability (ISO 9283)", missing, tables=tuple(tables))


def _models(found: Verification) -> tuple[tuple[str, ModelErrors], ...]:
    return ("nominal", found.nominal), ("calibrated", found.calibrated)


def _distance_table(distances: list[tuple[str, DistanceAccuracy | None]]) -> ShownTable:
    headings = (Heading("model"), *(Heading(t, numeric=True) for t in ("mean, mm", "rms, mm", "largest, mm", "pairs")))
    group = [
        [Cell(name), *(number(v * 1e3) for v in (one.mean_m, one.rms_m, one.max_m)), count(one.pairs)]
        for name, one in distances
        if one is not None
    ]
    return ShownTable("Distance accuracy AD over all pairs of poses", headings, aligned([group]))


def _repeated_table(repeated: tuple[RepeatedPose, ...]) -> ShownTable:
    titles = ("visits", "AP nominal, mm", "AP calibrated, mm", "RP, mm", "AP nominal, mrad", "AP calibrated, mrad")
    titles += ("RP about x, y, z, mrad",)
    headings = (Heading("poses"), *(Heading(t, numeric=True) for t in titles))
    group = [
        [
            Cell(", ".join(map(str, one.poses[:6])) + (", ..." if one.visits > 6 else "")),
            count(one.visits),
            *(number(v * 1e3) for v in (one.nominal.position_m, one.calibrated.position_m, one.repeatability_m)),
            *(number(v * 1e3) for v in (one.nominal.orientation_rad, one.calibrated.orientation_rad)),
            Cell(", ".join(fixed(v * 1e3, 2) for v in one.repeatability_rad), numeric=True),
        ]
        for one in repeated[:MOST_ROWS]
    ]
    caption, note = "Accuracy AP and repeatability RP of repeated poses", "The standard asks for 30 visits of a pose."
    return ShownTable(caption, headings, aligned([group]), note)
