"""What differs from one visit to the next: the arm's repeatability."""

from dataclasses import dataclass

import numpy as np

from core.geometry import Array

MEAN_LENGTH = np.sqrt(8 / np.pi)
"""Mean length of a vector of three independent normal numbers of standard deviation 1."""


@dataclass(frozen=True)
class Noise:
    """Which of the random parts of a measurement are switched on."""

    instrument: bool = True
    repeatability: bool = True


@dataclass(frozen=True)
class Repeatability:
    """How far a link stands from where it stood on the last visit.

    A mean radial error and a mean orientation error can be read in more than one way. Here both are means of lengths:
    at every standstill each link is displaced as a whole by one translation with three independent normal coordinates,
    its mean length the stated one, and by a rotation vector of the same kind about the middle of those of its targets
    that are seen in that standstill. A target that is seen alone shows the translation only.
    """

    mean_translation_m: float = 0.0
    mean_rotation_rad: float = 0.0

    def displaced(self, points_m: Array, body: np.ndarray, rng: np.random.Generator) -> Array:
        """The points of one visit, (m, 3).

        Args:
            points_m: where the points would be without it, (m, 3).
            body: which points move as one (the same link in the same standstill), 0.., integer (m,); -1: fixed.
        """
        count = int(body.max(initial=-1)) + 1
        shift = rng.normal(size=(count, 3)) * (self.mean_translation_m / MEAN_LENGTH)
        turn = rng.normal(size=(count, 3)) * (self.mean_rotation_rad / MEAN_LENGTH)
        moving = body >= 0
        rides, points = body[moving], points_m[moving]
        sums = np.stack([np.bincount(rides, weights=points[:, k], minlength=count) for k in range(3)], axis=1)
        middle = sums / np.maximum(np.bincount(rides, minlength=count), 1)[:, None]
        moved = points_m.copy()
        moved[moving] += shift[rides] + np.cross(turn[rides], points - middle[rides])
        return moved
