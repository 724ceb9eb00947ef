"""Table 2 on the dashboard: design against arm, with uncertainty, and pass or fail against the operator's limits."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from app.clicks import listening, saying
from app.spots import Spot
from app.words import block
from core.phi_model import PARAMETERS

if TYPE_CHECKING:
    from core.calibration import Calibration

NAMES = ("a", "b", "α", "θ")
SCALES = ((1e3, "mm"), (1e3, "mm"), (180 / np.pi, "deg"), (180 / np.pi, "deg"))
SIGNIFICANT = 2.0


@dataclass(frozen=True)
class Limits:
    """How far parameters may be off their design; 0: no limit is set."""

    length_mm: float = 0.0
    angle_deg: float = 0.0

    def of(self, unit: str) -> float:
        return self.length_mm if unit == "mm" else self.angle_deg


def limits_of(settings: Mapping[str, object]) -> Limits:
    """The limits that stand in a session's settings."""
    values = (settings.get(key, 0.0) for key in ("limit_length_mm", "limit_angle_deg"))
    return Limits(*(float(value) if isinstance(value, int | float) else 0.0 for value in values))


def limit_counts(found: "Calibration", limits: Limits) -> tuple[int, int, int] | None:
    """How many parameters are within their limits, beyond them, and undecided; None: no limit, or no geometry."""
    geometry = found.estimate.geometry
    if geometry is None or found.nominal is None or limits == Limits():
        return None
    counts = {"✔": 0, "✖": 0, "?": 0}
    for (i, k), std in np.ndenumerate(geometry.std):
        scale, unit = SCALES[k]
        difference = (geometry.model.parameters[i, k] - found.nominal.parameters[i, k]) * scale
        said = verdict(difference, std * scale, limits.of(unit)) if std > 0 else ""
        for sign in counts:
            counts[sign] += f">{sign}<" in said
    return counts["✔"], counts["✖"], counts["?"]


def table_2(found: "Calibration", limits: Limits) -> str:
    """Nominal, actual, difference and uncertainty of every parameter that is not fixed by convention."""
    geometry = found.estimate.geometry
    if geometry is None or found.nominal is None:
        missing = ", ".join(map(str, found.not_swept)) or "some"
        return block(f"<p class='soft'>The geometry needs every joint; not swept yet: {missing}.</p>", "table2")
    rows = "".join(
        _row(
            Spot(i + 1, PARAMETERS[k]),
            f"{NAMES[k]}<sub>{i + 1}</sub>",
            found.nominal.parameters[i, k],
            geometry.model.parameters[i, k],
            std,
            limits,
        )
        for (i, k), std in np.ndenumerate(geometry.std)
        if std > 0
    )
    numbers = "".join(f"<th class='n'>{name}</th>" for name in ("Nominal", "Actual", "Difference", "±u"))
    note = (
        "<p class='soft'>▲ deviates by more than two standard uncertainties u. Parameters fixed by convention are left "
        "out. A limit is kept (✔) or broken (✖) where two u do not reach across it; else it is open (?). Click a row "
        "to see it in 3-D, again to see them all.</p>"
    )
    table = f"<table><tr><th></th>{numbers}<th></th><th></th><th>Limit</th></tr>{rows}</table>"
    return block(listening(table) + note, "table2")


def verdict(difference: float, u: float, limit: float) -> str:
    """Pass, fail or open, with the uncertainty considered: a guard band of two u on both sides of the limit."""
    if limit <= 0:
        return ""
    if abs(difference) + SIGNIFICANT * u <= limit:
        return "<span class='ok'>✔</span>"
    if abs(difference) - SIGNIFICANT * u > limit:
        return "<span class='bad'>✖</span>"
    return "<span class='doubt'>?</span>"


def _row(spot: Spot, name: str, nominal: float, actual: float, std: float, limits: Limits) -> str:
    scale, unit = SCALES[PARAMETERS.index(spot.parameter)]
    difference, u = (actual - nominal) * scale, std * scale
    digits = int(np.clip(1 - np.floor(np.log10(u)), 0, 4))
    mark = "<span class='bad'>▲</span>" if abs(difference) > SIGNIFICANT * u else "○"
    return (
        f"<tr {saying(spot.word, 'Show it in 3-D')}><td>{name}</td><td class='n'>{nominal * scale:z.{digits}f}</td>"
        f"<td class='n'>{actual * scale:z.{digits}f}</td><td class='n'>{difference:+.{digits}f}</td>"
        f"<td class='n'>{u:.{digits}f}</td><td>{unit}</td><td>{mark}</td>"
        f"<td>{verdict(difference, u, limits.of(unit))}</td></tr>"
    )
