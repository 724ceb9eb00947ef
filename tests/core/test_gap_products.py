"""Products of columns that are worked out where they are asked for, against the direct ones."""

import numpy as np
import pytest

from core.gap.products import OfColumns, OfSquare, Products, Reduced, widths

SLICES = (slice(3, 5), slice(5, 6), slice(6, 8), slice(8, 12), slice(12, 13))
X = np.random.default_rng(4).normal(size=(40, 13))
SQUARE = X.T @ X


def reduced(of: Products) -> Reduced:
    first = of.rows(np.arange(3))
    return Reduced(of, first, np.linalg.solve(first[:, :3] + np.eye(3), first))


def all_kinds() -> list[tuple[Products, np.ndarray]]:
    less = SQUARE - SQUARE[:, :3] @ np.linalg.solve(SQUARE[:3, :3] + np.eye(3), SQUARE[:3])
    plain: list[tuple[Products, np.ndarray]] = [(OfColumns(X.T, SLICES), SQUARE), (OfSquare(SQUARE, SLICES), SQUARE)]
    return [*plain, *((reduced(of), less) for of, _ in plain)]


@pytest.mark.parametrize("kind", range(4))
class TestEveryKind:
    def test_rows_whatever_was_asked_before(self, kind: int) -> None:
        of, expected = all_kinds()[kind]
        for index in ([4], [4, 2, 9], [9, 9, 0], range(13)):
            np.testing.assert_allclose(of.rows(np.array(index)), expected[list(index)], atol=1e-10)

    def test_within_and_whole(self, kind: int) -> None:
        of, expected = all_kinds()[kind]
        index = np.array([7, 3, 11])
        np.testing.assert_allclose(of.within(index), expected[np.ix_(index, index)], atol=1e-10)
        np.testing.assert_allclose(of.whole, expected, atol=1e-10)
        assert of.count == 13

    def test_blocks_of_groups(self, kind: int) -> None:
        of, expected = all_kinds()[kind]
        for g, own in enumerate(SLICES):
            np.testing.assert_allclose(of.block(g), expected[own, own], atol=1e-10)
        assert sorted(int(g) for one in of.stacks for g in one.groups) == list(range(len(SLICES)))

    def test_times(self, kind: int) -> None:
        of, expected = all_kinds()[kind]
        numbers = np.random.default_rng(5).normal(size=(13, 3))
        np.testing.assert_allclose(of.times(numbers), expected @ numbers, atol=1e-9)


def test_what_was_given_out_is_not_shared() -> None:
    """Whoever changes rows that they got changes nobody else's."""
    of = OfColumns(X.T, SLICES)
    of.rows(np.arange(4))[:] = 0.0
    np.testing.assert_allclose(of.rows(np.arange(4)), SQUARE[:4], atol=1e-10)


def test_groups_by_width() -> None:
    found = {columns.shape[1]: (list(groups), columns.tolist()) for groups, columns in widths(SLICES)}
    assert found == {1: ([1, 4], [[5], [12]]), 2: ([0, 2], [[3, 4], [6, 7]]), 4: ([3], [[8, 9, 10, 11]])}
