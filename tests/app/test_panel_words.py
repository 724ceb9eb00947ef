"""What the dashboard's panels say."""

from dataclasses import dataclass

import pytest

from app.panels.check import check_words


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
