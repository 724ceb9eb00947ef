"""The stated covariance of measured points: the row's own matrix, else its sigma, else the instrument's."""

import numpy as np

from core.geometry import Array
from core.measurement_columns import COVARIANCE, Columns

SMALLEST_SIGMA_M = 1e-15
"""Below this a standard deviation is no length but a slip: its square loses all meaning."""
_ENTRIES = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])


def stated_covariance(columns: Columns, point_m: Array, sigma_m: float | None) -> Array:
    """Covariance of each seen point, (rows, 3, 3), m²; NaN where nothing is stated.

    Raises:
        CampaignError: a sigma is not above 0, or a matrix is not positive definite.
    """
    sigma = np.full(len(point_m), np.nan if sigma_m is None else sigma_m)
    if "sigma" in columns:
        own = columns.si("sigma")
        columns.table.check(columns.name("sigma"), own < SMALLEST_SIGMA_M, "a number above 0")
        sigma = np.where(np.isnan(own), sigma, own)
    covariance = sigma[:, None, None] ** 2 * np.eye(3)
    full = _full_matrices(columns)
    if full is not None:
        covariance = np.where(np.isnan(full), covariance, full)
    covariance[np.isnan(point_m[:, 0])] = np.nan
    return covariance


def _full_matrices(columns: Columns) -> Array | None:
    entries = columns.together(COVARIANCE)
    if entries is None:
        return None
    matrices = entries[:, _ENTRIES]
    diagonal = entries[:, [0, 3, 5]]
    for base, variance in zip(("cov_xx", "cov_yy", "cov_zz"), diagonal.T, strict=True):
        columns.table.check(columns.name(base), variance < SMALLEST_SIGMA_M**2, "a variance above 0")
    scale = np.sqrt(diagonal)
    # Of a correlation matrix the two leading minors tell all, whatever the units of the axes.
    xy, xz, yz = (matrices[:, i, j] / (scale[:, i] * scale[:, j]) for i, j in ((0, 1), (0, 2), (1, 2)))
    determinant = 1.0 + 2.0 * xy * xz * yz - xy**2 - xz**2 - yz**2
    flat = (np.abs(xy) >= 1.0) | (determinant < 1e-12)
    if flat.any():
        raise columns.table.failed(
            int(np.argmax(flat)),
            "columns cov_xx_mm2 to cov_zz_mm2: not a covariance, expected it positive definite",
        )
    return matrices
