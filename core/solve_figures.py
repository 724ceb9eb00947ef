"""The main numbers of a calibration, small enough to stand in a session, and what changed from one to the next."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from core.calibration import Calibration

PARAMETERS = (("a", 1e3, "mm"), ("b", 1e3, "mm"), ("alpha", 180 / np.pi, "deg"), ("theta", 180 / np.pi, "deg"))
STD = "u of "
"""Before the name of a number: its standard uncertainty."""
TELLING = 0.1
"""A number that moved by less than this share of its uncertainty did not change."""


@dataclass(frozen=True)
class Change:
    """One number or family that is not what it was."""

    name: str
    """``a2``, ``noise``, ``drive of joint 3``."""
    before: str | float | None
    """None: it was not known."""
    after: str | float | None
    unit: str = ""
    in_std: float = float("inf")
    """How far it moved, in standard uncertainties of the new value; infinite where none is known."""


def figures_of(found: Calibration) -> dict[str, str | float]:
    """The main numbers by name and unit, with their uncertainties, and the families of drives and couplings."""
    noise_mm, used = found.estimate.noise_m * 1e3, int(found.refinement.residuals.used.sum())
    figures: dict[str, str | float] = {
        "noise_mm": noise_mm,
        # Of a standard deviation by some two free residuals a point.
        f"{STD}noise_mm": noise_mm / np.sqrt(4 * max(used, 1)),
        "points used": float(used),
        "points rejected": float(len(found.rejected)),
    }
    for joint, fit in enumerate(found.estimate.transmissions, 1):
        if fit is not None:
            figures[f"drive of joint {joint}"] = fit.form.name
    for joint, fit in enumerate(found.estimate.couplings, 1):
        if fit is not None:
            figures[f"coupling into joint {joint}"] = fit.form.name
    geometry = found.estimate.geometry
    if geometry is not None:
        for (i, k), std in np.ndenumerate(geometry.std):
            if std > 0:
                name, scale, unit = PARAMETERS[k]
                key = f"{name}{i + 1}_{unit}"
                figures[key] = float(geometry.model.parameters[i, k] * scale)
                figures[STD + key] = float(std * scale)
    return figures


def changes(before: Mapping[str, str | float], after: Mapping[str, str | float]) -> tuple[Change, ...]:
    """What is not as it was: words first, then numbers, the furthest moved first."""
    found = []
    for key in dict.fromkeys((*before, *after)):
        if key.startswith(STD):
            continue
        one, two = before.get(key), after.get(key)
        change = _change(key, one, two, after.get(STD + key))
        if one != two and change.in_std > TELLING:
            found.append(change)
    return tuple(sorted(found, key=lambda change: -change.in_std))


def _change(key: str, before: str | float | None, after: str | float | None, std: str | float | None) -> Change:
    name, _, unit = key.rpartition("_")
    if unit not in ("mm", "deg"):
        name, unit = key, ""
    in_std = float("inf")
    if isinstance(before, float) and isinstance(after, float) and isinstance(std, float) and std > 0:
        in_std = abs(after - before) / std
    return Change(name, before, after, unit, in_std)
