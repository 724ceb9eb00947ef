"""Simulated sweeps of one joint, and the Cramer-Rao bound of its axis from all parameters of the sweep.

Nothing here uses the estimators: the bound is the Schur complement of the full Fisher information, every point's own
place along its arc included, with derivatives of the points taken numerically at the truth.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

DIRECTION = np.array([0.3, -0.5, 0.8]) / np.sqrt(0.98)
PLACE_M = np.array([-3.1, 4.4, 0.2])
"""The true axis, seen from an instrument some five metres away."""
STEP = 1e-6
"""Of the central differences, rad or m."""


@dataclass(frozen=True)
class Scene:
    """A joint that moves in equal steps, and targets that are seen at each stop."""

    name: str
    points: int
    """Of each target."""
    span: float
    """From the first to the last stop, rad (m where the joint slides)."""
    radius_m: tuple[float, ...]
    """Of each target's arc; where the joint slides, the targets' distances from the axis."""
    sigma_m: tuple[float, ...]
    """Standard deviation of one coordinate, by target."""
    height_m: tuple[float, ...] = (0.0, 0.1)
    azimuth_rad: tuple[float, ...] = (0.3, 2.3)
    uneven: bool = False
    """Every third point is twice as noisy."""
    shared: bool = False
    """Targets of one stop are known to have moved by the same displacement."""
    sliding: bool = False

    @property
    def targets(self) -> int:
        return len(self.radius_m)

    @cached_property
    def target(self) -> np.ndarray:
        return np.repeat(np.arange(self.targets), self.points)

    @cached_property
    def stop(self) -> np.ndarray:
        return np.tile(np.arange(self.points), self.targets)

    @cached_property
    def sigmas_m(self) -> Array:
        """Standard deviation of one coordinate of each point, (k,)."""
        sigma = np.array(self.sigma_m)[self.target]
        return np.where(self.uneven & (np.arange(len(sigma)) % 3 == 0), 2 * sigma, sigma)

    @cached_property
    def place_m(self) -> Array:
        """The point of the true axis nearest to the middle of the points: where its place is judged."""
        middle = self.points_m.mean(axis=0)
        return PLACE_M + DIRECTION * ((middle - PLACE_M) @ DIRECTION)

    @cached_property
    def points_m(self) -> Array:
        """Where the points truly are, (k, 3)."""
        return self._placed(PLACE_M, np.eye(3), *self._nuisances())

    @cached_property
    def basis(self) -> Array:
        """Two unit vectors across the true axis, (2, 3)."""
        first = np.cross(DIRECTION, [1.0, 0.0, 0.0])
        first /= np.linalg.norm(first)
        return np.stack([first, np.cross(DIRECTION, first)])

    @cached_property
    def bound(self) -> Array:
        """The Cramer-Rao bound of two tilts and two shifts at ``place_m``, (4, 4); sliding: of two tilts, (2, 2)."""
        return np.linalg.inv(self._information)

    @cached_property
    def best_linear(self) -> Array:
        """What the best linear estimator makes of whitened noise (3k,): (4, 3k); its covariance is the bound."""
        of_axis, of_rest = self._whitened_derivatives
        rest = of_rest @ np.linalg.lstsq(of_rest, of_axis, rcond=None)[0]
        return self.bound @ (of_axis - rest).T

    @cached_property
    def _information(self) -> Array:
        of_axis, of_rest = self._whitened_derivatives
        cross = of_axis.T @ of_rest
        return of_axis.T @ of_axis - cross @ np.linalg.solve(of_rest.T @ of_rest, cross.T)

    @cached_property
    def _whitened_derivatives(self) -> tuple[Array, Array]:
        """Of all points by the axis (3k, 4), and by everything else (3k, p)."""
        start = np.concatenate([n.ravel() for n in self._nuisances()])
        unknown = 2 if self.sliding else 4
        columns = []
        for j in range(unknown + len(start)):
            step = np.zeros(unknown + len(start))
            step[j] = STEP
            ahead, behind = (self._at(sign * step[:unknown], start + sign * step[unknown:]) for sign in (1, -1))
            columns.append(((ahead - behind) / (2 * STEP) / self.sigmas_m[:, None]).ravel())
        derivatives = np.stack(columns, axis=1)
        return derivatives[:, :unknown], derivatives[:, unknown:]

    def _nuisances(self) -> tuple[Array, ...]:
        """What is not the axis: arcs' heights, radii, places along the arcs, azimuths (shared stops only)."""
        way = np.linspace(0.0, self.span, self.points)
        height, radius, azimuth = (
            np.array(v[: self.targets]) for v in (self.height_m, self.radius_m, self.azimuth_rad)
        )
        if self.sliding:
            return radius * np.cos(azimuth), radius * np.sin(azimuth), (height[:, None] + way).ravel()
        if self.shared:
            return height, radius, way + azimuth[0], (azimuth - azimuth[0])[1:]
        return height, radius, (azimuth[:, None] + way).ravel()

    def _at(self, axis: Array, nuisances: Array) -> Array:
        """The points for small tilts and shifts of the axis and given nuisances, (k, 3)."""
        tilt = axis[:2] @ self.basis
        turn = np.cross(DIRECTION, tilt)
        angle = np.linalg.norm(turn)
        rotation = np.eye(3)
        if angle > 0:
            x, y, z = turn / angle
            k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            rotation = np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k
        shift = np.zeros(3) if self.sliding else axis[2:] @ self.basis
        pivot = self.place_m
        cuts = np.cumsum([n.size for n in self._nuisances()])[:-1]
        own = np.split(nuisances, cuts)
        return self._placed(pivot + rotation @ (PLACE_M - pivot) + shift, rotation, *own)

    def _placed(self, place_m: Array, rotation: Array, *nuisances: Array) -> Array:
        if self.sliding:
            x, y, along = nuisances
            local = np.stack([x[self.target], y[self.target], along], axis=1)
        else:
            height, radius, angle = nuisances[:3]
            if self.shared:
                angle = angle[self.stop] + np.concatenate([[0.0], nuisances[3]])[self.target]
            r = radius[self.target]
            local = np.stack([r * np.cos(angle), r * np.sin(angle), height[self.target]], axis=1)
        return place_m + local @ np.vstack([self.basis, DIRECTION]) @ rotation.T


def axis_error(basis: Array, point_m: Array, direction: Array, sliding: bool = False) -> Array:
    """Truth less estimate in an estimate's own basis: two tilts and two shifts at its point, (4,); sliding: (2,)."""
    tilts = basis @ (DIRECTION - direction)
    if sliding:
        return tilts
    foot = PLACE_M + DIRECTION * ((point_m - PLACE_M) @ DIRECTION)
    return np.concatenate([tilts, basis @ (foot - point_m)])
