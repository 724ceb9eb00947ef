"""What a calibration says of an arm: axes, functions, phi-model parameters, each with its uncertainty."""

from dataclasses import dataclass

import numpy as np

from core.arm import Arm
from core.function_fit import FunctionFit
from core.geometry import Array, perpendicular_basis
from core.parameter_covariance import ParameterCovariance
from core.phi_model import PhiModel


@dataclass(frozen=True)
class Geometry:
    """The phi-model that follows from the axes of an arm of which every joint is known."""

    base: Array
    """T_base: from frame 1 to the instrument's frame, (4, 4)."""
    model: PhiModel
    std: Array
    """Standard uncertainties of a_m, b_m, alpha_rad, theta_rad of every frame, 0 where fixed by agreement, (n-1, 4)."""
    covariance: Array
    """Of all parameters in that order, (4(n-1), 4(n-1))."""


@dataclass(frozen=True)
class ArmEstimate:
    """One estimate of the whole arm. Entries of joints that were not swept repeat the nominal arm, uncertainty NaN."""

    method: str
    """``joint by joint`` or ``all points at once``."""
    arm: Arm
    """Axes at zero displacement in the instrument's frame, and the functions."""
    axis_covariance: Array
    """Of (tilt 1, tilt 2, shift 1, shift 2) of every axis at its point, in ``axis_basis``, (4n, 4n), rad and m."""
    transmissions: tuple[FunctionFit | None, ...]
    """One a joint; None: not swept."""
    offset_std: Array
    """Standard uncertainty of the transducers' offsets, 0 where none is estimated, (n,)."""
    couplings: tuple[FunctionFit | None, ...]
    """Into each joint; None: no coupling, or none observed."""
    geometry: Geometry | None
    """None where a joint was not swept."""
    noise_m: float
    """Standard deviation of one coordinate of a point."""
    covariance: ParameterCovariance | None = None
    """Of geometry and drives together; None: they were not estimated together, or the geometry is not known."""

    def axis_std(self, joint: int) -> tuple[float, float]:
        """Standard uncertainties of direction (rad) and place (m) of the axis of a joint, 1..n."""
        variance = np.diag(self.axis_covariance)[4 * (joint - 1) : 4 * joint]
        return float(np.sqrt(variance[0] + variance[1])), float(np.sqrt(variance[2] + variance[3]))


def axis_basis(direction: Array) -> Array:
    """e1, e2 in which tilts and shifts of an axis are given, e1 x e2 = direction, (2, 3)."""
    return np.stack(perpendicular_basis(direction))
