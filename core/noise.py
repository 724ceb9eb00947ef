"""How noisy the points really are: what was stated, corrected by what the sweeps themselves show.

Stated covariances C_j come from the instrument. Points scatter by more than that (the arm does not come back to the
same place) or by less (a cautious data sheet). The scatter of all sweeps about their axes decides:

    more:  C_j + tau^2 I, with tau the arm's repeatability as one coordinate of a point shows it
    less:  k C_j, k < 1
    nothing stated:  s^2 I
"""

from dataclasses import dataclass

import numpy as np

from core.geometry import Array

FEWEST_FREEDOMS = 20
"""With fewer degrees of freedom than this a stated noise is believed unless chance contradicts it plainly."""


@dataclass(frozen=True)
class Noise:
    """The noise of every point of a campaign."""

    stated: bool
    """Whether the campaign states any."""
    factor: float = 1.0
    """Multiplies the stated covariances, k."""
    added_m: float = 0.0
    """Standard deviation of one coordinate that the points scatter beyond what is stated, tau."""

    def covariance(self, stated_m2: Array) -> Array:
        """Covariances to be used for points with stated ones of shape (k, 3, 3)."""
        base = self.factor * stated_m2 if self.stated else np.zeros_like(stated_m2)
        return base + self.added_m**2 * np.eye(3)

    def rms_m(self, stated_m2: Array) -> float:
        """Root mean square standard deviation of one coordinate over points."""
        return float(np.sqrt(np.mean(np.trace(self.covariance(stated_m2), axis1=1, axis2=2)) / 3))


def is_stated(covariance_m2: Array) -> bool:
    """Whether every one of some points has a stated covariance."""
    return bool(len(covariance_m2)) and bool(np.isfinite(covariance_m2).all())


def noise_from_scatter(observed_m2: float, stated_m2: float, components: int, degrees_of_freedom: float) -> Noise:
    """The noise that explains a sum of squared residuals: a moment estimate that depends on no weights.

    Args:
        observed_m2: sum of squared residual components, loss to the fit made up for.
        stated_m2: sum of the stated variances of the same components; NaN where none is stated.
        components: how many there are.
        degrees_of_freedom: of the fits that left them.
    """
    if not np.isfinite(stated_m2):
        return Noise(False, added_m=max(float(np.sqrt(observed_m2 / components)), 1e-12))
    ratio = observed_m2 / stated_m2
    if degrees_of_freedom < FEWEST_FREEDOMS and abs(ratio - 1) < 3 * np.sqrt(2 / max(degrees_of_freedom, 1)):
        return Noise(True)
    if ratio >= 1:
        return Noise(True, 1.0, float(np.sqrt((observed_m2 - stated_m2) / components)))
    return Noise(True, max(ratio, 1e-12), 0.0)
