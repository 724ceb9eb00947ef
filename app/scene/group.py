"""What is drawn under one node, and shown, hidden and removed as one; and solids as meshes without shadows."""

from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from app.scene.colours import Rgb
from app.scene.solids import Solid

if TYPE_CHECKING:
    import viser

Viewer: TypeAlias = "viser.ViserServer | viser.ClientHandle"
"""Whose scene is drawn in: that of all browsers, or that of one."""


class SceneGroup:
    """A node ``root`` that holds all that its subclass draws."""

    def __init__(self, viewer: Viewer, root: str) -> None:
        self._viewer, self._scene, self._root = viewer, viewer.scene, root
        self._top = self._scene.add_frame(root, show_axes=False)

    @property
    def visible(self) -> bool:
        return self._top.visible

    @visible.setter
    def visible(self, visible: bool) -> None:
        self._top.visible = visible

    def _together(self) -> AbstractContextManager[None]:
        """What is sent within reaches the browsers at once, so that no half-moved arm is ever seen."""
        return self._viewer.atomic()

    def remove(self) -> None:
        """Take all of it out of the scene."""
        self._top.remove()


def add_frame(scene: "viser.SceneApi", name: str, position_m: ArrayLike = (0.0, 0.0, 0.0)) -> "viser.FrameHandle":
    """A node without a shape of its own, for others to ride on, not turned.

    A node that is taken away and made again at once keeps its old pose in the browsers, unless the new one is said; and
    viser does not say what is as it always is at first. So the frame is turned and shifted there and back.
    """
    place = np.asarray(position_m, dtype=float)
    frame = scene.add_frame(name, show_axes=False, wxyz=(0.0, 1.0, 0.0, 0.0), position=place + 1.0)
    frame.wxyz, frame.position = (1.0, 0.0, 0.0, 0.0), place
    return frame


def add_solid(
    scene: "viser.SceneApi",
    name: str,
    solid: Solid,
    colour: Rgb,
    opacity: float | None = None,
    *,
    side: Literal["front", "double"] = "front",
    visible: bool = True,
) -> "viser.MeshHandle":
    """Draw a solid as the node of this name, which it replaces; ``opacity`` 0..1, None: opaque."""
    return scene.add_mesh_simple(
        name,
        solid.vertices_m,
        solid.faces,
        color=colour,
        opacity=opacity,
        side=side,
        visible=visible,
        # Shadows cost software renderers more than all the rest.
        cast_shadow=False,
        receive_shadow=False,
    )
