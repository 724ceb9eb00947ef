"""Names among small real causes, second names at one place, and what a probability owes to roughness of forms."""

from types import SimpleNamespace

import numpy as np
import pytest
from gap_cells import crane_cell, measured
from numpy.testing import assert_allclose

from core.gap.diagnosis import diagnose
from core.gap.posterior import FORM_ERROR, LEAST, MOST, _odds
from core.gap.result import UNKNOWN, Place
from core.gap.said import Said

CLUTTERED = (
    ("compliance:3:20urad/Nm", Place("compliance", joint=3), ("axis_wobble:3:0.005deg", "eccentricity:3:0.004deg")),
    ("zero_offset:2:0.1deg", Place("zero_offset", joint=2), ("mesh:3:0.003deg", "drift:-:0.02mm/h", "scale:-:100ppm")),
    ("backlash:1:0.05deg", Place("backlash", joint=1), ("ratio:1:0.03%", "mesh:2:0.003deg", "payload:-:0.5kg")),
)


@pytest.mark.parametrize(("great", "place", "small"), CLUTTERED, ids=[great for great, *_ in CLUTTERED])
def test_a_great_cause_among_small_ones_keeps_its_name(great: str, place: Place, small: tuple[str, ...]) -> None:
    found = diagnose(measured(crane_cell(), great, *small))
    first = found.causes[0]
    assert first.place.same_as(place)
    assert first.probability > 0.5
    assert not any(cause.place.effect == UNKNOWN for cause in found.causes)


@pytest.mark.parametrize("small", ["mesh:2:0.02deg", "quantisation:2:0.03deg"])
def test_two_names_at_one_joint_are_both_told_though_one_is_small(small: str) -> None:
    """Beside a zero offset that moves points by thirty times as much: less than a hundredth of the squared gap."""
    found = diagnose(measured(crane_cell(), "zero_offset:2:0.6deg", small))
    assert [cause.place for cause in found.causes] == [
        Place("zero_offset", joint=2),
        Place(small.split(":")[0], joint=2),
    ]
    assert found.causes[1].share_closed_last < 0.1
    assert found.left_rms_m < 1.2 * found.noise.floor_rms_m


PAIRS = (
    ("ratio:2:0.3%", "geometry:1.a:1mm", Place("ratio", joint=2), Place("geometry", frame=1)),
    ("ratio:3:0.3%", "geometry:2.alpha:0.1deg", Place("ratio", joint=3), Place("geometry", frame=2)),
    ("ratio:3:0.3%", "geometry:2.alpha:0.2deg", Place("ratio", joint=3), Place("geometry", frame=2)),
)


@pytest.mark.parametrize(("one", "other", "drive", "frame"), PAIRS, ids=[" ".join(pair[:2]) for pair in PAIRS])
def test_a_drive_and_the_frame_before_it_are_both_told(one: str, other: str, drive: Place, frame: Place) -> None:
    """Each is smooth, and a wobbling axis does nearly what both do."""
    found = diagnose(measured(crane_cell(), one, other))
    assert [cause.place for cause in found.causes] == [drive, frame]
    assert found.left_rms_m < 1.1 * found.noise.floor_rms_m


def test_what_is_rough_at_one_joint_does_not_hide_a_name_at_another() -> None:
    """The play of joint 3 is described less than perfectly; nothing else than its ratio acts at joint 1."""
    found = diagnose(measured(crane_cell(), "hysteresis:3:0.05deg", "ratio:1:0.2%", seed=0))
    assert found.causes[0].place == Place("ratio", joint=1)
    assert found.causes[0].probability > 0.5
    assert found.causes[1].place.joint == 3


def test_a_form_of_many_numbers_does_not_stand_in_for_two_others() -> None:
    """A wobble of axis 3 alone explains nearly all: more than what is off once a turn does alone."""
    found = diagnose(measured(crane_cell(), "eccentricity:3:0.1deg", "geometry:2.a:0.5mm"))
    assert found.causes[0].place == Place("eccentricity", joint=3)
    assert not any(cause.place.effect == "axis_wobble" for cause in found.causes)
    assert found.left_rms_m < 1.1 * found.noise.floor_rms_m


@pytest.mark.parametrize("joint", [2, 3])
def test_a_wobbling_axis_is_not_split_into_two_others(joint: int) -> None:
    found = diagnose(measured(crane_cell(), f"axis_wobble:{joint}:0.05deg"))
    assert [cause.place for cause in found.causes] == [Place("axis_wobble", joint=joint)]


@pytest.mark.parametrize(
    ("before", "after", "faint"),
    [
        (0.99, 0.98, True),
        (1.02, 1.005, True),
        (1.2, 1.12, True),
        (1.0, 0.95, False),
        (1.2, 1.02, False),
        (2.0, 1.9, False),
    ],
)
def test_names_that_close_next_to_nothing_of_the_noise_itself_are_not_told(
    before: float, after: float, faint: bool
) -> None:
    """Mean squares of kept-out points in floors, without and with a name; what is left above 1 can be closed."""
    judge = SimpleNamespace(
        floor_m2=1e-9, base_m2=before * 1e-9, closable_m2=max(before - 1, 1e-3) * 1e-9, square=lambda some: after * 1e-9
    )
    assert Said(None, judge)._faint([]) == faint


class TestOdds:
    EVIDENCE = np.array([10_000.0, 9_990.0, 9_000.0, 0.0])

    def test_what_stands_has_even_odds_with_itself(self) -> None:
        odds = _odds(self.EVIDENCE, np.array([1, 1, 1, 0]), 0)
        assert odds[0] == 0.0
        assert (np.diff(odds) < 0).all()

    def test_roughness_of_forms_shrinks_differences(self) -> None:
        odds = _odds(self.EVIDENCE, np.array([1, 1, 1, 0]), 0)
        assert_allclose(odds, (self.EVIDENCE - 1e4) / np.sqrt(1 + (FORM_ERROR * 1e4) ** 2))

    def test_a_freer_form_that_explains_no_more_is_not_helped_by_it(self) -> None:
        odds = _odds(self.EVIDENCE, np.array([1, 5, 1, 0]), 0)
        assert odds[1] == -10.0
        assert odds[2] > -1000.0

    def test_a_freer_form_that_explains_more_may_owe_it_to_roughness(self) -> None:
        odds = _odds(self.EVIDENCE, np.array([5, 1, 1, 0]), 1)
        assert -1.0 < odds[1] - odds[0] < 0.0


def test_no_name_is_ever_certain_or_impossible() -> None:
    found = diagnose(measured(crane_cell(), "ratio:2:0.3%"))
    (cause,) = found.causes
    assert LEAST < cause.probability <= MOST
