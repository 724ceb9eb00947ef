"""Geometric errors as dimensions: they lead from the nominal to the actual axis, exaggerated as asked."""

import numpy as np
import pytest

from app.scene.diagnosis import label_places
from app.scene.dimensions import LARGEST_ANGLE_RAD, dimensions, fitting_exaggeration, sketches
from core.estimate import Geometry
from core.findings import meaning, sense
from core.phi_model import PARAMETERS, frames
from core.phi_transforms import link_transform, phi_transform
from core.twin import irb_l6

NOMINAL, ACTUAL, BASE = irb_l6.nominal_model(), irb_l6.actual_model(), irb_l6.actual_base()
STD = np.tile([2e-4, 3e-4, 1e-4, 2e-4], (5, 1)) * np.array([[1, 0, 0, 1], *[[1, 1, 1, 1]] * 4])
GEOMETRY = Geometry(BASE, ACTUAL, STD, np.diag(STD.ravel() ** 2))
REACH_M = 1.6


def found(exaggeration: float = 1.0, arm_m: float = 0.3) -> dict:
    return {(d.frame, d.parameter): d for d in dimensions(NOMINAL, GEOMETRY, BASE, exaggeration, arm_m)}


def test_what_is_fixed_by_agreement_has_no_dimension() -> None:
    names = [(i + 1, p) for i in range(5) for k, p in enumerate(PARAMETERS) if STD[i, k] > 0]
    assert list(found()) == names


def test_deviation_std_text_and_significance() -> None:
    d = found()[2, "a_m"]
    assert d.deviation == pytest.approx(-3.1e-3)
    assert d.text == "link 2 is longer: a₂ −3.10 ± 0.20 mm"
    assert d.significant
    assert found()[2, "alpha_rad"].text == "axis 3 leans less: α₂ −0.1720 ± 0.0057°"
    assert found()[3, "theta_rad"].text == "axis 4 leans less: θ₃ +0.010 ± 0.011°"
    assert not found()[3, "theta_rad"].significant


def test_a_deviation_says_what_it_means() -> None:
    said = [
        f"{meaning(frame, name, nominal)} {sense(name, nominal, deviation)}".rstrip()
        for frame, name, nominal, deviation in (
            (2, "a_m", -0.69, -0.003),
            (2, "a_m", -0.69, 0.003),
            (3, "a_m", 0.67, 0.003),
            (2, "b_m", 0.0, 0.003),
            (5, "theta_rad", 0.0, 0.003),
            (4, "alpha_rad", np.pi / 2, -0.003),
        )
    ]
    assert said == [
        "link 2 is longer",
        "link 2 is shorter",
        "link 3 is longer",
        "axis 3 is shifted",
        "axis 6 leans more",
        "axis 5 leans less",
    ]


@pytest.mark.parametrize("frame", range(2, 6))
def test_without_exaggeration_dimensions_lead_to_the_actual_axis(frame: int) -> None:
    i, drawn = frame - 1, found()
    phi_frame = (frames(NOMINAL, np.zeros(6), BASE) @ np.eye(4))[i] @ phi_transform(NOMINAL.phi_rad[i])
    ideal = phi_frame @ link_transform(*NOMINAL.parameters[i])
    actual = phi_frame @ link_transform(*ACTUAL.parameters[i])
    assert np.allclose(drawn[frame, "a_m"].from_m, ideal[:3, 3])
    assert np.allclose(drawn[frame, "a_m"].to_m, drawn[frame, "b_m"].from_m)
    # The way turns by no theta: that shifts the place by b times its deviation, 5 micrometres here.
    place = drawn[frame, "b_m"].to_m
    shift = abs(ACTUAL.b_m[i] * (ACTUAL.theta_rad[i] - NOMINAL.theta_rad[i]))
    assert np.linalg.norm(place - actual[:3, 3]) <= shift + 1e-9
    assert np.allclose(drawn[frame, "alpha_rad"].from_m, place + 0.3 * ideal[:3, 2])
    assert np.allclose(drawn[frame, "alpha_rad"].to_m, drawn[frame, "theta_rad"].from_m)
    assert np.allclose(drawn[frame, "theta_rad"].to_m, place + 0.3 * actual[:3, 2])


@pytest.mark.parametrize("frame", range(2, 6))
@pytest.mark.parametrize("factor", [5.0, 40.0])
def test_lengths_grow_with_the_exaggeration(frame: int, factor: float) -> None:
    for name in ("a_m", "b_m"):
        d = found(factor)[frame, name]
        assert np.linalg.norm(d.to_m - d.from_m) == pytest.approx(factor * abs(d.deviation), rel=1e-9)
        assert d.text == found()[frame, name].text


def test_angles_grow_with_the_exaggeration_up_to_a_limit() -> None:
    d = found(20.0)[5, "alpha_rad"]
    chord = 2 * 0.3 * np.sin(20 * abs(d.deviation) / 2)
    assert np.linalg.norm(d.to_m - d.from_m) == pytest.approx(chord, rel=1e-9)
    most = found(1e5)[5, "alpha_rad"]
    assert np.linalg.norm(most.to_m - most.from_m) == pytest.approx(0.6 * np.sin(LARGEST_ANGLE_RAD / 2), rel=1e-9)


def test_a_perfect_arm_is_drawn_once() -> None:
    perfect = Geometry(BASE, NOMINAL, STD, GEOMETRY.covariance)
    for sketch in sketches(NOMINAL, perfect, BASE, 500.0):
        assert np.allclose(sketch.nominal_way_m, sketch.actual_way_m)
        assert np.allclose(sketch.nominal_axis.direction, sketch.actual_axis.direction)
    assert not any(d.significant for d in dimensions(NOMINAL, perfect, BASE, 500.0))


def test_sketches_show_the_nominal_arm_where_it_is() -> None:
    at_rest = frames(NOMINAL, np.zeros(6), BASE)
    for i, sketch in enumerate(sketches(NOMINAL, GEOMETRY, BASE, 30.0)):
        assert np.allclose(sketch.nominal_axis.point_m, at_rest[i + 1, :3, 3])
        assert np.allclose(sketch.nominal_axis.direction, at_rest[i + 1, :3, 2])
        assert np.allclose(sketch.nominal_way_m[0], at_rest[i, :3, 3])


def test_the_exaggeration_fits_and_is_round() -> None:
    factor = fitting_exaggeration(NOMINAL, GEOMETRY, REACH_M)
    assert factor == 50.0
    drawn = [d for d in found(factor).values() if d.parameter.endswith("_m")]
    assert max(np.linalg.norm(d.to_m - d.from_m) for d in drawn) <= 0.18 * REACH_M
    assert fitting_exaggeration(NOMINAL, Geometry(BASE, NOMINAL, STD, GEOMETRY.covariance), REACH_M) >= 1


def test_an_endless_exaggeration_is_refused() -> None:
    with pytest.raises(ValueError, match="finite"):
        sketches(NOMINAL, GEOMETRY, BASE, np.inf)


def test_labels_that_are_shown_do_not_overlap() -> None:
    drawn = tuple(found(20.0).values())
    places = label_places(drawn, 0.1, 0.7, np.array([0.8, -0.3, 0.4]))
    shown = places[[d.significant for d in drawn]]
    right = np.array([0.3, 0.8, 0.0]) / np.hypot(0.3, 0.8)
    over = np.cross(np.array([0.8, -0.3, 0.4]) / np.sqrt(0.89), right)
    for k, one in enumerate(shown):
        for other in shown[k + 1 :]:
            assert abs((one - other) @ right) >= 0.7 or abs((one - other) @ over) > 0.09
    room = (np.mean([d.middle_m for d in drawn], axis=0), 0.5)
    within = label_places(drawn, 0.1, 0.7, np.array([0.8, -0.3, 0.4]), room)
    assert np.abs((within - room[0]) @ right).max() <= 0.15 + 1e-12
    assert np.array_equal(label_places((), 0.1, 0.7, np.array([1.0, 0, 0])), np.zeros((0, 3)))
