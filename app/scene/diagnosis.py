"""The drawing of geometric errors: both arms' axes, phi-frames and common normals, and every difference in place."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from app.scene.cameras import FIELD_OF_VIEW_RAD, Camera, around, near
from app.scene.colours import BLUE, FITTED_AXIS, GREY, HIGHLIGHT, NOMINAL_AXIS, VERMILLION, Rgb
from app.scene.dimensions import Dimension, FrameSketch, dimensions, sketches
from app.scene.error_vectors import factor_text
from app.scene.group import SceneGroup, Viewer, add_solid
from app.scene.picture import picture_directions
from app.scene.solids import Solid, arrow, ball, merged
from core.estimate import Geometry
from core.geometry import Array, cross
from core.phi_model import PhiModel

if TYPE_CHECKING:
    import viser


LABEL_PX, LINE_PX, NARROWEST_PX, NARROWEST = 215.0, 25.0, 428.0, 428.0 / 768.0
"""Width of a label and height of a line, and the picture between the panels on the smallest screen."""
MOST_ROUNDS = 400
"""Of moving labels apart."""
SLACK = 1.15
"""Labels are kept that much further apart, because the view of them all is from a little further away."""


class DiagnosisView(SceneGroup):
    """Nodes ``root/nominal``, ``root/actual``, ``root/phi_frames``, ``root/dimensions/F_P`` and ``root/factor``.

    ``root/dimensions/2_a_m`` is the dimension of parameter a of frame 2, with its label beside it.
    """

    def __init__(
        self,
        viewer: Viewer,
        nominal: PhiModel,
        geometry: Geometry,
        base: Array,
        reach_m: float,
        exaggeration: float,
        direction: ArrayLike = (1.0, 0.0, 0.4),
        root: str = "/diagnosis",
    ) -> None:
        """Draw all differences.

        Args:
            viewer: whose scene it is drawn in.
            nominal: as for ``dimensions``, with ``geometry`` and ``base``.
            geometry: see there.
            base: see there.
            reach_m: of the arm; sets the sizes.
            exaggeration: how many times too large differences are drawn.
            direction: from the arm to the eye, (3,), for which labels are laid out.
            root: name of the node that holds it all.
        """
        super().__init__(viewer, root)
        self.direction = np.asarray(direction, dtype=float)
        self._reach = reach_m
        self._models = (nominal, geometry, base)
        self._exaggeration = exaggeration
        self._lit: tuple[int, str] | None = None
        self.dimensions: tuple[Dimension, ...] = ()
        self._labels: dict[tuple[int, str], viser.LabelHandle] = {}
        self._draw()

    @property
    def exaggeration(self) -> float:
        """How many times too large differences are drawn."""
        return self._exaggeration

    @exaggeration.setter
    def exaggeration(self, factor: float) -> None:
        self._exaggeration = factor
        self._draw()

    def highlight(self, frame: int | None, parameter: str = "") -> None:
        """Draw one dimension in the colour of attention, with its label; None: none."""
        self._lit = None if frame is None else (frame, parameter)
        with self._together():
            self._draw_dimensions()

    def has(self, frame: int, parameter: str) -> bool:
        """Whether there is such a dimension."""
        return (frame, parameter) in self._labels

    def overview(self) -> Camera:
        """A view that holds all differences with their labels."""
        return around("Geometric errors", np.vstack([self._corners(), self._places()]), self.direction, 1.1)

    def camera(self, frame: int, parameter: str) -> Camera:
        """A close view of one dimension.

        Raises:
            KeyError: there is no such dimension.
        """
        for d in self.dimensions:
            if (d.frame, d.parameter) == (frame, parameter):
                size = max(0.22 * self._reach, 1.4 * float(np.linalg.norm(d.to_m - d.from_m)))
                return near(d.text, d.middle_m, self.direction, size)
        raise KeyError(f"frame {frame} has no dimension {parameter}")

    def _corners(self) -> Array:
        """What a view of all differences must hold, without labels, (k, 3)."""
        corners = [self._models[2][:3, 3], *(p for d in self.dimensions for p in (d.from_m, d.to_m))]
        pad = 0.06 * self._reach
        return np.vstack([np.array(corners) - pad, np.array(corners) + pad])

    def _draw(self) -> None:
        drawn = sketches(*self._models, self._exaggeration)
        self.dimensions = tuple(dimensions(*self._models, self._exaggeration, 0.2 * self._reach))
        with self._together():
            self._sketch("nominal", drawn, NOMINAL_AXIS)
            self._sketch("actual", drawn, FITTED_AXIS)
            self._phi_frames(drawn)
            self._draw_dimensions()
            top = max(p.to_m[2] for p in self.dimensions) if self.dimensions else self._models[2][2, 3]
            middle = np.mean([s.phi_frame[:3, 3] for s in drawn], axis=0)
            place = (middle[0], middle[1], top + 0.16 * self._reach)
            text = f"differences {factor_text(self._exaggeration)}"
            self._scene.add_label(f"{self._root}/factor", text, position=place, anchor="bottom-center")

    def _sketch(self, which: str, drawn: list[FrameSketch], colour: Rgb) -> None:
        half, r = 0.2 * self._reach, 0.0022 * self._reach
        lines, shafts = [], []
        for sketch in drawn:
            axis = sketch.nominal_axis if which == "nominal" else sketch.actual_axis
            way = sketch.nominal_way_m if which == "nominal" else sketch.actual_way_m
            lines += [way[:2], way[1:]]
            radius = r if which == "nominal" else 1.6 * r
            shafts.append(arrow(axis.point_m - half * axis.direction, axis.point_m + half * axis.direction, radius))
        self._mesh(f"{which}/axes", merged(shafts), colour)
        self._scene.add_line_segments(
            f"{self._root}/{which}/normals", np.array(lines), colour, thickness=2.0, thickness_units="screen"
        )

    def _phi_frames(self, drawn: list[FrameSketch]) -> None:
        """X and Y short and grey, Z_phi longer and blue."""
        sizes = 0.06 * self._reach * np.array([0.6, 0.6, 1.5])
        ends = [
            (f[:3, 3], f[:3, 3] + size * f[:3, k]) for f in (s.phi_frame for s in drawn) for k, size in enumerate(sizes)
        ]
        colours = np.tile(np.array([GREY, GREY, BLUE], dtype=np.uint8)[:, None], (len(drawn), 2, 1))
        self._scene.add_line_segments(
            f"{self._root}/phi_frames", np.array(ends), colours, thickness=3.0, thickness_units="screen"
        )

    def _draw_dimensions(self) -> None:
        places = self._places()
        leaders = []
        over = picture_directions(self.direction)[1]
        for d, stacked in zip(self.dimensions, places, strict=True):
            key = (d.frame, d.parameter)
            lit = key == self._lit
            # One alone has its label close by, so that both are seen from near.
            place = d.middle_m + 0.07 * self._reach * over if lit else stacked
            name = f"dimensions/{d.frame}_{d.parameter}"
            self._mesh(name, self._leg(d, lit), self._colour(d, lit))
            shown = lit or (d.significant and self._lit is None)
            self._labels[key] = self._label(f"{name}/label", d.text, place, shown)
            leaders += [[d.middle_m, place]] if shown else []
        ends = np.array(leaders) if leaders else np.zeros((1, 2, 3))
        self._scene.add_line_segments(
            f"{self._root}/leaders", ends, GREY, thickness=1.0, thickness_units="screen", visible=bool(leaders)
        )

    def _places(self) -> Array:
        eye = around("Geometric errors", self._corners(), self.direction, 1.1).fitting(NARROWEST)
        width = 2 * NARROWEST * np.tan(FIELD_OF_VIEW_RAD / 2) * float(np.linalg.norm(eye.position_m - eye.look_at_m))
        pixel = SLACK * width / NARROWEST_PX
        return label_places(
            self.dimensions, LINE_PX * pixel, LABEL_PX * pixel, self.direction, (eye.look_at_m, width / 2)
        )

    def _colour(self, dimension: Dimension, lit: bool) -> Rgb:
        if lit:
            return HIGHLIGHT
        return VERMILLION if dimension.significant and self._lit is None else GREY

    def _leg(self, dimension: Dimension, lit: bool) -> Solid:
        radius = (0.0055 if lit else 0.0035) * self._reach
        leg = arrow(dimension.from_m, dimension.to_m, radius)
        return merged([leg, ball(dimension.from_m, radius, 8)])

    def _label(self, name: str, text: str, place: Array, shown: bool) -> "viser.LabelHandle":
        full = f"{self._root}/{name}"
        return self._scene.add_label(full, text, position=place, anchor="center-center", visible=shown)

    def _mesh(self, name: str, solid: Solid, colour: Rgb) -> None:
        add_solid(self._scene, f"{self._root}/{name}", solid, colour)


def label_places(
    drawn: tuple[Dimension, ...],
    height_m: float,
    width_m: float,
    direction: Array,
    room: tuple[Array, float] | None = None,
) -> Array:
    """Places for labels near their dimensions, (k, 3), one above the other where they would overlap.

    All stand in one plane square to the view, so that what is apart there is apart in the picture.

    Args:
        drawn: the dimensions; labels of those that are not significant stay where they are.
        height_m: way up the picture from one label to the next.
        width_m: labels this far apart or further across the picture do not overlap.
        direction: from the arm to the eye, (3,).
        room: middle of the picture, (3,), and half its width, m, in which whole labels are kept; None: endless.
    """
    if not drawn:
        return np.zeros((0, 3))
    right, over = picture_directions(direction)
    middles = np.array([d.middle_m for d in drawn])
    shown = np.array([d.significant for d in drawn])
    # A little above, so that a label does not cover what it speaks of.
    across, up = middles @ right, middles @ over + 0.8 * height_m
    if room is not None:
        aside = max(room[1] - width_m / 2, 0.0)
        across = np.clip(across, room[0] @ right - aside, room[0] @ right + aside)
    moved = _stacked(across, up, shown, height_m, width_m)
    away = cross(right, over)
    return across[:, None] * right + moved[:, None] * over + (middles @ away).mean() * away


def _stacked(across: Array, up: Array, shown: np.ndarray, height_m: float, width_m: float) -> Array:
    """Heights of labels in the picture, (k,), moved apart where those that are shown would overlap."""
    rivals = (np.abs(across[:, None] - across) < width_m) & shown[:, None] & shown
    np.fill_diagonal(rivals, False)
    order = np.argsort(np.argsort(up, kind="stable"))
    above = np.where(order[:, None] > order, 1.0, -1.0)
    moved = up.copy()
    for _ in range(MOST_ROUNDS):
        lacking = np.where(rivals, np.clip(height_m - (moved[:, None] - moved) * above, 0.0, None), 0.0)
        if lacking.max() < 1e-3 * height_m:
            break
        moved = moved + 0.25 * (lacking * above).sum(axis=1)
    return moved
