"""The comparison: errors are those of the arm, the same for all; what is lost is said; the bound is a bound."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from core.errors import InputError, NotConverged
from core.kinematics import active_commands
from core.rivals.comparison import (
    Comparison,
    Data,
    ErrorSizes,
    Found,
    Method,
    MethodRow,
    Reference,
    Trial,
    compare,
    smaller,
)
from core.rivals.comparison_json import comparison_to_json
from core.rivals.identified import calibrated_arm_of
from core.rivals.methods import aggregate_methods, all_methods, own_methods
from core.rivals.observed import Drives
from core.rivals.verdict import verdicts
from core.twin import irb_l6
from core.twin.noise import MEAN_LENGTH
from core.twin.trials import HAND, bound, kept_out, own_on_free_poses, references, trial, true_site

TRIALS = 2


@cache
def one_trial() -> Trial:
    return trial(3)


@cache
def found() -> Comparison:
    return compare([lambda: trial(0), lambda: trial(1)], own_methods(), "two trials", references(), ("a note",))


def perfect(made: Trial) -> Found:
    return Found(calibrated_arm_of(irb_l6.true_arm(), made.sweeps))


def method(calibrate, name: str = "one") -> Method:
    return Method(name, "nobody", Data.SWEEPS, Drives.FUNCTIONS, calibrate)


def test_all_data_have_the_same_number_of_points():
    made = one_trial()
    for data in (Data.SWEEPS, Data.POINTS, Data.POSES):
        table = made.campaign(data).measurements
        assert int((table.seen & ~table.check).sum()) == 129
    with pytest.raises(InputError, match="no campaign"):
        made.campaign(Data.NONE)


def test_free_poses_are_within_limits_and_away_from_the_kept_out_ones():
    made = one_trial()
    low, high = np.array([joint.limits for joint in made.sweeps.robot.joints]).T
    for campaign, targets in ((made.points, HAND[:1]), (made.poses, HAND)):
        table = campaign.measurements
        assert (table.commanded >= low).all()
        assert (table.commanded <= high).all()
        seen = {campaign.targets[t].name for t in table.target}
        assert seen == set(targets)
        # They range over more than half of what every joint can do.
        assert (np.ptp(table.commanded, axis=0) > 0.5 * (high - low)).all()


def test_kept_out_poses_lie_inside_the_swept_ranges():
    made = one_trial()
    table, robot = made.sweeps.measurements, made.sweeps.robot
    swept = active_commands(robot, table.commanded[table.phase == "sweep"])
    motors = active_commands(robot, made.commanded)
    assert motors.shape == (12, 6)
    assert (motors > swept.min(axis=0)).all()
    assert (motors < swept.max(axis=0)).all()
    np.testing.assert_array_equal(kept_out(made.sweeps), made.commanded)


def test_a_perfect_model_is_left_with_the_repeatability():
    rows = compare([lambda s=s: trial(s) for s in range(8)], [method(perfect)], "floor").rows
    stated = irb_l6.REPEATABILITY
    # Twelve visits in each of eight trials: the mean length is known to 4 %.
    assert rows[0].position_m.mean == pytest.approx(stated.mean_translation_m, rel=0.15)
    assert rows[0].orientation_rad.mean == pytest.approx(stated.mean_rotation_rad, rel=0.15)
    assert rows[0].length_error_m < 1e-12
    assert rows[0].angle_error_rad < 1e-12


def test_all_methods_go_on_the_same_visit():
    made = one_trial()
    first, again = made.execute(made.commanded), made.execute(made.commanded)
    np.testing.assert_array_equal(first, again)
    shift = np.linalg.norm(first[:, :3, 3] - made.wanted[:, :3, 3], axis=1)
    assert 0.1e-3 < shift.mean() < 0.7e-3


def test_the_nominal_arm_errs_as_the_paper_says():
    row = found().rows[0]
    assert row.name == "no calibration"
    assert row.position_m.mean * 1e3 == pytest.approx(47.0, abs=0.5)
    assert row.orientation_rad.mean == pytest.approx(0.05, abs=0.002)
    assert row.points == 0


def test_rows_hold_what_was_found():
    for row in found().rows[1:]:
        assert row.own
        assert row.points == 129
        assert row.failed == 0
        sizes = row.position_m
        assert 0 < sizes.mean <= sizes.rms <= sizes.max
        assert sizes.mean < sizes.p95 <= sizes.max
        assert row.seconds > 0
    assert (found().trials, found().poses) == (TRIALS, 12)


def test_a_method_that_fails_is_counted_and_not_averaged():
    count = iter(range(10))

    def sometimes(made: Trial) -> Found:
        if next(count) == 0:
            raise NotConverged("not this time")
        return perfect(made)

    def never(made: Trial) -> Found:
        raise NotConverged("never")

    whole = compare([lambda: trial(0), lambda: trial(1)], [method(sometimes), method(never, "none")], "t")
    assert [(row.name, row.failed) for row in whole.rows] == [("one", 1)]
    assert whole.notes == ("none, drives with functions: found no arm in any trial.",)


def test_progress_is_told_trial_by_trial():
    told = []
    compare([lambda: trial(0), lambda: trial(1)], [method(perfect)], "t", progress=told.append)
    assert told == [0, 1]


def test_every_method_has_its_source_and_a_name_of_its_own():
    methods = all_methods()
    assert all(one.source for one in methods)
    assert len({(one.name, one.drives) for one in methods}) == len(methods)
    assert len(aggregate_methods()) == 12


def test_free_poses_with_functions_find_the_arm():
    """With the same 129 points free poses tell more than the sweeps; the table must not hide it."""
    chosen = [m for m in aggregate_methods() if m.drives is Drives.FUNCTIONS and m.name.startswith("linear")]
    whole = compare([lambda: trial(0), lambda: trial(1)], [*own_methods(), *chosen], "t", references())
    for row in whole.rows[-2:]:
        assert row.position_m.mean < 0.6e-3
        assert row.length_error_m < 0.5e-3
    said = " ".join(verdicts(whole))
    assert "The sweeps lose to as many points in free poses: 2 of 2 methods" in said


def test_this_project_makes_as_much_of_free_poses_as_the_others():
    chosen = [m for m in aggregate_methods() if m.drives is Drives.FUNCTIONS and m.name.endswith("positions")]
    whole = compare([lambda: trial(0), lambda: trial(1)], [own_on_free_poses(), *chosen], "t")
    own, *others = whole.rows
    assert own.own
    for row in others:
        assert own.position_m.mean == pytest.approx(row.position_m.mean, rel=0.05)
    assert "as good within the luck of the trials" in " ".join(verdicts(whole))


def test_the_bound_is_what_the_sweeps_allow_and_not_more():
    position, orientation = bound()
    # An independent rough estimate of it says 1.3 mm.
    assert 1.2e-3 < position < 1.8e-3
    assert irb_l6.REPEATABILITY.mean_rotation_rad < orientation < 0.012
    site = true_site(irb_l6.cell())
    np.testing.assert_array_equal(np.flatnonzero(site.coupled), [2, 4])
    assert site.repeats.link_sigma_m == pytest.approx(0.34e-3 / MEAN_LENGTH)


def rows_of(*errors: tuple[float, bool, Data, Drives]) -> tuple[MethodRow, ...]:
    return tuple(
        MethodRow(f"m{k}", "s", data, drives, ErrorSizes(e * 1e-3, mean_std=0.01e-3), ErrorSizes(1e-3), own=own)
        for k, (e, own, data, drives) in enumerate(errors)
    )


def test_verdicts_say_where_it_loses_and_where_it_wins():
    told, functions, sweeps = Drives.AS_COMMANDED, Drives.FUNCTIONS, Data.SWEEPS
    limit = Reference("bound", 0.95e-3, 1e-3, "", bounds=True)
    base = Comparison("t", 10, 12, rows_of((1.0, True, Data.SWEEPS, functions)), (limit,), ())

    def said(*more: tuple[float, bool, Data, Drives]) -> str:
        return " ".join(verdicts(replace(base, rows=rows_of((1.0, True, Data.SWEEPS, functions), *more))))

    assert "1.05 times what the Cramer-Rao bound" in said()
    assert "what limits it are its points" in said()
    assert "None of 1 other methods on the same points is better, 1 as good" in said((0.99, False, sweeps, functions))
    assert "None of 1 other methods on the same points is better." in said((2.0, False, sweeps, functions))
    assert "On the very same points it loses to m1" in said((0.9, False, sweeps, told))
    lost = said((0.5, False, Data.POINTS, functions), (4.0, False, Data.POSES, told))
    assert "lose to as many points in free poses: 1 of 2 methods that were given those are better, the best 2.0" in lost
    assert "better than 1 of 1 methods that take the drives at their word" in lost
    assert "lose to" not in said((3.0, False, Data.POINTS, told))
    many = said(*((0.5 + 0.01 * k, False, Data.POINTS, functions) for k in range(6)))
    assert "and 3 more, up to 0.55 mm" in many
    worse = replace(base, references=(replace(limit, position_m=0.5e-3),))
    assert "the estimator could be better" in " ".join(verdicts(worse))
    free = said((0.5, True, Data.POINTS, functions), (0.4, False, Data.POINTS, functions))
    assert "From the free points this project's best is 'm1'" in free
    assert "On the very same points it loses to m2" in free


def test_means_differ_where_luck_does_not_explain_it():
    sizes = [ErrorSizes(mean, mean_std=std) for mean, std in ((1.0, 0.1), (0.7, 0.1), (0.75, 0.1), (0.85, np.nan))]
    assert smaller(sizes[1], sizes[0])
    assert not smaller(sizes[2], sizes[0])
    assert not smaller(sizes[0], sizes[1])
    assert smaller(sizes[3], sizes[0])
    assert not smaller(replace(sizes[3], mean=0.95), sizes[0])


def test_an_empty_comparison_is_refused():
    with pytest.raises(InputError, match="needs trials and methods"):
        Comparison("t", 0, 12, (), (), ())


def test_the_json_holds_the_table():
    document = json.loads(comparison_to_json(found()))
    assert document["format"] == "trueaxis-comparison/1"
    assert [m["name"] for m in document["methods"]] == [row.name for row in found().rows]
    best = document["methods"][-1]
    assert best["position_mm"]["mean"] == pytest.approx(found().rows[-1].position_m.mean * 1e3)
    assert best["own"] is True
    assert {r["name"]: r["mean_position_mm"] for r in document["references"]}["paper, after"] == 1.4
    assert document["verdicts"] == list(verdicts(found()))
    assert document["simulated"] is True
