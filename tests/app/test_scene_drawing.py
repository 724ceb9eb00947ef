"""What the scene makes of numbers: colours, arrows, tubes, aims, floors and views."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from app.scene.axes import AxisMark, axis_ends, tube_exaggeration, tube_radius_m, uncertainty_tube
from app.scene.cameras import Camera, between, presets
from app.scene.colours import NEGATIVE, NEUTRAL, POSITIVE, ResidualScale, hex_of, round_down, round_up, shaded
from app.scene.error_vectors import arrows, factor_text, magnified_ends
from app.scene.floor import INSTRUMENT_HEIGHT_M, floor_height, floor_under, grid_segments
from app.scene.link_shapes import skeleton
from app.scene.points import PointMarks, Verdict
from app.scene.stations import Station, aiming
from core.geometry import Line
from core.twin import irb_l6

TURNING = np.zeros(6, dtype=bool)
STATIONS = (Station("left", np.zeros(3)), Station("right", np.array([0.0, 6.0, 0.0])))


def bones():
    return skeleton(irb_l6.truth().arm.axes, TURNING, -1.3)


def mark(**changes) -> AxisMark:
    line = Line([0.1, 0.2, 0.3], [0.0, 0.0, 1.0])
    return AxisMark(**{"joint": 1, "line": line, "middle_m": np.array([0.1, 0.2, 0.5]), **changes})


def test_residual_colours_run_from_blue_over_grey_to_vermillion() -> None:
    colours = ResidualScale(2e-4).colours([-1.0, -2e-4, 0.0, 2e-4, 1.0, np.nan])
    assert colours.dtype == np.uint8
    assert colours.tolist() == [list(c) for c in (NEGATIVE, NEGATIVE, NEUTRAL, POSITIVE, POSITIVE, NEUTRAL)]


def test_the_legend_says_the_unit_and_shows_the_colours_of_the_points() -> None:
    legend = ResidualScale(5e-4).legend()
    assert [step.text for step in legend] == ["≤ −0.50 mm", "−0.25 mm", "0.00 mm", "+0.25 mm", "≥ +0.50 mm"]
    assert legend[1].colour == tuple(ResidualScale(5e-4).colours([-2.5e-4])[0])


def test_a_scale_holds_nine_of_ten_residuals_and_ignores_gaps() -> None:
    residuals = np.array([*np.linspace(-1e-4, 1.3e-4, 95), *[9e-3] * 5, np.nan])
    assert ResidualScale.over(residuals).limit_m == pytest.approx(2e-4)
    assert ResidualScale.over([np.nan]).limit_m == pytest.approx(1e-4)
    assert ResidualScale.over([0.0, 0.0]).limit_m == pytest.approx(1e-4)


def test_a_scale_without_extent_is_refused() -> None:
    with pytest.raises(ValueError, match="limit above 0"):
        ResidualScale(0.0)


@given(st.floats(1e-9, 1e6))
def test_round_numbers_enclose_a_value(value: float) -> None:
    low, high = round_down(value), round_up(value)
    assert low <= value * (1 + 1e-6)
    assert high >= value * (1 - 1e-6)
    assert high / low <= 2.5 + 1e-9
    assert f"{low:e}"[0] in "125"
    assert f"{high:e}"[0] in "125"


def test_shades_stay_colours() -> None:
    assert shaded((200, 100, 0), 2.0) == (255, 200, 0)
    assert hex_of(np.array([0, 114, 178])) == "#0072b2"


def contrast(one: tuple[int, int, int], other: tuple[int, int, int]) -> float:
    """WCAG 2 contrast of two colours."""

    def luminance(colour: tuple[int, int, int]) -> float:
        c = np.array(colour) / 255
        return float(np.where(c <= 0.03928, c / 12.92, ((c + 0.055) / 1.055) ** 2.4) @ [0.2126, 0.7152, 0.0722])

    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("ground", [(255, 255, 255), (20, 20, 20)])
@pytest.mark.parametrize(
    "name", ["ARM", "FITTED_AXIS", "NOMINAL_AXIS", "HIGHLIGHT", "ERROR_VECTOR", "VERMILLION", "BLUE"]
)
def test_colours_stand_out_from_both_grounds(name: str, ground: tuple[int, int, int]) -> None:
    from app.scene import colours

    assert contrast(getattr(colours, name), ground) > 2.0


def test_an_axis_arrow_lies_on_its_axis_about_the_joint() -> None:
    start, end = axis_ends(mark(), 0.9)
    assert np.allclose(start, [0.1, 0.2, 0.2])
    assert np.allclose(end, [0.1, 0.2, 1.1])


def test_the_tube_is_narrowest_at_the_axis_point() -> None:
    known = mark(direction_std_rad=1e-3, point_std_m=2e-4)
    assert tube_radius_m(known, [0.0], 100.0)[0] == pytest.approx(0.02)
    assert tube_radius_m(known, [0.3], 100.0)[0] == pytest.approx(100 * np.hypot(2e-4, 3e-4))
    solid = uncertainty_tube(known, 0.9, 100.0)
    radius = np.hypot(*(solid.vertices_m[:, :2] - [0.1, 0.2]).T)
    expected = tube_radius_m(known, solid.vertices_m[:, 2] - 0.3, 100.0)
    assert np.allclose(radius, expected)
    assert radius.min() == pytest.approx(0.02, rel=1e-6)


def test_an_axis_without_uncertainty_has_no_tube_and_a_slide_has_a_cone() -> None:
    assert uncertainty_tube(mark(), 0.9, 100.0) is None
    assert tube_radius_m(mark(direction_std_rad=1e-3), [0.5], 10.0)[0] == pytest.approx(5e-3)


def test_the_exaggeration_of_tubes_is_round_and_keeps_them_narrow() -> None:
    marks = (mark(direction_std_rad=1e-3, point_std_m=2e-4), mark(direction_std_rad=3e-4, point_std_m=0.0))
    factor = tube_exaggeration(marks, 0.9, 0.05)
    assert factor == 50.0
    assert tube_radius_m(marks[0], [0.8], factor)[0] <= 0.05
    assert tube_exaggeration((mark(),), 0.9, 0.05) == 1.0


def test_error_vectors_go_from_measured_to_predicted_magnified() -> None:
    measured = np.array([[1.0, 0, 0], [0, 1.0, 0], [0, 0, np.nan]])
    ends = magnified_ends(measured, measured + np.array([0, 0, 1e-4]), 200.0)
    assert np.allclose(ends, [[[1, 0, 0], [1, 0, 0.02]], [[0, 1, 0], [0, 1, 0.02]]])
    assert arrows(ends).vertices_m[:, 2].max() == pytest.approx(0.02)
    assert factor_text(200.0) == "× 200"
    assert len(arrows(magnified_ends(measured, measured, 200.0)).faces) == 0


def test_points_are_sorted_by_verdict_with_their_rows() -> None:
    marks = PointMarks(
        np.array([7, 8, 9, 10]),
        np.array([[0.0, 0, 0], [1, 0, 0], [np.nan] * 3, [3, 0, 0]]),
        np.arange(12, dtype=np.uint8).reshape(4, 3),
        np.array([Verdict.KEPT, Verdict.DOUBTFUL, Verdict.KEPT, Verdict.KEPT]),
    )
    kept = marks.of(Verdict.KEPT)
    assert kept.row.tolist() == [7, 10]
    assert kept.colour.tolist() == [[0, 1, 2], [9, 10, 11]]
    assert marks.of(Verdict.EXCLUDED).row.tolist() == []


def test_points_of_uneven_columns_are_refused() -> None:
    with pytest.raises(ValueError, match="2 points"):
        PointMarks(np.arange(2), np.zeros((3, 3)), np.zeros((2, 3), np.uint8), np.zeros(2, int))


@pytest.mark.parametrize("point", [[3.0, 4.0, 1.0], [-3.0, 5.0, -0.5], [-1.0, -2.0, 0.0], [0.0, 0.0, 2.0]])
def test_a_telescope_looks_at_its_target(point: list[float]) -> None:
    station = np.array([0.2, -0.1, 0.3])
    head, scope = (Rotation.from_quat(q, scalar_first=True) for q in aiming(station, station + point))
    assert np.allclose((head * scope).apply([0.0, 1.0, 0.0]), point / np.linalg.norm(point), atol=1e-9)
    assert np.allclose(head.apply([0.0, 0.0, 1.0]), [0, 0, 1])


def test_the_floor_lies_below_arm_and_tripods_and_reaches_around_them() -> None:
    free = skeleton(irb_l6.truth().arm.axes, TURNING)
    height = floor_height(free, [s.position_m for s in STATIONS])
    assert height <= free.base_m[2]
    assert height <= -INSTRUMENT_HEIGHT_M
    floor = floor_under(np.vstack([free.hubs_m, [0, 0, 0], [0, 6, 0]]), height)
    lines = grid_segments(floor)
    assert lines[..., 2].tolist() == np.full(lines.shape[:2], height).tolist()
    assert np.all(lines.min(axis=(0, 1))[:2] < [-3.7, -0.5])
    assert np.all(lines.max(axis=(0, 1))[:2] > [0.5, 6.5])
    assert len(lines) < 60


def seen(camera: Camera, points: np.ndarray) -> np.ndarray:
    """Where points are in a picture, upright -1..1 inside, (m, 2); sideways in the same unit."""
    forward = camera.look_at_m - camera.position_m
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, camera.up)
    right = right / np.linalg.norm(right)
    way = points - camera.position_m
    depth = way @ forward
    assert np.all(depth > 0)
    return (
        np.stack([way @ right, way @ np.cross(right, forward)], axis=1)
        / depth[:, None]
        / np.tan(camera.field_of_view_rad / 2)
    )


@pytest.mark.parametrize("seed", range(5))
def test_views_hold_what_they_are_named_after(seed: int) -> None:
    arm = bones()
    net = np.random.default_rng(seed).uniform(-0.6, 0.6, 6)
    views = {view.name: view for view in presets(arm, net, STATIONS, -1.3)}
    assert list(views) == ["All", "Arm", *(f"Joint {k}" for k in range(1, 7)), "Tool", "left", "right"]
    from app.scene.poses import link_motions
    from core.geometry import apply

    motions = link_motions(arm.axes, TURNING, net)
    points = np.array([arm.base_m, *(apply(m, h) for m, h in zip(motions, arm.hubs_m, strict=False))])
    for name in ("All", "Arm", "left", "right"):
        assert np.abs(seen(views[name], points)).max() < 1.2
        assert np.abs(seen(views[name], points)[:, 1]).max() < 1.0
    assert np.abs(seen(views["All"], np.array([s.position_m for s in STATIONS]))[:, 1]).max() < 1.0
    assert np.allclose(seen(views["Joint 3"], points[3:4]), 0.0, atol=1e-9)
    assert all(view.position_m[2] > arm.base_m[2] for view in views.values())


def test_a_flight_begins_and_ends_where_it_should_and_never_passes_through() -> None:
    first, last = (view for view in presets(bones(), np.zeros(6), STATIONS, -1.3) if view.name in ("All", "Tool"))
    assert np.allclose(between(first, last, 0.0).position_m, first.position_m)
    assert np.allclose(between(first, last, 1.0).position_m, last.position_m)
    opposite = Camera("back", 2 * first.look_at_m - first.position_m, first.look_at_m, first.up)
    sizes = [np.linalg.norm((v := between(first, opposite, s)).position_m - v.look_at_m) for s in np.linspace(0, 1, 21)]
    assert min(sizes) > 0.5 * np.linalg.norm(first.position_m - first.look_at_m)


@pytest.mark.parametrize(("eye", "look"), [([0, 0, 0], [0, 0, 0]), ([np.nan, 0, 0], [0, 0, 1])])
def test_a_camera_that_sees_nothing_is_refused(eye: list[float], look: list[float]) -> None:
    with pytest.raises(ValueError, match="camera"):
        Camera("x", np.array(eye, float), np.array(look, float), np.array([0.0, 0, 1]))
