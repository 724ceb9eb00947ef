"""Observed points: balls coloured by residual that can be clicked; what is doubtful or excluded has another shape."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from app.scene.colours import EXCLUDED, HIGHLIGHT, Bytes
from app.scene.group import SceneGroup, Viewer, add_solid
from app.scene.poses import turning_to
from app.scene.solids import Solid, ball, merged, octahedron, ring
from core.geometry import Array

if TYPE_CHECKING:
    import viser

UPRIGHT = (1.0, 0.0, 0.0, 0.0)

OnClick = Callable[[int, int], None]
"""Called with the row of the point and the number of the client who clicked it."""


class Verdict(IntEnum):
    """What is thought of a point."""

    KEPT = 0
    DOUBTFUL = 1
    EXCLUDED = 2


@dataclass(frozen=True)
class PointMarks:
    """Points as they are to be drawn, by columns of length m."""

    row: np.ndarray
    """What a click names: the row in the campaign's measurements, integer (m,)."""
    point_m: Array
    """In the instrument's frame, (m, 3)."""
    colour: Bytes
    """0..255, (m, 3); see ``ResidualScale.colours``."""
    verdict: np.ndarray
    """Of ``Verdict``, integer (m,)."""

    def __post_init__(self) -> None:
        m = len(self.row)
        shapes = (self.point_m.shape, self.colour.shape, self.verdict.shape)
        if shapes != ((m, 3), (m, 3), (m,)):
            raise ValueError(f"{m} points need columns of shape (m, 3), (m, 3) and (m,), got {shapes}")

    def of(self, verdict: Verdict) -> "PointMarks":
        """Those with one verdict and a place."""
        chosen = (self.verdict == verdict) & np.isfinite(self.point_m).all(axis=1)
        return PointMarks(self.row[chosen], self.point_m[chosen], self.colour[chosen], self.verdict[chosen])


def _upright(count: int) -> Array:
    return np.tile(np.array(UPRIGHT, dtype=np.float32), (count, 1))


def cage(radius_m: float) -> Solid:
    """Three thin rings: a hollow ball, for what is left out."""
    thickness = 0.22 * radius_m
    return merged([ring(np.zeros(3), axis, radius_m, thickness, 16) for axis in np.eye(3)])


class PointsView(SceneGroup):
    """Nodes ``root/kept``, ``root/doubtful``, ``root/excluded``, ``root/last``, ``root/chosen``, ``root/next``."""

    def __init__(self, viewer: Viewer, root: str = "/points", radius_m: float = 0.011) -> None:
        super().__init__(viewer, root)
        self._radius = radius_m
        self._on_click: OnClick | None = None
        self._solids = {
            Verdict.KEPT: ball(np.zeros(3), radius_m, 8),
            Verdict.DOUBTFUL: octahedron(1.7 * radius_m),
            Verdict.EXCLUDED: cage(1.15 * radius_m),
        }
        self._batches: dict[Verdict, viser.BatchedMeshHandle] = {}
        self._rows: dict[Verdict, np.ndarray] = {}
        self._last, self._next, self._chosen = self._halo(), self._ghost(), self._lens()

    def on_click(self, callback: OnClick) -> None:
        """Call back whenever a point is clicked; to be said before the first points are shown."""
        self._on_click = callback

    def show(self, marks: PointMarks) -> None:
        """Draw these points instead of those before."""
        with self._together():
            for verdict, solid in self._solids.items():
                self._batch(verdict, solid, marks.of(verdict))

    def mark_last(self, point_m: ArrayLike | None) -> None:
        """Surround the point that was measured last, (3,); None: no point."""
        self._put(self._last, point_m)

    def mark_chosen(self, point_m: ArrayLike | None, text: str = "") -> None:
        """Mark the point that somebody has chosen, (3,), with its name; None: none."""
        if point_m is not None:
            self._scene.add_label(
                f"{self._root}/chosen/name", text, position=(0.0, 0.0, 3.0 * self._radius), anchor="bottom-center"
            )
        self._put(self._chosen, point_m)

    def expect(self, point_m: ArrayLike | None, facing: ArrayLike = (0.0, 0.0, 1.0)) -> None:
        """Show where the next target is expected, (3,), as a ring square to a unit vector; None: nowhere."""
        self._put(self._next, point_m)
        self._next.wxyz = turning_to(facing)

    def _batch(self, verdict: Verdict, solid: Solid, marks: PointMarks) -> None:
        """Draw the points of one verdict: those that are there are moved and coloured, not drawn anew."""
        self._rows[verdict] = marks.row.copy()
        batch = self._batches.get(verdict)
        if len(marks.row) == 0:
            if batch is not None:
                batch.visible = False
            return
        if batch is None:
            self._batches[verdict] = self._first(verdict, solid, marks)
            return
        batch.batched_positions = marks.point_m.astype(np.float32)
        batch.batched_wxyzs = _upright(len(marks.row))
        if verdict is not Verdict.EXCLUDED:
            batch.batched_colors = marks.colour
        batch.visible = True

    def _first(self, verdict: Verdict, solid: Solid, marks: PointMarks) -> "viser.BatchedMeshHandle":
        batch = self._scene.add_batched_meshes_simple(
            f"{self._root}/{verdict.name.lower()}",
            solid.vertices_m,
            solid.faces,
            batched_wxyzs=_upright(len(marks.row)),
            batched_positions=marks.point_m,
            batched_colors=np.array(EXCLUDED) if verdict is Verdict.EXCLUDED else marks.colour,
            lod="off",
            flat_shading=verdict is Verdict.DOUBTFUL,
            cast_shadow=False,
            receive_shadow=False,
        )
        if self._on_click is not None:
            batch.on_click(lambda event: self._clicked(verdict, event))
        return batch

    def _clicked(self, verdict: Verdict, event: "viser.SceneNodePointerEvent[viser.BatchedMeshHandle]") -> None:
        index, rows = event.instance_index, self._rows[verdict]
        # What a browser sends is not to be trusted.
        if self._on_click is not None and isinstance(index, int) and 0 <= index < len(rows):
            self._on_click(int(rows[index]), event.client_id)

    def _halo(self) -> "viser.MeshHandle":
        solid = merged([ring(np.zeros(3), axis, 2.4 * self._radius, 0.4 * self._radius) for axis in np.eye(3)])
        return self._mark("last", solid, None)

    def _ghost(self) -> "viser.FrameHandle":
        node = self._scene.add_frame(f"{self._root}/next", show_axes=False, visible=False)
        self._mark("next/ring", ring(np.zeros(3), [0.0, 0.0, 1.0], 4.5 * self._radius, 0.6 * self._radius), None)
        self._mark("next/ball", ball(np.zeros(3), 1.3 * self._radius), 0.5)
        return node

    def _lens(self) -> "viser.FrameHandle":
        node = self._scene.add_frame(f"{self._root}/chosen", show_axes=False, visible=False)
        self._mark("chosen/lens", ball(np.zeros(3), 2.2 * self._radius), 0.45)
        return node

    def _mark(self, part: str, solid: Solid, opacity: float | None) -> "viser.MeshHandle":
        return add_solid(self._scene, f"{self._root}/{part}", solid, HIGHLIGHT, opacity, visible="/" in part)

    @staticmethod
    def _put(node: "viser.SceneNodeHandle", point_m: ArrayLike | None) -> None:
        if point_m is None or not np.isfinite(point_m).all():
            node.visible = False
            return
        node.position = np.asarray(point_m, dtype=float)
        node.visible = True
