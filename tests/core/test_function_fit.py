"""Functions from curves: constants with the spread promised, and families chosen without over-fitting."""

from collections import Counter

import numpy as np
import pytest

from core.errors import InputError, NotConverged
from core.function_fit import SweepCurve, choose_function, fit_function
from core.motion_forms import MotionFunction, coupling_form, transmission_form
from core.robot import Joint, JointKind
from core.transmission import candidates, fit_transmission

STD = 1e-4
NOTHING = (np.zeros((40, 0)), np.zeros((0, 0)))


def curve(rng, function, span_rad=4.0, stops=40, home=False, axis=None):
    """A sweep of a drive: displacement from its first stop with noise, and errors of its axis if wanted."""
    actual = np.linspace(-span_rad / 2, span_rad / 2, stops)
    effect, covariance = (np.zeros((stops, 0)), np.zeros((0, 0))) if axis is None else axis(actual)
    error = rng.multivariate_normal(np.zeros(len(covariance)), covariance) if len(covariance) else np.zeros(0)
    seen = actual + STD * rng.normal(size=stops) + effect @ error
    y = function(actual) - (function(0.0) if home else 0.0)
    return SweepCurve(seen - seen[0], y, np.full(stops, STD), effect, covariance)


def off_centre(actual):
    """What a shifted axis does to displacements: a first harmonic, in a place that varies with it."""
    return np.stack([np.sin(actual), -np.cos(actual)], axis=1), np.diag([1e-3, 1e-3]) ** 2


@pytest.mark.parametrize("home", [False, True])
@pytest.mark.parametrize("axis", [None, off_centre])
def test_constants_scatter_as_promised(home, axis):
    rng, form = np.random.default_rng(5), transmission_form("first_harmonic")
    true = MotionFunction(form, np.array([0.004, -0.002]))
    scores = []
    for _ in range(300):
        fit = fit_function(form, (curve(rng, true, home=home, axis=axis),), home=home)
        scores.append(
            (fit.coefficients - true.coefficients)
            @ np.linalg.solve(fit.covariance, fit.coefficients - true.coefficients)
        )
    # chi-square with two degrees of freedom: mean 2, standard deviation 2.
    assert np.mean(scores) == pytest.approx(2.0, abs=2.6 * 2 / np.sqrt(300))


def test_several_sweeps_share_the_constants_and_keep_their_starts():
    rng, form = np.random.default_rng(6), transmission_form("gear", 32 / 19)
    true = MotionFunction(form, np.array([0.04, 0.01]))
    fit = fit_function(form, (curve(rng, true), curve(rng, true, span_rad=2.0)))
    np.testing.assert_allclose(fit.coefficients, true.coefficients, atol=5 * fit.std.max())
    np.testing.assert_allclose(fit.start, [-2.0, -1.0], atol=5e-3)


def test_a_coupling_is_fitted_from_its_level():
    rng, form = np.random.default_rng(7), coupling_form("arctangent", -1.0)
    true = MotionFunction(form, np.array([-0.998, 0.21, 0.097, 0.0007]))
    active = np.linspace(-0.8, 0.8, 40)
    passive = true(active) + STD * rng.normal(size=40)
    fit = fit_function(
        form, (SweepCurve(active, passive - passive[0], np.full(40, STD), *NOTHING),), level=True, nominal_slope=-1.0
    )
    assert np.all(np.abs(fit.coefficients - true.coefficients) < 4 * fit.std)
    assert fit.start[0] == pytest.approx(-true(active[0]), abs=1e-3)


@pytest.mark.parametrize(
    ("name", "constants"),
    [("direct", ()), ("ratio", (1.02,)), ("first_harmonic", (0.003, -0.002)), ("gear", (0.02, 0.01))],
)
def test_the_true_family_is_chosen_when_the_data_show_it(name, constants):
    rng, joint = np.random.default_rng(8), Joint(JointKind.REVOLUTE, drive_ratio=2.5)
    true = MotionFunction(transmission_form(name, 2.5), np.array(constants))
    chosen = Counter(fit_transmission(joint, (curve(rng, true),), False).form.name for _ in range(60))
    assert chosen[name] >= 57, chosen


@pytest.mark.parametrize("axis", [None, off_centre])
def test_a_perfect_drive_is_given_no_constants(axis):
    """An off-centre axis looks like a first harmonic; its known uncertainty must take the blame."""
    rng, joint = np.random.default_rng(9), Joint(JointKind.REVOLUTE, drive_ratio=2.5)
    true = MotionFunction(transmission_form("direct"), np.zeros(0))
    chosen = Counter(
        fit_transmission(joint, (curve(rng, true, span_rad=1.0, stops=16, axis=axis),), False).form.name
        for _ in range(100)
    )
    assert chosen["direct"] >= 97, chosen


def test_what_the_stops_cannot_tell_apart_is_said():
    rng, joint = np.random.default_rng(10), Joint(JointKind.REVOLUTE)
    true = MotionFunction(transmission_form("first_harmonic"), np.array([0.01, 0.0]))
    fit = fit_transmission(joint, (curve(rng, true, span_rad=0.5, stops=16),), False)
    assert "cannot tell apart" in fit.reason
    assert {c.name for c in fit.candidates} == {form.name for form, _ in candidates(joint)}
    assert sum(c.probability for c in fit.candidates) == pytest.approx(1.0)


def test_the_family_of_the_description_is_taken_as_it_is():
    rng = np.random.default_rng(11)
    true = MotionFunction(transmission_form("direct"), np.zeros(0))
    joint = Joint(JointKind.REVOLUTE, transmission="harmonics_2")
    assert fit_transmission(joint, (curve(rng, true),), False).form.name == "harmonics_2"


def test_a_family_that_does_not_exist_is_refused():
    joint = Joint(JointKind.REVOLUTE, transmission="harmonic_first")
    with pytest.raises(InputError, match=r"no transmission form 'harmonic_first'.*first_harmonic"):
        fit_transmission(joint, (curve(np.random.default_rng(0), np.sin),), False)


def test_fewer_stops_than_constants_are_refused():
    forms = ((transmission_form("harmonics_6"), 1.0),)
    with pytest.raises(NotConverged, match="could be fitted to 4 stops"):
        choose_function(forms, (curve(np.random.default_rng(0), np.sin, stops=4),))


def test_sliding_joints_choose_between_direct_and_ratio():
    assert [form.name for form, _ in candidates(Joint(JointKind.PRISMATIC))] == ["direct", "ratio"]
