"""Numbers and facts put into words: rounding to the uncertainty, units of joints, what a calibration says in short."""

import re

import numpy as np

from core.calibration import Calibration
from core.findings import Finding
from core.measurements import Campaign
from core.noise import Noise, is_stated

MOST_DECIMALS = 7

GREEK = {"alpha": "\N{GREEK SMALL LETTER ALPHA}", "theta": "\N{GREEK SMALL LETTER THETA}"}
SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


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
    """A sentence of plain ASCII with the signs that print uses, and a unit that is said twice said once."""
    text = text.replace("+- ", "± ").replace(" -", " \N{MINUS SIGN}")
    return re.sub(r" (mm|deg|%) ± ([0-9.]+) \1", r" ± \2 \1", text)


def as_sentence(text: str) -> str:
    """A finding as a sentence of its own; a parameter that it names is written as tables and pictures write it."""
    named = re.sub(r"\b(a|b|alpha|theta) (\d+)(?=\)$)", lambda m: parameter_sign(m[1], int(m[2])), text)
    return f"{typeset(with_capital(named))}."


def with_capital(sentence: str) -> str:
    """A sentence with a capital letter, unless it begins with a name: of a file, a column, a key."""
    first = re.match(r"[a-z]+(?=[ ,:;]|$)", sentence)
    return sentence if first is None else sentence[:1].upper() + sentence[1:]


def parameter_sign(name: str, frame: int) -> str:
    """``alpha`` of frame 2 as formulas write it, α₂."""
    return GREEK.get(name, name) + str(frame).translate(SUBSCRIPTS)


def two_digits(value: float) -> str:
    """A positive number with two digits, trailing zero and all: 0.020."""
    return fixed(value, decimals_for(value))


def is_simulated(campaign: Campaign) -> bool:
    """Whether the campaign itself says that no real robot was measured: in its title, source or instrument."""
    words = [campaign.title, campaign.notes.get("source", ""), *campaign.instrument.description.values()]
    return any("simulated" in (text := str(word).lower()) and "not simulated" not in text for word in words)


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


def summary(calibration: Calibration) -> tuple[str, ...]:
    """What was found, in three to six sentences, the significant first."""
    sentences = (
        _compared(calibration),
        _strongest(calibration),
        _zeros(calibration),
        _noise(calibration),
        _points(calibration),
        _missing(calibration),
    )
    return tuple(typeset(s) for s in sentences if s)


def duration(seconds: float) -> str:
    """A span of time: 45 s, 12 min, 1 h 50 min."""
    if seconds < 60:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60:02d} min"


def _judged(calibration: Calibration) -> list[Finding]:
    """Findings with an uncertainty of their own: readings at the arm's marks are what they are."""
    return [f for f in calibration.findings if f.std > 0]


def _compared(calibration: Calibration) -> str:
    judged = _judged(calibration)
    if not judged:
        return "Nothing could be compared with the design."
    count = sum(f.significant for f in judged)
    beyond = "by more than two standard uncertainties"
    if count == 0:
        return f"No quantity that was compared ({len(judged)} in all) differs from the design {beyond}."
    verb = "quantity differs" if count == 1 else "quantities differ"
    return f"{count} {verb} from the design {beyond}; {len(judged)} in all were compared."


def _strongest(calibration: Calibration) -> str:
    """The most certain deviations: two between axes, which depend on no choice of frames, and one of a drive."""
    clear = [f for f in _judged(calibration) if f.significant]
    between = [f for f in clear if f.parameter in ("distance_m", "angle_rad")][:2]
    drives = [f for f in clear if f.joint is not None][:1]
    texts = [f.text for f in between + drives] or [f.text for f in clear[:2]]
    return f"Most certain: {'; '.join(texts)}." if texts else ""


def _zeros(calibration: Calibration) -> str:
    readings = [f for f in calibration.findings if f.parameter.startswith("zero") and f.deviation != 0]
    if not readings:
        return ""
    worst = max(readings, key=lambda f: (f.parameter == "zero_rad", abs(f.deviation)))
    if len(readings) == 1:
        return f"{worst.text[0].upper()}{worst.text[1:]}."
    unit, scale = parameter_unit(worst.parameter)
    size = fixed(abs(worst.deviation) * scale, 3)
    return f"At the arm's marks {len(readings)} joints do not read zero; joint {worst.joint} is {size} {unit} off."


def _noise(calibration: Calibration) -> str:
    found, stated = calibration.estimate.noise_m * 1e3, stated_noise_m(calibration)
    text = f"One coordinate of a point scatters by {two_digits(found)} mm (standard deviation)"
    if stated is None:
        return f"{text}, estimated from the points; the campaign states none."
    ratio, stated = found / (stated * 1e3), stated * 1e3
    if ratio > 1.1:
        return f"{text}, {ratio:.1f} times the {two_digits(stated)} mm that were stated for the instrument."
    if ratio < 0.9:
        return f"{text}, less than the {two_digits(stated)} mm that were stated for the instrument."
    return f"{text}, as stated for the instrument ({two_digits(stated)} mm)."


def _points(calibration: Calibration) -> str:
    used = calibration.refinement.residuals.used
    left = int((~used).sum())
    sweeps = len(calibration.found.fits)
    points = f"{used.sum()} points of {sweeps} sweep{'s' if sweeps > 1 else ''} were used"
    if left == 0:
        return f"{points}; none was rejected."
    return f"{points}; {left} {'was' if left == 1 else 'were'} rejected."


def _missing(calibration: Calibration) -> str:
    absent = tuple(sorted({*calibration.not_swept, *calibration.not_moved}))
    if not absent:
        return ""
    text = f"The data say nothing of {joint_list(absent)}"
    return f"{text}, so the geometry of the whole arm cannot be given." if calibration.nominal is None else f"{text}."
