"""Transmission and coupling functions as ``calibration.json`` carries them."""

import numpy as np

from core.calibration import Calibration
from core.function_fit import FunctionFit
from core.json_values import Json, degrees, mm, named, number
from core.motion_forms import Arctangent


def transmission_records(calibration: Calibration) -> list[Json]:
    """One record for each joint of which the drive is known; they map actual to commanded displacement."""
    estimate = calibration.estimate
    records = []
    for joint, fit in enumerate(estimate.transmissions, 1):
        if fit is not None:
            slides = calibration.campaign.robot.joints[joint - 1].slides
            records.append(
                {
                    "joint": joint,
                    **_function_record(fit, slides),
                    **_residuals("before", fit.rms_before, slides),
                    **_residuals("after", fit.rms_after, slides),
                    **_offset_record(calibration, joint, slides),
                }
            )
    return records


def coupling_records(calibration: Calibration) -> list[Json]:
    """One record for each coupling that was observed; active displacement of ``from`` to passive one of ``to``."""
    records = []
    for joint, fit in enumerate(calibration.estimate.couplings, 1):
        if fit is not None:
            slides = calibration.campaign.robot.joints[joint - 1].slides
            records.append(
                {
                    "from": joint - 1,
                    "to": joint,
                    **_function_record(fit, slides),
                    **_residuals("before", fit.rms_before, slides),
                    **_residuals("after", fit.rms_after, slides),
                }
            )
    return records


def _function_record(fit: FunctionFit, slides: bool) -> Json:
    names = fit.form.coefficient_names
    coefficients, std = named(names, fit.coefficients), named(names, fit.std)
    if isinstance(fit.form, Arctangent):
        # The paper's writing of the same function: passive motion counts from zero, the cosine below has the factor 1.
        n1 = coefficients["n1"]
        coefficients |= {"n2": None if n1 is None else 0.0 - n1, "d0": 1.0}
        std |= {"n2": std["n1"], "d0": 0.0}
    return {
        "form": fit.form.name,
        "formula": f"f(x) = {fit.form.formula}",
        "coefficients": coefficients,
        "std": std,
        "constants": {name: number(value) for name, value in fit.form.constants().items()},
        "reason": fit.reason,
        "candidates": [
            {
                "form": candidate.name,
                "constants": candidate.constants,
                "rms_mm" if slides else "rms_rad": mm(candidate.rms) if slides else number(candidate.rms),
                "chi_square": number(candidate.chi_square),
                "probability": number(candidate.probability),
            }
            for candidate in fit.candidates
        ],
    }


def _residuals(when: str, rms: float, slides: bool) -> Json:
    """In rad; where the joint slides in mm, and then null in rad."""
    if slides:
        return {f"rms_{when}_rad": None, f"rms_{when}_mm": mm(rms)}
    return {f"rms_{when}_rad": number(rms)}


def _offset_record(calibration: Calibration, joint: int, slides: bool) -> Json:
    """Offset of the transducer; null where the campaign does not tell the commands at the arm's marks."""
    known = calibration.campaign.home is not None
    offset = calibration.estimate.arm.transmissions[joint - 1].offset if known else np.nan
    std = calibration.estimate.offset_std[joint - 1] if known else np.nan
    if slides:
        return {"offset_mm": mm(offset), "offset_std_mm": mm(std)}
    return {"offset_deg": degrees(offset), "offset_std_deg": degrees(std)}
