"""Calibrated arms of simulated cells, and campaigns to judge them by."""

from dataclasses import replace
from functools import cache

import numpy as np

from core.calibrated_arm import CalibratedArm, calibrated_arm
from core.calibration import Calibration, calibrate
from core.geometry import apply, invert
from core.measurements import Campaign
from core.twin import irb_l6, scara
from core.twin.campaign import simulate_campaign, truth
from core.twin.cell import Cell
from core.twin.noise import Noise

EXACT = Noise(instrument=False, repeatability=False)
INSTRUMENT = Noise(repeatability=False)


def cell(which: str) -> Cell:
    return scara.cell() if which == "scara" else irb_l6.cell()


@cache
def campaign(which: str = "l6", noise: Noise = EXACT, seed: int = 1) -> Campaign:
    """A campaign that states no target's place; ``with_known_targets`` states them."""
    found = simulate_campaign(seed, cell(which), noise)
    return replace(found, targets=tuple(replace(target, point_m=None) for target in found.targets))


@cache
def calibration(which: str = "l6", noise: Noise = EXACT, seed: int = 1) -> Calibration:
    return calibrate(campaign(which, noise, seed))


@cache
def arm(which: str = "l6", noise: Noise = EXACT, seed: int = 1) -> CalibratedArm:
    return calibrated_arm(calibration(which, noise, seed))


def with_known_targets(found: Campaign, sigma_m: float = 0.0) -> Campaign:
    """The paper's campaign with the places of all targets on the last link stated, as they truly are."""
    true = truth()
    places = apply(invert(true.frames_at_rest()[-1]), true.rest_points_m)
    targets = tuple(
        replace(target, point_m=tuple(places[k]), sigma_m=sigma_m) if target.link == 6 else target
        for k, target in enumerate(found.targets)
    )
    return replace(found, targets=targets)


def poses_only(found: Campaign, keep: np.ndarray) -> Campaign:
    """A campaign without some of its rows."""
    table = found.measurements
    return replace(found, measurements=replace(table, point_m=np.where(keep[:, None], table.point_m, np.nan)))
