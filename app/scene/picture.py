"""Directions in the picture that an eye has of the scene."""

import numpy as np
from numpy.typing import ArrayLike

from core.geometry import Array, cross

UP = np.array([0.0, 0.0, 1.0])


def picture_directions(away: ArrayLike) -> tuple[Array, Array]:
    """To the right and up in the picture, unit, (3,) each, for an eye that is ``away`` from what it looks at, (3,)."""
    back = np.asarray(away, dtype=float) / np.linalg.norm(away)
    right = cross(UP, back)
    right = right / np.linalg.norm(right)
    return right, cross(back, right)
