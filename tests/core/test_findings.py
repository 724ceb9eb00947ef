"""What is said of an arm is what its numbers say."""

import numpy as np
import pytest

from core.arm_jacobian import ArmState, Layout, moved
from core.calibration import calibrate
from core.findings import axis_angle, crossing_distance, parallel_distance
from core.geometry import Line
from core.twin.campaign import simulate_campaign
from core.twin.effects import parse_effect
from core.twin.irb_l6 import cell
from core.twin.noise import Noise

RNG = np.random.default_rng(11)
SILENT = Noise(instrument=False, repeatability=False)


def nudged(first, second, step):
    layout = Layout((slice(0, 4), slice(4, 8)), (None, None), (None, None), slice(8, 8), 8)
    state = ArmState((first, second), (None, None), (None, None), np.zeros((0, 3)))
    return moved(state, layout, step).axes


@pytest.mark.parametrize(
    ("measure", "tilt"), [(axis_angle, 1.0), (axis_angle, 0.02), (crossing_distance, 1.0), (parallel_distance, 0.02)]
)
def test_gradients_of_measures_between_axes(measure, tilt):
    for _ in range(20):
        direction = RNG.normal(size=3)
        first = Line(RNG.normal(size=3), direction)
        second = Line(RNG.normal(size=3), direction / np.linalg.norm(direction) + tilt * RNG.normal(size=3))
        _, gradient = measure(first, second)
        for k, unit in enumerate(np.eye(8)):
            high, low = (
                measure(*nudged(first, second, 1e-6 * unit))[0],
                measure(*nudged(first, second, -1e-6 * unit))[0],
            )
            assert gradient[k] == pytest.approx((high - low) / 2e-6, abs=2e-4)


def test_axes_further_apart_than_designed_are_said_to_be():
    effect = parse_effect("geometry:2:-5mm", cell().robot)
    plain, changed = (
        calibrate(simulate_campaign(1, noise=SILENT, effects=effects)).findings for effects in ((), (effect,))
    )

    def distance(found):
        return next(f for f in found if f.parameter == "distance_m" and f.frame == 2)

    assert distance(changed).deviation - distance(plain).deviation == pytest.approx(5e-3, abs=1e-5)
    assert "further apart than designed" in distance(changed).text
    assert distance(changed).significant


def test_significant_means_beyond_two_standard_uncertainties():
    found = calibrate(simulate_campaign(4)).findings
    assert {f.significant for f in found} == {True, False}
    for finding in found:
        assert finding.significant == (abs(finding.deviation) > 2 * finding.std)


def test_significant_findings_come_first_and_name_their_place():
    found = calibrate(simulate_campaign(4)).findings
    flags = [f.significant for f in found]
    assert flags == sorted(flags, reverse=True)
    assert all((f.frame is None) != (f.joint is None) for f in found)
