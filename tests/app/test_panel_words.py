"""What the dashboard's panels say."""

from dataclasses import dataclass

import numpy as np
import pytest

from app.panels.check import check_words, one_check_words
from app.table_2 import Limits, limit_counts, limits_of, table_2, verdict
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
    text = one_check_words(Checked(scatter_m), 0.11e-3)
    assert words in text
    assert f"class='verdict {look}'" in text
    assert f"{scatter_m * 1e3:.3f} mm" in text


def test_no_check_and_no_promise_are_said():
    assert "Not checked yet" in check_words((), 1e-4)
    assert "promises nothing" in check_words((Checked(1e-4),), None)
    assert "take more" in check_words((Checked(None),), 1e-4)


def test_names_are_escaped():
    hostile = Checked(1e-4, target="<img src=x>")
    assert "<img" not in check_words((hostile, hostile), 1e-4)


def test_few_shots_are_judged_by_what_they_can_tell():
    """As many instruments as keep their promise are called fine, whatever the number of shots."""
    rng = np.random.default_rng(4)
    for count in (3, 8, 20):
        points = rng.normal(size=(2000, count, 3)) * 1e-4
        off = points - points.mean(axis=1, keepdims=True)
        scatter = np.sqrt((off**2).sum(axis=(1, 2)) / (count - 1))
        words = [one_check_words(Checked(s, shots=(0,) * count), 1e-4) for s in scatter]
        assert np.mean(["as promised" in text and "worse" not in text for text in words]) > 0.95
        assert np.mean(["far worse" in text for text in words]) < 2e-3


def test_earlier_checks_are_listed():
    text = check_words((Checked(1e-4), Checked(2e-4), Checked(3e-4)), 1e-4)
    assert text.index("0.200 mm") < text.index("0.100 mm")


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


def test_limits_are_counted_and_read_from_settings():
    found = calibrate(simulate_campaign(1))
    assert limit_counts(found, Limits()) is None
    limits = limits_of({"limit_length_mm": 1000.0, "limit_angle_deg": 1e-6, "other": "x"})
    assert limits == Limits(1000.0, 1e-6)
    kept, broken, undecided = limit_counts(found, limits)
    text = table_2(found, limits)
    assert (kept, broken, undecided) == tuple(text.count(f"'>{sign}</span></td></tr>") for sign in "✔✖?")
    assert kept + broken + undecided == int((found.estimate.geometry.std > 0).sum())
    assert limits_of({"limit_length_mm": "nonsense"}) == Limits()
