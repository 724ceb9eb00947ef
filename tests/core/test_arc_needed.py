"""How much arc is missing: about as much as it then takes."""

import numpy as np
import pytest

from core.arc_needed import arc_needed
from core.arm import turn
from core.geometry import Line
from core.live_sweep import live_sweep

AXIS = Line(np.array([1.0, 2.0, 0.5]), np.array([0.2, -0.1, 1.0]))


def arc(count: int, step_deg: float, radius_m: float, sigma_m: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    angle = np.deg2rad(step_deg) * np.arange(count)
    off = AXIS.point_m + radius_m * np.array([1.0, 2.0, 0.0]) / np.sqrt(5)
    start = np.broadcast_to(off, (count, 3))
    return turn(AXIS, angle, start) + sigma_m * rng.normal(size=(count, 3)), angle


@pytest.mark.parametrize(("radius_m", "sigma_m", "step_deg"), [(0.15, 3e-4, 2.0), (0.5, 1e-4, 0.5), (0.08, 3e-4, 3.0)])
def test_the_axis_is_defined_about_where_it_was_said(radius_m: float, sigma_m: float, step_deg: float) -> None:
    shares = []
    for seed in range(40):
        points, angle = arc(60, step_deg, radius_m, sigma_m, seed)
        said = arc_needed(points[:5], angle[:5])
        first = next(k for k in range(5, 61) if live_sweep(points[:k], angle[:k]).fit is not None)
        if said is not None and first > 5:
            assert said.span_rad == pytest.approx(angle[4])
            assert said.needed_rad == pytest.approx(angle[4] + said.more_shots * np.deg2rad(step_deg))
            shares.append(angle[first - 1] / said.needed_rad)
    assert len(shares) > 25
    assert 0.6 < np.median(shares) < 1.3


def test_less_noise_needs_less_arc() -> None:
    spans = [arc_needed(*arc(5, 1.0, 0.3, sigma, 1), sigma).needed_rad for sigma in (1e-4, 3e-4, 1e-3)]
    assert spans == sorted(spans)


def test_what_cannot_be_told_is_not_told() -> None:
    points, angle = arc(6, 2.0, 0.15, 3e-4, 1)
    assert arc_needed(points[:3], angle[:3]) is None
    assert arc_needed(np.tile(points[0], (6, 1)), angle) is None
    assert arc_needed(points, np.zeros(6)) is None
    assert arc_needed(np.zeros((0, 3)), np.zeros(0)) is None
