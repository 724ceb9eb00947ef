"""A session with measured points as a campaign folder."""

from pathlib import Path

import numpy as np

from tests.benchmarks.withheld.absorbed import SIGMA_M
from tests.benchmarks.withheld.rigid import Array
from tests.benchmarks.withheld.sessions import Session


def write_campaign(
    folder: Path, session: Session, point_m: Array, rng: np.random.Generator, history: bool = True
) -> None:
    """Write campaign.toml, robot.toml and measurements.csv.

    Args:
        point_m: measured points of the measured rows in the instrument's frame, (k, 3), m.
        rng: for the errors of the thermometers.
        history: False leaves out moves and senses of approach, as one who did not log them.
    """
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "robot.toml").write_text(session.arm.toml)
    (folder / "campaign.toml").write_text(_description(session))
    columns = _columns(session, point_m, rng)
    if not history:
        columns = {name: cells for name, cells in columns.items() if not name.startswith("approach")}
    keep = np.flatnonzero(session.measured | history)
    rows = [",".join(columns)] + [",".join(cells) for cells in zip(*columns.values(), strict=True)]
    (folder / "measurements.csv").write_text("\n".join([rows[0], *(rows[1 + k] for k in keep)]) + "\n")


def _description(session: Session) -> str:
    targets = "".join(f'[[target]]\nname = "T{t + 1}"\nlink = {session.arm.count}\n' for t in range(session.targets))
    return (
        'format = "trueaxis-campaign/1"\ntitle = "Simulated arm, withheld suite"\nrobot = "robot.toml"\n'
        f'joint_values = "{"readback" if session.readback else "commanded"}"\n[instrument]\nkind = "laser-tracker"\n'
        f"sigma_mm = {SIGMA_M * 1e3:g}\n{targets}"
    )


def _columns(session: Session, point_m: Array, rng: np.random.Generator) -> dict[str, list[str]]:
    m, n = session.q.shape
    swept, posed, seen = session.phase == "sweep", session.phase == "pose", session.measured
    point = np.full((m, 3), np.nan)
    point[seen] = point_m * 1e3
    columns = {
        "record": _whole(session.record),
        "phase": [str(word) for word in session.phase],
        "joint": _whole(session.joint + 1, swept),
        "sweep": _whole(session.sweep, swept),
        "step": _whole(session.step, swept),
        "pose": _whole(session.pose, posed),
        "approach": _whole(session.sense[np.arange(m), np.maximum(session.joint, 0)], swept),
    }
    columns |= {f"approach{j + 1}": _whole(session.sense[:, j], seen) for j in range(n)}
    columns["target"] = [f"T{t + 1}" if t >= 0 else "" for t in session.target]
    columns |= _joints(session)
    columns |= {f"{axis}_mm": _decimal(point[:, k], 5) for k, axis in enumerate("xyz")}
    return columns | _conditions(session, rng)


def _joints(session: Session) -> dict[str, list[str]]:
    """Commands, and speeds where any joint was measured in motion."""
    out = {}
    for j, slides in enumerate(session.arm.chain.sliding):
        unit, factor = ("mm", 1e3) if slides else ("deg", 180 / np.pi)
        out[f"q{j + 1}_{unit}"] = _decimal(session.q[:, j] * factor, 9)
        if session.speed.any():
            out[f"speed{j + 1}_{unit}_s"] = _decimal(session.speed[:, j] * factor, 7)
    return out


def _conditions(session: Session, rng: np.random.Generator) -> dict[str, list[str]]:
    """Clock, two thermometers with errors of 0.05 K, and the load."""
    m = len(session.q)
    swing = 0.6 * np.sin(2 * np.pi * (session.hours / 9.0 + rng.uniform(0, 1)))
    air = 21.0 + swing + rng.normal(0, 0.03, m)
    body = 21.0 + swing + 9.0 * session.warmth(0.8) + rng.normal(0, 0.05, m)
    return {
        "time_s": _decimal(session.time_s, 2),
        "temperature_c": _decimal(air, 2),
        "arm_temperature_c": _decimal(body, 2),
        "payload_kg": _decimal(session.payload_kg, 3),
    }


def _whole(values: np.ndarray, there: np.ndarray | None = None) -> list[str]:
    known = np.ones(len(values), dtype=bool) if there is None else there
    return [str(int(value)) if say else "" for value, say in zip(values, known, strict=True)]


def _decimal(values: Array, digits: int) -> list[str]:
    return ["" if np.isnan(value) else f"{value:.{digits}f}" for value in values]
