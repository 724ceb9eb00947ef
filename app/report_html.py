"""The report of a calibration: one page of HTML that holds everything it shows."""

import logging
from dataclasses import replace

from app.captions import all_residuals_caption, coupling_caption, drive_caption, residual_caption
from app.figures.couplings import coupling_figure
from app.figures.deviations import deviations_figure
from app.figures.over_time import over_time_figure
from app.figures.residuals import residual_figure, thinned_sweeps
from app.figures.transmissions import transmission_figure
from app.report_page import Item, Page, Plot, Section, page_html
from app.report_scene import residual_scale, scene_html
from app.report_tables import (
    is_empty,
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
from core.wording import as_sentence, fixed, is_simulated, joint_list, summary

LOG = logging.getLogger("trueaxis")


def report_html(calibration: Calibration) -> str:
    """The report as one self-contained page: it opens from a disk and asks for nothing from a network."""
    page = report_page(calibration)
    first, *rest = page.sections
    return page_html(replace(page, sections=(first, _scene(calibration), *rest)))


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


def _scene(calibration: Calibration) -> Section:
    """The arm to be turned and looked at; apart from the page, because it takes a server for a moment to write it."""
    title = "The arm in 3-D"
    try:
        page = scene_html(calibration)
    except OSError as error:
        LOG.warning("the report has no 3-D scene: %s", error)
        return Section("scene", title, (f"The scene could not be drawn on the machine of this report: {error}.",))
    low, *_, high = residual_scale(calibration).legend()
    text = (
        "Drag to turn it, scroll to come nearer, hold the right button to shift it; the button in its corner lists all "
        "parts, to be shown or hidden. Balls are the measured points, coloured by radial residual from blue "
        f"({low.text}) over grey to orange ({high.text}); cages are rejected points."
    )
    if calibration.estimate.geometry is not None and calibration.nominal is not None:
        text += (
            " Grey: axes and common normals as designed. Green: as they are, each drawn from where its frame should "
            "be, the differences as many times too large as the label on top says. Orange: differences beyond two "
            "standard uncertainties, with their true values; grey arrows: smaller ones."
        )
    return Section("scene", title, (text,), scene=page)


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
        Plot(transmission_figure(calibration, joint), drive_caption(calibration, joint))
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
    plots = tuple(Plot(coupling_figure(calibration, j), coupling_caption(calibration, j)) for j in seen)
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
        "Measured minus predicted point: of all sweeps over time, then sweep by sweep in the order of measurement. "
        "All panels have the same scale; "
        "grey bands hold about 95 % of the points if the noise is as estimated."
    ]
    thin = thinned_sweeps(calibration)
    if thin:
        texts.append(
            f"Of {'; '.join(thin)} only some of the points are drawn, here and above, "
            "the largest residuals always among them."
        )
    each = tuple(
        Plot(residual_figure(calibration, k), residual_caption(calibration, k))
        for k in range(len(calibration.found.fits))
    )
    drift = Plot(over_time_figure(calibration), all_residuals_caption(calibration))
    return Section("residuals", "Residuals", tuple(texts), plots=(drift, *each))


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
