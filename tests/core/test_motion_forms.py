"""Functions of drives: derivatives against finite differences, inverses, and what each family promises."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from core.errors import InputError
from core.motion_forms import (
    Arctangent,
    CouplingGear,
    Direct,
    DriveGear,
    Harmonics,
    MotionFunction,
    Proportional,
    coupling_form,
    transmission_form,
)

N = 32 / 19
TRANSMISSIONS = [
    (Direct(), 0.0),
    (Proportional(), 0.2),
    (Harmonics(1), 0.2),
    (Harmonics(4), 0.05),
    (DriveGear(N), 0.2),
    (DriveGear(-0.4), 0.2),
]
COUPLINGS = [
    (Proportional(-0.8, "proportional", "gain"), 0.2),
    (CouplingGear(N), 0.2),
    (CouplingGear(-1.5), 0.2),
    (Arctangent(-1.0), 0.15),
    (Arctangent(1.0), 0.15),
]
FORMS = [pytest.param(form, size, id=f"{type(form).__name__}-{form.name}") for form, size in TRANSMISSIONS + COUPLINGS]
MANY = st.lists(st.floats(-6, 6), min_size=1, max_size=6).map(np.array)
SHARES = st.lists(st.floats(-1, 1), min_size=8, max_size=8).map(np.array)


def constants(form, size, shares):
    return form.start() + size * shares[: len(form.coefficient_names)]


@pytest.mark.parametrize(("form", "size"), FORMS)
class TestEveryForm:
    @given(x=MANY, shares=SHARES)
    def test_slope(self, form, size, x, shares):
        c, h = constants(form, size, shares), 1e-5
        ahead, behind = form.evaluate(x + h, c)[0], form.evaluate(x - h, c)[0]
        np.testing.assert_allclose(form.evaluate(x, c)[1], (ahead - behind) / (2 * h), atol=1e-7)

    @given(x=MANY, shares=SHARES)
    def test_gradient_by_the_constants(self, form, size, x, shares):
        c, h = constants(form, size, shares), 1e-5
        gradient = form.evaluate(x, c)[2]
        assert gradient.shape == (len(x), len(form.coefficient_names))
        for k in range(len(c)):
            step = np.zeros(len(c))
            step[k] = h
            slope = (form.evaluate(x, c + step)[0] - form.evaluate(x, c - step)[0]) / (2 * h)
            np.testing.assert_allclose(gradient[:, k], slope, atol=1e-7)

    @given(x=MANY, shares=SHARES, offset=st.floats(-0.5, 0.5))
    def test_inverse(self, form, size, x, shares, offset):
        function = MotionFunction(form, constants(form, size, shares), offset)
        np.testing.assert_allclose(function.inverse(function(x)), x, atol=1e-10)

    def test_value_is_smooth_over_two_turns(self, form, size):
        function = MotionFunction(form, constants(form, size, np.linspace(-1, 1, 8)))
        x = np.linspace(-4 * np.pi, 4 * np.pi, 4001)
        steps = np.diff(function(x))
        assert np.abs(steps).max() < 5 * np.abs(steps).min()

    def test_start_is_a_perfect_drive(self, form, size):
        x = np.linspace(-2, 2, 9)
        value = form.evaluate(x, form.start())[0]
        gain = getattr(form, "gain", getattr(form, "ratio", 1.0)) if (form, size) in COUPLINGS else 1.0
        np.testing.assert_allclose(value, gain * x, atol=1e-12)


@pytest.mark.parametrize(("form", "size"), COUPLINGS)
@given(shares=SHARES)
def test_couplings_are_zero_at_zero(form, size, shares):
    assert form.evaluate(np.zeros(1), constants(form, size, shares))[0][0] == pytest.approx(0.0, abs=1e-15)


def test_formulas_by_hand():
    x = np.array([0.4])
    assert Harmonics(2).evaluate(x, np.array([0.1, 0.2, 0.3, 0.4]))[0][0] == pytest.approx(
        0.4 + 0.1 * np.sin(0.4) + 0.2 * np.cos(0.4) + 0.3 * np.sin(0.8) + 0.4 * np.cos(0.8)
    )
    assert DriveGear(2.0).evaluate(x, np.array([0.1, 0.2]))[0][0] == pytest.approx(
        0.4 + 2 * (0.1 * np.sin(0.2) + 0.2 * np.cos(0.2))
    )
    assert CouplingGear(2.0).evaluate(x, np.array([0.1, 0.2]))[0][0] == pytest.approx(
        0.8 + 0.1 * np.sin(0.8) + 0.2 * (np.cos(0.8) - 1)
    )
    assert Arctangent(-1.0).evaluate(x, np.array([-0.9, 0.2, 0.1, 0.05]))[0][0] == pytest.approx(
        np.arctan((-0.9 * np.sin(0.4) + 0.2 * (np.cos(0.4) - 1)) / (np.cos(0.4) + 0.1 * np.sin(0.4) + 0.05))
    )


def test_any_shape_goes_in_and_comes_out():
    function = MotionFunction(Harmonics(1), np.array([0.1, 0.2]), 0.3)
    x = np.linspace(-1, 1, 6).reshape(2, 3)
    assert function(x).shape == (2, 3)
    assert function.inverse(function(x)).shape == (2, 3)
    assert float(function(0.0)) == pytest.approx(0.5)


def test_wrong_number_of_constants_is_refused():
    with pytest.raises(InputError, match="first_harmonic takes 2 constants, got 3"):
        MotionFunction(Harmonics(1), np.zeros(3))


@pytest.mark.parametrize("name", ["direct", "ratio", "first_harmonic", "gear", "harmonics_2", "harmonics_12"])
def test_transmissions_by_name(name):
    assert transmission_form(name, drive_ratio=2.0).name == name


@pytest.mark.parametrize("name", ["proportional", "gear", "arctangent"])
def test_couplings_by_name(name):
    form = coupling_form(name, gain=-1.3)
    assert form.name == name
    np.testing.assert_allclose(form.evaluate(np.array([1e-6]), form.start())[1], -1.3, atol=1e-9)


@pytest.mark.parametrize("name", ["harmonics_13", "harmonics_0", "sine", "harmonics_", ""])
def test_unknown_transmissions_are_refused(name):
    with pytest.raises(InputError, match="there is no transmission form"):
        transmission_form(name)


def test_a_gear_needs_its_ratio():
    with pytest.raises(InputError, match="needs the joint's drive_ratio"):
        transmission_form("gear")


def test_unknown_couplings_are_refused():
    with pytest.raises(InputError, match="there is no coupling form 'direct'; expected one of proportional"):
        coupling_form("direct", 1.0)
