"""Colours of the scene, told apart by colour-blind eyes, on white and on near-black ground.

Hues are those of Okabe and Ito (2008, "Color Universal Design"). Residuals run from blue through a middle grey, which
stands out from both grounds, to vermillion; blue and vermillion stay apart in every common kind of colour blindness.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Rgb = tuple[int, int, int]
Bytes = NDArray[np.uint8]

ORANGE: Rgb = (230, 159, 0)
SKY: Rgb = (86, 180, 233)
GREEN: Rgb = (0, 158, 115)
BLUE: Rgb = (0, 114, 178)
VERMILLION: Rgb = (213, 94, 0)
GREY: Rgb = (140, 146, 155)

ARM: Rgb = (168, 176, 188)
"""The calibrated arm: neutral, so that every hue is left to the data."""
GHOST: Rgb = SKY
"""The nominal arm."""
FITTED_AXIS: Rgb = GREEN
NOMINAL_AXIS: Rgb = GREY
HIGHLIGHT: Rgb = (217, 30, 140)
"""What is being done now: magenta, which no other thing has; always with a shape of its own as well."""
EXCLUDED: Rgb = GREY
ERROR_VECTOR: Rgb = (150, 110, 230)
SIGHT_LINE: Rgb = SKY
INSTRUMENT: Rgb = ORANGE
FLOOR: Rgb = (128, 132, 138)

NEGATIVE, NEUTRAL, POSITIVE = BLUE, (160, 160, 160), VERMILLION
"""Ends and middle of the residual scale."""


def shaded(colour: Rgb, share: float) -> Rgb:
    """A colour darkened (share < 1) or lightened (share > 1, at most to white)."""
    r, g, b = (int(np.clip(round(c * share), 0, 255)) for c in colour)
    return r, g, b


def hex_of(colour: ArrayLike) -> str:
    """A colour of three numbers 0..255 as HTML writes it: #0072b2."""
    r, g, b = (int(c) for c in np.asarray(colour))
    return f"#{r:02x}{g:02x}{b:02x}"


@dataclass(frozen=True)
class LegendStep:
    """One entry of a legend."""

    text: str
    """With its unit: +0.20 mm."""
    colour: Rgb


@dataclass(frozen=True)
class ResidualScale:
    """Signed residuals as colours: blue at -limit, grey at zero, vermillion at +limit, and no further beyond."""

    limit_m: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.limit_m) and self.limit_m > 0):
            raise ValueError(f"a colour scale needs a limit above 0 m, got {self.limit_m}")

    @classmethod
    def over(cls, residual_m: ArrayLike) -> "ResidualScale":
        """A scale with a round limit (1, 2 or 5 times a power of ten) that holds nine of ten residuals.

        Args:
            residual_m: any shape; NaN is left out; without any finite residual the limit is 0.1 mm.
        """
        size = np.abs(np.asarray(residual_m, dtype=float)).ravel()
        size = size[np.isfinite(size)]
        top = float(np.quantile(size, 0.9)) if len(size) else 0.0
        return cls(round_up(top) if top > 1e-9 else 1e-4)

    def colours(self, residual_m: ArrayLike) -> Bytes:
        """Colours of residuals (m,), shape (m, 3), bytes; NaN is grey."""
        share = np.nan_to_num(np.asarray(residual_m, dtype=float) / self.limit_m)
        share = np.clip(share, -1.0, 1.0)[:, None]
        end = np.where(share < 0, np.array(NEGATIVE), np.array(POSITIVE))
        mixed = np.array(NEUTRAL) + np.abs(share) * (end - np.array(NEUTRAL))
        return np.round(mixed).astype(np.uint8)

    def legend(self) -> tuple[LegendStep, ...]:
        """Five steps from the lowest to the highest residual."""
        shares = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
        colours = self.colours(shares * self.limit_m)
        return tuple(LegendStep(self._text(s), _rgb(c)) for s, c in zip(shares, colours, strict=True))

    def _text(self, share: float) -> str:
        value = share * self.limit_m * 1e3
        decimals = max(0, int(np.ceil(-np.log10(self.limit_m * 1e3))) + 1)
        sign = "\N{MINUS SIGN}" if share < 0 else "+" if share > 0 else ""
        bound = {-1.0: "\N{LESS-THAN OR EQUAL TO} ", 1.0: "\N{GREATER-THAN OR EQUAL TO} "}.get(share, "")
        return f"{bound}{sign}{abs(value):.{decimals}f} mm"


def round_down(value: float) -> float:
    """The last number that is 1, 2 or 5 times a power of ten, for a value above 0."""
    power = 10.0 ** np.floor(np.log10(value))
    step = next(s for s in (10.0, 5.0, 2.0, 1.0) if s * power <= value * (1 + 1e-9))
    return float(step * power)


def round_up(value: float) -> float:
    """The next number that is 1, 2 or 5 times a power of ten, for a value above 0."""
    power = 10.0 ** np.floor(np.log10(value))
    step = next(s for s in (1.0, 2.0, 5.0, 10.0) if value <= s * power * (1 + 1e-9))
    return float(step * power)


def _rgb(colour: Bytes) -> Rgb:
    r, g, b = (int(c) for c in colour)
    return r, g, b
