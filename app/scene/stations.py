"""Instrument stations on their tripods, and sight lines to what they look at."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from app.scene.colours import GREY, INSTRUMENT, SIGHT_LINE, shaded
from app.scene.group import SceneGroup, Viewer, add_frame, add_solid
from app.scene.solids import Solid, barrel, merged, tube
from core.geometry import Array

if TYPE_CHECKING:
    import viser


@dataclass(frozen=True)
class Station:
    """One instrument."""

    name: str
    position_m: Array
    """Where its axes meet, (3,)."""


def tripod(height_m: float) -> Solid:
    """Three legs and a plate for a head at the origin, the floor ``height_m`` below."""
    plate_z = -0.16
    turns = np.deg2rad([90.0, 210.0, 330.0])
    spread = 0.38 * max(height_m, 0.3)
    legs = [
        tube([0.05 * c, 0.05 * s, plate_z], [spread * c, spread * s, -height_m], 0.020, 0.012, 10)
        for c, s in zip(np.cos(turns), np.sin(turns), strict=True)
    ]
    return merged([*legs, tube([0, 0, plate_z - 0.03], [0, 0, plate_z], 0.085, 0.085)])


def alidade() -> Solid:
    """The part that turns about the upright axis: foot and two standards."""
    foot = tube([0, 0, -0.16], [0, 0, -0.10], 0.075, 0.065)
    standards = [tube([side, 0, -0.11], [side, 0, 0.05], 0.032, 0.026) for side in (-0.062, 0.062)]
    return merged([foot, *standards])


def telescope() -> Solid:
    """The part that also turns about the level axis; it looks along +y."""
    axle = barrel([0, 0, 0], [1.0, 0, 0], 0.026, 0.15)
    return merged(
        [tube([0, -0.08, 0], [0, 0.02, 0], 0.022, 0.032), tube([0, 0.02, 0], [0, 0.12, 0], 0.032, 0.042), axle]
    )


def aiming(position_m: ArrayLike, point_m: ArrayLike) -> tuple[Array, Array]:
    """Quaternions of alidade and telescope (within the alidade) of a station that looks at a point, (4,) each."""
    x, y, z = np.asarray(point_m, dtype=float) - np.asarray(position_m, dtype=float)
    level = np.hypot(x, y)
    heading = 0.0 if level < 1e-9 else -np.arctan2(x, y)
    turn = Rotation.from_euler("z", heading).as_quat(scalar_first=True)
    return turn, Rotation.from_euler("x", np.arctan2(z, level)).as_quat(scalar_first=True)


class StationsView(SceneGroup):
    """Nodes ``root/0``, ``root/1``.. with ``tripod``, ``head``, ``head/telescope``, ``label``, and ``root/sights``."""

    def __init__(self, viewer: Viewer, stations: tuple[Station, ...], floor_m: float, root: str = "/stations") -> None:
        super().__init__(viewer, root)
        self._stations = stations
        self._heads = [self._station(k, station, floor_m) for k, station in enumerate(stations)]
        self._sights: viser.LineSegmentsHandle | None = None

    def aim(self, point_m: ArrayLike | None) -> None:
        """Turn all stations to a point, (3,), and draw their sight lines; None: no lines."""
        if self._sights is not None:
            self._sights.visible = point_m is not None
        if point_m is None or not self._stations:
            return
        point = np.asarray(point_m, dtype=float)
        lines = np.array([[station.position_m, point] for station in self._stations])
        with self._together():
            for station, (head, scope) in zip(self._stations, self._heads, strict=True):
                head.wxyz, scope.wxyz = aiming(station.position_m, point)
            if self._sights is None:
                self._sights = self._scene.add_line_segments(
                    f"{self._root}/sights", lines, SIGHT_LINE, thickness=1.6, thickness_units="screen"
                )
            else:
                self._sights.points = lines.astype(np.float32)

    def _station(self, k: int, station: Station, floor_m: float) -> tuple["viser.FrameHandle", "viser.FrameHandle"]:
        root = f"{self._root}/{k}"
        add_frame(self._scene, root, station.position_m)
        add_solid(self._scene, f"{root}/tripod", tripod(max(float(station.position_m[2]) - floor_m, 0.25)), GREY)
        head = add_frame(self._scene, f"{root}/head")
        add_solid(self._scene, f"{root}/head/body", alidade(), INSTRUMENT)
        scope = add_frame(self._scene, f"{root}/head/telescope")
        add_solid(self._scene, f"{root}/head/telescope/body", telescope(), shaded(GREY, 0.5))
        self._scene.add_label(f"{root}/label", station.name[:32], position=(0, 0, 0.14), anchor="bottom-center")
        return head, scope
