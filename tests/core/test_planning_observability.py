"""Observability indices by their definitions, and what each of them does and does not depend on."""

import numpy as np
import pytest

from core.errors import InputError
from core.planning.observability import observability, scaled_singular_values

RNG = np.random.default_rng(3)
JACOBIAN = RNG.normal(size=(60, 8)) @ RNG.normal(size=(8, 8))
ONES = np.ones(8)


def indices(jacobian, poses=20, scale=ONES):
    return observability(scaled_singular_values(jacobian, scale), poses)


def test_by_hand():
    found = observability([4.0, 2.0, 1.0], 4)
    assert found.o1 == pytest.approx(2.0 / 2.0)
    assert (found.o2, found.o3, found.o4, found.condition) == (0.25, 1.0, 0.25, 4.0)
    assert found.o5 == pytest.approx(1 / (1 / 4 + 1 / 2 + 1))


def test_they_are_what_the_information_matrix_says():
    """O1 is its determinant, O3 its smallest eigenvalue, the condition number the ratio of its extremes."""
    values = np.linalg.eigvalsh(JACOBIAN.T @ JACOBIAN)
    found = indices(JACOBIAN)
    assert found.o1 == pytest.approx(np.linalg.det(JACOBIAN.T @ JACOBIAN) ** (1 / 16) / np.sqrt(20))
    assert found.o3 == pytest.approx(np.sqrt(values[0]))
    assert found.condition == pytest.approx(np.sqrt(values[-1] / values[0]))
    assert found.o5 == pytest.approx(1 / np.sum(values**-0.5))
    assert found.o2 == pytest.approx(1 / found.condition)
    assert found.o4 == pytest.approx(found.o2 * found.o3)


def test_measuring_everything_twice():
    """O1 counts per measurement; O3, O4 and O5 grow as the root of the number, O2 does not change."""
    once, twice = indices(JACOBIAN, 20), indices(np.vstack([JACOBIAN, JACOBIAN]), 40)
    assert twice.o1 == pytest.approx(once.o1)
    assert twice.o2 == pytest.approx(once.o2)
    for name in ("o3", "o4", "o5"):
        assert getattr(twice, name) == pytest.approx(np.sqrt(2) * getattr(once, name))


def test_only_o1_compares_two_sets_whatever_the_units_are():
    other, units = RNG.normal(size=(60, 8)), np.geomspace(1e-3, 1e3, 8)
    plain, scaled = (
        {name: getattr(indices(JACOBIAN, 20, s), name) / getattr(indices(other, 20, s), name) for name in ("o1", "o3")}
        for s in (ONES, units)
    )
    assert scaled["o1"] == pytest.approx(plain["o1"])
    assert abs(scaled["o3"] / plain["o3"] - 1) > 0.1


@pytest.mark.parametrize("jacobian", [np.hstack([JACOBIAN[:, :7], JACOBIAN[:, :1]]), JACOBIAN[:5]])
def test_what_cannot_be_told_apart_has_no_observability(jacobian):
    found = indices(jacobian)
    assert (found.o1, found.o2, found.o3, found.o4, found.o5) == (0.0,) * 5
    assert found.condition == np.inf


@pytest.mark.parametrize(("values", "poses"), [([], 3), ([1.0], 0), ([np.nan, 1.0], 3), ([-1.0, 1.0], 3), ([0.0], 3)])
def test_nothing_to_judge_is_refused(values, poses):
    with pytest.raises(InputError, match="expected"):
        observability(values, poses)
