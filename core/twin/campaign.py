"""One simulated campaign: schedule, true points, the arm's repeatability, the instrument's readings."""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from core.geometry import Array
from core.measurements import POSE, Campaign, Measurements
from core.session_plan import commands_for
from core.twin import irb_l6
from core.twin.cell import Cell, Truth
from core.twin.effects import Effect
from core.twin.forward import faulty_truth, true_points
from core.twin.noise import Noise, Repeatability

NOISY = Noise()


def simulate_campaign(
    seed: int, cell: Cell | None = None, noise: Noise = NOISY, effects: tuple[Effect, ...] = ()
) -> Campaign:
    """A campaign measured on a simulated arm.

    The covariance of a point states what the instrument does, not the arm's repeatability: that is for a calibration to
    find. Latency shows on a moving arm only: with such an effect the sweeps are measured in motion.

    Args:
        seed: of the random numbers; the same seed gives the same campaign.
        cell: what is simulated; None: the paper's arm, ``irb_l6.cell()``.
        noise: which random parts are switched on.
        effects: faults of the arm, the base, the targets or the instrument.

    Raises:
        InputError: an effect names something that the cell has not, or cannot be made.
    """
    cell = _prepared(irb_l6.cell() if cell is None else cell, effects)
    rng = np.random.default_rng(seed)
    repeatability = cell.repeatability if noise.repeatability else Repeatability()
    stood = repeatability.displaced(true_points(cell, effects), cell.bodies, rng)
    if noise.instrument:
        points_m, covariance_m2 = cell.instrument.measure(stood, rng)
    else:
        points_m, covariance_m2 = stood, cell.instrument.covariance(stood)
    return Campaign(
        robot=cell.robot,
        targets=cell.targets,
        measurements=_measurements(cell, points_m, covariance_m2),
        title=cell.title,
        instrument=cell.instrument.statement,
        home=cell.home,
        notes={**dict(cell.notes), "seed": str(seed)},
    )


def truth(cell: Cell | None = None, effects: tuple[Effect, ...] = ()) -> Truth:
    """What the arm of a cell really is, to compare estimates with.

    Of the effects only those of the geometry show here.

    Raises:
        InputError: an effect names something that the cell has not.
    """
    return faulty_truth(irb_l6.cell() if cell is None else cell, effects)


@lru_cache(maxsize=8)
def in_motion(cell: Cell) -> Cell:
    """The same cell with sweeps that are measured while the joint moves."""
    return replace(cell, protocol=replace(cell.protocol, in_motion=True))


@lru_cache(maxsize=8)
def both_ways(cell: Cell) -> Cell:
    """The same cell with every sweep made forwards and then backwards."""
    return replace(cell, protocol=replace(cell.protocol, both_ways=True))


def _prepared(cell: Cell, effects: tuple[Effect, ...]) -> Cell:
    moving = any(effect.name == "latency" for effect in effects)
    return in_motion(cell) if moving and not cell.protocol.in_motion else cell


def _measurements(cell: Cell, points_m: Array, covariance_m2: Array) -> Measurements:
    rows = cell.schedule
    count = len(rows.stop)
    speed = commands_for(cell.robot, rows.speed)[rows.stop] if cell.protocol.in_motion else None
    return Measurements(
        record=np.arange(1, count + 1),
        phase=rows.column("phase"),
        joint=rows.column("joint"),
        sweep=rows.column("sweep"),
        step=rows.column("step"),
        pose=rows.column("pose"),
        target=rows.target,
        commanded=rows.commanded[rows.stop],
        point_m=points_m,
        covariance_m2=covariance_m2,
        check=rows.column("phase") == POSE,
        approach=rows.approach[rows.stop],
        time_s=rows.time_s,
        temperature_c=rows.air_c,
        arm_temperature_c=rows.arm_c,
        payload_kg=np.zeros(count),
        speed=speed,
    )
