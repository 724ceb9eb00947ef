"""How long a diagnosis of the gap takes, and how much memory, for campaigns of 1,000 to 20,000 points.

Run by ``python -m tests.benchmarks gap``. Each campaign is the twin's L6, all of it off, with backlash and a drift
beside; each diagnosis runs in a process of its own, so that its peak of memory is its own.
"""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import numpy as np

from core.calibrated_arm import CalibratedArm, calibrated_arm
from core.calibration import calibrate
from core.gap.diagnosis import diagnose
from core.measurements import Campaign
from core.twin import irb_l6
from core.twin.campaign import NOISY, simulate_campaign
from core.twin.effects import parse_effect
from tests.benchmarks.tables import markdown

SIZES = (1_000, 5_000, 20_000)
EFFECTS = ("backlash:1:0.05deg", "drift:-:0.2mm/h")
SWEPT = 0.6
"""Share of points on arcs; the rest are poses."""
SEED = 5


def campaign(points: int) -> Campaign:
    """A simulated campaign of about so many points, forward and back."""
    cell = irb_l6.cell()
    plan = cell.protocol
    shots = sum(sweep.points * len(sweep.targets) for sweep in plan.sweeps)
    times = SWEPT * points / (2 * shots)
    sweeps = tuple(replace(sweep, points=max(round(sweep.points * times), 4)) for sweep in plan.sweeps)
    low, high = plan.poses.min(axis=0), plan.poses.max(axis=0)
    count = max(round((1 - SWEPT) * points / len(plan.pose_targets)), 4)
    poses = np.random.default_rng(SEED).uniform(low, high, (count, len(low)))
    longer = replace(plan, sweeps=sweeps, poses=poses, both_ways=True, seconds_a_shot=5.0)
    effects = tuple(parse_effect(text, cell.robot) for text in EFFECTS)
    found = simulate_campaign(SEED, replace(cell, protocol=longer), NOISY, effects)
    rows = found.measurements
    return replace(found, measurements=replace(rows, check=np.zeros(rows.count, dtype=bool)))


def asked(points: int, drawn: bool) -> tuple[int, float, float, float, float]:
    """Points, seconds, peak memory in MB, gap before and after in mm."""
    made = campaign(points)
    arm: CalibratedArm | None = None if drawn else calibrated_arm(calibrate(campaign(1_000)))
    found = diagnose(made, arm)
    return len(found.rows), found.seconds, found.peak_memory_mb, found.gap_rms_m * 1e3, found.left_rms_m * 1e3


def report() -> str:
    """Times and peaks as a table in Markdown."""
    rows = []
    for points in SIZES:
        for drawn in (True, False):
            with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
                count, seconds, peak_mb, before, after = pool.submit(asked, points, drawn).result()
            sim = "as drawn" if drawn else "calibrated"
            rows.append([f"{count}", sim, f"{seconds:.1f} s", f"{peak_mb:.0f} MB", f"{before:.2f}", f"{after:.2f}"])
    return markdown(("points", "sim", "time", "peak memory", "gap, mm", "left, mm"), rows)
