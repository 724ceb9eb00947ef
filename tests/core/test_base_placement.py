"""A base is found from its joint axes, and what they leave open is said."""

import numpy as np
import pytest
from hypothesis import given, settings
from random_arms import SEEDS, random_line, random_motion

from core.base_placement import place_base
from core.geometry import Line, angle_between


@settings(max_examples=60, deadline=None)
@given(SEEDS)
def test_axes_in_general_place_give_the_base_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lines, base = [random_line(rng) for _ in range(4)], random_motion(rng)
    # A point of a line may be anywhere on it.
    found = [Line((m := line.moved(base)).point_m + rng.normal() * m.direction, m.direction) for line in lines]
    placed = place_base(lines, found, [False] * 4)
    assert placed.settled
    assert placed.base == pytest.approx(base, abs=1e-5)


@settings(max_examples=60, deadline=None)
@given(SEEDS)
def test_one_axis_is_met_and_the_rest_stays_open(seed: int) -> None:
    rng = np.random.default_rng(seed)
    line = random_line(rng)
    found = line.moved(random_motion(rng))
    placed = place_base([line], [found], [False])
    assert not placed.settled
    met = line.moved(placed.base)
    assert angle_between(met.direction, found.direction) < 1e-5
    assert np.linalg.norm(met.point_m - found.point_m) < 1e-9


def test_parallel_axes_and_sliding_ones_leave_something_open() -> None:
    up = [Line([x, 0.0, 0.0], [0.0, 0.0, 1.0]) for x in (0.0, 0.4)]
    across = Line([0.0, 0.0, 0.3], [1.0, 0.0, 0.0])
    assert not place_base(up, up, [False, False]).settled
    assert not place_base([up[0], across], [up[0], across], [False, True]).settled
    assert place_base([up[0], across], [up[0], across], [False, False]).settled


def test_without_axes_the_base_stays_where_the_instrument_is() -> None:
    placed = place_base([], [], [])
    assert not placed.settled
    assert np.array_equal(placed.base, np.eye(4))
