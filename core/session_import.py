"""A campaign folder -> the events that a session would have kept of it."""

from pathlib import Path
from typing import Any

import numpy as np

from core.campaign_files import read_campaign
from core.errors import CampaignError, RobotError
from core.geometry import Array
from core.input_files import read_text
from core.kinematics import active_commands
from core.measurements import SWEEP, Campaign
from core.robot_files import ROBOT_FORMAT
from core.session_events import (
    Event,
    Fact,
    InstrumentChosen,
    OperatorNamed,
    Planned,
    RobotChosen,
    ShotTaken,
    TargetEntry,
    TargetsNamed,
    Titled,
)
from core.session_plan import PlannedSweep, commands_for
from core.sweep_fits import SAME_COMMAND
from core.toml_records import LIMIT_BYTES, parse_toml
from core.urdf import URDF_LIMIT_BYTES

OPERATOR = "operator"
"""The note of a campaign that names who measured."""
UPPER = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
OPTIONAL = (
    "time_s",
    "temperature_c",
    "arm_temperature_c",
    "payload_kg",
    "speed",
    "torque_nm",
    "readback",
    "wanted",
    "target_quaternion",
    "simulated_point_m",
)
"""Columns of a campaign that a shot may carry, under the same names."""


def campaign_events(folder: Path | str) -> list[Event]:
    """What happened in a campaign, as events.

    Raises:
        CampaignError, RobotError: the folder cannot be read.
    """
    campaign = read_campaign(folder)
    instrument, notes = campaign.instrument, dict(campaign.notes)
    events: list[Event] = [
        Titled(campaign.title),
        OperatorNamed(_line(notes.pop(OPERATOR, ""))),
        _robot_event(Path(folder)),
        TargetsNamed(tuple(TargetEntry(t.name, t.link, t.point_m, t.sigma_m) for t in campaign.targets)),
        InstrumentChosen(
            instrument.kind, instrument.sigma_m, _texts(instrument.description), instrument.turn_sigma_rad
        ),
        Planned(sweeps_of(campaign), None if campaign.home is None else campaign.home, campaign.joint_values),
    ]
    events += [Fact(_line(key), _text(value)) for key, value in notes.items()]
    return events + shots_of(campaign)


def sweeps_of(campaign: Campaign) -> tuple[PlannedSweep, ...]:
    """The sweeps that a campaign made, as a plan; those of a single stop are left to the shots."""
    table = campaign.measurements
    swept = np.flatnonzero(table.phase == SWEEP)
    sweeps = []
    for joint, number in dict.fromkeys(zip(table.joint[swept].tolist(), table.sweep[swept].tolist(), strict=True)):
        rows = swept[(table.joint[swept] == joint) & (table.sweep[swept] == number)]
        low, high, held = _range_of(campaign, joint, rows)
        stops = int(table.step[rows].max()) + 1
        if low < high and stops > 1:
            names = tuple(dict.fromkeys(campaign.targets[k].name for k in table.target[rows]))
            both_ways = len(set(table.approach[rows, joint - 1].tolist()) - {0}) > 1
            sweeps.append(PlannedSweep(joint, number, low, high, stops, names, both_ways, held))
    return tuple(sweeps)


def _range_of(campaign: Campaign, joint: int, rows: np.ndarray) -> tuple[float, float, tuple[float, ...] | None]:
    """How far the motor of a sweep went from where it was held, and where that was; None: at home."""
    robot, n = campaign.robot, campaign.robot.joint_count
    home = active_commands(robot, np.zeros(n) if campaign.home is None else campaign.home)[0]
    motors = active_commands(robot, campaign.measurements.commanded[rows])
    still = np.where(np.arange(n) == joint - 1, home, motors[0])
    along = motors[:, joint - 1] - still[joint - 1]
    at_home = np.abs(still - home).max() <= SAME_COMMAND
    held = None if at_home else tuple(commands_for(robot, still[None, :])[0].tolist())
    return float(along.min()), float(along.max()), held


def shots_of(campaign: Campaign) -> list[ShotTaken]:
    """Every row of a campaign as a shot; covariances that only repeat the instrument's sigma are left out."""
    table = campaign.measurements
    names = [*(target.name for target in campaign.targets), ""]
    stated = campaign.instrument.sigma_m
    upper = np.array([table.covariance_m2[:, i, j] for i, j in UPPER]).T
    own = np.isfinite(upper).all(axis=1)
    if stated is not None:
        own &= ~np.isclose(table.covariance_m2, stated**2 * np.eye(3), rtol=1e-13, atol=0).all(axis=(1, 2))
    seen = table.seen
    return [
        ShotTaken(
            target=names[table.target[k]],
            commanded=table.commanded[k],
            point_m=table.point_m[k] if seen[k] else None,
            covariance_m2=upper[k] if own[k] else None,
            phase=str(table.phase[k]),
            joint=int(table.joint[k]),
            sweep=int(table.sweep[k]),
            step=int(table.step[k]),
            pose=int(table.pose[k]),
            approach=table.approach[k] if table.approach[k].any() else (),
            check=bool(table.check[k]),
            record=int(table.record[k]),
            **{name: _one(getattr(table, name), k) for name in OPTIONAL},
        )
        for k in range(table.count)
    ]


def _one(column: Array | None, row: int) -> Any:
    """One row of a column that may be missing; nothing for what is not a number."""
    if column is None or np.isnan(column[row]).all():
        return None
    values = column[row].tolist()
    return [None if value != value else value for value in values] if column.ndim > 1 else values


def _line(text: str) -> str:
    return " ".join(_text(text).split())[:200]


def _text(text: str) -> str:
    """Without characters that no event holds, and not longer than one."""
    return "".join(c if c in "\n\t" or (c >= " " and c != "\x7f") else " " for c in text)[:10_000]


def _texts(texts: dict[str, str]) -> dict[str, str]:
    return {_line(key): _text(text) for key, text in texts.items()}


def _robot_event(folder: Path) -> RobotChosen:
    """The texts of the robot of a campaign folder that has been read before."""
    top = parse_toml(
        read_text(folder / "campaign.toml", LIMIT_BYTES, CampaignError), "trueaxis-campaign/1", CampaignError
    )
    path = folder / top.text("robot", "robot.toml")
    source = read_text(path, LIMIT_BYTES, RobotError)
    robot = parse_toml(source, ROBOT_FORMAT, RobotError)
    if "urdf" not in robot:
        return RobotChosen(source.text)
    name = robot.text("urdf")
    return RobotChosen(source.text, {name: read_text(path.parent / name, URDF_LIMIT_BYTES, RobotError).text})
