"""Errors that do not repeat: at one joint (play or friction that nobody logged), or nowhere in particular."""

from dataclasses import dataclass

import numpy as np

from core.gap.doings import Doings
from core.gap.effects.candidate import motors
from core.gap.sim import Part, Sim, Slot
from core.gap.whitening import Whitening
from core.geometry import Array

SIZES = 10.0 ** np.linspace(-1.5, 2.0, 22)
LEAST_GAIN = 10.0
"""Log likelihood by which scatter of one joint must beat scatter that is the same everywhere."""


@dataclass(frozen=True, eq=False)
class Scatter:
    """Noise of which a part comes from one joint: covariance of a point ``scale (C + size^2 J J')``."""

    joint: int
    """1..n"""
    size: float
    """Standard deviation of that joint in radians or metres, before scaling."""
    scale: float
    moved: Array
    """J, what the joint moves at each point, m for one radian or metre, (m, 3)."""

    def over(self, covariance_m2: Array) -> Array:
        """Covariances with that joint's part, (m, 3, 3)."""
        return self.scale * (covariance_m2 + self.size**2 * self.moved[:, :, None] * self.moved[:, None, :])


def joint_scatter(sim: Sim, doings: Doings, left_m: Array, white: Whitening) -> Scatter | None:
    """The joint whose random errors make residuals (m, 3) most likely; None: an even scatter does nearly as well."""
    used = white.weight > 0
    left = white.rows(left_m)[used]
    count = left.size
    most = -0.5 * count * np.log(np.sum(left**2) / count) + LEAST_GAIN
    best: Scatter | None = None
    for j, part in _movers(doings):
        field = sim.fields([Slot(part, j)])[:, :, 0]
        answer = white.rows(field)[used]
        strength = np.sum(answer**2, axis=1)
        along = np.sum(answer * left, axis=1) ** 2 / np.maximum(strength, 1e-300)
        rest = float(np.sum(left**2) - np.sum(along))
        unit = np.sqrt(np.mean(strength))
        if not unit > 0:
            continue
        for size in SIZES / unit:
            grown = 1 + size**2 * strength
            scale = (rest + np.sum(along / grown)) / count
            value = -0.5 * (count * np.log(scale) + np.sum(np.log(grown))) - 0.5 * np.log(count)
            if value > most:
                most, best = value, Scatter(j + 1, float(size), float(scale), field)
    return best


def _movers(doings: Doings) -> list[tuple[int, Part]]:
    """Motors, and joints that do not pass on to the next one what they do themselves."""
    passed = doings.seen.chain.coupling_gains
    alone = [j for j in motors(doings) if j + 1 < len(passed) and passed[j + 1]]
    return [*((j, Part.DRIVE) for j in motors(doings)), *((j, Part.JOINT) for j in alone)]
