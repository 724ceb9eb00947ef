"""Session <-> campaign: what was measured in a session can be calibrated and exported, and a campaign folder opened.

Shots that were left out or measured again are not in the campaign; its notes say which and why.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from core.campaign_writer import write_campaign
from core.geometry import Array
from core.measurements import Campaign, Measurements, Target
from core.robot import Robot
from core.session import Session
from core.session_events import (
    SessionError,
    ShotTaken,
)
from core.session_families import with_families
from core.session_import import OPERATOR, campaign_events
from core.session_robot import write_texts
from core.session_state import Shot, State

_SYMMETRIC = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])
LEFT_OUT = "left out"
"""The note of an exported campaign that says which shots are not in it, and why."""


def to_campaign(state: State) -> Campaign:
    """The campaign of a session's shots that count.

    Raises:
        SessionError: robot, targets or shots are not there yet.
        RobotError: the robot's description cannot be read.
        InputError: a drive or coupling was given a family that it cannot have.
    """
    robot = state.robot
    if robot is None or not state.targets:
        raise SessionError(f"{'no robot is' if robot is None else 'no targets are'} chosen yet, expected them first")
    shots = [shot for shot in state.shots if shot.counts]
    if not shots:
        raise SessionError("no shot counts yet, expected at least one")
    return Campaign(
        robot=with_families(robot, state.settings),
        targets=state.targets,
        measurements=_measurements(shots, state.targets, robot, state.instrument.sigma_m),
        title=state.title,
        instrument=state.instrument,
        joint_values=state.plan.joint_values,
        home=None if state.plan.home is None else np.array(state.plan.home),
        notes=_notes(state),
    )


def export_campaign(state: State, folder: Path | str) -> None:
    """Write a session as a campaign folder, which is made if it is not there.

    Raises:
        SessionError, RobotError: as for ``to_campaign``, or the folder cannot be written.
    """
    campaign = to_campaign(state)
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_texts(folder, state.robot_files)
        write_campaign(folder, campaign, state.robot_toml)
    except OSError as wrong:
        raise SessionError(f"{folder} cannot be written: {wrong.strerror}, expected a folder with room") from None


def open_campaign(folder: Path | str, path: Path | str, by: str = "") -> Session:
    """Make a session file of a campaign folder and open it.

    Raises:
        CampaignError, RobotError: the folder cannot be read.
        SessionError: the file cannot be written.
    """
    return Session.create(path, campaign_events(folder), by)


def _notes(state: State) -> dict[str, str]:
    notes = dict(state.facts)
    if state.operator:
        notes[OPERATOR] = state.operator
    gone = [f"record {shot.record}: {shot.reason}" for shot in state.shots if shot.verdict == "excluded"]
    gone += [f"record {shot.record}: measured again" for shot in state.shots if shot.superseded_by is not None]
    if gone:
        notes[LEFT_OUT] = "; ".join(gone[:20]) + (f"; and {len(gone) - 20} more" if len(gone) > 20 else "")
    return notes


def _measurements(shots: list[Shot], targets: tuple[Target, ...], robot: Robot, sigma_m: float | None) -> Measurements:
    taken = [shot.taken for shot in shots]
    n, index = robot.joint_count, {target.name: k for k, target in enumerate(targets)}
    points = _rows(taken, lambda shot: shot.point_m, 3)
    unknown = [shot.target for shot in taken if shot.target and shot.target not in index]
    if unknown:
        raise SessionError(f"there is no target {unknown[0]!r}, which a shot shows, expected it among the targets")
    return Measurements(
        record=np.array([shot.record for shot in shots]),
        phase=np.array([shot.phase for shot in taken]),
        joint=np.array([shot.joint for shot in taken]),
        sweep=np.array([shot.sweep for shot in taken]),
        step=np.array([shot.step for shot in taken]),
        pose=np.array([shot.pose for shot in taken]),
        target=np.array([index.get(shot.target, -1) for shot in taken]),
        commanded=np.array([shot.commanded for shot in taken], dtype=float),
        point_m=points,
        covariance_m2=_covariances(taken, points, sigma_m),
        check=np.array([shot.check for shot in taken]),
        approach=np.array([shot.approach or (0,) * n for shot in taken]),
        time_s=_column(taken, "time_s"),
        temperature_c=_column(taken, "temperature_c"),
        arm_temperature_c=_column(taken, "arm_temperature_c"),
        payload_kg=_column(taken, "payload_kg"),
        speed=_table(taken, "speed", n, 0.0),
        torque_nm=_table(taken, "torque_nm", n),
        readback=_table(taken, "readback", n),
        wanted=_table(taken, "wanted", n),
        target_quaternion=_table(taken, "target_quaternion", 4),
        simulated_point_m=_table(taken, "simulated_point_m", 3),
    )


def _covariances(taken: list[ShotTaken], points_m: Array, sigma_m: float | None) -> Array:
    """Each point's own, else the instrument's, (m, 3, 3); NaN where nothing was seen or nothing is stated."""
    own = _rows(taken, lambda shot: shot.covariance_m2, 6)[:, _SYMMETRIC]
    stated = (np.nan if sigma_m is None else sigma_m**2) * np.eye(3)
    covariance = np.where(np.isnan(own), stated, own)
    covariance[np.isnan(points_m[:, 0])] = np.nan
    return covariance


def _column(taken: list[ShotTaken], name: str) -> Array | None:
    values = [getattr(shot, name) for shot in taken]
    if all(value is None for value in values):
        return None
    return np.array([np.nan if value is None else value for value in values])


def _table(taken: list[ShotTaken], name: str, width: int, absent: float = np.nan) -> Array | None:
    if all(getattr(shot, name) is None for shot in taken):
        return None
    return _rows(taken, lambda shot: getattr(shot, name), width, absent)


def _rows(taken: list[ShotTaken], of: Callable[[ShotTaken], Any], width: int, absent: float = np.nan) -> Array:
    nothing = (absent,) * width
    return np.array([of(shot) or nothing for shot in taken], dtype=float).reshape(-1, width)
