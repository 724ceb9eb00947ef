"""What a calibration leaves uncertain, all parameters together: they err in concert, not one by one."""

from dataclasses import dataclass

import numpy as np

from core.errors import InputError
from core.geometry import Array
from core.motion_forms import MotionForm
from core.phi_model import PARAMETERS

FRAME, TRANSMISSION, COUPLING = "frame", "transmission", "coupling"
LEAST = 1e-12
"""Share of the largest variance below which a combination of parameters counts as known."""


@dataclass(frozen=True)
class Parameter:
    """One number of a calibrated arm: ``frame 5 alpha_rad``, ``transmission 3 s``, ``coupling 4 gain``."""

    part: str
    """``frame``, ``transmission`` or ``coupling``."""
    number: int
    """Of the frame, of the joint that is driven, or of the joint that is moved along, 1..n."""
    name: str

    def __str__(self) -> str:
        return f"{self.part} {self.number} {self.name}"


def frame_parameters(joints: int) -> list[Parameter]:
    """Those of the phi-model of an arm, frame by frame."""
    return [Parameter(FRAME, i, name) for i in range(1, joints) for name in PARAMETERS]


def constants_of(part: str, number: int, form: MotionForm) -> list[Parameter]:
    """Those of the function of one drive."""
    return [Parameter(part, number, name) for name in form.coefficient_names]


@dataclass(frozen=True, eq=False)
class ParameterCovariance:
    """The joint covariance of parameters of the phi-model and of constants of the drives, in SI."""

    parameters: tuple[Parameter, ...]
    matrix: Array
    """(p, p)"""

    def __post_init__(self) -> None:
        shape = (len(self.parameters),) * 2
        if self.matrix.shape != shape or not np.isfinite(self.matrix).all():
            raise InputError(
                f"the covariance of {shape[0]} parameters must be {shape[0]} x {shape[0]} finite numbers, "
                f"got shape {self.matrix.shape}"
            )

    def roots(self) -> Array:
        """A matrix whose product with its transpose is the covariance, (p, k): a column each independent error.

        Parameters differ in unit, so it is taken of their correlations.
        """
        std = np.sqrt(np.maximum(np.diag(self.matrix), 0.0))
        unit = np.where(std > 0, std, 1.0)
        variance, vectors = np.linalg.eigh(self.matrix / np.outer(unit, unit))
        kept = variance > LEAST * max(float(variance.max(initial=0.0)), 1e-300)
        return unit[:, None] * vectors[:, kept] * np.sqrt(variance[kept])
