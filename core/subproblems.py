"""Rotations about known axes that bring points where they are wanted: the pieces of which closed-form inverse
kinematics are made, each a formula with one or two answers.

After Elias and Wen, "IK-Geo: unified robot inverse kinematics using subproblem decomposition" (arXiv:2211.05737), who
number them as here. Where there is no answer, the best in the sense of least squares is given, which leaves no gap at
the border of an arm's reach.

Vectors are columns of components, (3, ...): whatever follows are poses and answers, and is broadcast. Axes are unit
vectors of three numbers.
"""

import numpy as np

from core.geometry import Array


def dot(a: Array, b: Array) -> Array:
    """Inner products of columns, (...)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def crossed(a: Array, b: Array) -> Array:
    """Cross products of columns, (3, ...)."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def turned(axis: Array, angle: Array, vector: Array) -> Array:
    """Columns turned about an axis, (3, ...): Rodrigues' formula."""
    cosine, sine = np.cos(angle), np.sin(angle)
    along = (1.0 - cosine) * dot(axis, vector)
    over = crossed(axis, vector)
    return np.stack([cosine * vector[i] + sine * over[i] + along * axis[i] for i in range(3)])


def bring(axis: Array, start: Array, goal: Array) -> Array:
    """Subproblem 1: the angle that turns ``start`` as near to ``goal`` as it comes."""
    return np.arctan2(dot(axis, crossed(start, goal)), dot(start, goal) - dot(axis, start) * dot(axis, goal))


def meet(axis_1: Array, first: Array, axis_2: Array, second: Array) -> tuple[Array, Array]:
    """Subproblem 2: both pairs of angles that turn ``first`` about axis 1 and ``second`` about axis 2 onto one another.

    Returns:
        Angles about axis 1 and about axis 2, (2, ...) each.
    """
    c = float(axis_1 @ axis_2)
    over = crossed(axis_1, axis_2)
    h_1, h_2, square = dot(axis_1, first), dot(axis_2, second), dot(first, first)
    alpha, beta = (h_1 - c * h_2) / (1 - c * c), (h_2 - c * h_1) / (1 - c * c)
    left = square - alpha * alpha - beta * beta - 2 * c * alpha * beta
    gamma = np.sqrt(np.maximum(left, 0.0) / (1 - c * c))
    both = np.stack([gamma, -gamma])
    common = np.stack([alpha * axis_1[i] + beta * axis_2[i] + both * over[i] for i in range(3)])
    return bring(axis_1, first, common), bring(axis_2, second, common)


def reach(axis: Array, start: Array, other: Array, distance_2: Array) -> Array:
    """Subproblem 3: both angles at which ``other + turned start`` has a length, by its square, (2, ...)."""
    return level(other, axis, start, 0.5 * (distance_2 - dot(other, other) - dot(start, start)))


def level(normal: Array, axis: Array, start: Array, height: Array) -> Array:
    """Subproblem 4: both angles at which the turned ``start`` has a component along ``normal``, (2, ...)."""
    along = dot(axis, start)
    flat = np.stack([start[i] - axis[i] * along for i in range(3)])
    a, b = dot(normal, flat), dot(normal, crossed(axis, start))
    size = np.hypot(a, b)
    ratio = (height - dot(normal, axis) * along) / np.maximum(size, 1e-300)
    away = np.arccos(np.clip(ratio, -1.0, 1.0))
    middle = np.arctan2(b, a)
    return np.stack(np.broadcast_arrays(middle + away, middle - away))
