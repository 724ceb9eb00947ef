"""The circle of a sweep while it is being measured: the arc that the axis so far gives its targets, and that axis."""

from typing import TYPE_CHECKING

import numpy as np

from app.scene.colours import FITTED_AXIS
from app.scene.group import SceneGroup, Viewer
from core.axes import AxisFit
from core.geometry import Array

if TYPE_CHECKING:
    import viser

PIECES = 48
BEYOND = 0.15
"""How far an arc is drawn beyond its shots at both ends, as a share of what they span."""
THICKNESS_PX = 2.0


def arc_points_m(fit: AxisFit, target: int, points_m: Array) -> Array:
    """The arc of a target through the angles of its shots (k, 3) and a little beyond, (pieces + 1, 3).

    For a sliding axis the line through the shots.
    """
    start, direction = fit.line.point_m, fit.line.direction
    if fit.sliding:
        along = (points_m - points_m.mean(axis=0)) @ direction
        reach = BEYOND * np.ptp(along)
        ways = np.linspace(along.min() - reach, along.max() + reach, PIECES + 1)
        return points_m.mean(axis=0) + ways[:, None] * direction
    across = (points_m - start) @ fit.basis.T
    angle = np.unwrap(np.arctan2(across[:, 1], across[:, 0]))
    reach = BEYOND * np.ptp(angle)
    turns = np.linspace(angle.min() - reach, angle.max() + reach, PIECES + 1)
    centre = start + fit.height_m[target] * direction
    circle = np.cos(turns)[:, None] * fit.basis[0] + np.sin(turns)[:, None] * fit.basis[1]
    return centre + fit.radius_m[target] * circle


def spokes_m(fit: AxisFit, arcs: list[Array]) -> Array:
    """From the axis to both ends of every arc, and the axis between the highest and the lowest of them, (k, 2, 3)."""
    ends = np.concatenate([arc[[0, -1]] for arc in arcs])
    feet = np.array([fit.line.foot_of(end) for end in ends])
    along = (feet - fit.line.point_m) @ fit.line.direction
    reach = 0.25 * float(np.linalg.norm(ends - feet, axis=1).max())
    tips = fit.line.point_m + np.array([along.min() - reach, along.max() + reach])[:, None] * fit.line.direction
    return np.concatenate([np.stack([feet, ends], axis=1), tips[None]])


class SweepCircle(SceneGroup):
    """Nodes ``root/arcs`` and ``root/spokes``."""

    def __init__(self, viewer: Viewer, root: str = "/sweep") -> None:
        super().__init__(viewer, root)
        self._drawn: list[viser.LineSegmentsHandle] = []

    def show(self, fit: AxisFit | None, points_m: Array, target: np.ndarray) -> None:
        """Draw the arcs of a sweep.

        Args:
            fit: its axis so far; None: there is none, and nothing is drawn.
            points_m: the shots that it rests on, (k, 3).
            target: index of the target of each shot, as in the fit, (k,).
        """
        with self._together():
            for node in self._drawn:
                node.remove()
            self._drawn = []
            if fit is None:
                return
            arcs = [arc_points_m(fit, int(k), points_m[target == k]) for k in np.unique(target)]
            self._lines("arcs", np.concatenate([np.stack([arc[:-1], arc[1:]], axis=1) for arc in arcs]), THICKNESS_PX)
            if not fit.sliding:
                self._lines("spokes", spokes_m(fit, arcs), 1.0)

    def _lines(self, name: str, segments_m: Array, thickness: float) -> None:
        self._drawn.append(
            self._scene.add_line_segments(
                f"{self._root}/{name}", segments_m, FITTED_AXIS, thickness=thickness, thickness_units="screen"
            )
        )
