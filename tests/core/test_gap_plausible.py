"""Numbers that an effect never has give away that its name only stands in for something."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from gap_cells import crane_cell, measured

from core.gap.analysis import Analysis, analyse
from core.gap.effects.candidate import Candidate
from core.gap.evidence import NOTHING
from core.gap.observations import observe
from core.gap.plausible import Own, gives_at_one_joint, mostly_idle, own, plausible
from core.gap.problem import Problem, pose_problem
from core.gap.result import Place
from core.geometry import Array


@cache
def looked_at(*effects: str) -> Analysis:
    return analyse(observe(measured(crane_cell(), *effects)))


def best_of(problem: Problem, place: Place) -> Own:
    """The candidate of a place that explains most, alone."""
    evidence = problem.evidence(1e-4)
    groups = np.array([k for k in problem.named if problem.candidates[k].place.same_as(place)])
    gains = evidence.gains(groups)
    best = int(np.argmax(gains.evidence))
    assert gains.evidence[best] > 20
    return own(problem, evidence, int(groups[best]), float(gains.size[best]), NOTHING)


@pytest.mark.parametrize(
    ("effect", "place", "right"),
    [
        ("backlash:1:0.05deg", Place("backlash", joint=1), True),
        ("backlash:1:0.05deg", Place("hysteresis", joint=1), False),
        ("hysteresis:1:0.06deg", Place("hysteresis", joint=1), True),
        ("zero_offset:2:0.1deg", Place("geometry", frame=1), False),
        ("zero_offset:2:0.1deg", Place("linkage", joint=2), False),
        ("axis_wobble:1:0.05deg", Place("axis_wobble", joint=1), True),
        ("compliance:3:20urad/Nm", Place("compliance", joint=3), True),
    ],
)
def test_names_that_are_right_and_names_that_stand_in(effect: str, place: Place, right: bool) -> None:
    problem = looked_at(effect).problem
    assert plausible(best_of(problem, place), problem.sim.seen.chain) == right


@pytest.mark.parametrize(
    ("effect", "place"),
    [
        ("backlash:1:0.05deg", Place("backlash", joint=1)),
        ("hysteresis:1:0.06deg", Place("hysteresis", joint=1)),
        ("compliance:3:20urad/Nm", Place("compliance", joint=3)),
    ],
)
def test_nothing_runs_ahead_of_what_drives_it(effect: str, place: Place) -> None:
    """The same residuals turned round."""
    old = looked_at(effect).problem
    problem = pose_problem(old.sim, old.doings, old.candidates, -old.residual_m, old.white)
    assert not plausible(best_of(problem, place), problem.sim.seen.chain)


def test_play_that_never_changes_side_is_none() -> None:
    form = form_of(np.array([2.0]), "backlash", ("gap_rad",))
    assert plausible(form, crane_cell().robot)
    assert not plausible(replace(form, constant=True), crane_cell().robot)


def form_of(numbers: Array, effect: str, names: tuple[str, ...]) -> Own:
    """A form with such numbers, as well measured as real ones are."""
    square = 900.0 * np.eye(len(numbers))
    pull = (square + np.eye(len(numbers))) @ numbers
    return Own(Candidate(Place(effect, joint=1), "", names, lambda _: []), np.ones(len(numbers)), 1.0, square, pull)


def with_numbers(numbers: Array, like: Own) -> Own:
    """The same candidate had its numbers been these, as far as its prior lets them be found."""
    inner = like.square + np.eye(len(numbers)) / like.size**2
    return replace(like, pull=inner @ numbers)


@pytest.mark.parametrize("number", [1, 3])
def test_a_frame_that_is_turned_otherwise_or_longer_is_no_zero_offset(number: int) -> None:
    """The next axis lies along x of this frame, through its origin."""
    problem = looked_at("zero_offset:2:0.1deg").problem
    like, chain = best_of(problem, Place("geometry", frame=1)), problem.sim.seen.chain
    assert plausible(with_numbers(40.0 * np.eye(5)[number], like), chain)
    assert not plausible(with_numbers(40.0 * np.eye(5)[0], like), chain)


@pytest.mark.parametrize(
    ("loss", "not_yet", "with_load", "right"),
    [(5, 0, 0, False), (5, -1, 0, False), (5, -4, 0, True), (5, 0, 3, True), (5, -4, -3, False), (-5, 4, 0, False)],
)
def test_hysteresis_grows_with_the_way_or_the_load(loss: float, not_yet: float, with_load: float, right: bool) -> None:
    names = ("loss_rad", "not_yet_after_50_mrad_rad", "with_load_rad")
    form = form_of(np.array([loss, not_yet, with_load], dtype=float), "hysteresis", names)
    assert plausible(form, crane_cell().robot) == right


@pytest.mark.parametrize(("share", "right"), [(1.0, True), (0.9, True), (1.1, True), (0.6, False), (1.5, False)])
def test_steps_of_encoders_are_whole(share: float, right: bool) -> None:
    """At even distances a share of steps of another size looks alike."""
    form = form_of(np.array([share]), "quantisation", ("share_1",))
    assert plausible(form, crane_cell().robot) == right


@pytest.mark.parametrize(("under_itself", "right"), [(0.0, True), (0.7, True), (-0.3, True), (-1.0, False)])
@pytest.mark.parametrize("effect", ["compliance", "flexure"])
def test_what_bends_bends_under_its_own_weight_too(effect: str, under_itself: float, right: bool) -> None:
    names = ("give_rad_per_nm", "own_weight_give_rad_per_nm")
    form = form_of(np.array([5.0, 5.0 * under_itself]), effect, names)
    assert plausible(form, crane_cell().robot) == right


def test_random_wobbles_do_not_cancel_and_the_most_cancelling_does() -> None:
    problem = looked_at("axis_wobble:1:0.05deg").problem
    like, chain = best_of(problem, Place("axis_wobble", joint=1)), problem.sim.seen.chain
    values, vectors = np.linalg.eigh(like.square)
    assert not plausible(with_numbers(vectors[:, 0], like), chain)
    assert plausible(with_numbers(vectors[:, -1], like), chain)
    draws = np.random.default_rng(5).standard_normal((60, len(values)))
    right = np.mean([plausible(with_numbers(one, like), chain) for one in draws])
    assert right == pytest.approx(0.95, abs=3 * np.sqrt(0.95 * 0.05 / 60))


class TestIdle:
    def form(self, numbers: Array, effect: str = "flexure") -> Own:
        return form_of(numbers, effect, tuple(f"give_{k}_rad" for k in range(len(numbers))))

    def test_one_number_of_eight(self) -> None:
        alone = np.zeros(8)
        alone[3] = 5.0
        assert mostly_idle(self.form(alone))
        assert not mostly_idle(self.form(alone, "geometry"))

    def test_numbers_of_one_size_are_hardly_ever_idle(self) -> None:
        rng = np.random.default_rng(6)
        assert np.mean([mostly_idle(self.form(rng.standard_normal(8))) for _ in range(100)]) <= 0.02

    def test_a_single_number_is_never_idle(self) -> None:
        assert not mostly_idle(self.form(np.array([0.01])))


@pytest.mark.parametrize(
    ("effect", "second", "third", "alone"),
    [
        ("payload", 3.0, 0.1, True),
        ("payload", 3.0, 2.0, False),
        ("payload", -3.0, 0.1, False),
        ("ratio", 3.0, 0.1, False),
    ],
)
def test_a_load_under_which_one_joint_alone_gives_way(effect: str, second: float, third: float, alone: bool) -> None:
    names = ("give_of_joint_2_rad_per_nm", "give_of_joint_3_rad_per_nm")
    assert gives_at_one_joint(form_of(np.array([second, third]), effect, names)) == alone
