"""What a diagnosis of the gap says: plain records, SI units."""

import math
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from core.errors import CampaignError
from core.geometry import Array
from core.measurements import Campaign


class Verdict(StrEnum):
    """What is known of the gap as a whole."""

    EXPLAINED = "explained"
    PARTLY_EXPLAINED = "partly_explained"
    UNEXPLAINED = "unexplained"
    """It stands out of the noise and no candidate accounts for it."""
    NO_GAP = "no_gap"


UNKNOWN = "unknown"
"""The effect of a cause that is located, not named."""


NEAR_FLOOR = 1.25
"""Floors that count as down to the noise, whatever small things the evidence sees in them."""
NOTABLY = 0.95
"""Of the gap: a calibration that leaves less of it takes part in it."""


@dataclass(frozen=True)
class Place:
    """An effect and where it sits. What does not apply is None."""

    effect: str
    joint: int | None = None
    """The joint or link, 1..n. Of a coupling: the joint that follows."""
    source: int | None = None
    """Of a coupling: the joint that drives."""
    frame: int | None = None
    """Of geometry: frame i carries joint i to joint i+1 (the last: the tool)."""
    target: str | None = None
    record: int | None = None
    """From this record on."""
    variable: str | None = None
    """Of an unknown that follows no joint: ``time`` or ``configuration``."""

    @property
    def identity(self) -> tuple[str | int | None, ...]:
        """What makes it one cause; the record at which something moved is a parameter, not a name."""
        return self.effect, self.joint, self.source, self.frame, self.target, self.variable

    def same_as(self, other: "Place") -> bool:
        """Whether both are one cause."""
        return self.identity == other.identity


@dataclass(frozen=True)
class Parameter:
    """One estimated number of a cause."""

    name: str
    """With its unit: ``amplitude_rad``, ``gap_m``; files and pages convert by the suffix."""
    value: float
    std: float


@dataclass(frozen=True)
class Cause:
    """One effect at one place, and what it accounts for. Lengths are rms over kept-out points, m."""

    place: Place
    probability: float
    """That effect and place are both right."""
    twins: tuple[Place, ...]
    """The causes that these data cannot tell from it, itself first."""
    parameters: tuple[Parameter, ...]
    gap_before_rms_m: float
    """Before it was added, after all stronger ones."""
    gap_after_rms_m: float
    share_closed: float
    """Of gap^2 - floor^2, by this cause alone."""
    share_closed_last: float
    """The same when it is added after all the others."""
    shift_m: Array
    """What it alone moves at every point of the gap, in the instrument's frame, (m, 3)."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.probability <= 1.0:
            raise CampaignError(f"a probability must be 0..1, got {self.probability}")


@dataclass(frozen=True)
class NoiseModel:
    """What was found of the noise of one coordinate of a point."""

    stated_m: float | None
    used_m: float
    source: str
    """``replicates``, ``residuals`` or ``statement``."""
    degrees_of_freedom: float
    tail_degrees: float
    """Degrees of freedom of the Student distribution that fits the tails; infinite: normal."""
    correlation: float
    """Of neighbours in the order of measurement."""
    floor_rms_m: float
    """Rms length of real minus sim if the sim were perfect."""
    floor_source: str
    """``repeats``, ``sigma`` or ``unknown``."""


@dataclass(frozen=True)
class Outlier:
    """A point that was left out of every fit."""

    record: int
    length_m: float


@dataclass(frozen=True)
class Where:
    """Where real and sim part, over the points of the gap."""

    by_joint: Array
    """Share of the gap beyond the floor that errors at each joint could account for, (n,), sum 1 (0 without a gap)."""
    sweep_directions: Array | None
    """Shares axial, radial, tangential over the sweeps; None: there are none."""
    pose_directions: Array | None
    """Shares x, y, z over the poses, in the instrument's frame; None: there are none."""
    worst_region: str
    """A sentence."""
    worst_rows: np.ndarray
    """Indices of the points of that region, into the points of the gap."""


@dataclass(frozen=True)
class Transfer:
    """A fit on some points, judged on others. Rms lengths, m."""

    fitted_on: str
    predicted: str
    points: int
    gap_before_rms_m: float
    gap_after_rms_m: float


@dataclass(frozen=True)
class DetectionLimit:
    """The smallest size of an effect that these data would have shown."""

    place: Place
    size: float
    unit: str
    """``rad``, ``m`` or ``1`` of the parameter whose size it is."""
    rms_m: float
    """What an effect of that size moves the points by, rms, m."""


@dataclass(frozen=True)
class Rivals:
    """Causes that the data cannot tell apart, and the measurement that would."""

    places: tuple[Place, ...]
    next_measurement: str
    separation: float
    """Expected, in standard deviations; 0: no measurement of points would separate them."""


@dataclass(frozen=True)
class LeftTest:
    """Whether what is left is noise."""

    name: str
    p_value: float
    left_is_noise: bool


@dataclass(frozen=True)
class Cell:
    """One square of the map cause by joint: how strongly the data speak for an effect at a place alone."""

    place: Place
    evidence: float
    """Natural logarithm of the odds against no effect at all."""
    share_closed: float


@dataclass(frozen=True)
class Reliability:
    """Probabilities that were said and how often they were right, on simulated worlds of this robot and protocol."""

    said: Array
    """Mean probability said in each bin, (k,)."""
    right: Array
    """Share of right ones, (k,)."""
    worlds: np.ndarray
    """How many worlds fell in each bin, (k,)."""


@dataclass(frozen=True, eq=False)
class GapReport:
    """The diagnosis of one campaign. Points of the gap: seen, on links 1..n, outliers included."""

    campaign: Campaign
    sim: str
    """What the sim is, in words: the nominal model, a calibration, another simulator's points."""
    rows: np.ndarray
    """Rows of the campaign's measurements that the gap is made of, (m,)."""
    difference_m: Array
    """Real minus sim with base and unknown targets placed, (m, 3)."""
    left_m: Array
    """The same after all causes, fitted on all points, (m, 3)."""
    verdict: Verdict
    gap_rms_m: float
    """On kept-out points."""
    left_rms_m: float
    """On kept-out points, after all causes."""
    noise: NoiseModel
    causes: tuple[Cause, ...]
    where: Where
    transfers: tuple[Transfer, ...]
    left_test: LeftTest
    limits: tuple[DetectionLimit, ...]
    rivals: tuple[Rivals, ...]
    outliers: tuple[Outlier, ...]
    warnings: tuple[str, ...]
    evidence_map: tuple[Cell, ...]
    reliability: Reliability | None
    hold_out: str
    """How points were kept out, in words."""
    seconds: float = 0.0
    peak_memory_mb: float = 0.0
    notes: tuple[str, ...] = field(default=())
    within_calibration_rms_m: float = math.nan
    """On kept-out points, with a calibrated sim moved as far as its own uncertainty lets it, before any cause; NaN: the
    sim states none."""

    @property
    def calibration_matters(self) -> bool:
        """Whether what a calibration leaves uncertain takes a notable part of the gap."""
        return self.within_calibration_rms_m < NOTABLY * self.gap_rms_m
