"""The ASEA IRB L6 of Sultan and Wager: the nominal robot, and the arm that table 2 and section 4 describe.

What is theirs: both columns of table 2, the axis lines, transmission and coupling functions of section 4, the gear
ratio 32/19. Two printed numbers are taken as misprints, because the axis lines and table 2 agree only without them: the
y-coordinate of the point on axis 2 (4.4418 m here, printed 4.4442) and a_4 (-0.08 mm here, printed -0.7 mm).

What is this project's choice: the signs within the functions (lost in the text at hand, all taken as printed there,
that is positive), joint limits, tool, masses, and the transducer offsets, which were not published. The offsets are
such that the nominal model misses twelve test poses by 47.0 mm and 0.050 rad on average, as reported there.
"""

from functools import lru_cache

import numpy as np

from core.arm import Arm
from core.geometry import Array, Line
from core.motion_forms import Arctangent, CouplingGear, Direct, DriveGear, Harmonics, MotionFunction, Proportional
from core.phi_convention import convention_for
from core.phi_model import PhiModel, axes, from_axes
from core.robot import Coupling, Joint, JointKind, LinkMass, Robot
from core.robot_builders import PhiTool, robot_from_phi

RATIO = 32 / 19
PHI_RAD = np.array([np.pi / 2, 0.0, 0.0, 0.0, 0.0])
TURNING = np.zeros(6, dtype=bool)

AXIS_POINTS_M = (
    (-3.1423, 4.4394, -0.526123),
    (-3.1352, 4.4418, -0.5293),
    (-3.1367, 4.4388, 0.1638),
    (-3.1367, 5.1116, 0.16354),
    (-3.14308, 4.44598, 0.16303),
    (-3.1565, 5.3466, -0.52353),
)
AXIS_DIRECTIONS = (
    (0.001445, 0.002876, 0.999995),
    (0.999898, 0.013323, 0.0051096),
    (0.999983, 0.00537, 0.002136),
    (0.999917, 0.012724, 0.002198),
    (-0.014096, 0.99990, 0.000597),
    (-0.006872, 0.002904, -0.999972),
)
"""Section 4's axis lines in the frame of the left-hand theodolite; here they give the base frame only."""

FOUR_BAR = ((-0.998132, 0.213253, -0.212863), (1.0, 0.096654, 0.0006941))
"""Section 4's coupling 2 -> 3: (n0, n1, n2) of the numerator, (d0, d1, d2) of the denominator."""

OFFSETS_RAD = np.array([0.03192, -0.02483, -0.01773, 0.02798, -0.03638, 0.02518])
"""Transducer offsets of the twin: a pattern of this project, scaled to the reported errors of the nominal model."""


def nominal_model() -> PhiModel:
    """Table 2, nominal."""
    return PhiModel(
        PHI_RAD,
        a_m=np.array([0.0, -0.690, -0.670, 0.0, 0.0]),
        b_m=np.array([0.0, 0.0, 0.0, 0.0, -0.2325]),
        alpha_rad=np.deg2rad([90.0, 90.0, 90.0, 90.0, 90.0]),
        theta_rad=np.deg2rad([-90.0, -180.0, -180.0, -90.0, -90.0]),
        sliding=TURNING,
    )


def actual_model() -> PhiModel:
    """Table 2, actual, with a_4 = -0.08 mm as the axis lines have it instead of the printed -0.7 mm."""
    return PhiModel(
        PHI_RAD,
        a_m=np.array([0.00232, -0.6931, -0.6727, -0.00008, -0.0039]),
        b_m=np.array([0.0, 0.00487, 0.00162, 0.00297, -0.2331]),
        alpha_rad=np.deg2rad([90.0, 89.828, 90.4213, 89.8033, 89.4829]),
        theta_rad=np.deg2rad([-90.378, -179.54, -179.99, -89.921, -90.137]),
        sliding=TURNING,
    )


def actual_base() -> Array:
    """From the actual frame 1 to the left-hand theodolite, (4, 4), by section 4's axis lines."""
    convention = convention_for(axes(nominal_model()), TURNING, PHI_RAD, y_reference=np.array([0.0, 1.0, 0.0]))
    lines = tuple(Line(np.array(p), np.array(z)) for p, z in zip(AXIS_POINTS_M, AXIS_DIRECTIONS, strict=True))
    return from_axes(lines, convention)[0]


@lru_cache
def nominal_robot() -> Robot:
    """The arm as its maker drew it; the tool's point lies 0.12 m from frame 6 along axis 6."""
    return robot_from_phi(
        "ASEA IRB L6",
        _joints(),
        nominal_model(),
        tool=PhiTool(phi_rad=np.pi / 2, alpha_rad=-np.pi / 2, gamma_rad=np.pi, h_m=0.12),
        couplings=(
            Coupling(2, 3, -1.0, form="arctangent"),
            Coupling(3, 4, -1.0, form="proportional"),
            Coupling(4, 5, RATIO, form="gear"),
        ),
        links=_links(),
        gravity_direction=(0.0, 0.0, -1.0),
    )


def true_arm(offsets_rad: Array = OFFSETS_RAD) -> Arm:
    """The arm as it is, in the frame of the left-hand theodolite.

    Geometry: table 2, actual (a_4 = -0.00008 m, recovered), its frame 1 placed by section 4's axis lines. Drives:
    section 4's functions in the forms of ``core.motion_forms``, couplings counted from zero.

    Args:
        offsets_rad: transducer offsets, (6,).
    """
    return Arm(
        nominal_robot(),
        axes(actual_model(), actual_base()),
        transmissions=tuple(
            MotionFunction(f.form, f.coefficients, float(o)) for f, o in zip(_drives(), offsets_rad, strict=True)
        ),
        couplings=(
            None,
            None,
            MotionFunction(Arctangent(-1.0), four_bar_constants(*FOUR_BAR)),
            MotionFunction(Proportional(-1.0, "proportional", "gain"), np.array([-1.0])),
            MotionFunction(CouplingGear(RATIO), np.array([0.040562, 0.000018])),
            None,
        ),
    )


def four_bar_constants(numerator: tuple[float, ...], denominator: tuple[float, ...]) -> Array:
    """n0, n1, d1, d2 of the arctangent form that equals a printed function less its value at zero, (4,).

    The fraction is a vector (denominator, numerator); taking off the angle that it has at x = 0 turns this vector back
    by that angle. Then the numerator is zero at zero (n2 = -n1), and a common factor makes d0 = 1.
    """
    n, d = np.array(numerator), np.array(denominator)
    angle = np.arctan2(n[1] + n[2], d[0] + d[2])
    # The numerator is written sine first, the denominator cosine first.
    top = np.cos(angle) * n - np.sin(angle) * d[[1, 0, 2]]
    bottom = np.sin(angle) * n[[1, 0, 2]] + np.cos(angle) * d
    return np.array([top[0], top[1], bottom[1], bottom[2]]) / bottom[0]


def _drives() -> tuple[MotionFunction, ...]:
    """Section 4's transmission functions, signs as printed."""
    first = Harmonics(1)
    return (
        MotionFunction(first, np.array([0.000771, 0.000007])),
        MotionFunction(first, np.array([0.001094, 0.001317])),
        MotionFunction(first, np.array([0.003462, 0.000867])),
        MotionFunction(Direct(), np.zeros(0)),
        MotionFunction(DriveGear(RATIO), np.array([0.041227, 0.000013])),
        MotionFunction(first, np.array([0.017334, 0.002677])),
    )


def _joints() -> tuple[Joint, ...]:
    limits_deg = ((-170, 170), (-50, 50), (-60, 60), (-90, 90), (-180, 180), (-180, 180))
    forms = ("first_harmonic", "first_harmonic", "first_harmonic", "direct", "gear", "first_harmonic")
    return tuple(
        Joint(JointKind.REVOLUTE, tuple(np.deg2rad(limits)), RATIO if form == "gear" else None, form)
        for limits, form in zip(limits_deg, forms, strict=True)
    )


def _links() -> tuple[LinkMass, ...]:
    """Plausible masses, with centres in the frames that move with joints 1..6."""
    return (
        LinkMass(42.0, (0.02, -0.05, -0.30)),
        LinkMass(18.0, (-0.31, -0.02, 0.0)),
        LinkMass(14.0, (-0.24, 0.0, 0.0)),
        LinkMass(4.0, (0.0, -0.02, 0.0)),
        LinkMass(3.0, (0.0, 0.0, 0.13)),
        LinkMass(1.5, (0.0, 0.0, 0.06)),
    )
