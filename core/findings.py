"""What the numbers say of an arm, in sentences like those of section 4 of the paper.

A finding compares the calibrated arm with the nominal one in a quantity that means something to the one who has to
mend it: how far apart two axes are, how far from parallel, where a drive's zero is. Each comes with its standard
uncertainty and is called significant where it exceeds two of them.
"""

from dataclasses import dataclass

import numpy as np

from core.estimate import ArmEstimate, axis_basis
from core.geometry import Array, Line, angle_between, common_normal, cross
from core.motion_forms import MotionFunction
from core.phi_convention import PARALLEL_SINE
from core.phi_model import PARAMETERS, PhiModel
from core.robot import Robot

SIGNIFICANT = 2.0
"""A deviation is significant beyond that many standard uncertainties."""
NOTHING_M = 1e-6
"""A length that is designed shorter than this is none."""


@dataclass(frozen=True)
class Finding:
    """One deviation of the arm from its design."""

    text: str
    parameter: str
    deviation: float
    """Actual minus nominal, m or rad."""
    std: float
    frame: int | None = None
    joint: int | None = None

    @property
    def significant(self) -> bool:
        return bool(abs(self.deviation) > SIGNIFICANT * self.std)

    @property
    def is_length(self) -> bool:
        return self.parameter.endswith("_m")


def findings(robot: Robot, nominal: PhiModel | None, estimate: ArmEstimate) -> tuple[Finding, ...]:
    """All findings, the significant ones first, each group by how many uncertainties it deviates.

    Readings at the arm's marks are stated, not estimated, and have no uncertainty: they close the significant ones.

    Args:
        robot: the nominal robot.
        nominal: its phi-model; None: not every joint was swept, so that only the drives are judged.
        estimate: the calibrated arm.
    """
    found = [*_of_drives(robot, estimate)]
    if nominal is not None and estimate.geometry is not None:
        found += _of_axis_pairs(robot, estimate)
        found += _of_parameters(nominal, estimate)
    return tuple(sorted(found, key=lambda f: (not f.significant, f.std == 0, -abs(f.deviation) / max(f.std, 1e-15))))


def meaning(frame: int, parameter: str, nominal: float) -> str:
    """What differs where a parameter of a frame does: the length of a link, or the place or lean of the next axis.

    Args:
        frame: 1..n-1.
        parameter: one of ``PARAMETERS``.
        nominal: its designed value, m or rad.
    """
    if not parameter.endswith("_m"):
        return f"axis {frame + 1} leans"
    return f"axis {frame + 1} is shifted" if abs(nominal) < NOTHING_M else f"link {frame} is"


def sense(parameter: str, nominal: float, deviation: float) -> str:
    """How the actual size of a parameter, m or rad, compares with the designed one; empty: none is designed."""
    larger = abs(nominal + deviation) >= abs(nominal)
    if not parameter.endswith("_m"):
        return "more" if larger else "less"
    if abs(nominal) < NOTHING_M:
        return ""
    return "longer" if larger else "shorter"


def _of_parameters(nominal: PhiModel, estimate: ArmEstimate) -> list[Finding]:
    geometry = estimate.geometry
    difference = geometry.model.parameters - nominal.parameters
    return [
        _parameter_finding(int(i) + 1, name, nominal.parameters[i, k], (difference[i, k], geometry.std[i, k]))
        for i, k in np.argwhere(geometry.std > 0)
        for name in [PARAMETERS[k]]
    ]


def _parameter_finding(frame: int, parameter: str, nominal: float, deviation: tuple[float, float]) -> Finding:
    size, std = deviation
    compared = sense(parameter, nominal, size)
    by = "" if compared in ("longer", "shorter") else "by "
    text = f"{meaning(frame, parameter, nominal)} {by}{_plain(abs(size), std, parameter.rpartition('_')[2])}"
    text += f" {compared} than designed" if compared else ""
    return Finding(f"{text} ({parameter.rpartition('_')[0]} {frame})", parameter, size, std, frame)


def _of_axis_pairs(robot: Robot, estimate: ArmEstimate) -> list[Finding]:
    """Distances and angles between consecutive axes: they do not depend on any choice of frames."""
    nominal, actual, found = robot.axes_at_zero(), estimate.arm.axes, []
    for i in range(robot.joint_count - 1):
        pair = slice(4 * i, 4 * i + 8)
        covariance = estimate.axis_covariance[pair, pair]
        names = f"axes {i + 1} and {i + 2}"
        parallel = abs(np.sin(angle_between(nominal[i].direction, nominal[i + 1].direction))) < PARALLEL_SINE
        measures = [(_angle_finding, axis_angle)]
        if not robot.sliding[i] and not robot.sliding[i + 1]:
            measures.append((_distance_finding, parallel_distance if parallel else crossing_distance))
        for finding, measure in measures:
            value, gradient = measure(actual[i], actual[i + 1])
            deviation = value - measure(nominal[i], nominal[i + 1])[0]
            std = float(np.sqrt(max(gradient @ covariance @ gradient, 0.0)))
            found.append(finding(names, i + 1, (deviation, std), parallel))
    return found


def _angle_finding(names: str, frame: int, deviation: tuple[float, float], parallel: bool) -> Finding:
    size, std = deviation
    if parallel:
        text = f"{names} are {_plain(abs(size), std, 'rad')} out of parallel"
    else:
        sense = "larger" if size > 0 else "smaller"
        text = f"{names} enclose an angle {_plain(abs(size), std, 'rad')} {sense} than designed"
    return Finding(text, "angle_rad", size, std, frame=frame)


def _distance_finding(names: str, frame: int, deviation: tuple[float, float], parallel: bool) -> Finding:
    size, std = deviation
    verb = "are" if parallel else "pass each other"
    sense = "further apart" if size > 0 else "closer together"
    text = f"{names} {verb} {_plain(abs(size), std, 'm')} {sense} than designed"
    return Finding(text, "distance_m", size, std, frame=frame)


def axis_angle(first: Line, second: Line) -> tuple[float, Array]:
    """The angle between two axes, near parallel ones taken without sense, and its gradient, (8,).

    Gradients are by tilts and shifts of the first axis, then of the second, see ``ArmEstimate.axis_covariance``.
    """
    sense = -1.0 if first.direction @ second.direction < -np.cos(np.arcsin(PARALLEL_SINE)) else 1.0
    one, two = first.direction, sense * second.direction
    angle = angle_between(one, two)
    sine = max(np.sin(angle), 1e-12)
    by_first = axis_basis(first.direction) @ ((np.cos(angle) * one - two) / sine)
    by_second = sense * axis_basis(second.direction) @ ((np.cos(angle) * two - one) / sine)
    return angle, np.concatenate([by_first, np.zeros(2), by_second, np.zeros(2)])


def crossing_distance(first: Line, second: Line) -> tuple[float, Array]:
    """The shortest distance between two axes that are not parallel, and its gradient, (8,)."""
    foot_1, foot_2 = common_normal(first, second)
    normal = cross(first.direction, second.direction)
    normal = normal / np.linalg.norm(normal)
    apart = float((foot_2 - foot_1) @ normal)
    return abs(apart), np.sign(apart) * _by_feet(first, second, normal, foot_1, foot_2)


def parallel_distance(first: Line, second: Line) -> tuple[float, Array]:
    """The distance of the second axis' point from the first axis, for nearly parallel axes, and its gradient, (8,)."""
    foot = first.foot_of(second.point_m)
    apart = float(np.linalg.norm(second.point_m - foot))
    normal = (second.point_m - foot) / max(apart, 1e-12)
    return apart, _by_feet(first, second, normal, foot, second.point_m)


def _by_feet(first: Line, second: Line, normal: Array, foot_1: Array, foot_2: Array) -> Array:
    """Change of the distance of two feet along their normal: a tilt moves a foot by its way along the axis."""
    out = np.empty(8)
    for at, line, foot, sign in ((0, first, foot_1, -1.0), (4, second, foot_2, 1.0)):
        along = sign * axis_basis(line.direction) @ normal
        out[at : at + 2] = along * ((foot - line.point_m) @ line.direction)
        out[at + 2 : at + 4] = along
    return out


def _of_drives(robot: Robot, estimate: ArmEstimate) -> list[Finding]:
    found = []
    for joint, fit in enumerate(estimate.transmissions, 1):
        if fit is None:
            continue
        slides = bool(robot.sliding[joint - 1])
        suffix = "_m" if slides else "_rad"
        offset, std = estimate.arm.transmissions[joint - 1].offset, float(estimate.offset_std[joint - 1])
        if std > 0 or offset != 0:
            found.append(_zero_finding(robot, joint, estimate, suffix))
        if fit.form.name == "ratio":
            error, std = 1.0 / fit.coefficients[0] - 1.0, float(fit.std[0]) / fit.coefficients[0] ** 2
            sense = "further" if error > 0 else "less far"
            text = f"joint {joint} moves {abs(error):.2%} +- {std:.2%} {sense} than commanded"
            found.append(Finding(text, "ratio", error, std, joint=joint))
        elif len(fit.coefficients) >= 2:
            found.append(_periodic_finding(joint, MotionFunction(fit.form, fit.coefficients), fit.covariance))
    return found


def _zero_finding(robot: Robot, joint: int, estimate: ArmEstimate, suffix: str) -> Finding:
    """What the joint reads at the arm's marks, where it should read zero."""
    reading = float(estimate.arm.commanded_for(np.zeros(robot.joint_count))[0, joint - 1])
    text = f"joint {joint} reads {_plain(reading, 0.0, suffix[1:])} at the arm's marks, where it should read zero"
    return Finding(text, f"zero{suffix}", reading, 0.0, joint=joint)


def _periodic_finding(joint: int, function: MotionFunction, covariance: Array) -> Finding:
    s, c = function.coefficients[:2]
    size = float(np.hypot(s, c)) * function.form.constants().get("N", 1.0)
    gradient = np.zeros(len(function.coefficients))
    gradient[:2] = np.array([s, c]) / max(np.hypot(s, c), 1e-15) * function.form.constants().get("N", 1.0)
    std = float(np.sqrt(gradient @ covariance @ gradient))
    text = f"the drive of joint {joint} errs by up to {_plain(size, std, 'rad')} once a turn"
    return Finding(text, "eccentricity_rad", size, std, joint=joint)


def _plain(value: float, std: float, unit: str) -> str:
    """A size with its standard uncertainty, in mm or deg: 3.1 mm +- 0.2 mm."""
    scale, name = (1e3, "mm") if unit == "m" else (180 / np.pi, "deg")
    value, std = value * scale, std * scale
    digits = 3 if std <= 0 else int(np.clip(1 - np.floor(np.log10(std)), 0, 4))
    error = f" +- {std:.{digits}f} {name}" if std > 0 else ""
    return f"{value:.{digits}f} {name}{error}"
