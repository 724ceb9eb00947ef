"""Transmission functions from sweeps: what a motor was asked for against what its joint did (equations 8 and 13)."""

from core.function_fit import FunctionFit, SweepCurve, choose_function, fit_function
from core.motion_forms import MotionForm, transmission_form
from core.robot import Joint

UNLIKELY_RATIO = 0.1
"""Prior odds of a wrong ratio at a turning joint: the tooth counts of a gear train are exact."""


def candidates(joint: Joint) -> tuple[tuple[MotionForm, float], ...]:
    """The families that a joint's drive may have, with prior odds."""
    direct, ratio = transmission_form("direct"), transmission_form("ratio")
    if joint.slides:
        return ((direct, 1.0), (ratio, 1.0))
    families = [(direct, 1.0), (ratio, UNLIKELY_RATIO), (transmission_form("first_harmonic"), 1.0)]
    if joint.drive_ratio is not None:
        families.append((transmission_form("gear", joint.drive_ratio), 1.0))
    families.append((transmission_form("harmonics_2"), 1.0))
    return tuple(families)


def fit_transmission(joint: Joint, curves: tuple[SweepCurve, ...], home: bool) -> FunctionFit:
    """Fit the transmission function of one joint: actual displacement to commanded displacement of its motor.

    Args:
        joint: tells the kind of drive and, if set, the family to be used.
        curves: one for each sweep of the joint; y is the commanded active displacement, from the zero of commands or,
            with ``home``, from the command at the arm's marks.
        home: whether the arm's marks define zero displacement.

    Raises:
        InputError: the robot's description names a family that does not exist.
        NotConverged: no family could be fitted.
    """
    if joint.transmission == "auto":
        return choose_function(candidates(joint), curves, home=home)
    return fit_function(transmission_form(joint.transmission, joint.drive_ratio), curves, home=home)
