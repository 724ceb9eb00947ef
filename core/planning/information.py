"""What planned sightings will tell of an arm, before any is made: the Fisher information of all unknowns.

The unknowns are those of the calibration (``core/refinement_problem.py``): tilts and shifts of all axes, the constants
of transmissions and couplings, the targets. A sighting of a target at p adds

    A' A,   A = C^-1/2 dp/dunknowns,      C = C_instrument(p) + s_link^2 I + sum_j s_j^2 (dp/dnet_j)(dp/dnet_j)'

with the instrument's covariance at that place, and the arm's repeatability of links and joints. Sightings count as
independent, as the calibration takes them: targets that are seen in one standstill should ride on different links.
The inverse is the Cramer-Rao bound: no unbiased estimator does better.
"""

from dataclasses import dataclass

import numpy as np

from core.arm_jacobian import Prediction
from core.geometry import Array
from core.measurements import Measurements
from core.planning.site import Site
from core.refinement_problem import inverses


@dataclass(frozen=True)
class Information:
    """The Fisher information of a number of sightings."""

    matrix: Array
    """(p, p)."""
    shots: int
    of_arm: int
    """How many of the unknowns are the arm's; targets follow."""

    @property
    def covariance(self) -> Array:
        """The Cramer-Rao bound; enormous along what the sightings say nothing about, (p, p)."""
        return inverses(self.matrix)[1]

    @property
    def unobservable(self) -> int:
        """Combinations of unknowns that the sightings say nothing about, targets that are not seen left out."""
        asked = (np.arange(len(self.matrix)) < self.of_arm) | (np.diag(self.matrix) > 0)
        return inverses(self.matrix[np.ix_(asked, asked)])[2]


def whitened(site: Site, commanded: Array, target: np.ndarray) -> Array:
    """Derivatives of planned sightings by all unknowns in units of their noise, A, (m, 3, p)."""
    seen = site.predict(commanded, target)
    return np.linalg.solve(np.linalg.cholesky(expected_covariance(site, seen)), seen.jacobian)


def expected_covariance(site: Site, seen: Prediction) -> Array:
    """What instrument and repeatability make of planned sightings, (m, 3, 3), m^2."""
    covariance = site.sight.covariance(seen.point_m) + site.repeats.link_sigma_m**2 * np.eye(3)
    if site.repeats.joint_sigma is None:
        return covariance
    by_joint = seen.by_net * site.repeats.joint_sigma
    return covariance + by_joint @ np.swapaxes(by_joint, 1, 2)


def information_of(site: Site, table: Measurements) -> Information:
    """The information of planned (or measured) sightings; rows to be checked with, and moves, tell nothing."""
    rows = np.flatnonzero(fitted(table))
    matrix = whitened(site, table.commanded[rows], table.target[rows]).reshape(-1, site.layout.size)
    return Information(matrix.T @ matrix, len(rows), site.layout.targets.start)


def fitted(table: Measurements) -> np.ndarray:
    """Rows that a calibration fits, boolean, (m,)."""
    return (table.target >= 0) & ~table.check
