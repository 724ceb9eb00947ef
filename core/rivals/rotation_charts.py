"""How rotations change with their rotation vectors: the Jacobians of the exponential map of SO(3).

Source: Chirikjian, Stochastic Models, Information Theory, and Lie Groups 2, Birkhaeuser 2012, section 10.6.
"""

import numpy as np

from core.geometry import Array, skew

SMALL_RAD = 1e-4
"""Below this angle the first terms of the series are exact to rounding."""


def left_jacobian(vector_rad: Array) -> Array:
    """J of exp(v + dv) = exp(J dv) exp(v) to first order, for rotation vectors (..., 3), shape (..., 3, 3)."""
    vector = np.asarray(vector_rad, dtype=float)
    angle = np.linalg.norm(vector, axis=-1)[..., None, None]
    k, safe = skew(vector), np.maximum(angle, SMALL_RAD)
    first = np.where(angle < SMALL_RAD, 0.5 - angle**2 / 24, (1 - np.cos(safe)) / safe**2)
    second = np.where(angle < SMALL_RAD, 1 / 6 - angle**2 / 120, (safe - np.sin(safe)) / safe**3)
    return np.eye(3) + first * k + second * (k @ k)


def inverse_right_jacobian(vector_rad: Array) -> Array:
    """J of log(exp(v) exp(w)) = v + J w to first order in w, for vectors v (..., 3) shorter than pi, (..., 3, 3)."""
    vector = np.asarray(vector_rad, dtype=float)
    angle = np.linalg.norm(vector, axis=-1)[..., None, None]
    k, safe = skew(vector), np.maximum(angle, SMALL_RAD)
    # Half-angle form: no cancellation in 1 - cos.
    second = np.where(angle < SMALL_RAD, 1 / 12 + angle**2 / 720, (1 - safe / 2 / np.tan(safe / 2)) / safe**2)
    return np.eye(3) + k / 2 + second * (k @ k)
