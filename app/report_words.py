"""The fixed words of the report, and the facts of its head: object, instrument, conditions."""

import numpy as np

from core.calibration import Calibration
from core.geometry import Array
from core.robot import JointKind
from core.version import VERSION
from core.wording import duration, stated_noise_m, two_digits

ESTIMATORS = {
    "likelihood": "maximum likelihood with the points' covariances",
    "paper": "Sultan and Wager's least squares (equations 3 to 5)",
}
KINDS = {JointKind.REVOLUTE: "turning", JointKind.PRISMATIC: "sliding", JointKind.PASSIVE: "passive"}
COMMANDS = {
    "commanded": "as commanded",
    "goal": "a planner's goals",
    "readback": "as read back from the joints",
}
CONVENTIONS = (
    "Every joint is moved on its own while a point on the arm is measured. The points of one sweep lie on a circle "
    "about the joint's axis (on a line along it where the joint slides), so the axis is found without believing any "
    "command. Joint by joint, the displacements about these axes give the drives, the couplings and the geometry. "
    "From that start all parameters are fitted to all points at once, weighted by their noise; that is the result.",
    "Displacement is positive in the sense in which a positive command moves the joint, and counts from the arm's "
    "marks where the campaign gives their readings, else from command zero. The functions of the drives map actual "
    "to commanded displacement; those of the couplings map the active displacement of one joint to the passive one "
    "of the next.",
    "Frames of the phi-model: Z of frame 1 on the axis of joint 1; Y of frame 1 along the common normal from axis 1 "
    "to axis 2; its origin where that normal meets axis 1; phi of frame 1 is 90 deg. Where axes 1 and 2 are "
    "parallel, Y of frame 1 points from one to the other. Through a sliding axis only a direction is known: a and b "
    "are zero.",
    "Lengths are mm, angles deg, unless a heading says otherwise. u and the number after ± are standard "
    "uncertainties (one standard deviation); they rest on the noise as estimated from these points, not on a data "
    "sheet.",
)
TERMS = (
    ("Active, passive", "What a joint's own motor makes it do; what the motor of the joint below does to it as well."),
    (
        "Axial, radial, tangential",
        "Along the axis of the swept joint; away from it; along the arc on which the point moves.",
    ),
    ("Coupling", "A linkage or gear through which the motor of one joint moves the next joint too."),
    ("Noise σ", "Standard deviation of one coordinate of a point, root mean square over points and directions."),
    (
        "RMS",
        "Root mean square. Axial, radial and tangential ones are of one direction; of lengths in space where it says"
        " so.",
    ),
    (
        "phi-model",
        "The link parameters a, b, α, θ between consecutive axes, with an angle φ chosen so that parallel axes are "
        "no special case.",
    ),
    (
        "Rejected",
        "A point so far out that noise would put any point of its sweep there less than once in a thousand times.",
    ),
    (
        "Significant",
        "Further off than two standard uncertainties. One value in twenty is, by chance, on a perfect arm.",
    ),
    (
        "Standard uncertainty u",
        "The standard deviation that belongs to a value; it is within ±2 u of the truth about 95 times in 100.",
    ),
    ("Sweep", "A sequence of stops in which one joint alone is moved by its motor."),
)


def facts(calibration: Calibration) -> tuple[tuple[str, str], ...]:
    """Object, instrument and conditions, label and value; what nobody recorded is left out or said to be unknown."""
    campaign, table = calibration.campaign, calibration.campaign.measurements
    kinds = [KINDS[joint.kind] for joint in campaign.robot.joints]
    joints = ", ".join(f"{kinds.count(k)} {k}" for k in dict.fromkeys(kinds))
    stated = stated_noise_m(calibration)
    found = [
        ("Robot", campaign.robot.name),
        ("Joints", f"{len(kinds)} ({joints})"),
        ("Instrument", campaign.instrument.kind.replace("-", " ")),
        *((_label(key), str(value)) for key, value in campaign.instrument.description.items()),
        (
            "Stated noise",
            "none" if stated is None else f"{two_digits(stated * 1e3)} mm, one coordinate",
        ),
        ("Joint values", COMMANDS.get(campaign.joint_values, campaign.joint_values)),
        ("Air temperature", _range(table.temperature_c, "°C")),
        ("Arm temperature", _range(table.arm_temperature_c, "°C")),
        ("Payload", _range(table.payload_kg, "kg")),
        ("Time span", _time(table.time_s)),
        *((_label(key), str(value)) for key, value in campaign.notes.items()),
        ("Axis estimator", ESTIMATORS.get(calibration.estimator, calibration.estimator)),
        ("Software", f"trueaxis {VERSION}"),
        ("SHA-256 of input", campaign.digest or "not read from files"),
    ]
    return tuple(found)


def key_numbers(calibration: Calibration) -> tuple[tuple[str, str], ...]:
    """The numbers on top of the report."""
    residuals, stated = calibration.refinement.residuals, stated_noise_m(calibration)
    used = residuals.used
    length = np.linalg.norm(residuals.residual_m[used], axis=1)
    judged = [f for f in calibration.findings if f.std > 0]
    return (
        ("Significant deviations", f"{sum(f.significant for f in judged)} of {len(judged)}"),
        ("Noise σ estimated", f"{two_digits(calibration.estimate.noise_m * 1e3)} mm"),
        ("Noise σ stated", "none" if stated is None else f"{two_digits(stated * 1e3)} mm"),
        ("Residuals, RMS length", f"{two_digits(1e3 * np.sqrt(np.mean(length**2)))} mm"),
        ("Points used", f"{used.sum()}"),
        ("Points rejected", f"{(~used).sum()}"),
    )


def _range(values: Array | None, unit: str) -> str:
    known = np.array([]) if values is None else values[np.isfinite(values)]
    if len(known) == 0:
        return "not recorded"
    low, high = known.min(), known.max()
    return f"{low:.3g} {unit}" if low == high else f"{low:.1f} to {high:.1f} {unit}"


def _time(values: Array | None) -> str:
    known = np.array([]) if values is None else values[np.isfinite(values)]
    return duration(float(np.ptp(known))) if len(known) > 1 else "not recorded"


def _label(key: str) -> str:
    words = str(key).replace("_", " ")
    return words[:1].upper() + words[1:]
