"""Places of the scene that results speak of, and how a piece of the page names one when it is clicked."""

import re
from dataclasses import dataclass

from core.findings import Finding
from core.phi_model import PARAMETERS

SHOWN_BY = {"distance_m": "b_m", "angle_rad": "alpha_rad"}
"""Of two consecutive axes: the dimension in which their distance or angle is seen."""


@dataclass(frozen=True)
class Spot:
    """A dimension of the geometry, or a joint."""

    number: int
    """Of the frame or joint, 1.."""
    parameter: str = ""
    """Of the frame: ``a_m``, ``b_m``, ``alpha_rad`` or ``theta_rad``; empty: a joint is meant."""

    def __post_init__(self) -> None:
        if self.number < 1 or self.parameter not in ("", *PARAMETERS):
            raise ValueError(f"a spot needs a number from 1 and a parameter of a frame, got {self}")

    @property
    def word(self) -> str:
        """What the page says of it: ``2-a_m``, ``3``."""
        return f"{self.number}-{self.parameter}" if self.parameter else str(self.number)


def spot_of(finding: Finding) -> Spot | None:
    """Where a finding is seen; None: nowhere in particular."""
    if finding.frame is not None:
        return Spot(finding.frame, SHOWN_BY.get(finding.parameter, finding.parameter))
    return None if finding.joint is None else Spot(finding.joint)


def spot_named(word: str) -> Spot | None:
    """The spot that a browser names; None: it says anything else."""
    found = re.fullmatch(rf"([1-9]\d{{0,2}})(?:-({'|'.join(PARAMETERS)}))?", word, re.ASCII)
    return None if found is None else Spot(int(found[1]), found[2] or "")
