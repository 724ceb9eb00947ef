"""The floor of the cell: a grid of fine lines, as large as what stands on it."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from app.scene.colours import FLOOR
from app.scene.link_shapes import Skeleton, upright
from core.geometry import Array

if TYPE_CHECKING:
    import viser

INSTRUMENT_HEIGHT_M = 1.45
"""Of a theodolite or tracker on its tripod."""


@dataclass(frozen=True)
class Floor:
    """A level rectangle."""

    height_m: float
    low_m: Array
    """Its corner with the least x and y, (2,)."""
    high_m: Array
    """Its corner with the most x and y, (2,)."""


def floor_height(bones: Skeleton, stations_m: ArrayLike) -> float:
    """A floor that neither arm nor tripods would sink into, where nobody measured it; stations (k, 3)."""
    stations = np.asarray(stations_m, dtype=float).reshape(-1, 3)
    lowest = [bones.base_m[2]] if upright(bones) else [bones.hubs_m[:, 2].min() - 0.6 * bones.reach_m]
    return float(min([*lowest, *(stations[:, 2] - INSTRUMENT_HEIGHT_M)]))


def floor_under(points_m: ArrayLike, height_m: float, margin_m: float = 0.8, cell_m: float = 0.5) -> Floor:
    """The floor under points (m, 3), with a margin, in whole cells."""
    flat = np.asarray(points_m, dtype=float)[:, :2]
    low = np.floor((flat.min(axis=0) - margin_m) / cell_m) * cell_m
    high = np.ceil((flat.max(axis=0) + margin_m) / cell_m) * cell_m
    return Floor(height_m, low, high)


def grid_segments(floor: Floor, cell_m: float = 0.5) -> Array:
    """The lines of the grid, (k, 2, 3)."""
    (x0, y0), (x1, y1), z = floor.low_m, floor.high_m, floor.height_m
    xs = np.arange(x0, x1 + cell_m / 2, cell_m)
    ys = np.arange(y0, y1 + cell_m / 2, cell_m)
    along_y = [[(x, y0, z), (x, y1, z)] for x in xs]
    along_x = [[(x0, y, z), (x1, y, z)] for y in ys]
    return np.array(along_y + along_x)


def draw_floor(
    scene: "viser.SceneApi", floor: Floor, cell_m: float = 0.5, root: str = "/floor"
) -> "viser.LineSegmentsHandle":
    """Draw the grid; lines keep their width of one pixel."""
    # A shaded grid plane costs software renderers more than the whole rest of the scene; lines do not.
    return scene.add_line_segments(root, grid_segments(floor, cell_m), FLOOR, thickness=0.7, thickness_units="screen")
