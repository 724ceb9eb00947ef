"""The passive motion of a coupled joint: its deviation from the nominal gain, before and after the fit."""

import plotly.graph_objects as go

from app.figures.curves import Observed, curve_figure, fitted_curve
from core.calibration import Calibration
from core.wording import display_unit


def coupling_figure(calibration: Calibration, joint: int) -> go.Figure:
    """The passive motion of a joint (2..n) whose coupling was observed, against the active one of the joint below."""
    robot, fit = calibration.campaign.robot, calibration.estimate.couplings[joint - 1]
    gain = float(robot.coupling_gains[joint - 1])
    unit, scale = display_unit(robot.joints[joint - 1].slides)
    below_unit, below_scale = display_unit(robot.joints[joint - 2].slides)
    motions = [m for m in calibration.motions if m.found.sweep.joint == joint - 1 and m.passive is not None]
    observed = []
    for index, motion in enumerate(motions):
        curve = motion.passive
        observed.append(
            Observed(
                name=f"sweep {motion.found.sweep.number}",
                x=curve.displacement * below_scale,
                before=(curve.y - fit.start[index] - gain * curve.displacement) * scale,
                after=fit.residual[index] * scale,
                std=curve.std * scale,
            )
        )
    low, high = min(o.x.min() for o in observed), max(o.x.max() for o in observed)
    fitted = fitted_curve(fit, low / below_scale, high / below_scale, gain, False, 1.0)
    fitted = type(fitted)(fitted.x * below_scale, fitted.deviation * scale, fitted.std * scale)
    return curve_figure(
        f"Joint {joint}, dragged along by joint {joint - 1}",
        tuple(observed),
        fitted,
        f"active displacement of joint {joint - 1} [{below_unit}]",
        unit,
    )
