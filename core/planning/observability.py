"""Observability indices: how well a set of measurements shows all unknowns of an arm, in one number.

Of the singular values s_1 >= ... >= s_L of the identification Jacobian, n being the number of measured poses:

    O1 = (s_1 ... s_L)^(1/L) / sqrt(n)    Borm and Menq 1991, Int. J. Robotics Research 10(1), 51: the volume of the
                                          confidence ellipsoid
    O2 = s_L / s_1                        Driels and Pathre 1990, J. Robotic Systems 7(2), 197: inverse condition number
    O3 = s_L                              Nahvi, Hollerbach and Hayward 1994, IEEE ICRA: the worst shown unknown
    O4 = s_L^2 / s_1                      Nahvi and Hollerbach 1996, IEEE ICRA, 647: the noise amplification index
    O5 = 1 / (1/s_1 + ... + 1/s_L)        Sun and Hollerbach 2008, IEEE ICRA, 831

For all of them more is better. They compare unknowns of different units, so the Jacobian is scaled: rows by the noise
of the measurement, columns by the deviation that is plausible of each unknown (Hollerbach and Wampler 1996, Int. J.
Robotics Research 15(6), 573). O1 is D-optimality, O3 E-optimality, O5 is near to A-optimality (Sun and Hollerbach).
Only the ratio of O1 of two sets of measurements does not depend on the scale of the columns.
"""

from dataclasses import dataclass

import numpy as np

from core.errors import InputError
from core.geometry import Array


@dataclass(frozen=True)
class Observability:
    """The five indices and the condition number of one set of measurements; 0 (infinite) where it shows too little."""

    o1: float
    o2: float
    o3: float
    o4: float
    o5: float
    condition: float


def scaled_singular_values(jacobian: Array, scale: Array) -> Array:
    """Singular values of a Jacobian (rows, L) whose columns are multiplied by a scale (L,), largest first, (L,).

    Args:
        jacobian: derivatives in units of the noise, as ``information.whitened`` has them.
        scale: plausible deviations of the unknowns, in their own units.
    """
    rows, unknowns = jacobian.shape
    values = np.linalg.svd(jacobian * scale, compute_uv=False)
    return np.concatenate([values, np.zeros(max(unknowns - rows, 0))])


def observability(singular_values: Array, poses: int) -> Observability:
    """All indices, from singular values (L,).

    Args:
        poses: n of O1, the number of measurements.

    Raises:
        InputError: there is nothing to judge.
    """
    values = np.sort(np.asarray(singular_values, dtype=float))[::-1]
    if len(values) == 0 or poses < 1 or not (np.isfinite(values) & (values >= 0)).all() or values[0] == 0:
        raise InputError(
            f"observability of {len(values)} unknowns in {poses} measurements, expected at least one of each, and "
            "singular values of at least 0 that are not all 0"
        )
    largest, smallest = float(values[0]), float(values[-1])
    if smallest <= np.finfo(float).eps * largest * len(values):
        return Observability(0.0, 0.0, 0.0, 0.0, 0.0, np.inf)
    return Observability(
        o1=float(np.exp(np.log(values).mean()) / np.sqrt(poses)),
        o2=smallest / largest,
        o3=smallest,
        o4=smallest**2 / largest,
        o5=float(1 / np.sum(1 / values)),
        condition=largest / smallest,
    )
