"""The parallelogram that lets a motor in the base drive a joint further out, as on the ASEA IRB L6.

Where the design couples joint i + 1 to joint i with gain -1 and both axes are parallel, a crank turns about axis i
beside the arm and a rod, parallel to the link between both axes, hands its turn on to a lever of the same length on the
next link. The crank keeps the angle of that link, whatever joint i does.
"""

from dataclasses import dataclass

import numpy as np

from app.scene.link_shapes import Skeleton
from app.scene.solids import Solid, barrel, capsule, merged
from core.geometry import Array, Line, cross, joint_motion, transform
from core.robot import Coupling


@dataclass(frozen=True)
class Linkage:
    """One parallelogram at rest, in the frame of the axes."""

    source: int
    """The joint whose axis carries the crank, 1..n-1; the lever is on link ``source + 1``."""
    axes: tuple[Line, ...]
    lever_m: Array
    """From an axis to the pin of its crank or lever, at rest, (3,)."""
    crank_m: Array
    """Where the crank sits on its axis, (3,)."""
    elbow_m: Array
    """Where the lever sits on the next axis, (3,)."""
    radius_m: float

    @property
    def same_sense(self) -> float:
        """+1 where both axes point the same way, -1 where they point against each other."""
        first, second = self.axes[self.source - 1], self.axes[self.source]
        return float(np.sign(first.direction @ second.direction))

    def crank(self) -> Solid:
        """Moves by ``crank_motion``."""
        return self._arm(self.crank_m, self.axes[self.source - 1].direction)

    def lever(self) -> Solid:
        """Rides on link ``source + 1``."""
        return self._arm(self.elbow_m, self.axes[self.source].direction)

    def rod(self) -> Solid:
        """Moves by ``rod_motion``."""
        start, end = self.crank_m + self.lever_m, self.elbow_m + self.lever_m
        return capsule(start, end, 0.55 * self.radius_m, 0.55 * self.radius_m)

    def crank_motion(self, motions: Array, net: Array) -> Array:
        """How the crank has moved, (4, 4), from the motions of links 0..n, (n + 1, 4, 4), and net displacements."""
        i = self.source - 1
        angle = net[i] + self.same_sense * net[i + 1]
        return motions[i] @ joint_motion(self.axes[i], angle, sliding=False)

    def rod_motion(self, motions: Array, net: Array) -> Array:
        """How the rod has moved, (4, 4): it stays parallel to its link and hangs on the crank's pin."""
        along, crank = motions[self.source], self.crank_motion(motions, net)
        pin = self.crank_m + self.lever_m
        hung = crank[:3, :3] @ pin + crank[:3, 3]
        return transform(along[:3, :3], hung - along[:3, :3] @ pin)

    def _arm(self, at: Array, direction: Array) -> Solid:
        r = self.radius_m
        parts = [capsule(at, at + self.lever_m, r, 0.85 * r), barrel(at + self.lever_m, direction, 0.8 * r, 2.6 * r)]
        return merged([*parts, barrel(at, direction, 1.5 * r, 2.0 * r)])


def linkages(bones: Skeleton, couplings: tuple[Coupling, ...]) -> tuple[Linkage, ...]:
    """The parallelograms that a design's couplings speak of."""
    return tuple(_linkage(bones, c.source) for c in couplings if _is_parallelogram(bones, c))


def _is_parallelogram(bones: Skeleton, coupling: Coupling) -> bool:
    i = coupling.source - 1
    first, second = bones.axes[i], bones.axes[i + 1]
    cosine = float(first.direction @ second.direction)
    far = np.linalg.norm(bones.hubs_m[i + 1] - bones.leaves_m[i]) > 0.1 * bones.reach_m
    turning = not (bones.sliding[i] or bones.sliding[i + 1])
    return bool(turning and far and abs(cosine) > 0.98 and abs(coupling.gain + np.sign(cosine)) < 0.1)


def _linkage(bones: Skeleton, source: int) -> Linkage:
    i = source - 1
    axis, radius = bones.axes[i].direction, bones.radius_m(source + 1)
    link = bones.hubs_m[i + 1] - bones.hubs_m[i]
    # Odd ones on one side of the arm, even ones on the other, so that two in a row do not meet.
    side = (1.0 if source % 2 == 0 else -1.0) * 1.55 * radius * axis
    size = float(np.clip(0.20 * np.linalg.norm(link), 0.9 * radius, 2.2 * radius))
    return Linkage(
        source,
        bones.axes,
        size * _lever_direction(bones, i, link),
        bones.hubs_m[i] + side,
        bones.hubs_m[i + 1] + side,
        0.42 * radius,
    )


def _lever_direction(bones: Skeleton, i: int, link: Array) -> Array:
    """Away from where the next link goes, unless that is along this one; then square to this one."""
    axis = bones.axes[i].direction
    square = cross(axis, link / np.linalg.norm(link))
    ahead = [p - bones.hubs_m[i + 1] for p in (*bones.hubs_m[i + 2 :], bones.tool_m)]
    following = next((w for w in ahead if np.linalg.norm(w) > 0.1 * bones.reach_m), square)
    back = -following + (following @ axis) * axis
    back = back / max(float(np.linalg.norm(back)), 1e-9)
    if np.linalg.norm(cross(back, link / np.linalg.norm(link))) > 0.5:
        return back
    return square * (1.0 if square[2] >= 0 else -1.0)
