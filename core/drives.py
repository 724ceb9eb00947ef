"""From fitted constants to the functions of an arm: nominal where nothing was seen, with transducers' offsets."""

from dataclasses import replace

import numpy as np

from core.function_fit import FunctionFit
from core.geometry import Array
from core.measurements import Campaign
from core.motion_forms import MotionFunction, coupling_form, transmission_form


def drive_functions(campaign: Campaign, fits: list[FunctionFit | None]) -> tuple[MotionFunction, ...]:
    """The transmission functions with their offsets; nominal where a joint was not swept."""
    plain = [
        MotionFunction(transmission_form("direct"), np.zeros(0))
        if fit is None
        else MotionFunction(fit.form, fit.coefficients)
        for fit in fits
    ]
    return tuple(replace(f, offset=float(o)) for f, o in zip(plain, offsets(campaign, plain), strict=True))


def coupling_functions(campaign: Campaign, fits: list[FunctionFit | None]) -> tuple[MotionFunction | None, ...]:
    """The coupling functions into each joint; the nominal gain where none was observed."""
    out: list[MotionFunction | None] = []
    for joint, fit in enumerate(fits, 1):
        coupling = campaign.robot.coupling_into(joint)
        if coupling is None:
            out.append(None)
        elif fit is None:
            out.append(MotionFunction(coupling_form("proportional", coupling.gain), np.array([coupling.gain])))
        else:
            out.append(MotionFunction(fit.form, fit.coefficients))
    return tuple(out)


def offsets(campaign: Campaign, drives: list[MotionFunction]) -> Array:
    """Offsets of the transducers, by which the commands at the arm's marks read what they do, rad or m, (n,)."""
    if campaign.home is None:
        return np.zeros(len(drives))
    at_zero = np.array([replace(drive, offset=0.0)(0.0) for drive in drives])
    gains = np.where(campaign.robot.coupling_compensated, campaign.robot.coupling_gains, 0.0)
    return campaign.home - at_zero - gains * np.concatenate([[0.0], at_zero[:-1]])


def offset_std(campaign: Campaign, fits: list[FunctionFit | None]) -> Array:
    """Standard uncertainties of the offsets, from the constants of the functions, (n,)."""
    if campaign.home is None:
        return np.zeros(len(fits))
    gains = np.where(campaign.robot.coupling_compensated, campaign.robot.coupling_gains, 0.0)
    variance = np.zeros(len(fits))
    for k, fit in enumerate(fits):
        if fit is not None:
            gradient = fit.form.evaluate(np.zeros(1), fit.coefficients)[2][0]
            variance[k] = gradient @ fit.covariance @ gradient
    return np.sqrt(variance + gains**2 * np.concatenate([[0.0], variance[:-1]]))
