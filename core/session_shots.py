"""What was asked for and what the instrument saw there -> the shot that a session keeps."""

from typing import Any

import numpy as np

from core.instruments import Reading
from core.measurements import POSE
from core.session_events import ShotTaken
from core.session_plan import Step


def shot_at(step: Step, reading: Reading, payload_kg: float | None = None, replaces: int | None = None) -> ShotTaken:
    """The shot of a planned step.

    Args:
        replaces: the id of the shot that this one measures again.
    """
    approach = [0] * len(step.commanded)
    approach[step.joint - 1] = step.sense
    return ShotTaken(
        target=step.target,
        commanded=step.commanded,
        joint=step.joint,
        sweep=step.sweep,
        step=step.step,
        approach=tuple(approach),
        replaces=replaces,
        payload_kg=payload_kg,
        **_seen(reading),
    )


def shot_of_pose(
    number: int,
    target: str,
    commanded: tuple[float, ...],
    wanted: tuple[float, ...],
    approach: tuple[int, ...],
    reading: Reading,
) -> ShotTaken:
    """A shot at a test pose, which no calibration ever fits.

    Args:
        number: of the standstill, the index of the pose in a campaign.
        commanded: what the robot was sent, (n,).
        wanted: what the nominal arm would have been sent, (n,).
        approach: sense in which each joint reached its place, (n,).
    """
    return ShotTaken(
        target=target,
        commanded=commanded,
        phase=POSE,
        pose=number,
        approach=approach,
        check=True,
        wanted=None if commanded == wanted else wanted,
        **_seen(reading),
    )


def senses(before: tuple[float, ...], after: tuple[float, ...]) -> tuple[int, ...]:
    """The sense in which each joint goes from one command to another: +1, -1, or 0, (n,)."""
    return tuple(np.sign(np.subtract(after, before)).astype(int).tolist())


def _seen(reading: Reading) -> dict[str, Any]:
    """The fields of a shot that come from the instrument."""
    return {
        "point_m": reading.point_m,
        "covariance_m2": reading.covariance_m2,
        "angles_rad": reading.angles_rad,
        "time_s": reading.time_s,
        "temperature_c": reading.temperature_c,
        "arm_temperature_c": reading.arm_temperature_c,
    }
