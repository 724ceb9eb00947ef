"""How small an effect could have been and still have been seen."""

import numpy as np

from core.gap.evidence import Evidence
from core.gap.problem import Problem
from core.gap.result import DetectionLimit

UNITS = ("rad_per_nm", "m_per_n", "rad_per_m", "m_per_rad", "per_k", "rad", "m", "s", "1")
SURE = 3.0
"""Log evidence above the threshold at which an effect is hardly ever missed."""


def detection_limits(problem: Problem, evidence: Evidence, threshold: float) -> tuple[DetectionLimit, ...]:
    """For every effect and place the smallest first number that would have been claimed, best candidate of each."""
    best: dict[tuple[object, ...], DetectionLimit] = {}
    needed = 2 * (threshold + SURE)
    noise_m = _noise_m(problem)
    for k in problem.named:
        candidate = problem.candidates[k]
        column = problem.slices[k].start
        square = evidence.square.block(k)[0, 0]
        if not square > 1e-12:
            continue
        number = np.sqrt((needed + 2 * problem.cost[k] + np.log1p(square)) / square)
        unit = next(unit for unit in UNITS if candidate.names[0].endswith(f"_{unit}"))
        moved = np.sqrt(problem.sums.square.block(k)[0, 0] / max(problem.sums.count / 3, 1)) * number * noise_m
        limit = DetectionLimit(candidate.place, float(number * problem.design.scale[column]), unit, float(moved))
        place = candidate.place
        key = (place.effect, place.joint, place.source, place.frame, place.target)
        if key not in best or limit.rms_m < best[key].rms_m:
            best[key] = limit
    return tuple(best.values())


def _noise_m(problem: Problem) -> float:
    """One coordinate's noise, rms over points."""
    spread = np.linalg.inv(problem.white.root)
    return float(np.sqrt(np.mean(np.sum(spread**2, axis=(1, 2))) / 3))
