"""An arm in a scene, drawn as an arm; to move it, only its links' frames are sent."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from app.scene.colours import ARM, Rgb, shaded
from app.scene.group import SceneGroup, Viewer, add_frame, add_solid
from app.scene.link_shapes import Skeleton, link_shapes, skeleton
from app.scene.linkage import linkages
from app.scene.poses import link_motions, pose_of
from app.scene.solids import Solid
from core.geometry import Array, Line
from core.robot import Coupling

if TYPE_CHECKING:
    import viser


class RobotView(SceneGroup):
    """One arm: nodes ``root/link0`` .. ``root/linkN`` (frames that move) with ``body`` and ``joint`` in each.

    The node of a link stands where the link's joint is met; at rest it is not turned. A point p that rides on link k
    is drawn at its place when ``p - origin(k)`` is given in that node.
    """

    def __init__(
        self,
        viewer: Viewer,
        root: str,
        axes: tuple[Line, ...],
        sliding: np.ndarray,
        colour: Rgb = ARM,
        opacity: float | None = None,
        *,
        couplings: tuple[Coupling, ...] = (),
        floor_m: float | None = None,
        tool_m: Array | None = None,
        swell_m: float = 0.0,
    ) -> None:
        """Draw an arm with all joints at zero.

        Args:
            viewer: whose scene it is drawn in.
            root: name of the node that holds it all, ``/calibrated``.
            axes: joint axes at zero displacement, in the instrument's frame.
            sliding: which joints slide, boolean, (n,).
            colour: of the links; joints are darker.
            opacity: 0..1; None: solid.
            couplings: of the design; those of a parallelogram are drawn as one.
            floor_m: height of the floor; None: below the arm by a fitting distance.
            tool_m: the tool's point with all joints at zero, (3,).
            swell_m: added to all radii: a ghost must not flicker with the arm that it surrounds.
        """
        super().__init__(viewer, root)
        self.axes, self.sliding = tuple(axes), np.asarray(sliding, dtype=bool)
        self.bones: Skeleton = skeleton(self.axes, self.sliding, floor_m, tool_m)
        self.linkages = linkages(self.bones, couplings)
        self.net = np.zeros(len(self.axes))
        self._opacity = opacity
        self._origins = np.vstack([self.bones.base_m, self.bones.hubs_m])
        self._links = [self._frame(f"{root}/link{k}", origin) for k, origin in enumerate(self._origins)]
        self._pieces: list[viser.MeshHandle] = []
        self._draw_links(colour, swell_m)
        self._cranks, self._rods = [], []
        self._draw_linkages(shaded(colour, 0.62))

    def show(self, net: ArrayLike) -> None:
        """Move the arm to net displacements, rad or m, (n,).

        Raises:
            ValueError: there is not one finite displacement for each joint.
        """
        motions = link_motions(self.axes, self.sliding, net)
        self.net = np.array(net, dtype=float)
        with self._together():
            for node, motion, origin in zip(self._links, motions, self._origins, strict=True):
                self._put(node, motion, origin)
            for linkage, crank, rod in zip(self.linkages, self._cranks, self._rods, strict=True):
                self._put(crank, linkage.crank_motion(motions, self.net), linkage.crank_m)
                self._put(rod, linkage.rod_motion(motions, self.net), linkage.crank_m)

    @property
    def opacity(self) -> float | None:
        """0..1, None: solid."""
        return self._opacity

    @opacity.setter
    def opacity(self, opacity: float | None) -> None:
        self._opacity = opacity
        with self._together():
            for piece in self._pieces:
                piece.opacity = opacity

    def link_node(self, link: int) -> str:
        """Name of the node that moves with a link, 0..n."""
        return f"{self._root}/link{link}"

    def origin_m(self, link: int) -> Array:
        """Where the node of a link, 0..n, stands with all joints at zero, (3,)."""
        return self._origins[link]

    def tool_m(self) -> Array:
        """Where the tool's point is now, (3,)."""
        motion = link_motions(self.axes, self.sliding, self.net)[-1]
        return motion[:3, :3] @ self.bones.tool_m + motion[:3, 3]

    def _frame(self, name: str, position: Array) -> "viser.FrameHandle":
        return add_frame(self._scene, name, position)

    def _draw_links(self, colour: Rgb, swell_m: float) -> None:
        for k, shape in enumerate(link_shapes(self.bones, swell_m)):
            self._add(f"{self.link_node(k)}/body", shape.body.about(self._origins[k]), colour)
            self._add(f"{self.link_node(k)}/joint", shape.joint.about(self._origins[k]), shaded(colour, 0.6))

    def _draw_linkages(self, colour: Rgb) -> None:
        for linkage in self.linkages:
            i, at = linkage.source, linkage.crank_m
            self._cranks.append(self._frame(f"{self._root}/crank{i}", at))
            self._rods.append(self._frame(f"{self._root}/rod{i}", at))
            self._add(f"{self._root}/crank{i}/body", linkage.crank().about(at), colour)
            self._add(f"{self._root}/rod{i}/body", linkage.rod().about(at), colour)
            self._add(f"{self.link_node(i + 1)}/lever", linkage.lever().about(self._origins[i + 1]), colour)

    def _add(self, name: str, solid: Solid, colour: Rgb) -> None:
        if len(solid.faces) > 0:
            self._pieces.append(add_solid(self._scene, name, solid, colour, self._opacity))

    @staticmethod
    def _put(node: "viser.FrameHandle", motion: Array, origin_m: Array) -> None:
        pose = pose_of(motion, origin_m)
        node.position, node.wxyz = pose.position_m, pose.wxyz
