"""What a fit of a joint axis says: the line, how well it is known, and how the points lie about it."""

from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc, gammaincc

from core.geometry import Array, Line

ROUNDING_M = 1e-9
"""Residuals below this are rounding of coordinates, whatever their pattern."""


@dataclass(frozen=True)
class AxisFit:
    """A joint axis found from points, in the frame and the order of the points that were given."""

    line: Line
    """The axis; its point is the one nearest to the middle of the arcs, its direction the positive sense."""
    sliding: bool
    basis: Array
    """Two unit vectors e1, e2 normal to the axis, e1 x e2 = direction, (2, 3)."""
    covariance: Array
    """Of the tilts towards e1 and e2 [rad] and the shifts along e1 and e2 [m], (4, 4); sliding: tilts only, (2, 2)."""
    estimator: str
    sigma_m: float
    """Standard deviation of one coordinate of a point, on which the covariance rests (root mean square over points)."""
    noise_factor: float
    """Estimated over stated standard deviation; 1 where nothing was stated."""
    radius_m: Array
    """Radius of each target's arc, (targets,); 0 for a sliding axis."""
    height_m: Array
    """Where each target's plane cuts the axis, from the axis point, (targets,); sliding: 0."""
    axial_m: Array
    """Residuals along the axis, (k,); for a sliding axis there is none (0)."""
    radial_m: Array
    """Residuals away from the axis, (k,); for a sliding axis along e1."""
    tangential_m: Array
    """Residuals along the arc where targets of one stop share its displacement, else 0, (k,); sliding: along e2."""
    used: np.ndarray
    """Which points were fitted, boolean (k,)."""
    outlier_probability: Array
    """Chance that a point of this sweep lies so far out by noise alone, before allowing for their number, (k,)."""
    chi_square: float
    """Weighted sum of squared residuals by the stated noise (equal to the degrees of freedom where none is stated)."""
    degrees_of_freedom: int

    @property
    def direction_std_rad(self) -> float:
        """Standard uncertainty of the direction: root of the summed variances of both tilts."""
        return float(np.sqrt(self.covariance[0, 0] + self.covariance[1, 1]))

    @property
    def point_std_m(self) -> float:
        """Standard uncertainty of the axis' place at its point: root of the summed variances of both shifts."""
        if self.sliding:
            return float("nan")
        return float(np.sqrt(self.covariance[2, 2] + self.covariance[3, 3]))

    @property
    def rms_axial_m(self) -> float:
        """Root mean square of the axial residuals of the fitted points."""
        return float(np.sqrt(np.mean(self.axial_m[self.used] ** 2)))

    @property
    def rms_radial_m(self) -> float:
        """Root mean square of the radial residuals of the fitted points (sliding: away from the line)."""
        square = self.radial_m[self.used] ** 2
        if self.sliding:
            square = square + self.tangential_m[self.used] ** 2
        return float(np.sqrt(np.mean(square)))

    @property
    def fit_probability(self) -> float:
        """Chance of a worse fit if model and stated noise are right (chi-square test); NaN where none is stated."""
        if self.noise_factor == 1.0:
            return float("nan")
        return float(gammaincc(self.degrees_of_freedom / 2, self.chi_square / 2))

    @property
    def outliers(self) -> np.ndarray:
        """Points that stand out: less than one chance in a thousand that any point of the sweep would, (k,)."""
        square = self.axial_m**2 + self.radial_m**2 + self.tangential_m**2
        return (self.outlier_probability * len(self.used) < 1e-3) & (square > ROUNDING_M**2)


def outlier_probabilities(square: Array, freedom: Array, total: float, degrees_of_freedom: float) -> Array:
    """Chance of a residual as large as each one, by external studentisation (an F-test), shape (k,).

    Each point is judged by the scatter of all the others, so neither a wrong stated noise nor the point itself
    hides it (Baarda's data snooping with unknown variance; Pope 1976, NOAA TR NOS 65 NGS 1).

    Args:
        square: squared residual of each point in units of its own standard deviation, leverage removed, (k,).
        freedom: how many components it has, (k,).
        total: weighted sum of squares of the whole fit.
        degrees_of_freedom: of the whole fit.
    """
    rest = degrees_of_freedom - freedom
    if np.any(rest <= 0) or total <= 0:
        return np.ones_like(square)
    scatter = np.maximum(total - square, 1e-30 * total) / rest
    return np.where(
        freedom > 0, fdtrc(np.maximum(freedom, 1e-9), rest, square / np.maximum(freedom, 1e-9) / scatter), 1.0
    )
