"""How fast one joint axis is found, against the barest fit and against a general optimiser, and how that grows."""

import subprocess
import sys
from collections.abc import Callable

import numpy as np
from scipy.optimize import least_squares

from core.axes import fit_axis
from core.geometry import perpendicular_basis
from tests.benchmarks.campaign_speed import campaign_table
from tests.benchmarks.clock import median_s
from tests.benchmarks.simulated_sweeps import DIRECTION, Array, Scene, axis_error
from tests.benchmarks.tables import markdown

SCENE = Scene("116 points over 90 deg", 116, np.pi / 2, (0.5,), (0.11e-3,))
ACCURACY_SWEEPS = 100
SIZES = (100, 10_000, 1_000_000)
ONE_SIZE = """
import sys, time, resource
import numpy as np
from core.axes import fit_axis
count = int(sys.argv[1])
angle = np.linspace(0.3, 1.9, count)
points = np.stack([0.5 * np.cos(angle) + 2.0, 0.5 * np.sin(angle) - 1.0, np.full(count, 0.4)], axis=1)
points += np.random.default_rng(1).normal(size=points.shape) * 1.1e-4
times = []
for _ in range(3 if count > 100_000 else 30):
    start = time.perf_counter()
    fit_axis(points, sigma_m=1.1e-4)
    times.append(time.perf_counter() - start)
print(np.median(times), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


def bare(points_m: Array) -> tuple[Array, Array]:
    """Direction and centre by plane and circle as it is usually written: no checks, no covariance, no residuals."""
    middle = points_m.mean(axis=0)
    centred = points_m - middle
    _, _, vt = np.linalg.svd(centred, full_matrices=False)
    flat = centred @ vt[:2].T
    matrix = np.column_stack([2 * flat, np.ones(len(flat))])
    centre = np.linalg.lstsq(matrix, np.sum(flat**2, axis=1), rcond=None)[0]
    return vt[2], middle + centre[:2] @ vt[:2]


def leanest(points_m: Array) -> tuple[Array, Array]:
    """The same through 3x3 and 2x2 normal equations: the least that numpy can be asked to do."""
    middle = points_m.mean(axis=0)
    centred = points_m - middle
    _, vectors = np.linalg.eigh(centred.T @ centred)
    flat = centred @ vectors[:, 1:]
    centre = np.linalg.solve(2 * flat.T @ flat, flat.T @ np.einsum("ij,ij->i", flat, flat))
    return vectors[:, 0], middle + vectors[:, 1:] @ centre


def general(points_m: Array) -> tuple[Array, Array]:
    """The same sum of squares as ``likelihood``, by a general optimiser from the closed form."""
    direction, centre = bare(points_m)
    e1, e2 = perpendicular_basis(direction)

    def axis(unknown: Array) -> tuple[Array, Array]:
        turned = direction + unknown[0] * e1 + unknown[1] * e2
        return turned / np.linalg.norm(turned), centre + unknown[2] * e1 + unknown[3] * e2

    def residual(unknown: Array) -> Array:
        along, place = axis(unknown)
        relative = points_m - place
        z = relative @ along
        rho = np.linalg.norm(relative - np.outer(z, along), axis=1)
        return np.concatenate([z - unknown[4], rho - unknown[5]])

    radius = float(np.mean(np.linalg.norm(points_m - centre, axis=1)))
    return axis(least_squares(residual, np.array([0, 0, 0, 0, 0, radius]), xtol=1e-12, ftol=1e-12, gtol=1e-12).x)


def by_product(points_m: Array) -> tuple[Array, Array]:
    """``core.axes.fit_axis`` as it is called: checks, covariance, residuals, outliers and sense included."""
    line = fit_axis(points_m).line
    return line.direction, line.point_m


WAYS: dict[str, Callable[[Array], tuple[Array, Array]]] = {
    "plane and circle, leanest": leanest,
    "plane and circle, as usually written": bare,
    "scipy.optimize.least_squares": general,
    "core.axes.fit_axis": by_product,
}


def one_axis_table() -> str:
    """Time and accuracy of each way to find one axis from 116 points."""
    rng = np.random.default_rng(7)
    sweeps = [SCENE.points_m + rng.normal(size=SCENE.points_m.shape) * 0.11e-3 for _ in range(ACCURACY_SWEEPS)]
    times = {
        name: median_s(lambda way=way: way(sweeps[0]), 300 if way is not general else 30) for name, way in WAYS.items()
    }
    reference = times["plane and circle, as usually written"]
    rows = []
    for name, way in WAYS.items():
        errors = np.array([_error(*way(points), points) for points in sweeps])
        direction, place = (np.sqrt(np.mean(np.sum(part**2, axis=1))) for part in (errors[:, :2], errors[:, 2:]))
        rows.append(
            (
                name,
                f"{times[name] * 1e3:.3f}",
                f"{times[name] / reference:.1f}",
                f"{np.rad2deg(direction):.5f}",
                f"{place * 1e3:.4f}",
            )
        )
    return markdown(("one axis from 116 points", "ms", "times bare", "direction, deg", "place, mm"), rows)


def _error(direction: Array, point_m: Array, points_m: Array) -> Array:
    direction = direction * np.sign(direction @ DIRECTION)
    foot = point_m + direction * ((points_m.mean(axis=0) - point_m) @ direction)
    return axis_error(np.stack(perpendicular_basis(direction)), foot, direction)


def growth_table() -> str:
    """Time and memory of one fit, each size in a process of its own."""
    rows = []
    for count in SIZES:
        done = subprocess.run(
            [sys.executable, "-c", ONE_SIZE, str(count)], capture_output=True, text=True, check=True, timeout=300
        )
        seconds, kilobytes = map(float, done.stdout.split())
        rows.append((f"{count:,}", f"{seconds * 1e3:.2f}", f"{seconds / count * 1e6:.2f}", f"{kilobytes / 1024:.0f}"))
    return markdown(("points", "ms", "us a point", "peak memory of the process, MB"), rows)


def start_up() -> str:
    """Wall time of ``trueaxis --help``, the interpreter included."""
    command = [sys.executable, "-m", "app", "--help"]
    seconds = median_s(lambda: subprocess.run(command, capture_output=True, check=True, timeout=60), 5)
    return f"`trueaxis --help`: {seconds:.2f} s"


def report() -> str:
    """All tables of speed."""
    return "\n\n".join([one_axis_table(), growth_table(), campaign_table(), start_up()])
