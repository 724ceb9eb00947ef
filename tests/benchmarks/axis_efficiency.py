"""How near the estimators of joint axes come to the best that their points allow.

Each scene is simulated many times. Root mean square errors of direction and place are compared with the Cramer-Rao
bound, and the stated covariances with the errors: the normalised squared error e' C^-1 e has the mean 4 (2 for a
sliding axis), and over N sweeps its mean stays within 4 +- 2.576 sqrt(8 / N) with 99 % probability.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from core.axes import AxisFit, fit_axis
from core.axes.plane_circle import plane_circle
from core.axes.points import sweep_points
from core.errors import TrueaxisError
from tests.benchmarks.simulated_sweeps import DIRECTION, Array, Scene, axis_error
from tests.benchmarks.tables import markdown

SWEEPS = 4000
SEED = 20
NORMAL_99 = 2.576
LARGEST_RATIO = 1.05
"""Of a root mean square error to its bound."""

MM = 1e-3
DEG = np.pi / 180
ROTARY = (
    Scene("17 points over 50 deg", 17, 50 * DEG, (0.5,), (0.11 * MM,)),
    Scene("16 points over 45 deg", 16, 45 * DEG, (0.5,), (0.11 * MM,)),
    Scene("16 points over 5 deg", 16, 5 * DEG, (1.0,), (0.02 * MM,)),
    Scene("200 points over 360 deg, two targets", 200, 360 * DEG, (0.5, 0.3), (0.1 * MM, 0.2 * MM), uneven=True),
    Scene("the same, stops shared", 200, 360 * DEG, (0.5, 0.3), (0.1 * MM, 0.2 * MM), uneven=True, shared=True),
    Scene("16 points over 45 deg, two targets, stops shared", 16, 45 * DEG, (0.5, 0.3), (0.11 * MM,) * 2, shared=True),
)
TOO_NOISY = Scene("16 points over 5 deg, noise of theodolites", 16, 5 * DEG, (1.0,), (0.11 * MM,))
"""Where the noise is as large as the sagitta allows: listed to show where the bound stops being reached."""
SLIDING = (
    Scene("20 points over 0.5 m", 20, 0.5, (0.2,), (0.11 * MM,), sliding=True),
    Scene("16 points over 0.1 m", 16, 0.1, (0.2,), (0.02 * MM,), sliding=True),
    Scene("30 points over 0.5 m, two targets", 30, 0.5, (0.2, 0.4), (0.1 * MM, 0.2 * MM), uneven=True, sliding=True),
)

Estimate = tuple[Array, Array, Array, Array | None]
"""Basis (2, 3), point (3,), direction (3,), covariance where there is one."""


@dataclass(frozen=True)
class Efficiency:
    """What many simulated sweeps of one scene say of one estimator."""

    scene: Scene
    estimator: str
    sweeps: int
    errors: Array
    """Of the sweeps in which the axis was found, (found, 4 or 2)."""
    ideal: Array
    """Errors of the best linear estimator under the very same noise, (found, 4 or 2)."""
    squares: Array | None
    """Normalised squared errors, (found,); None: no covariance is stated."""

    @property
    def not_found(self) -> int:
        return self.sweeps - len(self.errors)

    @property
    def direction_ratio(self) -> float:
        """Root mean square error of the direction over the bound."""
        return _ratio(self.errors[:, :2], self.scene.bound[:2, :2])

    @property
    def place_ratio(self) -> float:
        """Root mean square error of the axis' place over the bound; NaN for a sliding axis."""
        return float("nan") if self.scene.sliding else _ratio(self.errors[:, 2:], self.scene.bound[2:, 2:])

    @property
    def paired_ratios(self) -> tuple[float, ...]:
        """The same ratios to what the best linear estimator does under the same noise: free of the noise's luck."""
        blocks = [slice(0, 2)] if self.scene.sliding else [slice(0, 2), slice(2, 4)]
        return tuple(float(np.sqrt(np.sum(self.errors[:, b] ** 2) / np.sum(self.ideal[:, b] ** 2))) for b in blocks)

    @property
    def ratio_scatter(self) -> float:
        """Standard deviation by which the noise's luck alone moves a ratio to the bound, at most."""
        return float(1 / np.sqrt(2 * len(self.errors)))

    @property
    def mean_square(self) -> float:
        """Mean normalised squared error, expected 4 (2 for a sliding axis)."""
        return float("nan") if self.squares is None else float(self.squares.mean())

    @property
    def ideal_mean_square(self) -> float:
        """What the best linear estimator's errors come to under the same noise: the luck in ``mean_square``."""
        return float(np.mean(np.einsum("ij,jk,ik->i", self.ideal, np.linalg.inv(self.scene.bound), self.ideal)))

    @property
    def mean_square_limits(self) -> tuple[float, float]:
        """99 % limits of that mean if the stated covariance is right."""
        freedom = self.errors.shape[1]
        width = NORMAL_99 * np.sqrt(2 * freedom / len(self.errors))
        return freedom - width, freedom + width

    @property
    def consistent(self) -> bool:
        low, high = self.mean_square_limits
        return low <= self.mean_square <= high


def by_fit_axis(estimator: str) -> Callable[[Scene, Array], Estimate]:
    """One of the estimators of ``core.axes``."""

    def estimate(scene: Scene, points_m: Array) -> Estimate:
        fit: AxisFit = fit_axis(
            points_m,
            sliding=scene.sliding,
            estimator=estimator,
            target=scene.target,
            stop=scene.stop if scene.shared else None,
            sigma_m=scene.sigmas_m,
        )
        return fit.basis, fit.line.point_m, fit.line.direction, fit.covariance

    return estimate


def by_closed_form(scene: Scene, points_m: Array) -> Estimate:
    """Plane, then circle (Stone 1987); for a sliding axis the first principal direction."""
    if scene.sliding:
        centred = (
            points_m - np.stack([points_m[scene.target == k].mean(axis=0) for k in range(scene.targets)])[scene.target]
        )
        direction, point = np.linalg.svd(centred, full_matrices=False)[2][0], points_m.mean(axis=0)
    else:
        found = plane_circle(sweep_points(points_m, scene.target), debias=False)
        direction = found.direction
        point = found.point_m + direction * ((points_m.mean(axis=0) - found.point_m) @ direction)
    return scene.basis, point, direction * np.sign(direction @ DIRECTION), None


ESTIMATORS: dict[str, Callable[[Scene, Array], Estimate]] = {
    "likelihood": by_fit_axis("likelihood"),
    "paper": by_fit_axis("paper"),
    "closed form": by_closed_form,
}


def study(scene: Scene, estimator: str, sweeps: int = SWEEPS, seed: int = SEED) -> Efficiency:
    """Simulate a scene many times and compare an estimator's errors with the bound.

    Args:
        estimator: ``likelihood``, ``paper`` or ``closed form`` (plane and circle; sliding: principal direction).
        sweeps: how many; the luck of the noise moves a ratio by 1 / sqrt(2 sweeps).
        seed: the same for all estimators, so that they see the same noise.
    """
    rng = np.random.default_rng(seed)
    estimate = ESTIMATORS[estimator]
    errors, ideal, squares = [], [], []
    for _ in range(sweeps):
        noise = rng.normal(size=scene.points_m.shape)
        try:
            basis, point, direction, covariance = estimate(scene, scene.points_m + noise * scene.sigmas_m[:, None])
        except TrueaxisError:
            continue
        error = axis_error(basis, point, direction, scene.sliding)
        errors.append(error)
        ideal.append(scene.best_linear @ noise.ravel())
        if covariance is not None:
            squares.append(error @ np.linalg.solve(covariance, error))
    return Efficiency(
        scene, estimator, sweeps, np.array(errors), np.array(ideal), np.array(squares) if squares else None
    )


def _ratio(errors: Array, bound: Array) -> float:
    return float(np.sqrt(np.mean(np.sum(errors**2, axis=1)) / np.trace(bound)))


HEADER = (
    "sweep",
    "radius, m",
    "noise, mm",
    "estimator",
    "direction, deg",
    "/ bound",
    "place, mm",
    "/ bound",
    "squared error",
    "99 % limits",
    "not found",
)


def table(sweeps: int = SWEEPS) -> str:
    """All scenes and estimators as a Markdown table, with what the columns mean."""
    rows = [_row(study(scene, name, sweeps)) for scene in (*ROTARY, TOO_NOISY, *SLIDING) for name in ESTIMATORS]
    low, high = Efficiency(ROTARY[0], "", sweeps, np.zeros((sweeps, 4)), np.zeros((sweeps, 4)), None).mean_square_limits
    return "\n".join(
        [
            f"Errors of joint axes over {sweeps} simulated sweeps each (seed {SEED}), root mean square, and over the "
            f"Cramer-Rao bound; the luck of the noise moves a ratio by {100 / np.sqrt(2 * sweeps):.1f} %.",
            f"Squared error: mean of e'C^-1 e by the stated covariance, 4 if that is right ({low:.2f} to {high:.2f} "
            "with 99 % probability), 2 for a sliding axis.",
            "Closed form: plane, then circle; for a sliding axis the principal direction.",
            "",
            markdown(HEADER, rows),
        ]
    )


def _row(found: Efficiency) -> tuple[str, ...]:
    scene = found.scene
    direction = np.rad2deg(found.direction_ratio * np.sqrt(np.trace(scene.bound[:2, :2])))
    place = "-" if scene.sliding else f"{found.place_ratio * np.sqrt(np.trace(scene.bound[2:, 2:])) * 1e3:.3g}"
    low, high = found.mean_square_limits
    stated = found.squares is not None
    return (
        scene.name,
        "sliding" if scene.sliding else ", ".join(f"{r:g}" for r in scene.radius_m),
        ", ".join(f"{s * 1e3:g}" for s in scene.sigma_m) + (" and twice that" if scene.uneven else ""),
        found.estimator,
        f"{direction:.3g}",
        f"{found.direction_ratio:.3f}",
        place,
        "-" if scene.sliding else f"{found.place_ratio:.3f}",
        f"{found.mean_square:.2f}{'' if found.consistent else ' (wrong)'}" if stated else "none stated",
        f"{low:.2f} to {high:.2f}",
        str(found.not_found),
    )
