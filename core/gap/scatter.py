"""Errors that do not repeat: at one joint (play or friction that nobody logged), or nowhere in particular."""

import numpy as np

from core.gap.effects.candidate import motors
from core.gap.problem import Problem
from core.gap.sim import Part, Slot
from core.geometry import Array

SIZES = 10.0 ** np.linspace(-1.5, 2.0, 22)


def scattering_joint(problem: Problem, left_m: Array) -> int | None:
    """The joint whose random errors make the residuals most likely, 1..n; None: an even scatter is likelier.

    The covariance of a point is then ``s^2 J_j J_j' + I`` in units of the noise; the overall scale is free in both.
    """
    used = problem.white.weight > 0
    left = problem.white.rows(left_m)[used]
    count = left.size
    best, joint = -0.5 * count * np.log(np.sum(left**2) / count), None
    for j in motors(problem.doings):
        field = problem.sim.fields([Slot(Part.DRIVE, j)])[:, :, 0]
        answer = problem.white.rows(field)[used]
        strength = np.sum(answer**2, axis=1)
        along = np.sum(answer * left, axis=1) ** 2 / np.maximum(strength, 1e-300)
        rest = float(np.sum(left**2) - np.sum(along))
        unit = np.sqrt(np.mean(strength))
        if not unit > 0:
            continue
        for size in SIZES:
            grown = 1 + (size / unit) ** 2 * strength
            scale = (rest + np.sum(along / grown)) / count
            value = -0.5 * (count * np.log(scale) + np.sum(np.log(grown))) - 0.5 * np.log(count)
            if value > best + 3.0:
                best, joint = value, j + 1
    return joint
