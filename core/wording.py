"""Numbers and facts put into words: rounding to the uncertainty, units of joints, what a calibration says in short."""

import numpy as np

from core.calibration import Calibration
from core.measurements import Campaign
from core.noise import Noise, is_stated

MOST_DECIMALS = 7


def display_unit(slides: bool) -> tuple[str, float]:
    """The unit in which displacements of a joint are shown, and how many of it make one SI unit."""
    return ("mm", 1e3) if slides else ("deg", 180.0 / np.pi)


def parameter_unit(parameter: str) -> tuple[str, float]:
    """The unit in which a quantity is shown, by the SI unit at the end of its name; none: a plain number."""
    if parameter.endswith("_m"):
        return "mm", 1e3
    return ("deg", 180.0 / np.pi) if parameter.endswith("_rad") else ("", 1.0)


def decimals_for(std: float, fallback: int = 3) -> int:
    """How many decimals show two digits of a standard uncertainty; ``fallback`` where there is none."""
    if not np.isfinite(std) or std <= 0:
        return fallback
    two_digits = float(f"{std:.1e}")
    return int(np.clip(1 - np.floor(np.log10(two_digits)), 0, MOST_DECIMALS))


def fixed(value: float, decimals: int) -> str:
    """A number with a true minus sign, and without one on zero."""
    text = f"{value:.{decimals}f}"
    if float(text) == 0:
        text = text.lstrip("-")
    return text.replace("-", "\N{MINUS SIGN}")


def with_uncertainty(value: float, std: float, unit: str = "") -> str:
    """A value with its standard uncertainty, both rounded to two digits of the latter: 3.10 ± 0.22 mm."""
    decimals = decimals_for(std)
    tail = f" {unit}" if unit else ""
    if not np.isfinite(std) or std <= 0:
        return fixed(value, decimals) + tail
    return f"{fixed(value, decimals)} ± {fixed(std, decimals)}{tail}"


def typeset(text: str) -> str:
    """A sentence of plain ASCII with the signs that print uses."""
    return text.replace(" +- ", " ± ").replace(" -", " \N{MINUS SIGN}")


def is_simulated(campaign: Campaign) -> bool:
    """Whether the campaign itself says that no real robot was measured."""
    words = [campaign.title, *campaign.notes.values(), *campaign.instrument.description.values()]
    return any("simulat" in str(word).lower() for word in words)


def stated_noise_m(calibration: Calibration) -> float | None:
    """Root mean square of the stated standard deviations of one coordinate over the points of the sweeps."""
    stated = np.concatenate([f.sweep.covariance_m2 for f in calibration.found.fits])
    return Noise(True).rms_m(stated) if is_stated(stated) else None


def joint_list(joints: tuple[int, ...]) -> str:
    """joint 3; joints 2 and 5; joints 1, 2 and 4."""
    names = [str(j) for j in joints]
    if len(names) == 1:
        return f"joint {names[0]}"
    return f"joints {', '.join(names[:-1])} and {names[-1]}"
