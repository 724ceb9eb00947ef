"""What the dashboard's panels say."""

from dataclasses import dataclass

import pytest

from app.panels.check import check_words
from app.table_2 import Limits, table_2, verdict
from core.calibration import calibrate
from core.twin.campaign import simulate_campaign


@dataclass(frozen=True)
class Checked:
    net_radial_m: float | None
    target: str = "T1"
    shots: tuple = (0,) * 8


@pytest.mark.parametrize(
    ("scatter_m", "words", "look"),
    [
        (0.19e-3, "as promised", "ok"),
        (0.30e-3, "worse than promised", "doubt"),
        (0.50e-3, "far worse than promised", "bad"),
    ],
)
def test_a_check_is_green_orange_or_red_with_words(scatter_m, words, look):
    text = check_words(Checked(scatter_m), 0.11e-3)
    assert words in text
    assert f"class='verdict {look}'" in text
    assert f"{scatter_m * 1e3:.3f} mm" in text


def test_no_check_and_no_promise_are_said():
    assert "Not checked yet" in check_words(None, 1e-4)
    assert "promises nothing" in check_words(Checked(1e-4), None)


def test_names_are_escaped():
    assert "<img" not in check_words(Checked(1e-4, target="<img src=x>"), 1e-4)


@pytest.mark.parametrize(
    ("difference", "u", "limit", "sign"),
    [(0.5, 0.1, 1.0, "✔"), (0.9, 0.1, 1.0, "?"), (1.1, 0.1, 1.0, "?"), (1.5, 0.1, 1.0, "✖"), (-1.5, 0.1, 1.0, "✖")],
)
def test_limits_are_judged_with_the_uncertainty_considered(difference, u, limit, sign):
    assert sign in verdict(difference, u, limit)
    assert verdict(difference, u, 0.0) == ""


def test_table_2_shows_every_measured_parameter_and_its_verdict():
    found = calibrate(simulate_campaign(1))
    text = table_2(found, Limits(length_mm=1000.0, angle_deg=1e-6))
    assert text.count("<tr") == 1 + int((found.estimate.geometry.std > 0).sum())
    assert text.count("<span class='ok'>✔</span>") == 8 + 1
    assert "✔" not in table_2(found, Limits()).replace("(✔)", "")
