"""How the arm came to each point: senses, travel since the last reversal, and the flank that a gear rests on."""

from dataclasses import replace

import numpy as np
import pytest
from gap_arms import ARMS, TURNS, campaign, table

from core.gap.doings import Doings, doings
from core.gap.observations import observe
from core.geometry import Array
from core.measurements import MOVE, POSE, Target
from core.robot import Coupling, LinkMass, Robot
from core.robot_builders import DhRow, robot_from_dh

G = 9.80665


def crane(couplings: tuple[Coupling, ...] = (), gravity: tuple[float, float, float] | None = (0.0, -1.0, 0.0)) -> Robot:
    """Two links of 1 m with 1 kg on either end, turned about horizontal axes; q = 0 is level."""
    links = (LinkMass(1.0, (1.0, 0, 0)), LinkMass(1.0, (1.0, 0, 0)))
    return robot_from_dh("crane", (TURNS,) * 2, [DhRow(0, 0, 1.0, 0)] * 2, couplings, links, gravity)


def path(robot: Robot, q: Array, measured: list[int] | None = None, **columns: object) -> Doings:
    """A path of which some records are measured, the others passed."""
    q = np.asarray(q, dtype=float)
    which = np.full(len(q), -1)
    which[list(range(len(q))) if measured is None else measured] = 0
    points = np.where((which >= 0)[:, None], 0.0, np.nan) * np.ones(3)
    phase = np.where(which >= 0, POSE, MOVE).astype(object)
    rows = table(q, which, points, phase=phase)
    return doings(observe(campaign(robot, (Target("T", robot.joint_count),), replace(rows, **columns))))


def first(told: Doings, values: Array) -> list[float]:
    return [float(v) for v in values[:, 0]]


def swing(*places: float) -> Array:
    """The first joint goes through places, the second stands still."""
    return np.column_stack([places, np.zeros(len(places))])


class TestSenseAndTravel:
    def test_there_and_back(self) -> None:
        told = path(crane(), swing(0.0, 0.1, 0.3, 0.2, 0.2, 0.15, 0.4))
        assert first(told, told.sense) == [0, 1, 1, -1, -1, -1, 1]
        np.testing.assert_allclose(told.travel[:, 0], [0, 0.1, 0.3, 0.1, 0.1, 0.15, 0.25], atol=1e-12)

    def test_a_joint_that_stands_still_has_none(self) -> None:
        told = path(crane(), swing(0.0, 0.1, 0.3))
        assert set(told.sense[:, 1]) == {0}
        assert np.abs(told.travel[:, 1]).max() == 0

    def test_moves_between_points_count_and_are_no_points(self) -> None:
        """Overshoot by 0.05 and back: the point is reached from above, 0.05 after the reversal."""
        told = path(crane(), swing(0.0, 0.35, 0.3), measured=[0, 2])
        assert told.count == 2
        assert told.past.complete
        assert first(told, told.sense) == [0, -1]
        np.testing.assert_allclose(told.travel[:, 0], [0, 0.05], atol=1e-12)

    def test_records_count_in_their_order_not_in_that_of_rows(self) -> None:
        q, order = swing(0.0, 0.1, 0.3, 0.2), np.array([4, 2, 3, 1])
        told = path(crane(), q, record=order)
        assert list(told.seen.record) == [1, 2, 3, 4]
        # In the order of records: 0.2, 0.1, 0.3, 0.0.
        assert first(told, told.sense) == [0, -1, 1, -1]

    def test_senses_of_motors_not_of_joints_where_they_are_coupled(self) -> None:
        """Joint 2 keeps its net place while motor 1 moves: a compensating controller turns motor 2."""
        told = path(crane((Coupling(1, 2, -1.0),)), swing(0.0, 0.2, 0.1))
        assert list(told.sense[:, 1]) == [0, 1, -1]
        uncoupled = told.uncoupled
        assert list(uncoupled.sense[:, 1]) == [0, 0, 0]
        assert list(uncoupled.sense[:, 0]) == [0, 1, -1]


class TestLoggedApproach:
    def test_what_was_written_down_wins_over_the_path(self) -> None:
        approach = np.array([[0, 0], [1, 0], [-1, 0], [-1, 0]])
        told = path(crane(), swing(0.0, 0.1, 0.2, 0.1), approach=approach)
        assert told.past.complete
        assert first(told, told.sense) == [0, 1, -1, -1]

    def test_a_joint_may_have_come_back_to_where_it_was(self) -> None:
        approach = np.array([[1, 0], [-1, 0], [1, 0]])
        told = path(crane(), swing(0.3, 0.3, 0.3), approach=approach)
        assert first(told, told.sense) == [1, -1, 1]

    def test_unknown_falls_back_on_the_path(self) -> None:
        approach = np.array([[1, 1], [0, 0], [0, -1]])
        told = path(crane(), np.array([[0.0, 0.0], [0.1, -0.1], [0.2, -0.2]]), approach=approach)
        assert first(told, told.sense) == [1, 1, 1]
        assert list(told.sense[:, 1]) == [1, -1, -1]

    def test_no_log_is_no_history(self) -> None:
        assert not path(crane(), swing(0.0, 0.1, 0.2)).past.complete


class TestFlank:
    """g = q + flank b / 2: +1 where the load pushes the joint ahead of its motor, or where it is dragged backwards."""

    def test_dragged_by_friction_the_joint_stays_behind_its_motor(self) -> None:
        told = path(crane(), swing(0.0, 0.1, 0.3, 0.2, 0.2, 0.4))
        assert list(told.past.flank(0, np.inf)[1:]) == [-1, -1, 1, 1, -1]

    def test_gravity_holds_a_level_arm_on_its_lower_flank_whatever_the_sense(self) -> None:
        """Torque of joint 1 is negative all along: it hangs below its motor both ways."""
        told = path(crane(), swing(0.0, 0.1, 0.3, 0.2, -0.4, 0.4))
        assert np.all(told.drive_load[:, 0] < -20)
        assert set(told.past.flank(0, 1.0)) == {-1}

    def test_beyond_the_top_it_falls_to_the_other_flank(self) -> None:
        told = path(crane(), swing(1.0, 2.0, 1.0))
        assert list(np.sign(told.drive_load[:, 0])) == [-1, 1, -1]
        assert list(told.past.flank(0, 1.0)) == [-1, 1, -1]

    def test_near_the_top_friction_decides_and_the_sense_shows(self) -> None:
        """|torque| there is 3 kg m g times sin 0.05 = 1.5 N m, friction 2 N m."""
        top = np.pi / 2
        told = path(crane(), swing(top - 0.04, top + 0.02, top - 0.02, top, top + 0.01))
        assert np.abs(told.drive_load[:, 0]).max() < 1.5
        assert list(told.past.flank(0, 2.0)[1:]) == [-1, 1, -1, -1]

    def test_a_joint_at_rest_keeps_its_flank_until_another_joint_loads_it(self) -> None:
        """Joint 1 at the top with its forearm up; folding the forearm forward pulls it over, unfolding leaves it."""
        q = np.array([[np.pi / 2 - 0.1, 0.0], [np.pi / 2, 0.0], [np.pi / 2, -1.2], [np.pi / 2, 0.0], [np.pi / 2, 1.2]])
        told = path(crane(), q)
        np.testing.assert_allclose(told.drive_load[1:, 0], -G * np.sin([0, 1.2, 0, -1.2]), atol=1e-9)
        # Dragged up by its motor it hangs behind: -1 (and gravity says -1 on the way); then joint 2 alone moves.
        assert list(told.past.flank(0, 5.0)[1:]) == [-1, -1, -1, 1]

    def test_a_load_that_comes_and_goes_within_one_move_is_seen(self) -> None:
        """Joint 1 goes over the top and back below friction without a record in between."""
        low, high = np.pi / 2 - 0.5, np.pi / 2 + 0.5
        between = path(crane(), swing(low, high, np.pi / 2))
        assert list(between.past.flank(0, 10.0)) == [-1, 1, 1]

    def test_what_was_written_down_counts_where_friction_holds(self) -> None:
        top, approach = np.pi / 2, np.array([[1, 0], [-1, 0], [-1, 0]])
        told = path(crane(), swing(top - 0.02, top, 0.0), approach=approach)
        assert list(told.past.flank(0, 5.0)) == [-1, 1, -1]

    def test_payload_decides_as_weight_does(self) -> None:
        """With the arm alone below friction, a payload presses it down."""
        robot = replace(crane(), links=())
        q = swing(0.0, 0.3, 0.2, 0.1)
        none = path(robot, q)
        assert list(none.past.flank(0, 5.0)[1:]) == [-1, 1, 1]
        loaded = path(robot, q, payload_kg=np.full(4, 3.0))
        assert list(loaded.past.flank(0, 5.0)) == [-1, -1, -1, -1]

    def test_without_gravity_the_motor_alone_decides(self) -> None:
        told = path(crane(gravity=None), swing(0.0, 0.1, 0.3, 0.2))
        assert list(told.past.flank(0, 1.0)[1:]) == [-1, -1, 1]


def test_payload_is_kept_over_records_where_nobody_wrote_it() -> None:
    told = path(crane(), swing(0.0, 0.1, 0.2, 0.3), payload_kg=np.array([2.0, np.nan, np.nan, 1.0]))
    np.testing.assert_array_equal(told.past.payload_kg, [2, 2, 2, 1])


@pytest.mark.parametrize("name", ["phi with a slide", "coupled"])
def test_a_part_of_the_points_keeps_its_whole_past(name: str) -> None:
    robot, rng = ARMS[name](1), np.random.default_rng(1)
    told = path(robot, rng.uniform(-1, 1, (30, robot.joint_count)), measured=list(range(3, 30, 2)))
    keep = np.array([2, 5, 9])
    part = told.part(keep)
    np.testing.assert_array_equal(part.sense, told.sense[keep])
    np.testing.assert_array_equal(part.travel, told.travel[keep])
    np.testing.assert_array_equal(part.past.flank(1, 3.0), told.past.flank(1, 3.0)[keep])


class TestDragged:
    """A joint trails its motor by what a spring with friction holds (Dahl's model), step by step."""

    @staticmethod
    def by_hand(places: Array, way: float) -> list[float]:
        behind, out = 0.0, []
        for step in np.diff(places, prepend=places[0]):
            side = np.sign(step)
            behind = side + (behind - side) * np.exp(-abs(step) / way)
            out.append(behind)
        return out

    @pytest.mark.parametrize("way", [0.01, 0.15, 2.0])
    def test_step_by_step(self, way: float) -> None:
        places = np.random.default_rng(4).normal(0.0, 0.2, 97).cumsum()
        told = path(crane(), swing(*places))
        np.testing.assert_allclose(told.past.dragged(0, way), self.by_hand(places, way), atol=1e-12)
        assert np.abs(told.past.dragged(1, way)).max() == 0

    def test_a_short_reversal_takes_back_a_part(self) -> None:
        told = path(crane(), swing(0.0, 1.0, 0.95, 1.0))
        behind = told.past.dragged(0, 0.1)
        assert behind[1] == pytest.approx(1, abs=1e-4)
        assert 0.1 < behind[2] < 0.3
        assert behind[2] < behind[3] < behind[1]

    def test_far_beyond_a_reversal_it_is_what_travel_says(self) -> None:
        told = path(crane(), swing(0.0, 3.0, *np.linspace(2.9, 2.0, 10)))
        expected = told.sense[:, 0] * (1 - 2 * np.exp(-told.travel[:, 0] / 0.2))
        np.testing.assert_allclose(told.past.dragged(0, 0.2)[2:], expected[2:], atol=1e-5)


class TestWarmth:
    """Warm by work, cold by rest; times are what the records say."""

    def test_without_a_rest_it_is_what_time_makes(self) -> None:
        told = path(crane(), swing(*np.linspace(0, 1, 30)), time_s=20.0 * np.arange(30))
        assert not told.rested
        np.testing.assert_allclose(told.warmth(300.0), 1 - np.exp(-20.0 * np.arange(30) / 300.0), atol=1e-12)

    def test_a_rest_cools(self) -> None:
        time_s = np.concatenate([20.0 * np.arange(20), 380.0 + 1500.0 + 20.0 * np.arange(20)])
        told = path(crane(), swing(*np.linspace(0, 1, 40)), time_s=time_s)
        assert told.rested
        warm = told.warmth(600.0)
        assert warm[19] == pytest.approx(1 - np.exp(-380 / 600))
        assert warm[20] == pytest.approx(warm[19] * np.exp(-1500 / 600))
        assert (np.diff(warm[20:]) > 0).all()

    def test_passed_records_are_work_too(self) -> None:
        """Half an hour of moves between two points is no rest."""
        time_s = 60.0 * np.arange(40)
        told = path(crane(), swing(*np.linspace(0, 1, 40)), measured=[0, 39], time_s=time_s)
        assert not told.rested
        assert told.warmth(900.0)[-1] == pytest.approx(1 - np.exp(-39 * 60 / 900))
