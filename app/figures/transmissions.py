"""The error of one joint's drive: commanded minus actual displacement, before and after the fit."""

import plotly.graph_objects as go

from app.figures.curves import Observed, curve_figure, fitted_curve
from core.calibration import Calibration
from core.wording import display_unit


def transmission_figure(calibration: Calibration, joint: int) -> go.Figure:
    """The transmission error of a joint that was swept, 1..n."""
    fit = calibration.estimate.transmissions[joint - 1]
    unit, scale = display_unit(calibration.campaign.robot.joints[joint - 1].slides)
    motions = [m for m in calibration.motions if m.found.sweep.joint == joint]
    observed = []
    for index, motion in enumerate(motions):
        x = motion.curve.displacement + fit.start[index]
        observed.append(
            Observed(
                name=f"sweep {motion.found.sweep.number}",
                x=x * scale,
                before=(motion.curve.y - x) * scale,
                after=fit.residual[index] * scale,
                std=motion.curve.std * scale,
            )
        )
    low, high = min(o.x.min() for o in observed) / scale, max(o.x.max() for o in observed) / scale
    fitted = fitted_curve(fit, low, high, 1.0, calibration.campaign.home is not None, scale)
    return curve_figure(
        f"Joint {joint}: commanded − actual",
        tuple(observed),
        fitted,
        f"actual displacement [{unit}]",
        unit,
    )
