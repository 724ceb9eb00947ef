"""What a click on the page may name, and what it may not."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.clicks import listening, saying
from app.spots import Spot, spot_named, spot_of
from core.phi_model import PARAMETERS
from tests.app.report_cases import six_joints


@given(st.integers(1, 999), st.sampled_from(("", *PARAMETERS)))
def test_a_spot_is_found_by_its_word(number, parameter):
    assert spot_named(Spot(number, parameter).word) == Spot(number, parameter)


@pytest.mark.parametrize("word", ["", "0", "-1", "2-c_m", "2-a_m ", "2-a_m\n", "9999", "2-a_m<script>", "٣", "1٣"])
def test_anything_else_names_nothing(word):
    assert spot_named(word) is None


@given(st.text(max_size=70))
def test_no_text_breaks_it(word):
    found = spot_named(word)
    assert found is None or found.word == word


def test_a_spot_that_cannot_be_is_refused():
    with pytest.raises(ValueError, match="parameter"):
        Spot(1, "c_m")
    with pytest.raises(ValueError, match="number"):
        Spot(0)


def test_every_finding_of_the_arm_has_its_place():
    found = six_joints()
    spots = [spot_of(finding) for finding in found.findings]
    assert None not in spots
    std = found.estimate.geometry.std
    for spot in spots:
        if spot.parameter in ("a_m", "theta_rad"):
            assert std[spot.number - 1, PARAMETERS.index(spot.parameter)] > 0


def test_what_is_said_cannot_leave_its_attribute():
    text = listening(f"<b {saying(chr(39) + ' onclick=alert(1) x=', 'a<b')}>x</b>")
    assert "' onclick=alert(1)" not in text
    assert "a&lt;b" in text
