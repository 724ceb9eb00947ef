"""The loop closed on the twin: what was wanted, commanded, measured; before compensation and after it."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from arms_in_use import EXACT, arm, cell

from core.compensation import compensate
from core.geometry import Array
from core.kinematics import active_commands, forward, nominal_net
from core.measurements import POSE, Campaign
from core.pose_loop import PoseLoop, pose_loop
from core.rotations import vectors_of_rotations
from core.twin.campaign import simulate_campaign, truth
from core.twin.noise import Noise
from core.verification import verify
from core.verification_json import verification_to_json


def wanted_commands() -> Array:
    own = cell("l6")
    return own.schedule.commanded[[k for k, stop in enumerate(own.schedule.stops) if stop.phase == POSE]]


@cache
def campaign_of_both(noise: Noise = EXACT, calibrated_with: Noise = EXACT) -> Campaign:
    """The twin sent to its test poses by nominal and then by compensated commands."""
    own, ready, wanted = cell("l6"), arm("l6", calibrated_with), wanted_commands()
    found = compensate(ready, forward(ready.nominal, nominal_net(ready.nominal, wanted)), wanted)
    assert found.ok.all()
    sent = np.concatenate([wanted, found.commanded])
    # A protocol displaces motors from the centre; these are the displacements that lead to the same commands.
    motors = active_commands(own.robot, sent) - active_commands(own.robot, own.centre)
    simulated = simulate_campaign(3, replace(own, protocol=replace(own.protocol, poses=motors)), noise)
    table = simulated.measurements
    posed = table.phase == POSE
    column = np.full(table.commanded.shape, np.nan)
    column[posed] = np.concatenate([wanted, wanted])[table.pose[posed]]
    np.testing.assert_allclose(table.commanded[posed], sent[table.pose[posed]], rtol=0, atol=1e-12)
    return replace(simulated, measurements=replace(table, wanted=column))


@cache
def loop(noise: Noise = EXACT, calibrated_with: Noise = EXACT) -> PoseLoop:
    return pose_loop(verify(campaign_of_both(noise, calibrated_with), arm("l6", calibrated_with)))


def test_each_wanted_pose_was_visited_in_both_ways() -> None:
    found = loop()
    assert found.wanted.shape == (12, 6)
    np.testing.assert_allclose(found.wanted, wanted_commands(), rtol=0, atol=1e-12)
    assert found.nominal.row.tolist() == list(range(12))
    assert found.compensated.row.tolist() == list(range(12, 24))
    assert found.nominal.goal.tolist() == found.compensated.goal.tolist() == list(range(12))
    assert found.both.tolist() == list(range(12))


def test_before_it_is_the_nominal_arm_s_error_and_after_it_nothing_is_left() -> None:
    found = loop()
    np.testing.assert_allclose(
        found.nominal.errors.position.value, found.found.nominal.position.value[:12], rtol=0, atol=1e-12
    )
    assert found.nominal.errors.position.mean == pytest.approx(0.0470, abs=5e-5)
    assert found.compensated.errors.position.max < 1e-7
    assert found.compensated.errors.orientation.max < 1e-7


def test_the_errors_are_where_the_twin_s_tool_really_is_off_the_wanted_pose() -> None:
    """With a calibration that errs: measured errors are the true ones, not what the calibration believes."""
    found = loop(EXACT, Noise())
    ready = arm("l6", Noise())
    commanded = found.found.measured.seen.commanded
    true = truth().base @ truth().tool_poses(commanded)
    wanted = ready.base @ forward(ready.nominal, nominal_net(ready.nominal, found.found.measured.seen.wanted))
    shift = np.linalg.norm(true[:, :3, 3] - wanted[:, :3, 3], axis=1)
    turn = np.linalg.norm(vectors_of_rotations(true[:, :3, :3] @ np.swapaxes(wanted[:, :3, :3], 1, 2)), axis=1)
    for attempts in (found.nominal, found.compensated):
        np.testing.assert_allclose(attempts.errors.position.value, shift[attempts.row], rtol=0, atol=1e-7)
        np.testing.assert_allclose(attempts.errors.orientation.value, turn[attempts.row], rtol=0, atol=1e-7)
    assert 1e-4 < found.compensated.errors.position.mean < 3e-3


def test_a_second_visit_counts_as_the_last_one() -> None:
    found = loop()
    assert found.compensated.last(4) == 4
    assert found.compensated.last(99) is None


def test_without_compensated_visits_there_is_nothing_after() -> None:
    own = campaign_of_both()
    found = pose_loop(verify(replace(own, measurements=replace(own.measurements, wanted=None)), arm()))
    assert found.compensated.count == 0
    assert found.compensated.errors.position.count == 0
    assert np.isnan(found.compensated.errors.position.mean)
    assert len(found.wanted) == 24
    assert len(found.both) == 0


def test_the_file_tells_both_ways() -> None:
    document = json.loads(verification_to_json(loop(Noise(), Noise()).found))
    told = document["compensation"]
    assert [(v["wanted"], v["command"]) for v in told["visits"][:2]] == [(1, "nominal"), (2, "nominal")]
    assert [v["pose"] for v in told["visits"]] == list(range(24))
    own = [v["position_mm"] for v in told["visits"] if v["command"] == "compensated"]
    assert told["summary"]["compensated"]["position_mm"]["mean"] == pytest.approx(np.mean(own))
    means = [told["summary"][name]["position_mm"]["mean"] for name in ("nominal", "compensated")]
    assert told["improvement_position"] == pytest.approx(means[0] / means[1])
    assert means[0] > 30
    assert means[1] < 3
    plain = replace(campaign_of_both(), measurements=replace(campaign_of_both().measurements, wanted=None))
    assert json.loads(verification_to_json(verify(plain, arm())))["compensation"] is None
