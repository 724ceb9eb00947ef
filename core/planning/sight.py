"""What the points are measured with, as far as a plan has to know it: where it stands, how well and what it sees."""

from dataclasses import dataclass

import numpy as np

from core.errors import InputError
from core.geometry import Array
from core.theodolite import Theodolite, point_covariance


@dataclass(frozen=True)
class Field:
    """Where a station can see a target at all."""

    nearest_m: float = 1.0
    farthest_m: float = 20.0
    steepest_rad: float = float(np.deg2rad(50.0))
    """Above or below the station's horizon."""

    def __post_init__(self) -> None:
        if not 0 <= self.nearest_m < self.farthest_m:
            raise InputError(
                f"a station sees from {self.nearest_m:g} m to {self.farthest_m:g} m, expected the nearer distance first"
            )
        if not 0 < self.steepest_rad <= np.pi / 2:
            raise InputError(f"the steepest sight must be above 0 and at most 90 deg, got {self.steepest_rad:g} rad")


@dataclass(frozen=True)
class Sight:
    """One or more stations that all look at the same point.

    Two theodolites fix a point by their angles, so that its covariance depends on where it is; anything else is taken
    as equally exact in all directions.
    """

    stations: tuple[Theodolite, ...] = ()
    """Their places in the instrument's frame, their verticals and angles; none: sight is not judged."""
    sigma_m: float | None = None
    """Standard deviation of one coordinate of a point; None: by the angles of the stations."""
    field: Field = Field()

    def __post_init__(self) -> None:
        if self.sigma_m is None and len(self.stations) < 2:
            raise InputError(
                f"{len(self.stations)} stations fix no point by their angles: expected two of them, or a standard "
                "deviation of points"
            )
        if self.sigma_m is not None and not (np.isfinite(self.sigma_m) and self.sigma_m > 0):
            raise InputError(f"the standard deviation of points must be above 0, got {self.sigma_m}")

    def covariance(self, points_m: Array) -> Array:
        """What the instrument alone adds to points (m, 3), (m, 3, 3), m^2."""
        if self.sigma_m is None:
            return point_covariance(self.stations, points_m)
        return np.broadcast_to(self.sigma_m**2 * np.eye(3), (len(points_m), 3, 3))

    def in_field(self, points_m: Array) -> np.ndarray:
        """Which points (m, 3) every station has in its field, boolean, (m,)."""
        seen = np.ones(len(points_m), dtype=bool)
        for station in self.stations:
            x, y, z = ((points_m - station.position_m) @ station.rotation.T).T
            level = np.hypot(x, y)
            away = np.hypot(level, z)
            seen &= (away >= self.field.nearest_m) & (away <= self.field.farthest_m)
            seen &= np.arctan2(np.abs(z), level) <= self.field.steepest_rad
        return seen
