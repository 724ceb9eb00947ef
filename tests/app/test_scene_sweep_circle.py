"""The circle of a sweep in progress lies where its shots do."""

import numpy as np
import pytest

from app.scene.sweep_circle import PIECES, arc_points_m, spokes_m
from core.arm import slide, turn
from core.axes import fit_axis
from core.geometry import Line

AXIS = Line(np.array([1.0, 2.0, 0.5]), np.array([0.2, -0.1, 1.0]))


@pytest.mark.parametrize("span_deg", [20.0, 300.0])
def test_arcs_go_through_the_shots_of_every_target(span_deg):
    angle = np.deg2rad(np.linspace(0, span_deg, 24))
    starts = AXIS.point_m + np.array([[0.5, 0.0, 0.1], [0.0, 0.3, -0.2]])
    points = np.concatenate([turn(AXIS, angle, np.tile(start, (24, 1))) for start in starts])
    target = np.repeat([0, 1], 24)
    fit = fit_axis(points, target=target, commanded=np.tile(angle, 2))
    arcs = [arc_points_m(fit, k, points[target == k]) for k in (0, 1)]
    for k, arc in enumerate(arcs):
        assert arc.shape == (PIECES + 1, 3)
        assert np.linalg.norm(arc - AXIS.foot_of(arc[0]), axis=1) == pytest.approx(fit.radius_m[k], rel=1e-6)
        gaps = np.linalg.norm(points[target == k][:, None] - arc[None], axis=2).min(axis=1)
        assert gaps.max() < 1.01 * fit.radius_m[k] * np.deg2rad(span_deg) * 1.3 / PIECES
    spokes = spokes_m(fit, arcs)
    assert spokes.shape == (5, 2, 3)
    for point in (*spokes[:4, 0], *spokes[4]):
        assert np.linalg.norm(point - AXIS.foot_of(point)) < 1e-6


def test_a_sliding_axis_is_a_line_through_its_shots():
    way = np.linspace(0, 0.3, 10)
    points = slide(AXIS, way, np.tile(AXIS.point_m, (10, 1)))
    fit = fit_axis(points, sliding=True, commanded=way)
    line = arc_points_m(fit, 0, points)
    assert np.linalg.norm(line[-1] - line[0]) == pytest.approx(0.3 * 1.3)
    assert np.abs(np.cross(line - AXIS.point_m, AXIS.direction)).max() < 1e-9
