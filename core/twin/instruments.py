"""Simulated instruments: what is read instead of the truth, and the uncertainty that is stated for it."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from core.geometry import Array
from core.measurements import Instrument
from core.theodolite import Theodolite, intersect, point_covariance


class PointInstrument(ABC):
    """Something that measures points."""

    @property
    @abstractmethod
    def statement(self) -> Instrument:
        """What the campaign says about it."""

    @abstractmethod
    def measure(self, points_m: Array, rng: np.random.Generator) -> tuple[Array, Array]:
        """Readings of points (m, 3), and their stated covariance (m, 3, 3), m^2."""

    @abstractmethod
    def covariance(self, points_m: Array) -> Array:
        """The covariance that is stated for points (m, 3), shape (m, 3, 3), m^2."""


@dataclass(frozen=True)
class TheodolitePair(PointInstrument):
    """Two theodolites whose places, orientation and scale are known exactly; only pointing is uncertain.

    "0.19 mm net radial error" can be read in several ways. Here it is the root mean square length of the error of a
    point that comes from pointing alone: the error of the network's own scale and orientation is not in it.
    """

    left: Theodolite
    right: Theodolite
    sigma_m: float
    """What is stated for one coordinate where a point carries no covariance of its own."""

    @property
    def statement(self) -> Instrument:
        return Instrument("theodolite-pair", self.sigma_m, {"model": "simulated pair of theodolites"})

    def measure(self, points_m: Array, rng: np.random.Generator) -> tuple[Array, Array]:
        seen = []
        for station in (self.left, self.right):
            noise = rng.normal(size=(len(points_m), 2)) * [station.sigma_hz_rad, station.sigma_v_rad]
            seen.append(station.observe(points_m) + noise)
        met = intersect(self.left, self.right, *seen)
        return met.point_m, met.covariance_m2

    def covariance(self, points_m: Array) -> Array:
        return point_covariance((self.left, self.right), points_m)


@dataclass(frozen=True)
class Tracker(PointInstrument):
    """A laser tracker, taken as equally exact in all directions."""

    sigma_m: float

    @property
    def statement(self) -> Instrument:
        return Instrument("laser-tracker", self.sigma_m, {"model": "simulated laser tracker"})

    def measure(self, points_m: Array, rng: np.random.Generator) -> tuple[Array, Array]:
        return points_m + self.sigma_m * rng.normal(size=points_m.shape), self.covariance(points_m)

    def covariance(self, points_m: Array) -> Array:
        return np.broadcast_to(self.sigma_m**2 * np.eye(3), (len(points_m), 3, 3)).copy()
