"""The aggregate model's Jacobians against central differences, for every way to write the parameters."""

import numpy as np
import pytest
from rival_cells import EXACT, HAND, cell, free_poses

from core.geometry import line_distance
from core.phi_convention import convention_of
from core.rivals.aggregate import ParameterProblem
from core.rivals.chain_parameters import PhiParameters
from core.rivals.denavit_hartenberg import DhParameters
from core.rivals.markers import frames_of, marker_moves, markers
from core.rivals.observed import Drives
from core.rivals.problems import Problem, Repeatability, point_problem, pose_problem
from core.rivals.rotation_charts import inverse_right_jacobian, left_jacobian
from core.rotations import rotations_of_vectors, vectors_of_rotations

TOLD = Repeatability(2e-4, 2e-3)
STEP = 1e-6
BUILD = {"points": point_problem, "poses": pose_problem}


def problem(name: str, kind: str, drives: Drives) -> Problem:
    targets = HAND[name] if kind == "poses" else HAND[name][:1]
    return BUILD[kind](free_poses(name, False, targets, 12, 3, EXACT), drives, TOLD)


def somewhere(size: int) -> np.ndarray:
    return 0.03 * np.random.default_rng(5).normal(size=size)


def assert_matches(found: np.ndarray, differences: np.ndarray) -> None:
    scale = np.abs(differences).max()
    np.testing.assert_allclose(found, differences, rtol=0, atol=1e-7 * scale)


@pytest.mark.parametrize("drives", Drives)
@pytest.mark.parametrize("kind", BUILD)
@pytest.mark.parametrize("name", ["irb_l6", "scara"])
class TestEquations:
    def test_jacobian_by_local_deviations(self, name, kind, drives):
        equations = problem(name, kind, drives).equations
        state = equations.moved(problem(name, kind, drives).start, somewhere(equations.size))
        found = equations.evaluate(state).jacobian
        for k, step in enumerate(STEP * np.eye(equations.size)):
            ahead, behind = (equations.evaluate(equations.moved(state, s * step)).residual for s in (1, -1))
            assert_matches(found[:, k], (behind - ahead) / (2 * STEP))

    def test_one_standstill_after_the_other_is_all_of_them(self, name, kind, drives):
        found = problem(name, kind, drives)
        whole = found.equations.evaluate(found.start)
        each = [found.equations.part(slice(k, k + 1)).evaluate(found.start) for k in range(found.equations.count)]
        np.testing.assert_allclose(np.concatenate([e.residual for e in each]), whole.residual, atol=1e-9)
        np.testing.assert_allclose(np.concatenate([e.jacobian for e in each]), whole.jacobian, atol=1e-7)


def chain_of(found: Problem, written: str):
    if written == "phi":
        return PhiParameters(found.start.axes, convention_of(found.campaign.robot))
    return DhParameters(found.campaign.robot, found.base)


@pytest.mark.parametrize("written", ["phi", "dh"])
@pytest.mark.parametrize("name", ["irb_l6", "scara"])
class TestChainParameters:
    def test_they_start_at_the_nominal_axes(self, name, written):
        found = problem(name, "points", Drives.AS_COMMANDED)
        chain = chain_of(found, written)
        for mine, nominal, slides in zip(
            chain.axes(np.zeros(chain.size)), found.start.axes, cell(name, False).robot.sliding, strict=True
        ):
            np.testing.assert_allclose(mine.direction, nominal.direction, atol=1e-12)
            assert slides or line_distance(mine, nominal) < 1e-12

    @pytest.mark.parametrize("kind", BUILD)
    def test_jacobian(self, name, written, kind):
        found = problem(name, kind, Drives.FUNCTIONS)
        whole = ParameterProblem(found.equations, found.start, chain_of(found, written))
        x = somewhere(whole.size)
        jacobian = whole.jacobian(x)
        for k, step in enumerate(STEP * np.eye(whole.size)):
            assert_matches(jacobian[:, k], (whole.residual(x + step) - whole.residual(x - step)) / (2 * STEP))


def test_phi_parameters_are_as_many_as_the_axes_have_freedoms():
    found = problem("irb_l6", "points", Drives.AS_COMMANDED)
    assert chain_of(found, "phi").size == chain_of(found, "dh").size == 4 * 6


@pytest.mark.parametrize("size", [0.0, 1e-7, 1e-3, 0.4, 3.0])
def test_rotation_charts_are_derivatives(size):
    rng = np.random.default_rng(2)
    v = rng.normal(size=3)
    v *= size / np.linalg.norm(v)
    rotation = rotations_of_vectors(v[None])[0]
    for step in STEP * np.eye(3):
        ahead, behind = (rotations_of_vectors((v + s * step)[None])[0] for s in (1, -1))
        turn = (vectors_of_rotations((ahead @ rotation.T)[None]) - vectors_of_rotations((behind @ rotation.T)[None]))[0]
        np.testing.assert_allclose(left_jacobian(v) @ step, turn / 2, atol=1e-9 * STEP + 1e-15)
        ends = [vectors_of_rotations((rotation @ rotations_of_vectors(s * step[None])[0])[None])[0] for s in (1, -1)]
        np.testing.assert_allclose(inverse_right_jacobian(v) @ step, (ends[0] - ends[1]) / 2, atol=1e-14)


def test_markers_show_their_frame_and_its_motion():
    rng = np.random.default_rng(4)
    frame = np.tile(np.eye(4), (5, 1, 1))
    frame[:, :3, :3], frame[:, :3, 3] = rotations_of_vectors(rng.normal(size=(5, 3))), rng.normal(size=(5, 3))
    np.testing.assert_allclose(frames_of(markers(frame)), frame, atol=1e-14)
    shift, turn = rng.normal(size=3), rng.normal(size=3)
    arm = markers(frame) - frame[:, None, :3, 3]
    expected = shift + np.cross(turn, arm)
    moves = (marker_moves(markers(frame)) @ np.concatenate([shift, turn])).reshape(5, 3, 3)
    np.testing.assert_allclose(moves, expected, atol=1e-13)
