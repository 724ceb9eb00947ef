"""The report of a calibration: one page of HTML that holds everything it shows."""

import numpy as np

from app.figures.couplings import coupling_figure
from app.figures.deviations import deviations_figure
from app.figures.residuals import residual_figure, thinned_sweeps
from app.figures.transmissions import transmission_figure
from app.report_page import Item, Page, Plot, Section, page_html
from app.report_tables import (
    family_words,
    is_empty,
    reason_words,
    shown_axes,
    shown_candidates,
    shown_constants,
    shown_couplings,
    shown_drives,
    shown_parameters,
    shown_rejected,
    shown_sweeps,
    shown_targets,
    shown_zeros,
)
from app.report_words import CONVENTIONS, TERMS, facts, key_numbers
from core.calibration import APART, Calibration
from core.function_fit import FunctionFit
from core.wording import as_sentence, decimals_for, display_unit, fixed, is_simulated, joint_list, summary, two_digits


def report_html(calibration: Calibration) -> str:
    """The report as one self-contained page: it opens from a disk and asks for nothing from a network."""
    return page_html(report_page(calibration))


def report_page(calibration: Calibration) -> Page:
    """The report as sections, before it becomes HTML."""
    campaign = calibration.campaign
    sections = (
        _findings(calibration),
        _measured(calibration),
        _geometry(calibration),
        _axes(calibration),
        _drives(calibration),
        _couplings(calibration),
        _zeros(calibration),
        _residuals(calibration),
        _left_out(calibration),
        _method(),
    )
    return Page(
        kind="Calibration report",
        title=campaign.title or campaign.robot.name,
        badge="SIMULATED: no robot was measured" if is_simulated(campaign) else "",
        summary=summary(calibration),
        facts=facts(calibration),
        sections=tuple(s for s in sections if s is not None),
        figures=key_numbers(calibration),
    )


def _findings(calibration: Calibration) -> Section:
    clear = sorted((f for f in calibration.findings if f.significant), key=lambda f: f.std == 0)
    rest = [f for f in calibration.findings if not f.significant]
    first = "▲ marks what exceeds two standard uncertainties; the number after ± is one standard uncertainty."
    return Section(
        id="findings",
        title="Findings",
        paragraphs=(first if clear else "Nothing exceeds two standard uncertainties.",),
        items=tuple(Item(as_sentence(f.text), True) for f in clear),
        minor_title="Not significant: within two standard uncertainties of the design" if rest else "",
        minor_items=tuple(as_sentence(f.text) for f in rest),
    )


def _measured(calibration: Calibration) -> Section:
    return Section("measured", "What was measured", tables=(shown_sweeps(calibration), shown_targets(calibration)))


def _geometry(calibration: Calibration) -> Section:
    figure = deviations_figure(calibration)
    if figure is None:
        absent = tuple(sorted({*calibration.not_swept, *calibration.not_moved}))
        text = "The parameters of the links need a sweep of every joint"
        if absent:
            have = "has" if len(absent) == 1 else "have"
            text += f"; {joint_list(absent)} {have} none that can be used"
        text += "."
        if calibration.campaign.robot.joint_count < 2:
            text = "An arm with a single joint has no links between axes, so there is no geometry to compare."
        return Section("geometry", "Geometry", paragraphs=(text,))
    caption = "▲ significant, ○ not significant. Zero is the design value; bars are ±2 standard uncertainties."
    plots = (Plot(figure, caption),)
    text = "The parameters follow from the joint axes alone; joint by joint is the estimate one joint at a time."
    return Section("geometry", "Geometry", (text,), plots=plots, tables_after=(shown_parameters(calibration),))


def _axes(calibration: Calibration) -> Section:
    return Section("axes", "Joint axes", tables=(shown_axes(calibration),))


def _drives(calibration: Calibration) -> Section:
    plots = tuple(
        Plot(transmission_figure(calibration, joint), _drive_caption(calibration, joint, fit))
        for joint, fit in enumerate(calibration.estimate.transmissions, 1)
        if fit is not None
    )
    text = (
        "Error: commanded minus actual displacement, as measured (points) and by the fitted function (line) with its "
        "95 % band. The band holds the uncertainty of the axis, which moves all points together. Left over: what the "
        "function does not explain."
    )
    after = (shown_constants(calibration, "transmission"), shown_candidates(calibration, "transmission"))
    return Section(
        "drives",
        "Drives",
        (text,),
        tables=(shown_drives(calibration),),
        plots=plots,
        tables_after=tuple(t for t in after if not is_empty(t)),
    )


def _couplings(calibration: Calibration) -> Section | None:
    robot, fits = calibration.campaign.robot, calibration.estimate.couplings
    if not robot.couplings:
        return None
    unseen = [c for c in robot.couplings if fits[c.target - 1] is None]
    text = (
        "The motor of one joint moves the next joint as well. Error: that passive motion less the nominal one, as "
        "measured (points) and by the fitted function (line). Left over: what the function does not explain."
    )
    lines = [
        f"Joint {c.target} is dragged along by joint {c.source} with a nominal gain of {fixed(c.gain, 4)}; no second "
        "target showed it, so the nominal value stands."
        for c in unseen
    ]
    seen = [joint for joint, fit in enumerate(fits, 1) if fit is not None]
    if not seen:
        return Section("couplings", "Couplings", tuple(lines))
    after = (shown_constants(calibration, "coupling"), shown_candidates(calibration, "coupling"))
    plots = tuple(Plot(coupling_figure(calibration, j), _coupling_caption(calibration, j)) for j in seen)
    return Section(
        "couplings",
        "Couplings",
        (text, *lines),
        tables=(shown_couplings(calibration),),
        plots=plots,
        tables_after=tuple(t for t in after if not is_empty(t)),
    )


def _zeros(calibration: Calibration) -> Section:
    table = shown_zeros(calibration)
    if table is None:
        text = (
            "The campaign does not say what the joints read at the arm's marks. Displacements count from command zero, "
            "and an offset of a transducer shows as a turn of the axes beyond its joint."
        )
        return Section("zeros", "Zeros", (text,))
    return Section("zeros", "Zeros", tables=(table,))


def _residuals(calibration: Calibration) -> Section:
    texts = [
        "Measured minus predicted point, for every sweep in the order of measurement. All panels have the same scale; "
        "grey bands hold about 95 % of the points if the noise is as estimated."
    ]
    thin = thinned_sweeps(calibration)
    if thin:
        texts.append(
            f"Of {'; '.join(thin)} only some of the points are drawn, here and above, "
            "the largest residuals always among them."
        )
    plots = tuple(
        Plot(residual_figure(calibration, k), _residual_caption(calibration, k))
        for k in range(len(calibration.found.fits))
    )
    return Section("residuals", "Residuals", tuple(texts), plots=plots)


def _left_out(calibration: Calibration) -> Section:
    table = shown_rejected(calibration)
    texts = ["No point was rejected."] if table is None else []
    if calibration.not_swept:
        texts.append(f"Not swept: {joint_list(calibration.not_swept)}. Nothing is known of axis and drive.")
    if calibration.not_moved:
        texts.append(f"Swept in name only: the command of {joint_list(calibration.not_moved)} never changed.")
    if not calibration.refinement.tied:
        texts.append(f"{APART[0].upper()}{APART[1:]}.")
    if calibration.refinement.unobservable:
        lost = calibration.refinement.unobservable
        texts.append(f"These points say nothing of {lost} combination{'s' if lost > 1 else ''} of parameters.")
    return Section("left-out", "Left out", tuple(texts), tables=() if table is None else (table,))


def _method() -> Section:
    return Section("method", "Method and conventions", CONVENTIONS, terms=TERMS)


def _drive_caption(calibration: Calibration, joint: int, fit: FunctionFit) -> str:
    unit, scale = display_unit(calibration.campaign.robot.joints[joint - 1].slides)
    text = _fit_words(fit, unit, scale)
    excess = float(calibration.refinement.arc_excess[joint - 1]) * scale
    if excess > 0:
        digits = decimals_for(excess)
        text += f" Beyond it the drive departs by {fixed(excess, digits)} {unit} (standard deviation)."
    return text


def _coupling_caption(calibration: Calibration, joint: int) -> str:
    unit, scale = display_unit(calibration.campaign.robot.joints[joint - 1].slides)
    return _fit_words(calibration.estimate.couplings[joint - 1], unit, scale)


def _fit_words(fit: FunctionFit, unit: str, scale: float) -> str:
    digits = decimals_for(fit.rms_after * scale)
    before, after = fixed(fit.rms_before * scale, digits), fixed(fit.rms_after * scale, digits)
    family = family_words(fit.form.name)
    if len(fit.coefficients) == 0:
        return f"Family: {family}, no constants. RMS {after} {unit}. Why: {reason_words(fit.reason)}."
    return f"Family: {family}. RMS {before} {unit} before, {after} {unit} after. Why: {reason_words(fit.reason)}."


def _residual_caption(calibration: Calibration, index: int) -> str:
    at = sum(len(f.sweep.rows) for f in calibration.found.fits[:index])
    rows = slice(at, at + len(calibration.found.fits[index].sweep.rows))
    residuals = calibration.refinement.residuals
    used = residuals.used[rows]
    length = np.linalg.norm(residuals.residual_m[rows][used], axis=1)
    rms = two_digits(1e3 * float(np.sqrt(np.mean(length**2))))
    return f"{used.sum()} points, RMS length of their residuals in space {rms} mm."
