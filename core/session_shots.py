"""A planned step and what the instrument saw there -> the shot that a session keeps."""

from core.instruments import Reading
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
        point_m=reading.point_m,
        covariance_m2=reading.covariance_m2,
        joint=step.joint,
        sweep=step.sweep,
        step=step.step,
        approach=tuple(approach),
        replaces=replaces,
        angles_rad=reading.angles_rad,
        time_s=reading.time_s,
        temperature_c=reading.temperature_c,
        arm_temperature_c=reading.arm_temperature_c,
        payload_kg=payload_kg,
    )
