"""Errors of the instrument: as stated, and in the ways that stated noise is wrong."""

from collections.abc import Callable

import numpy as np

from tests.benchmarks.withheld.absorbed import SIGMA_M
from tests.benchmarks.withheld.rigid import Array

Noise = Callable[[np.random.Generator, int], Array]


def as_stated(rng: np.random.Generator, count: int) -> Array:
    """Normal, independent."""
    return rng.normal(0, SIGMA_M, (count, 3))


def _larger(rng: np.random.Generator, count: int) -> Array:
    return 2.0 * as_stated(rng, count)


def _smaller(rng: np.random.Generator, count: int) -> Array:
    return 0.5 * as_stated(rng, count)


def _tails(rng: np.random.Generator, count: int) -> Array:
    """Student's t with 3 degrees of freedom, of the stated standard deviation."""
    return rng.standard_t(3, (count, 3)) * SIGMA_M / np.sqrt(3.0)


def _outliers(rng: np.random.Generator, count: int) -> Array:
    """One point in a hundred is 0.3 mm off."""
    out = as_stated(rng, count)
    wrong = rng.permutation(count)[: max(1, round(0.01 * count))]
    way = rng.normal(size=(len(wrong), 3))
    out[wrong] += 3e-4 * way / np.linalg.norm(way, axis=1, keepdims=True)
    return out


def _correlated(rng: np.random.Generator, count: int) -> Array:
    """Each error keeps 0.7 of the one before, along the order of measurement; the spread is as stated."""
    keep, fresh = 0.7, as_stated(rng, count)
    out = fresh.copy()
    for k in range(1, count):
        out[k] = keep * out[k - 1] + np.sqrt(1 - keep**2) * fresh[k]
    return out


NOISES: dict[str, Noise] = {
    "stated": as_stated,
    "twice": _larger,
    "half": _smaller,
    "t3": _tails,
    "outliers": _outliers,
    "ar1": _correlated,
}
