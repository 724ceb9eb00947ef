"""The shape of an arm: a skeleton on its axes, links that move as the arm does, a parallelogram that stays one."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from app.scene.link_shapes import PARALLEL_SINE, Skeleton, link_shapes, skeleton
from app.scene.linkage import linkages
from app.scene.poses import link_motions, pose_of, turning_to
from app.scene.targets import foot_on_link
from core.arm import carry
from core.geometry import Line, apply, rotation_about, transform
from core.phi_model import axes
from core.robot import Coupling
from core.twin import irb_l6, scara

TURNING = np.zeros(6, dtype=bool)
CELLS = {"irb_l6": irb_l6.cell(), "scara": scara.cell()}
ANGLES = st.lists(st.floats(-1.2, 1.2), min_size=6, max_size=6).map(np.array)


def bones_of(name: str, floor_m: float | None = None) -> Skeleton:
    cell = CELLS[name]
    return skeleton(cell.truth.arm.axes, cell.robot.sliding, floor_m)


def nominal_bones() -> Skeleton:
    """Of the design, whose parallel axes are parallel."""
    return skeleton(axes(irb_l6.nominal_model()), TURNING)


def off_axis(line: Line, point_m: np.ndarray) -> float:
    return float(np.linalg.norm(point_m - line.foot_of(point_m)))


@pytest.mark.parametrize("name", CELLS)
@pytest.mark.parametrize("seed", range(3))
def test_nodes_move_as_the_core_carries_points(name: str, seed: int) -> None:
    cell, rng = CELLS[name], np.random.default_rng(seed)
    lines, sliding = cell.truth.arm.axes, cell.robot.sliding
    net = rng.uniform(-0.9, 0.9, len(lines)) * np.where(sliding, 0.1, 1.0)
    motions = link_motions(lines, sliding, net)
    for link, (motion, origin) in enumerate(zip(motions, rng.normal(size=(len(lines) + 1, 3)), strict=True)):
        pose, local = pose_of(motion, origin), rng.normal(size=3)
        drawn = pose.position_m + Rotation.from_quat(pose.wxyz, scalar_first=True).apply(local)
        expected = carry(lines, sliding, net[None], np.array([link]), (origin + local)[None])[0]
        assert np.allclose(drawn, expected, atol=1e-12)


@pytest.mark.parametrize("bad", [np.zeros(5), np.full(6, np.nan)])
def test_displacements_that_make_no_pose_are_refused(bad: np.ndarray) -> None:
    with pytest.raises(ValueError, match="6 joints"):
        link_motions(irb_l6.truth().arm.axes, TURNING, bad)


@given(st.lists(st.floats(-1, 1), min_size=3, max_size=3).map(np.array).filter(lambda v: np.linalg.norm(v) > 0.01))
def test_turning_to(vector: np.ndarray) -> None:
    direction = vector / np.linalg.norm(vector)
    turned = Rotation.from_quat(turning_to(direction), scalar_first=True).apply([0.0, 0.0, 1.0])
    assert np.allclose(turned, direction, atol=1e-6)


@pytest.mark.parametrize("name", CELLS)
def test_the_skeleton_goes_through_all_turning_axes(name: str) -> None:
    bones, cell = bones_of(name), CELLS[name]
    for i in np.flatnonzero(~cell.robot.sliding):
        assert off_axis(cell.truth.arm.axes[i], bones.hubs_m[i]) < 1e-9
        assert off_axis(cell.truth.arm.axes[i], bones.leaves_m[i]) < 1e-9


def test_the_skeleton_has_the_lengths_of_table_2() -> None:
    bones = nominal_bones()
    lengths = np.linalg.norm(np.diff(bones.hubs_m, axis=0), axis=1)
    assert np.allclose(lengths, [0.0, 0.690, 0.670, 0.0, 0.2325], atol=1e-9)


def test_nearly_parallel_axes_do_not_send_the_skeleton_away() -> None:
    turn = rotation_about([0.0, 1.0, 0.0], 0.5 * np.arcsin(PARALLEL_SINE))
    first, second = Line(np.zeros(3), [0, 0, 1]), Line([0.3, 0.2, 0], turn @ np.array([0.0, 0.0, 1.0]))
    bones = skeleton((first, second), np.zeros(2, dtype=bool))
    assert np.linalg.norm(bones.hubs_m[1]) < 0.4


@pytest.mark.parametrize("floor", [-1.5, -1.2])
def test_an_upright_arm_stands_on_the_floor(floor: float) -> None:
    bones = bones_of("irb_l6", floor)
    assert bones.base_m[2] == pytest.approx(floor, abs=1e-9)
    body = link_shapes(bones)[0].body.vertices_m
    assert body[:, 2].min() == pytest.approx(floor, abs=0.01)


def test_an_arm_on_a_wall_has_its_base_behind_it() -> None:
    wall = transform(rotation_about([0.0, 1.0, 0.0], np.pi / 2), [0, 0, 0])
    lines = tuple(line.moved(wall) for line in axes(irb_l6.nominal_model()))
    bones = skeleton(lines, TURNING, floor_m=-5.0)
    assert abs(bones.base_m[2]) < 0.01
    assert bones.base_m[0] < -0.2


@pytest.mark.parametrize("name", CELLS)
def test_every_link_has_a_shape_of_fitting_size(name: str) -> None:
    bones = bones_of(name)
    shapes = link_shapes(bones)
    assert len(shapes) == len(bones.axes) + 1
    points = np.concatenate([s.body.vertices_m for s in shapes] + [s.joint.vertices_m for s in shapes])
    distance = np.linalg.norm(points[:, None] - np.vstack([bones.base_m, bones.hubs_m, bones.tool_m]), axis=2)
    assert distance.min(axis=1).max() < 0.9 * bones.reach_m
    assert sum(len(s.body.faces) + len(s.joint.faces) for s in shapes) < 6000


def test_a_ghost_encloses_the_arm() -> None:
    bones = bones_of("irb_l6")
    inner, outer = link_shapes(bones), link_shapes(bones, swell_m=0.01)
    for i, line in enumerate(bones.axes[1:], 1):
        thin, thick = (max(off_axis(line, p) for p in shapes[i].joint.vertices_m) for shapes in (inner, outer))
        assert thick == pytest.approx(thin + 0.01, abs=1e-9)


def test_the_tool_is_where_it_was_said_to_be() -> None:
    tool = bones_of("irb_l6").hubs_m[-1] + [0.03, 0.1, -0.2]
    bones = skeleton(irb_l6.truth().arm.axes, TURNING, None, tool)
    ends = link_shapes(bones)[-1].body.vertices_m
    assert np.linalg.norm(ends - tool, axis=1).min() < 0.012


def test_an_arm_needs_axes() -> None:
    with pytest.raises(ValueError, match="at least one axis"):
        skeleton((), np.zeros(0, dtype=bool))


def test_the_l6_has_the_parallelograms_of_its_couplings() -> None:
    assert [linkage.source for linkage in linkages(nominal_bones(), irb_l6.nominal_robot().couplings)] == [2, 3]
    assert linkages(nominal_bones(), (Coupling(2, 3, 1.0), Coupling(4, 5, -1.0))) == ()


@settings(deadline=None)
@given(ANGLES)
def test_the_parallelogram_stays_one(net: np.ndarray) -> None:
    bones = nominal_bones()
    motions = link_motions(bones.axes, TURNING, net)
    for linkage in linkages(bones, irb_l6.nominal_robot().couplings):
        rod = linkage.rod_motion(motions, net)
        near_pin, far_pin = linkage.crank_m + linkage.lever_m, linkage.elbow_m + linkage.lever_m
        lever = motions[linkage.source + 1]
        assert np.allclose(apply(rod, far_pin), apply(lever, far_pin), atol=1e-9)
        assert np.allclose(apply(rod, near_pin), apply(linkage.crank_motion(motions, net), near_pin), atol=1e-9)


def test_joint_2_alone_does_not_turn_the_crank_of_joint_3() -> None:
    bones, net = nominal_bones(), np.array([0.0, 0.4, -0.4, 0.0, 0.0, 0.0])
    linkage = linkages(bones, irb_l6.nominal_robot().couplings)[0]
    assert np.allclose(linkage.crank_motion(link_motions(bones.axes, TURNING, net), net), np.eye(4), atol=1e-12)


@pytest.mark.parametrize("link", range(7))
def test_a_stalk_ends_on_its_link(link: int) -> None:
    bones, point = bones_of("irb_l6"), np.array([-3.0, 5.0, 0.3])
    foot = foot_on_link(bones, link, point)
    ends = np.vstack([bones.base_m, bones.hubs_m, bones.leaves_m[-1]])[link : link + 2]
    assert min(np.linalg.norm(point - e) for e in ends) + 1e-12 >= np.linalg.norm(point - foot)
