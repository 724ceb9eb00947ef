"""Verdicts in sentences, and a ledger that adds up."""

from dataclasses import replace

import numpy as np
import pytest

from core.gap.ledger import MOST_SWITCHES, closed_share, difference_with, ledger, switches
from core.gap.place_words import MEANINGS, NAMES, cause_words, listed, place_words
from core.gap.result import Place
from core.gap.verdict_words import key_numbers, left_sentence, length_words, next_sentence, percent, verdict_sentence
from tests.core import gap_reports

MADE = ("explained", "partly_explained", "unexplained", "no_gap", "barely_known")


def made(name: str):
    return getattr(gap_reports, name)()


@pytest.mark.parametrize("name", MADE)
def test_every_verdict_is_one_sentence_with_gap_and_floor(name: str) -> None:
    report = made(name)
    sentence = verdict_sentence(report)
    assert sentence.endswith(".")
    assert sentence[0].isupper()
    assert length_words(report.gap_rms_m) in sentence
    assert length_words(report.noise.floor_rms_m) in sentence
    assert "nan" not in sentence


def test_a_class_is_said_as_an_alternative_and_an_unknown_by_its_place() -> None:
    assert cause_words(made("explained").causes[0]) == "compliance of joint 2 or flexure of link 1"
    assert "unknown effect at joint 5" in verdict_sentence(made("partly_explained"))


@pytest.mark.parametrize(
    ("place", "words"),
    [
        (Place("backlash", joint=3), "backlash of joint 3"),
        (Place("coupling", joint=4, source=3), "coupling from joint 3 to joint 4"),
        (Place("geometry", frame=2), "geometry of frame 2"),
        (Place("latency"), "latency of all joints"),
        (Place("thermal"), "thermal growth of all links"),
        (Place("thermal", joint=2), "thermal growth of link 2"),
        (Place("target_slip", target="T1", record=80), "target slip of target T1 from record 80 on"),
        (Place("base_shift", record=80), "base shift from record 80 on"),
        (Place("drift"), "drift"),
        (Place("unknown", variable="time"), "unknown effect that follows time"),
        (Place("unknown"), "unknown effect"),
    ],
)
def test_places_in_words(place: Place, words: str) -> None:
    assert place_words(place) == words


def test_every_effect_has_a_name_and_a_meaning() -> None:
    assert set(NAMES) == set(MEANINGS)


def test_lists_in_words() -> None:
    assert [listed(list("abc"[:k]), "or") for k in range(4)] == ["", "a", "a or b", "a, b or c"]


@pytest.mark.parametrize(("length_m", "words"), [(4.512e-3, "4.51 mm"), (3.12e-5, "0.0312 mm"), (0.0, "0.000 mm")])
def test_lengths_have_three_digits(length_m: float, words: str) -> None:
    assert length_words(length_m) == words


@pytest.mark.parametrize("name", MADE)
def test_the_ledger_adds_up_to_the_gap(name: str) -> None:
    report = made(name)
    lines = ledger(report)
    assert sum(line.square_m2 for line in lines) == pytest.approx(report.gap_rms_m**2)
    assert sum(line.share for line in lines) == pytest.approx(1.0)


def test_steps_that_do_not_follow_each_other_are_made_up_for_in_a_line_of_their_own() -> None:
    report = replace(made("explained"), left_rms_m=3.5e-4)
    assert len(ledger(report)) == len(ledger(made("explained"))) + 1
    assert sum(line.square_m2 for line in ledger(report)) == pytest.approx(report.gap_rms_m**2)


def test_without_a_gap_there_is_nothing_to_close() -> None:
    assert np.isnan(closed_share(made("no_gap")))
    assert 0.99 < closed_share(made("explained")) < 1.0


def test_causes_are_added_one_by_one_and_all_of_them_as_fitted_together() -> None:
    report = made("explained")
    np.testing.assert_array_equal(difference_with(report, 0), report.difference_m)
    both = report.difference_m - report.causes[0].shift_m - report.causes[2].shift_m
    np.testing.assert_allclose(difference_with(report, 0b101), both, atol=1e-18)
    np.testing.assert_array_equal(difference_with(report, 0b111), report.left_m)


def test_what_is_left_is_judged_with_its_probability() -> None:
    assert "cannot be told from noise (null bootstrap, p = 0.31)" in left_sentence(made("explained"))
    assert "not noise alone" in left_sentence(made("partly_explained"))
    assert "(" not in left_sentence(made("barely_known"))


def test_what_to_measure_next_says_how_well_it_would_do() -> None:
    first, second = made("explained").rivals
    assert "4.2 standard deviations" in next_sentence(first)
    assert "standard deviations" not in next_sentence(second)


@pytest.mark.parametrize(
    ("share", "words"),
    [
        (0.5, "50 %"),
        (0.997, "99.7 %"),
        (0.99999, "100 %"),
        (1.0, "100 %"),
        (0.003, "0.3 %"),
        (0.0, "0 %"),
        (np.nan, "not known"),
    ],
)
def test_shares_next_to_none_and_all_keep_a_decimal(share: float, words: str) -> None:
    assert percent(share) == words


@pytest.mark.parametrize("count", [0, 1, MOST_SWITCHES, MOST_SWITCHES + 1, 13])
def test_switches_cover_every_cause_once(count: int) -> None:
    report = replace(made("explained"), causes=(made("explained").causes[0],) * count)
    found = switches(report)
    assert len(found) == min(count, MOST_SWITCHES)
    assert sum(switch.causes for switch in found) == 2**count - 1
    if count > MOST_SWITCHES:
        assert found[-1].words == f"the {count - MOST_SWITCHES + 1} other causes"


def test_a_sentence_names_a_few_causes_and_counts_the_others() -> None:
    report = replace(made("explained"), causes=made("explained").causes * 2)
    assert "coupling from joint 3 to joint 4; and 3 other causes take" in verdict_sentence(report)


def test_causes_of_which_one_is_a_class_are_parted_by_semicolons() -> None:
    classes = "or flexure of link 1; backlash of joint 3; and coupling from joint 3 to joint 4 take"
    assert classes in verdict_sentence(made("explained"))


def test_what_has_no_name_is_in_what_is_left() -> None:
    sentence = verdict_sentence(made("partly_explained"))
    assert sentence.startswith("Compliance of joint 2 takes the gap")
    assert sentence.endswith("has no name (an unknown effect at joint 5).")


@pytest.mark.parametrize(("kind", "words"), [("explained", "Left"), ("partly_explained", "Left with the named causes")])
def test_the_key_numbers_say_what_was_left_by_what(kind: str, words: str) -> None:
    assert key_numbers(made(kind))[1] == (words, length_words(made(kind).left_rms_m))


def test_data_that_cannot_show_a_gap_are_not_said_to_have_none() -> None:
    assert verdict_sentence(made("no_gap")).startswith("No gap beyond the noise")
    assert verdict_sentence(replace(made("no_gap"), gap_rms_m=3e-2)).startswith("No gap can be shown: on points kept")


def test_what_is_left_far_above_the_floor_is_not_called_down_to_it() -> None:
    assert "which is down to the noise" in verdict_sentence(made("explained"))
    sentence = verdict_sentence(replace(made("explained"), left_rms_m=6e-4))
    assert sentence.endswith("to 0.600 mm, while noise alone would leave 0.225 mm.")
