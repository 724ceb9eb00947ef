"""Labels of axes that lie together stand apart in the picture, at any pose of a wrist."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.scene.axes import LABEL_HEIGHT, LABEL_SHARES, LABEL_WIDTH, TIP, label_shares
from app.scene.picture import picture_directions

VIEW = np.array([0.45, -0.9, 0.4])


def overlapping(middles, directions, length, shares):
    right, over = picture_directions(VIEW)
    places = middles + np.array(shares)[:, None] * length * directions
    close = [
        abs((a - b) @ right) < LABEL_WIDTH * length and abs((a - b) @ over) < LABEL_HEIGHT * length
        for k, a in enumerate(places)
        for b in places[:k]
    ]
    return any(close)


def test_one_axis_alone_has_its_label_at_the_tip():
    assert label_shares(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]), 1.0, VIEW) == (TIP,)


@pytest.mark.parametrize("axis", [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.6, 0.0, 0.8]])
def test_axes_that_coincide_are_told_apart(axis):
    middles, directions = np.zeros((2, 3)), np.tile(axis, (2, 1))
    shares = label_shares(middles, directions, 1.3, VIEW)
    assert shares[0] == TIP
    assert not overlapping(middles, directions, 1.3, shares)


@given(st.floats(-0.4, 0.4), st.floats(-0.3, 0.3))
def test_a_nearly_stretched_wrist_is_told_apart(bend, offset):
    """Axes 4 and 6 along the arm, axis 5 across; the wrist bends by little."""
    middles = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.3 + offset, 0.0, 0.0]])
    directions = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [np.cos(bend), 0.0, -np.sin(bend)]])
    shares = label_shares(middles, directions, 1.0, VIEW)
    assert set(shares) <= set(LABEL_SHARES)
    assert not overlapping(middles, directions, 1.0, shares)
