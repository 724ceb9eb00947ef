"""What a calibration leaves uncertain is no cause: its columns are derivatives, and what it never knew has no name."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from arms_in_use import calibration

from core.calibrated_arm import CalibratedArm, assembled_arm, calibrated_arm
from core.calibration import Calibration, calibrate
from core.drives import offsets
from core.estimate import ArmEstimate
from core.gap.calibration_doubt import doubt_columns
from core.gap.corrected import Diagnosis
from core.gap.design import Design
from core.gap.diagnosis import diagnose
from core.gap.experiments import blocks_for, observe_block
from core.gap.ledger import ledger
from core.gap.observations import Observations, observe
from core.gap.place_words import CALIBRATION
from core.gap.result import Place, Verdict
from core.gap.sim import Sim
from core.gap.verdict_words import verdict_sentence
from core.geometry import Array
from core.measurements import Campaign
from core.parameter_covariance import FRAME, TRANSMISSION, Parameter, ParameterCovariance
from core.phi_model import PARAMETERS
from core.twin import irb_l6
from core.twin.campaign import simulate_campaign
from core.twin.effects import parse_effect
from core.twin.noise import Noise

STEP = 1e-6


def perturbed(found: Calibration, parameter: Parameter, step: float) -> CalibratedArm:
    """The arm of a calibration with one parameter changed, its base where it was."""
    estimate = found.estimate
    if parameter.part == FRAME:
        values = estimate.geometry.model.parameters.copy()
        values[parameter.number - 1, PARAMETERS.index(parameter.name)] += step
        model = replace(estimate.geometry.model, **dict(zip(PARAMETERS, values.T, strict=True)))
        changed: ArmEstimate = replace(estimate, geometry=replace(estimate.geometry, model=model))
    else:
        which = "transmissions" if parameter.part == TRANSMISSION else "couplings"
        functions = list(getattr(estimate.arm, which))
        one = functions[parameter.number - 1]
        coefficients = one.coefficients.copy()
        coefficients[one.form.coefficient_names.index(parameter.name)] += step
        functions[parameter.number - 1] = replace(one, coefficients=coefficients)
        if which == "transmissions":
            counted = offsets(found.campaign, [replace(f, offset=0.0) for f in functions])
            functions = [replace(f, offset=float(o)) for f, o in zip(functions, counted, strict=True)]
        changed = replace(estimate, arm=replace(estimate.arm, **{which: tuple(functions)}))
    rest = (found.refinement.rest_points_m, found.refinement.rest_covariance_m2)
    return assembled_arm(found.campaign, found.convention, found.nominal, changed, rest)


def points_m(seen: Observations, target_m: Array) -> Array:
    return Sim(seen, np.eye(4), target_m, np.zeros(3)).points_m()


@pytest.mark.parametrize("which", ["l6", "scara"])
def test_the_columns_are_the_derivatives_by_the_parameters(which: str) -> None:
    found = calibration(which, Noise())
    arm = calibrated_arm(found)
    target_m = np.random.default_rng(3).uniform(-0.2, 0.2, (len(found.campaign.targets), 3))
    for parameter in arm.covariance.parameters:
        seen = observe(found.campaign, replace(arm, covariance=ParameterCovariance((parameter,), np.eye(1))))
        moved = [points_m(observe(found.campaign, perturbed(found, parameter, s)), target_m) for s in (STEP, -STEP)]
        expected = (moved[0] - moved[1]) / (2 * STEP)
        (column,) = doubt_columns(seen)
        sim = Sim(seen, np.eye(4), target_m, np.zeros(3))
        derivative = Design(sim, (column,), np.ones(1)).whole()[:, :, 0]
        # A root is free in its sign. What a motor passes on goes with the nominal gain, which is off by a per cent.
        sign = np.sign(np.sum(derivative * expected))
        close = 0.01 if parameter.part == TRANSMISSION else 1e-6
        scale = np.abs(expected).max()
        assert scale > 0
        np.testing.assert_allclose(sign * derivative, expected, rtol=0, atol=close * scale, err_msg=str(parameter))


def test_without_a_covariance_there_is_no_doubt() -> None:
    found = calibration("scara", Noise())
    arm = replace(calibrated_arm(found), covariance=None)
    assert doubt_columns(observe(found.campaign, arm)) == []
    assert doubt_columns(observe(found.campaign)) == []


def test_a_planned_block_is_predicted_by_the_calibrated_drives() -> None:
    found = calibration("scara", Noise())
    arm = calibrated_arm(found)
    seen = observe(found.campaign, arm)
    block = blocks_for(seen, 1)[0]
    again = observe_block(seen, block)
    np.testing.assert_allclose(again.net, arm.drives.net(again.commanded), atol=1e-15)
    assert len(doubt_columns(again)) == len(doubt_columns(seen))


def simulated(seed: int, *effects: str) -> Campaign:
    cell = irb_l6.cell()
    return simulate_campaign(seed, cell, effects=tuple(parse_effect(text) for text in effects))


@cache
def diagnosed(seed: int, *effects: str) -> Diagnosis:
    """Held against the arm as calibrated on another campaign of it."""
    return diagnose(simulated(seed, *effects), calibrated_arm(calibrate(simulated(20))))


@pytest.mark.parametrize("seed", [20, 21, 22])
def test_what_the_calibration_never_knew_is_no_gap(seed: int) -> None:
    found = diagnosed(seed)
    assert found.verdict is Verdict.NO_GAP
    assert found.causes == ()
    assert found.within_calibration_rms_m == found.left_rms_m < 0.5 * found.gap_rms_m
    assert "leaves uncertain" in verdict_sentence(found)


@pytest.mark.parametrize("seed", [23, 24])
def test_a_cause_is_found_beside_what_the_calibration_never_knew(seed: int) -> None:
    found = diagnosed(seed, "latency:all:20ms")
    assert found.causes[0].place.effect == "latency"
    assert found.causes[0].probability > 0.5
    delay = found.causes[0].parameters[0]
    assert delay.value == pytest.approx(0.02, abs=4 * delay.std)
    assert CALIBRATION in verdict_sentence(found)
    lines = ledger(found)
    assert lines[0].words == CALIBRATION
    assert sum(line.square_m2 for line in lines) == pytest.approx(found.gap_rms_m**2)


def test_the_corrected_sim_moves_the_calibration_as_far_as_it_was_moved() -> None:
    found = diagnosed(23, "latency:all:20ms")
    seen, points = found.corrected.points_m(found.campaign)
    left = np.sqrt(np.mean(np.sum((seen.point_m - points) ** 2, axis=1)))
    assert left < 1.2 * found.left_rms_m
    still = replace(found.corrected, doubt=np.zeros_like(found.corrected.doubt))
    _, unmoved = still.points_m(found.campaign)
    assert np.sqrt(np.mean(np.sum((seen.point_m - unmoved) ** 2, axis=1))) > 2 * left


def test_the_floor_is_at_least_the_noise_that_the_calibration_found() -> None:
    """The instrument's statement knows nothing of how well the arm comes back to a place."""
    noise_m = calibrated_arm(calibrate(simulated(20))).noise_m
    found = diagnosed(25, "backlash:2:0.2deg")
    assert found.noise.stated_m < 0.6 * noise_m
    assert found.noise.floor_rms_m == pytest.approx(np.sqrt(3) * noise_m, rel=0.05)
    assert found.causes[0].place.same_as(Place("backlash", joint=2))
    assert found.causes[0].probability > 0.5
