"""What stands under a figure: what was fitted, how well, and why."""

import numpy as np

from app.report_tables import family_words, reason_words
from core.calibration import Calibration
from core.function_fit import FunctionFit
from core.report import sweep_rows
from core.wording import decimals_for, display_unit, fixed, two_digits


def drive_caption(calibration: Calibration, joint: int) -> str:
    """The function of a drive that was swept, 1..n: its family, what it explains, and why it was chosen."""
    unit, scale = display_unit(calibration.campaign.robot.joints[joint - 1].slides)
    text = _fit_words(calibration.estimate.transmissions[joint - 1], unit, scale)
    excess = float(calibration.refinement.arc_excess[joint - 1]) * scale
    if excess > 0:
        digits = decimals_for(excess)
        text += f" Beyond it the drive departs by {fixed(excess, digits)} {unit} (standard deviation)."
    return text


def coupling_caption(calibration: Calibration, joint: int) -> str:
    """The same of the function by which a joint, 2..n, is dragged along."""
    unit, scale = display_unit(calibration.campaign.robot.joints[joint - 1].slides)
    return _fit_words(calibration.estimate.couplings[joint - 1], unit, scale)


def residual_caption(calibration: Calibration, index: int) -> str:
    """How large the residuals of sweep ``index`` (0.., in the order of measurement) are."""
    _, rows = list(sweep_rows(calibration))[index]
    residuals = calibration.refinement.residuals
    return _size_words(residuals.residual_m[rows][residuals.used[rows]])


def all_residuals_caption(calibration: Calibration) -> str:
    """How large the residuals of all sweeps are."""
    residuals = calibration.refinement.residuals
    return _size_words(residuals.residual_m[residuals.used])


def _size_words(residual_m: np.ndarray) -> str:
    rms = two_digits(1e3 * float(np.sqrt(np.mean(np.sum(residual_m**2, axis=1)))))
    return f"{len(residual_m)} points, RMS length of their residuals in space {rms} mm."


def _fit_words(fit: FunctionFit, unit: str, scale: float) -> str:
    digits = decimals_for(fit.rms_after * scale)
    before, after = fixed(fit.rms_before * scale, digits), fixed(fit.rms_after * scale, digits)
    family = family_words(fit.form.name)
    if len(fit.coefficients) == 0:
        return f"Family: {family}, no constants. RMS {after} {unit}. Why: {reason_words(fit.reason)}."
    return f"Family: {family}. RMS {before} {unit} before, {after} {unit} after. Why: {reason_words(fit.reason)}."
