"""Joint axes as long thin arrows with labels, and how well they are known as a tube about them."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from app.scene.colours import FITTED_AXIS, HIGHLIGHT, NOMINAL_AXIS, Rgb, round_down
from app.scene.group import SceneGroup, Viewer, add_frame, add_solid
from app.scene.link_shapes import Skeleton
from app.scene.picture import picture_directions
from app.scene.poses import link_motions, pose_of
from app.scene.solids import Solid, arrow, lathe
from core.geometry import Array, Line, apply

if TYPE_CHECKING:
    import viser

TUBE_OPACITY = 0.28
TAIL, TIP = -1 / 3, 2 / 3
"""Ends of an arrow from its joint, as shares of its length."""
LABEL_SHARES = (TIP, TAIL, 0.48, 0.85)
"""Where on its axis a label may stand, the best place first."""
LABEL_WIDTH, LABEL_HEIGHT = 0.26, 0.11
"""Labels further apart than this in a picture of the arm do not overlap, as shares of the arrows' length."""
LENGTH_OF_REACH = 0.8
"""A good length of arrows, as a share of an arm's reach: long enough for all tips to stand clear of the arm."""


@dataclass(frozen=True)
class AxisMark:
    """An axis at rest as it is to be drawn."""

    joint: int
    """1..n"""
    line: Line
    """At zero displacement, in the instrument's frame."""
    middle_m: Array
    """The point of the axis about which the arrow lies, (3,): where the joint is."""
    direction_std_rad: float = float("nan")
    """Standard uncertainty of the direction; NaN: no tube."""
    point_std_m: float = float("nan")
    """Standard uncertainty of the place at ``line.point_m``; NaN (a slide has no place): taken as 0."""
    text: str = ""
    """Of the label; empty: none."""


def axis_arrow(mark: AxisMark, length_m: float, radius_m: float) -> Solid:
    """The arrow of an axis: a third of it behind the joint, two thirds ahead."""
    start, end = axis_ends(mark, length_m)
    return arrow(start, end, radius_m)


def axis_ends(mark: AxisMark, length_m: float) -> tuple[Array, Array]:
    """Tail and tip of the arrow of an axis, each (3,)."""
    middle = mark.line.foot_of(mark.middle_m)
    return middle + TAIL * length_m * mark.line.direction, middle + TIP * length_m * mark.line.direction


def label_shares(middles_m: Array, directions: Array, length_m: float, view: ArrayLike) -> tuple[float, ...]:
    """Where on each axis its label stands, a share of the arrows' length from the joint, so that none covers another.

    Axes that lie together, as those of a stretched wrist do, get their labels at different ends or distances. Where
    there is no free place, the label keeps the tip.

    Args:
        middles_m: of the arrows, (n, 3).
        directions: of the axes, unit, (n, 3).
        length_m: of the arrows.
        view: from the arm to the eye, (3,).
    """
    picture = np.stack(picture_directions(view)) / (length_m * np.array([[LABEL_WIDTH], [LABEL_HEIGHT]]))
    chosen, taken = [], np.zeros((0, 2))
    for middle, direction in zip(middles_m, directions, strict=True):
        places = {share: picture @ (middle + share * length_m * direction) for share in LABEL_SHARES}
        free = (s for s, p in places.items() if not (np.abs(taken - p) < 1.0).all(axis=1).any())
        chosen.append(next(free, TIP))
        taken = np.vstack([taken, places[chosen[-1]]])
    return tuple(chosen)


def tube_radius_m(mark: AxisMark, along_m: ArrayLike, exaggeration: float) -> Array:
    """Radius of the tube at distances from the axis' point, (k,): one standard uncertainty, exaggerated.

    Place and direction are uncorrelated at that point, so variances add: narrow there, wider to both ends.
    """
    place = 0.0 if np.isnan(mark.point_std_m) else mark.point_std_m
    return exaggeration * np.hypot(place, np.asarray(along_m, dtype=float) * mark.direction_std_rad)


def uncertainty_tube(mark: AxisMark, length_m: float, exaggeration: float, least_m: float = 1e-4) -> Solid | None:
    """The tube about the arrow of an axis; None where the uncertainty is not known."""
    if not np.isfinite(mark.direction_std_rad):
        return None
    start, end = axis_ends(mark, length_m)
    ways = np.linspace((start - mark.line.point_m) @ mark.line.direction, 0.0, 8)
    ways = np.union1d(ways, np.linspace((end - mark.line.point_m) @ mark.line.direction, 0.0, 8))
    low, high = ((p - mark.line.point_m) @ mark.line.direction for p in (start, end))
    ways = ways[(ways >= low - 1e-12) & (ways <= high + 1e-12)]
    radius = np.maximum(tube_radius_m(mark, ways, exaggeration), least_m)
    return lathe(mark.line.point_m, mark.line.direction, np.stack([ways, radius], axis=1), 16)


def tube_exaggeration(marks: tuple[AxisMark, ...], length_m: float, widest_m: float) -> float:
    """A round factor that makes no tube wider than a radius, at least 1; 1 where no uncertainty is known."""
    widest = [
        tube_radius_m(mark, (np.stack(axis_ends(mark, length_m)) - mark.line.point_m) @ mark.line.direction, 1.0).max()
        for mark in marks
        if np.isfinite(mark.direction_std_rad)
    ]
    return max(round_down(widest_m / max([*widest, 1e-12])), 1.0) if widest else 1.0


class AxesView(SceneGroup):
    """Axes of one arm that follow its motion: nodes ``root/1`` .. ``root/n`` with ``arrow``, ``tube``, ``label``."""

    def __init__(
        self,
        viewer: Viewer,
        root: str,
        marks: tuple[AxisMark, ...],
        sliding: np.ndarray,
        length_m: float,
        colour: Rgb = FITTED_AXIS,
        radius_m: float = 0.004,
        exaggeration: float = 1.0,
        view: ArrayLike = (0.4, -0.8, 0.35),
    ) -> None:
        """Draw the axes of joints 1..n, in that order, as they are with all joints at zero.

        ``view`` is the direction from the arm to the eye, (3,), in which no label covers another.
        """
        super().__init__(viewer, root)
        self._colour = colour
        self._length, self._radius, self._exaggeration = length_m, radius_m, exaggeration
        self._marks, self._sliding = tuple(marks), np.asarray(sliding, dtype=bool)
        self._lit: int | None = None
        self._view = np.asarray(view, dtype=float)
        self._net = np.zeros(len(self._marks))
        self._shares: dict[int, float] = {}
        self._nodes = [self._node(mark) for mark in marks]
        self._shafts = [self._arrow(mark, colour, radius_m) for mark in marks]
        self._labels = {mark.joint: self._label(mark) for mark in marks if mark.text}
        self._tubes: dict[int, viser.MeshHandle] = {}
        self._draw_tubes()

    def place(self, marks: tuple[AxisMark, ...], exaggeration: float) -> None:
        """Draw the same joints' axes as they are known now: shapes are changed, not drawn anew."""
        self._marks, self._exaggeration = tuple(marks), exaggeration
        with self._together():
            self.highlight(None)
            for node, shaft, mark in zip(self._nodes, self._shafts, self._marks, strict=True):
                node.position = mark.middle_m
                shaft.vertices = self._shaft(mark, self._radius).vertices_m.astype(np.float32)
            self._spread_labels(moved=True)
            self._draw_tubes()

    def show(self, net: ArrayLike) -> None:
        """Move the axes to where joints at net displacements (n,) bring them."""
        motions = link_motions(tuple(m.line for m in self._marks), self._sliding, net)
        with self._together():
            for node, mark, motion in zip(self._nodes, self._marks, motions[:-1], strict=True):
                pose = pose_of(motion, mark.middle_m)
                node.position, node.wxyz = pose.position_m, pose.wxyz
            self._net = np.asarray(net, dtype=float)
            self._spread_labels()

    def highlight(self, joint: int | None) -> None:
        """Draw one axis, 1..n, thick and in the colour of attention, and the others as usual; None: none."""
        with self._together():
            for old in {self._lit, joint} - {None} if joint != self._lit else ():
                lit = old == joint
                colour, radius = (HIGHLIGHT, 2.0 * self._radius) if lit else (self._colour, self._radius)
                self._shafts[old - 1] = self._arrow(self._marks[old - 1], colour, radius)
        self._lit = joint

    @property
    def exaggeration(self) -> float:
        """How many times too wide the tubes of uncertainty are drawn."""
        return self._exaggeration

    @exaggeration.setter
    def exaggeration(self, factor: float) -> None:
        self._exaggeration = factor
        with self._together():
            self._draw_tubes()

    @property
    def labels_visible(self) -> bool:
        return all(label.visible for label in self._labels.values())

    @labels_visible.setter
    def labels_visible(self, visible: bool) -> None:
        for label in self._labels.values():
            label.visible = visible

    def _node(self, mark: AxisMark) -> "viser.FrameHandle":
        return add_frame(self._scene, f"{self._root}/{mark.joint}", mark.middle_m)

    def _arrow(self, mark: AxisMark, colour: Rgb, radius_m: float) -> "viser.MeshHandle":
        return self._mesh(mark, "arrow", self._shaft(mark, radius_m), colour, None)

    def _shaft(self, mark: AxisMark, radius_m: float) -> Solid:
        return axis_arrow(mark, self._length, radius_m).about(mark.middle_m)

    def _label_place(self, mark: AxisMark, share: float) -> Array:
        """Where the label stands, from the node of the axis, (3,)."""
        return mark.line.foot_of(mark.middle_m) + share * self._length * mark.line.direction - mark.middle_m

    def _label(self, mark: AxisMark) -> "viser.LabelHandle":
        name, place = f"{self._root}/{mark.joint}/label", self._label_place(mark, TIP)
        return self._scene.add_label(name, mark.text, position=place, anchor="bottom-center", font_screen_scale=1.05)

    def _spread_labels(self, moved: bool = False) -> None:
        """Put the labels where none covers another as the joints stand; ``moved``: also those that keep their end."""
        motions = link_motions(tuple(m.line for m in self._marks), self._sliding, self._net)[:-1]
        labelled = [(mark, motion) for mark, motion in zip(self._marks, motions, strict=True) if mark.text]
        if not labelled:
            return
        middles = np.stack([apply(motion, mark.line.foot_of(mark.middle_m)) for mark, motion in labelled])
        directions = np.stack([motion[:3, :3] @ mark.line.direction for mark, motion in labelled])
        shares = label_shares(middles, directions, self._length, self._view)
        for (mark, _), share in zip(labelled, shares, strict=True):
            if moved or share != self._shares.get(mark.joint, TIP):
                self._labels[mark.joint].position = self._label_place(mark, share)
            self._shares[mark.joint] = share

    def _draw_tubes(self) -> None:
        solids = [(mark, uncertainty_tube(mark, self._length, self._exaggeration)) for mark in self._marks]
        known = [(mark, solid.about(mark.middle_m)) for mark, solid in solids if solid is not None]
        for joint in self._tubes.keys() - {mark.joint for mark, _ in known}:
            self._tubes.pop(joint).remove()
        for mark, solid in known:
            tube = self._tubes.get(mark.joint)
            if tube is not None and np.array_equal(tube.faces, solid.faces):
                tube.vertices = solid.vertices_m.astype(np.float32)
            else:
                self._tubes[mark.joint] = self._mesh(mark, "tube", solid, self._colour, TUBE_OPACITY)

    def _mesh(self, mark: AxisMark, part: str, solid: Solid, colour: Rgb, opacity: float | None) -> "viser.MeshHandle":
        name = f"{self._root}/{mark.joint}/{part}"
        return add_solid(self._scene, name, solid, colour, opacity, side="double" if opacity else "front")


def axis_tips(bones: Skeleton, net: ArrayLike) -> Array:
    """Where the labels of an arm's axes usually stand, at net displacements (n,): (n, 3)."""
    motions = link_motions(bones.axes, bones.sliding, net)
    length = TIP * LENGTH_OF_REACH * bones.reach_m
    tips = [hub + length * line.direction for hub, line in zip(bones.hubs_m, bones.axes, strict=True)]
    return np.stack([apply(motion, tip) for motion, tip in zip(motions, tips, strict=False)])


def nominal_axes(
    viewer: Viewer, root: str, lines: tuple[Line, ...], hubs_m: Array, sliding: np.ndarray, length_m: float
) -> AxesView:
    """Nominal axes: thin, grey, without labels and tubes."""
    marks = tuple(AxisMark(k + 1, line, hub) for k, (line, hub) in enumerate(zip(lines, hubs_m, strict=True)))
    return AxesView(viewer, root, marks, sliding, length_m, NOMINAL_AXIS, 0.0025)
