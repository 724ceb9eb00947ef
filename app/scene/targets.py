"""Targets on their links, each on a thin stalk from the arm, so that one sees what it rides on."""

from typing import TYPE_CHECKING

import numpy as np

from app.scene.colours import GREEN, GREY, HIGHLIGHT
from app.scene.group import add_frame, add_solid
from app.scene.link_shapes import Skeleton
from app.scene.robot import RobotView
from app.scene.solids import ball, tube
from core.geometry import Array
from core.measurements import Target

if TYPE_CHECKING:
    import viser

LONGEST_NAME = 24


def foot_on_link(bones: Skeleton, link: int, point_m: Array) -> Array:
    """The point of a link's skeleton, 0..n, nearest to a point at rest, (3,)."""
    if link == 0:
        pieces = [(bones.base_m, bones.hubs_m[0])]
    elif link == len(bones.axes):
        pieces = [(bones.hubs_m[-1], bones.leaves_m[-1])]
    else:
        pieces = [
            (bones.hubs_m[link - 1], bones.leaves_m[link - 1]),
            (bones.leaves_m[link - 1], bones.hubs_m[link]),
        ]
    feet = np.array([_nearest(start, end, point_m) for start, end in pieces])
    return feet[np.argmin(np.linalg.norm(feet - point_m, axis=1))]


def _nearest(start: Array, end: Array, point: Array) -> Array:
    way = end - start
    share = (point - start) @ way / max(float(way @ way), 1e-12)
    return start + np.clip(share, 0.0, 1.0) * way


class TargetsView:
    """Nodes ``robot.root/linkK/targetI`` with ``ball``, ``stalk`` and ``label``; they move with the arm."""

    def __init__(
        self,
        scene: "viser.SceneApi",
        robot: RobotView,
        targets: tuple[Target, ...],
        rest_points_m: Array,
        radius_m: float = 0.014,
    ) -> None:
        """Draw targets at their places with all joints at zero, (t, 3); NaN: its place is not known, left out."""
        self._scene, self._radius = scene, radius_m
        self._balls: dict[int, tuple[str, viser.MeshHandle]] = {}
        self._labels: list[viser.LabelHandle] = []
        for k, (target, point) in enumerate(zip(targets, np.asarray(rest_points_m, dtype=float), strict=True)):
            if np.isfinite(point).all():
                self._draw(k, target, point, robot)

    def highlight(self, index: int | None) -> None:
        """Draw one target, by its index, in the colour of attention; None: none."""
        for k, (name, _) in list(self._balls.items()):
            colour, radius = (HIGHLIGHT, 1.5 * self._radius) if k == index else (GREEN, self._radius)
            self._balls[k] = (name, add_solid(self._scene, name, ball(np.zeros(3), radius), colour))

    @property
    def labels_visible(self) -> bool:
        return all(label.visible for label in self._labels)

    @labels_visible.setter
    def labels_visible(self, visible: bool) -> None:
        for label in self._labels:
            label.visible = visible

    def _draw(self, k: int, target: Target, point: Array, robot: RobotView) -> None:
        root = f"{robot.link_node(target.link)}/target{k}"
        add_frame(self._scene, root, point - robot.origin_m(target.link))
        name = f"{root}/ball"
        self._balls[k] = (name, add_solid(self._scene, name, ball(np.zeros(3), self._radius), GREEN))
        foot = foot_on_link(robot.bones, target.link, point) - point
        if np.linalg.norm(foot) > self._radius:
            add_solid(self._scene, f"{root}/stalk", tube(foot, np.zeros(3), 0.007, 0.004, 8), GREY)
        text = target.name if len(target.name) <= LONGEST_NAME else f"{target.name[: LONGEST_NAME - 1]}…"
        above = (0.0, 0.0, 1.4 * self._radius)
        self._labels.append(
            self._scene.add_label(f"{root}/label", text, position=above, anchor="bottom-center", font_screen_scale=0.95)
        )
