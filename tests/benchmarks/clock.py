"""Times as they are quoted: the median of several, in seconds."""

import time
from collections.abc import Callable

import numpy as np


def median_s(work: Callable[[], object], repeats: int) -> float:
    """Median wall time of some work after one run that is not counted."""
    work()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return float(np.median(times))


def once_s(work: Callable[[], object]) -> float:
    """Wall time of work that is too long to repeat."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start
