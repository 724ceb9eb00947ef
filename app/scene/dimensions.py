"""What differs between the nominal and the actual arm, as dimensions in space, exaggerated.

Each frame is compared on its own: its phi-frame is taken where the nominal arm has it, and the next axis is drawn twice
from there, as designed and as it is, the difference exaggerated. So one sees which link is long and which axis leans
without the errors of the frames below it. The next axis gets from its nominal to its actual place in two steps,

    along Z_phi by the difference of a,   then along the common normal X by that of b,

and its direction in two more, shown at a distance from that place: a turn about X by the difference of alpha,
then about Z_phi by that of theta.
"""

from dataclasses import dataclass

import numpy as np

from app.scene.colours import round_down
from core.estimate import Geometry
from core.findings import SIGNIFICANT, meaning, sense
from core.geometry import Array, Line
from core.phi_model import PARAMETERS, PhiModel, frames
from core.phi_transforms import link_transform, phi_transform
from core.wording import decimals_for, fixed, parameter_sign, parameter_unit

LARGEST_ANGLE_RAD = np.deg2rad(75.0)
"""No exaggerated angle is drawn larger: beyond it one could no longer tell which way an axis leans."""


@dataclass(frozen=True)
class Dimension:
    """One difference between actual and nominal, at its place in the instrument's frame, all joints at zero."""

    frame: int
    """1..n-1: from the axis of that joint to the next one."""
    parameter: str
    """``a_m``, ``b_m``, ``alpha_rad`` or ``theta_rad``."""
    from_m: Array
    """Nominal end, (3,)."""
    to_m: Array
    """Actual end, exaggerated, (3,)."""
    deviation: float
    """Actual minus nominal, m or rad, as it is."""
    std: float
    text: str
    """What it means, and the deviation with its uncertainty: link 2 is longer: a₂ −3.10 ± 0.22 mm."""
    significant: bool

    @property
    def middle_m(self) -> Array:
        return (self.from_m + self.to_m) / 2


@dataclass(frozen=True)
class FrameSketch:
    """What is drawn of one frame: its phi-frame, the way to the next axis, and that axis; twice."""

    frame: int
    phi_frame: Array
    """From the nominal phi-frame to the instrument's frame, (4, 4)."""
    nominal_way_m: Array
    """From the phi-frame along Z_phi, then along the common normal to the next axis: three points, (3, 3)."""
    actual_way_m: Array
    """The same, exaggerated, (3, 3)."""
    nominal_axis: Line
    """The next axis as designed; its point is the end of the way."""
    actual_axis: Line
    """As it is, exaggerated."""


def dimensions(
    nominal: PhiModel, geometry: Geometry, base: Array, exaggeration: float = 1.0, arm_m: float = 0.3
) -> list[Dimension]:
    """All differences that are estimated (not fixed by agreement), frame by frame.

    Args:
        nominal: the design.
        geometry: the actual arm in the same convention, with uncertainties.
        base: where the design's frame 1 stands in the instrument's frame, (4, 4); usually ``geometry.base``.
        exaggeration: how many times too large differences are drawn.
        arm_m: how far from its place the lean of an axis is shown.
    """
    out = []
    for i, sketch in enumerate(sketches(nominal, geometry, base, exaggeration)):
        deviation = geometry.model.parameters[i] - nominal.parameters[i]
        corners = _corners(nominal, sketch, i, deviation, exaggeration, arm_m)
        for k, name in enumerate(PARAMETERS):
            if geometry.std[i, k] > 0:
                ends = corners[k]
                designed = float(nominal.parameters[i, k])
                what = f"{meaning(i + 1, name, designed)} {sense(name, designed, float(deviation[k]))}".rstrip()
                out.append(_dimension(i + 1, name, ends, float(deviation[k]), float(geometry.std[i, k]), what))
    return out


def sketches(nominal: PhiModel, geometry: Geometry, base: Array, exaggeration: float = 1.0) -> list[FrameSketch]:
    """What is drawn of frames 1..n-1; arguments as for ``dimensions``.

    Raises:
        ValueError: both models do not have the same number of frames, or the exaggeration is not a finite number.
    """
    if nominal.parameters.shape != geometry.model.parameters.shape or not np.isfinite(exaggeration):
        raise ValueError("nominal and actual model need the same frames, and the exaggeration must be finite")
    phi_frames = frames(nominal, np.zeros(len(nominal.sliding)), base)[:-1] @ phi_transform(nominal.phi_rad)
    drawn = nominal.parameters + _exaggerated(geometry.model.parameters - nominal.parameters, exaggeration)
    out = []
    for i, phi_frame in enumerate(phi_frames):
        ideal, actual = (phi_frame @ link_transform(*row) for row in (nominal.parameters[i], drawn[i]))
        # Place and direction are shown apart: the way turns by no exaggerated angle.
        place = phi_frame @ link_transform(drawn[i, 0], drawn[i, 1], *nominal.parameters[i, 2:])
        out.append(
            FrameSketch(
                frame=i + 1,
                phi_frame=phi_frame,
                nominal_way_m=_way(phi_frame, ideal, nominal.parameters[i, 0]),
                actual_way_m=_way(phi_frame, place, drawn[i, 0]),
                nominal_axis=Line(ideal[:3, 3], ideal[:3, 2]),
                actual_axis=Line(place[:3, 3], actual[:3, 2]),
            )
        )
    return out


def fitting_exaggeration(nominal: PhiModel, geometry: Geometry, reach_m: float) -> float:
    """A round factor (1, 2 or 5 times a power of ten, at least 1) that makes the largest differences easy to see.

    The largest length gets at most 0.18 of the reach, the largest angle at most 35 degrees.
    """
    size = np.where(geometry.std > 0, np.abs(geometry.model.parameters - nominal.parameters), 0.0)
    largest = max(size[:, :2].max() / (0.18 * reach_m), size[:, 2:].max() / np.deg2rad(35.0), 1e-6)
    return max(round_down(1.0 / largest), 1.0)


def _exaggerated(deviation: Array, exaggeration: float) -> Array:
    """Deviations (..., 4) as they are drawn."""
    out = exaggeration * deviation
    out[..., 2:] = np.clip(out[..., 2:], -LARGEST_ANGLE_RAD, LARGEST_ANGLE_RAD)
    return out


def _way(phi_frame: Array, following: Array, a_m: float) -> Array:
    return np.stack([phi_frame[:3, 3], phi_frame[:3, 3] + a_m * phi_frame[:3, 2], following[:3, 3]])


def _corners(
    nominal: PhiModel, sketch: FrameSketch, i: int, deviation: Array, exaggeration: float, arm_m: float
) -> list[tuple[Array, Array]]:
    """From and to of the four dimensions of frame i + 1."""
    a, b, alpha, theta = nominal.parameters[i]
    da, db, dalpha, dtheta = _exaggerated(deviation, exaggeration)
    places = [
        (sketch.phi_frame @ link_transform(*row))[:3, 3]
        for row in ((a, b, alpha, theta), (a + da, b, alpha, theta), (a + da, b + db, alpha, theta))
    ]
    angles = ((alpha, theta), (alpha + dalpha, theta), (alpha + dalpha, theta + dtheta))
    tips = [places[2] + arm_m * (sketch.phi_frame @ link_transform(0.0, 0.0, *two))[:3, 2] for two in angles]
    return [(places[0], places[1]), (places[1], places[2]), (tips[0], tips[1]), (tips[1], tips[2])]


def _dimension(
    frame: int, parameter: str, ends: tuple[Array, Array], deviation: float, std: float, what: str
) -> Dimension:
    unit, scale = parameter_unit(parameter)
    decimals = decimals_for(std * scale)
    sign = "+" if deviation >= 0 else ""
    value = f"{sign}{fixed(deviation * scale, decimals)} ± {fixed(std * scale, decimals)}"
    name = parameter_sign(parameter.rpartition("_")[0], frame)
    text = f"{what}: {name} {value}{'°' if unit == 'deg' else f' {unit}'}"
    return Dimension(frame, parameter, *ends, deviation, std, text, bool(abs(deviation) > SIGNIFICANT * std))
