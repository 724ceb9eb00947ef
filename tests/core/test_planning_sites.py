"""What a plan rests on: what stations see, where targets sit, what is known of the arm."""

from dataclasses import replace

import numpy as np
import pytest

from core.calibration import calibrate
from core.errors import InputError
from core.measurements import Target
from core.planning.mounts import places_on_links, with_bar
from core.planning.proposal import expected_by, middle_ranges, poses_that_matter, shown_by, swept_ranges
from core.planning.sight import Field, Sight
from core.planning.site import Body, Repeats, Site, skeleton
from core.planning.site_makers import calibrated_site, narrowed, nominal_site, targets_on_links
from core.planning.visibility import segment_distance, visible
from core.robot import Coupling, Joint, JointKind, Robot
from core.theodolite import Theodolite, point_covariance
from core.twin import irb_l6, scara
from core.twin.campaign import simulate_campaign
from tests.benchmarks.planned_cell import drawn_site, kept_out_commands, table_1, true_site


def test_distances_of_segments_by_brute_force() -> None:
    rng = np.random.default_rng(0)
    a, b, c, d = rng.normal(size=(4, 200, 3))
    c[:20], a[20:40], d[40:60] = d[:20], b[20:40], c[40:60] + 2 * (b[40:60] - a[40:60])
    a[60:70], c[60:70] = b[60:70], d[60:70]
    steps = np.linspace(0.0, 1.0, 301)[:, None]
    for k in range(200):
        along, other = a[k] + steps * (b[k] - a[k]), c[k] + steps * (d[k] - c[k])
        nearest = np.linalg.norm(along[:, None] - other[None], axis=2).min()
        found = segment_distance(a[k], b[k], c[k], d[k])
        assert found <= nearest + 1e-12
        assert found == pytest.approx(nearest, abs=0.02)


def one_joint(at: tuple[float, float, float], target: tuple[float, float, float]) -> Site:
    """A post from the origin up to 1 m, with one target, seen by one station."""
    up = np.eye(4)
    up[2, 3] = 1.0
    flat = np.array([[1.0, 0, 0, 0.0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
    post = Robot("post", (Joint(JointKind.REVOLUTE), Joint(JointKind.REVOLUTE)), np.stack([up @ flat, np.eye(4)]))
    sight = Sight((Theodolite(np.array(at)),), sigma_m=1e-4)
    return nominal_site(post, np.eye(4), (Target("T", 1, target),), sight)


@pytest.mark.parametrize(
    ("target", "seen"),
    [
        ((0.06, 0.0, 0.5), True),
        ((-0.06, 0.0, 0.5), False),
        ((-0.3, 0.0, 0.5), False),
        ((-0.3, 0.2, 0.5), True),
        ((0.0, 0.06, 0.5), True),
        ((-0.3, 0.0, 1.2), True),
    ],
)
def test_a_target_behind_the_arm_is_not_seen(target, seen) -> None:
    site = one_joint((4.0, 0.0, 0.5), target)
    assert visible(site, np.zeros((1, 2)), np.zeros(1, dtype=int))[0] == seen
    # Half a turn of the first joint carries it to the other side.
    turned = visible(site, np.array([[np.pi, 0.0]]), np.zeros(1, dtype=int))[0]
    assert turned == visible(one_joint((-4.0, 0.0, 0.5), target), np.zeros((1, 2)), np.zeros(1, dtype=int))[0]


def test_every_station_has_to_see() -> None:
    site = one_joint((4.0, 0.0, 0.5), (0.06, 0.0, 0.5))
    behind = Theodolite(np.array([-4.0, 0.0, 0.5]))
    both = replace(site, sight=Sight((*site.sight.stations, behind), sigma_m=1e-4))
    assert not visible(both, np.zeros((1, 2)), np.zeros(1, dtype=int))[0]
    blind_to_it = replace(both, sight=Sight(sigma_m=1e-4))
    assert visible(blind_to_it, np.zeros((1, 2)), np.zeros(1, dtype=int))[0]


@pytest.mark.parametrize(
    ("point", "seen"),
    [((5.0, 0, 0), True), ((0.5, 0, 0), False), ((25.0, 0, 0), False), ((3.0, 0, 4.0), False), ((3.0, 0, 3.0), True)],
)
def test_the_field_of_a_station(point, seen) -> None:
    sight = Sight((Theodolite(np.zeros(3)),), sigma_m=1e-4, field=Field(1.0, 20.0, np.deg2rad(50.0)))
    assert sight.in_field(np.array([point]))[0] == seen


def test_the_instrument_is_as_exact_as_its_angles() -> None:
    stations = tuple(Theodolite(np.array([0.0, y, 0.0]), sigma_hz_rad=2e-5, sigma_v_rad=3e-5) for y in (0.0, 6.0))
    points = np.array([[-3.0, 4.0, 0.1], [-5.0, 2.0, 0.6]])
    np.testing.assert_array_equal(Sight(stations).covariance(points), point_covariance(stations, points))
    np.testing.assert_allclose(Sight(stations, 1e-4).covariance(points), np.tile(1e-8 * np.eye(3), (2, 1, 1)))


def test_the_paper_s_own_shots_are_seen_but_for_one() -> None:
    """The rule of sight is a little stricter than what table 1 does: its last shot of T1 in joint 4's sweep."""
    table = table_1()
    swept = table.phase == "sweep"
    seen = visible(true_site(), table.commanded[swept], table.target[swept])
    assert (~seen).sum() <= 1


def test_a_drawn_site_stands_where_the_calibrated_one_does() -> None:
    """Points and skeleton of the drawing and of a calibration differ by the arm's faults, a few millimetres."""
    drawn, found = drawn_site(), calibrated_site(calibrate(simulate_campaign(1)), drawn_site().sight)
    assert np.linalg.norm(drawn.skeleton_m - found.skeleton_m, axis=1).max() < 0.03
    seen = np.isfinite(found.state.rest_points_m).all(axis=1)
    assert seen.all()
    assert np.linalg.norm(drawn.state.rest_points_m - found.state.rest_points_m, axis=1).max() < 0.03
    assert found.repeats.link_sigma_m == pytest.approx(drawn.repeats.link_sigma_m, rel=0.15)
    one, other = (expected_by(shown_by(s, table_1()), table_1(), kept_out_commands()) for s in (drawn, found))
    assert other.mean_position_m == pytest.approx(one.mean_position_m, rel=0.15)


def test_without_stations_points_are_as_exact_as_the_campaign_says() -> None:
    campaign = simulate_campaign(1)
    site = calibrated_site(calibrate(campaign))
    fitted = ~campaign.measurements.check
    rms = np.sqrt(np.trace(campaign.measurements.covariance_m2[fitted], axis1=1, axis2=2).mean() / 3)
    assert site.sight.sigma_m == pytest.approx(rms)
    assert site.sight.stations == ()


def test_known_targets_are_where_the_campaign_has_them() -> None:
    cell = irb_l6.cell()
    places = places_on_links(true_site())
    for k, target in enumerate(cell.targets):
        if target.point_m is not None:
            np.testing.assert_allclose(places[k], target.point_m, rtol=0, atol=1e-8)
    drawn = drawn_site()
    np.testing.assert_allclose(places_on_links(drawn), [t.point_m for t in drawn.targets], rtol=0, atol=1e-9)


def test_a_bar_stands_across_the_last_axis() -> None:
    site = drawn_site()
    wider = with_bar(site, 0.3)
    line, ends = site.state.axes[5], wider.state.rest_points_m[-2:]
    assert [t.name for t in wider.targets[-2:]] == ["bar1", "bar2"]
    away = ends - np.array([line.foot_of(p) for p in ends])
    np.testing.assert_allclose(np.linalg.norm(away, axis=1), 0.3)
    np.testing.assert_allclose(away[0], -away[1], atol=1e-12)
    assert [t.name for t in with_bar(wider, 0.2).targets[-2:]] == ["bar3", "bar4"]
    for wrong in (0.0, -1.0, 6.0, np.nan):
        with pytest.raises(InputError, match="bar"):
            with_bar(site, wrong)


def test_ranges_that_cannot_be_are_refused() -> None:
    site = drawn_site()
    for ranges, words in (
        ({7: (-1.0, 1.0)}, "joint 7"),
        ({1: (1.0, -1.0)}, "57.2958 to -57.2958 deg"),
        ({2: (-1.0, 0.1)}, "-50 to 50 deg"),
    ):
        with pytest.raises(InputError, match=words):
            narrowed(site, ranges)


def test_ranges_that_matter_are_those_swept() -> None:
    site = drawn_site()
    ranges = np.rad2deg(swept_ranges(site, table_1()))
    np.testing.assert_allclose(ranges[[5, 4, 3, 2, 1, 0], 1], [25.0, 30.0, 45.0, 22.5, 22.5, 24.0], atol=1e-6)
    np.testing.assert_allclose(ranges[:, 0], -ranges[:, 1], atol=1e-6)
    middle = middle_ranges(site)
    np.testing.assert_allclose(np.ptp(middle, axis=1), np.ptp(site.limits, axis=1) / 2)
    impossible = np.tile([[5.0, 6.0]], (6, 1))
    with pytest.raises(InputError, match="within the limits"):
        poses_that_matter(site, impossible, 1)


def test_joints_without_limits_turn_once_and_slide_a_metre() -> None:
    slide = Robot(
        "open",
        (Joint(JointKind.REVOLUTE), Joint(JointKind.PRISMATIC), Joint(JointKind.REVOLUTE, (-np.inf, 1.0))),
        np.tile(np.eye(4), (3, 1, 1)),
    )
    limits = replace(
        drawn_site(), robot=replace(slide, joints=slide.joints * 2, link_transforms=np.tile(np.eye(4), (6, 1, 1)))
    ).limits
    np.testing.assert_allclose(limits[:3], [[-np.pi, np.pi], [-0.5, 0.5], [1.0 - 2 * np.pi, 1.0]])


@pytest.mark.parametrize("cell", [irb_l6.cell, scara.cell])
def test_a_robot_alone_gets_targets_on_every_link(cell) -> None:
    robot = cell().robot
    targets = targets_on_links(robot)
    assert [t.link for t in targets] == list(range(1, robot.joint_count + 1))
    site = nominal_site(robot, np.eye(4), targets, Sight(sigma_m=1e-4))
    np.testing.assert_allclose(site.skeleton_m, skeleton(robot, np.eye(4)))
    away = site.state.rest_points_m - site.skeleton_m[1:]
    np.testing.assert_allclose(np.linalg.norm(away, axis=1), 0.15)


def test_what_cannot_be_planned_for_is_refused() -> None:
    robot = irb_l6.cell().robot
    with pytest.raises(InputError, match="'T9' has no place"):
        nominal_site(robot, np.eye(4), (Target("T9", 6),), Sight(sigma_m=1e-4))
    joints = (Joint(JointKind.REVOLUTE), Joint(JointKind.PASSIVE), *robot.joints[2:])
    passive = replace(robot, joints=joints, couplings=(Coupling(1, 2, 1.0),))
    with pytest.raises(InputError, match="joint 2 of ASEA IRB L6 has no motor"):
        nominal_site(passive, np.eye(4), targets_on_links(robot), Sight(sigma_m=1e-4))
    with pytest.raises(InputError, match="home pose needs 6 values"):
        replace(drawn_site(), home=np.zeros(5))
    with pytest.raises(InputError, match="repeatability of joints needs 6 values"):
        replace(drawn_site(), repeats=Repeats(0.0, np.zeros(3)))
    with pytest.raises(InputError, match="at least one is needed"):
        drawn_site().with_targets((), np.zeros((0, 3)))


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: Sight(),
        lambda: Sight((Theodolite(np.zeros(3)),)),
        lambda: Sight(sigma_m=0.0),
        lambda: Sight(sigma_m=np.nan),
        lambda: Field(2.0, 1.0),
        lambda: Field(steepest_rad=0.0),
        lambda: Repeats(-1.0),
        lambda: Repeats(0.0, np.array([0.1, -0.1])),
        lambda: Repeats(0.0, np.array([0.1, np.nan])),
        lambda: Body(0.0, 0.1),
        lambda: Body(0.1, np.nan),
    ],
)
def test_records_are_checked_at_birth(wrong) -> None:
    with pytest.raises(InputError):
        wrong()
