"""Blocks of points that could be measured next, as a campaign would hold them."""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from core.gap.observations import Observations
from core.geometry import Array
from core.kinematics import active_commands, nominal_net
from core.measurements import POSE, Campaign, Measurements

POSES, POINTS = 40, 40
EXTRA_KG = 5.0

ELSEWHERE = 0.35
"""Share of their spans by which the other joints are moved for a sweep in another configuration."""
SEED = 17


@dataclass(frozen=True, eq=False)
class Block:
    """Something to measure, in words, and the campaign as it would be with it."""

    words: str
    campaign: Campaign
    """Its last ``count`` rows are the block."""
    count: int


def blocks_for(seen: Observations, joint: int | None) -> list[Block]:
    """What could be measured to tell causes at a joint (1..n) apart, or causes of no joint."""
    makers: list[Callable[[Observations, int | None], Block | None]] = [
        _reversed_sweep,
        _loaded_sweep,
        _second_radius,
        _other_configuration,
        _poses,
        _first_sweep_again,
    ]
    return [block for block in (make(seen, joint) for make in makers) if block is not None]


def _sweep_rows(seen: Observations, joint: int | None) -> np.ndarray:
    """Rows of the campaign that hold one sweep of a joint, or the first one."""
    table = seen.campaign.measurements
    mine = seen.rows[seen.swept & ((seen.joint == joint) if joint is not None else True)]
    if not len(mine):
        return mine
    first = mine[0]
    same = (table.joint[mine] == table.joint[first]) & (table.sweep[mine] == table.sweep[first])
    same &= table.approach[mine, table.joint[first] - 1] == table.approach[first, table.joint[first] - 1]
    rows = mine[same]
    return rows[:: max(1, len(rows) // POINTS)]


def _reversed_sweep(seen: Observations, joint: int | None) -> Block | None:
    rows = _sweep_rows(seen, joint)[::-1]
    if not len(rows):
        return None
    moving = int(seen.campaign.measurements.joint[rows[0]])
    return _block(seen, rows, f"the sweep of joint {moving} once more in the other sense", sense=-1)


def _loaded_sweep(seen: Observations, joint: int | None) -> Block | None:
    rows = _sweep_rows(seen, joint)
    if not len(rows) or seen.chain.gravity_direction is None:
        return None
    moving = int(seen.campaign.measurements.joint[rows[0]])
    words = f"the sweep of joint {moving} with {EXTRA_KG:g} kg more at the tool"
    return _block(seen, rows, words, extra_kg=EXTRA_KG)


def _second_radius(seen: Observations, joint: int | None) -> Block | None:
    rows = _sweep_rows(seen, joint)
    if not len(rows):
        return None
    moving = int(seen.campaign.measurements.joint[rows[0]])
    return _block(seen, rows, f"the sweep of joint {moving} with a second target elsewhere on its link", offset=True)


def _other_configuration(seen: Observations, joint: int | None) -> Block | None:
    rows = _sweep_rows(seen, joint)
    if not len(rows):
        return None
    moving = int(seen.campaign.measurements.joint[rows[0]])
    shift = ELSEWHERE * seen.span * np.where(np.arange(seen.joint_count) % 2, 1.0, -1.0)
    shift[moving - 1] = 0.0
    return _block(seen, rows, f"the sweep of joint {moving} with the other joints elsewhere", shift=shift)


def _poses(seen: Observations, joint: int | None) -> Block | None:
    rows = seen.rows[np.linspace(0, seen.count - 1, POSES).astype(int)]
    commanded = seen.campaign.measurements.commanded[seen.rows]
    low, high = commanded.min(axis=0), commanded.max(axis=0)
    drawn = np.random.default_rng(SEED).uniform(low, high, (POSES, len(low)))
    return _block(seen, rows, f"{POSES} poses all over the joint space, approached from changing sides", poses=drawn)


def _first_sweep_again(seen: Observations, joint: int | None) -> Block | None:
    rows = _sweep_rows(seen, int(seen.joint[seen.swept][0])) if seen.swept.any() else seen.rows[:0]
    if not len(rows):
        return None
    return _block(seen, rows, "the first sweep once more at the end")


def _block(
    seen: Observations,
    rows: np.ndarray,
    words: str,
    sense: int = 1,
    extra_kg: float = 0.0,
    offset: bool = False,
    shift: Array | None = None,
    poses: Array | None = None,
) -> Block:
    """Copies of some rows, changed and put behind all others."""
    campaign = seen.campaign
    table = campaign.measurements
    m, count = table.count, len(rows)
    changes: dict[str, object] = {one.name: _appended(getattr(table, one.name), rows) for one in fields(Measurements)}
    changes["record"] = np.concatenate([table.record, table.record.max() + 1 + np.arange(count)])
    changes["approach"][m:] *= sense
    if table.time_s is not None:
        pace = np.nanmedian(np.diff(table.time_s)) if m > 1 else 1.0
        changes["time_s"][m:] = np.nanmax(table.time_s) + pace * (1 + np.arange(count))
    if extra_kg:
        kg = changes["payload_kg"] if table.payload_kg is not None else np.zeros(m + count)
        changes["payload_kg"] = kg + np.where(np.arange(m + count) >= m, extra_kg, 0.0)
    if shift is not None:
        changes["commanded"][m:] += shift
        changes["sweep"][m:] += 1000
    if poses is not None:
        changes["commanded"][m:] = poses
        changes["phase"] = np.array([*table.phase, *[POSE] * count], dtype=object)
        changes["joint"][m:] = 0
        changes["pose"][m:] = table.pose.max() + 1 + np.arange(count)
        changes["approach"][m:] = np.sign(np.random.default_rng(SEED).standard_normal((count, seen.joint_count)))
    targets = campaign.targets
    if offset:
        old = table.target[rows]
        changes["target"][m:] = len(targets) + np.searchsorted(np.unique(old), old)
        targets += tuple(replace(targets[t], name=f"{targets[t].name}, elsewhere") for t in np.unique(old))
    return Block(words, replace(campaign, measurements=Measurements(**changes), targets=targets), count)


def _appended(values: Array | None, rows: np.ndarray) -> Array | None:
    return None if values is None else np.concatenate([values, values[rows]])


def observe_block(seen: Observations, block: Block) -> Observations:
    """The points of a block, for the same sim."""
    table = block.campaign.measurements
    rows = np.arange(table.count - block.count, table.count)
    commanded, robot, arm = table.commanded[rows], block.campaign.robot, seen.calibrated
    net = nominal_net(robot, commanded) if arm is None else arm.drives.net(commanded)
    return replace(seen, campaign=block.campaign, rows=rows, active=active_commands(robot, commanded), net=net)
