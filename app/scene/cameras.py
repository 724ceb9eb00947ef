"""Views worth having: everything, the arm, each joint, the tool, through each instrument; and the flight to one."""

import threading
import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from app.scene.axes import axis_tips
from app.scene.link_shapes import Skeleton
from app.scene.picture import UP, picture_directions
from app.scene.poses import link_motions
from app.scene.stations import Station
from core.geometry import Array, apply, cross

if TYPE_CHECKING:
    import viser

FIELD_OF_VIEW_RAD = 0.75
"""Upright; a long lens, because wide ones make lengths look wrong."""
WIDTH_OF_HEIGHT = 0.75
"""How wide the picture is, as a share of its height: between the panels of a screen of 1440 x 860, roughly."""
FRAMES_A_SECOND = 25


@dataclass(frozen=True)
class Camera:
    """A view."""

    name: str
    position_m: Array
    look_at_m: Array
    up: Array
    field_of_view_rad: float = FIELD_OF_VIEW_RAD
    stays: bool = False
    """Whether the eye is where it must be, as behind a telescope."""

    def __post_init__(self) -> None:
        for value in (self.position_m, self.look_at_m, self.up):
            if np.shape(value) != (3,) or not np.isfinite(value).all():
                raise ValueError(f"a camera needs three points or directions of three finite numbers, got {value}")
        if np.linalg.norm(self.look_at_m - self.position_m) < 1e-9:
            raise ValueError("a camera cannot look at the point where it stands")

    def fitting(self, width_of_height: float) -> "Camera":
        """The same view where the picture is narrower than views are made for: from further away, or with a wider
        lens."""
        more = max(WIDTH_OF_HEIGHT / max(width_of_height, 0.1), 1.0)
        if self.stays:
            return replace(self, field_of_view_rad=2.0 * np.arctan(more * np.tan(self.field_of_view_rad / 2)))
        return replace(self, position_m=self.look_at_m + more * (self.position_m - self.look_at_m))


def presets(
    bones: Skeleton,
    net: ArrayLike,
    stations: tuple[Station, ...] = (),
    floor_m: float | None = None,
    extremes: tuple[ArrayLike, ...] = (),
) -> tuple[Camera, ...]:
    """``All``, ``Arm``, ``Joint 1``.., ``Tool`` and the name of each station.

    Args:
        bones: of the arm.
        net: net displacements of its joints, (n,).
        stations: of the instrument.
        floor_m: height of the floor.
        extremes: other net displacements, (n,) each, at which the whole arm is to be seen too.
    """
    joints, tool = _spots(bones, net)
    # Links and levers stand out from the skeleton, and labels from them.
    thick = 0.11 * bones.reach_m
    elsewhere = [p for other in extremes for p in _spots(bones, other)]
    arm = np.vstack([p + sign * thick for p in (bones.base_m, joints, tool) for sign in (-1, 1)] + elsewhere)
    spots = [station.position_m for station in stations]
    feet = [np.array([p[0], p[1], p[2] if floor_m is None else floor_m]) for p in spots]
    side = viewing_direction(joints, tool, spots)
    close = 0.32 * bones.reach_m
    return (
        around("All", np.vstack([arm, *spots, *feet]), side + 0.25 * UP, 1.2),
        around("Arm", np.vstack([arm, axis_tips(bones, net)]), side, 1.1),
        *(near(f"Joint {k}", point, side, close) for k, point in enumerate(joints, 1)),
        near("Tool", tool, side, close),
        *(through(station, arm) for station in stations if np.linalg.norm(arm.mean(axis=0) - station.position_m) > 0.2),
    )


def _spots(bones: Skeleton, net: ArrayLike) -> tuple[Array, Array]:
    """Where joints, (n, 3), and tool, (3,), are at net displacements, (n,)."""
    motions = link_motions(bones.axes, bones.sliding, net)
    joints = np.stack([apply(motions[i], hub) for i, hub in enumerate(bones.hubs_m)])
    return joints, apply(motions[-1], bones.tool_m)


def viewing_direction(joints_m: Array, tool_m: Array, stations_m: list[Array]) -> Array:
    """From the arm to the eye: square to where the arm points, on the side of the instruments, from above; unit."""
    ahead = (tool_m - joints_m[0]) * [1.0, 1.0, 0.0]
    if np.linalg.norm(ahead) < 1e-3:
        ahead = np.array([1.0, 0.0, 0.0])
    ahead = ahead / np.linalg.norm(ahead)
    side = cross(ahead, UP)
    if stations_m and (np.mean(stations_m, axis=0) - joints_m[0]) @ side < 0:
        side = -side
    direction = side + 0.45 * ahead + 0.38 * UP
    return direction / np.linalg.norm(direction)


def around(name: str, points_m: Array, direction: Array, margin: float = 1.0) -> Camera:
    """A view from a direction that holds all points, (m, 3)."""
    away = direction / np.linalg.norm(direction)
    middle = (points_m.min(axis=0) + points_m.max(axis=0)) / 2
    right, over = picture_directions(away)
    offsets = points_m - middle
    size = np.maximum(np.abs(offsets @ over), np.abs(offsets @ right) / WIDTH_OF_HEIGHT)
    distance = np.max(margin * size / np.tan(FIELD_OF_VIEW_RAD / 2) + offsets @ away)
    return Camera(name, middle + max(float(distance), 0.3) * away, middle, UP)


def near(name: str, point_m: Array, direction: Array, size_m: float) -> Camera:
    """A view of what is within ``size_m`` of a point."""
    distance = size_m / np.tan(FIELD_OF_VIEW_RAD / 2)
    return Camera(name, point_m + distance * direction / np.linalg.norm(direction), point_m, UP)


def through(station: Station, points_m: Array) -> Camera:
    """What a station sees of points, (m, 3): from where its axes meet, only as wide as it must be."""
    eye = np.asarray(station.position_m, dtype=float)
    middle = (points_m.min(axis=0) + points_m.max(axis=0)) / 2
    way = middle - eye
    distance = float(np.linalg.norm(way))
    radius = float(np.linalg.norm(points_m - middle, axis=1).max())
    view = 2.0 * np.arctan(1.1 * radius / distance)
    # Just ahead of the telescope, which would otherwise fill the picture.
    return Camera(station.name, eye + 0.25 * way / distance, middle, UP, float(np.clip(view, 0.15, 1.4)), stays=True)


def between(start: Camera, end: Camera, share: float) -> Camera:
    """The view on the way from one to another, share 0..1, easing in and out; it swings rather than cuts through."""
    s = float(np.clip(share, 0.0, 1.0))
    s = s * s * (3.0 - 2.0 * s)
    look = (1 - s) * start.look_at_m + s * end.look_at_m
    offsets = [c.position_m - c.look_at_m for c in (start, end)]
    sizes = [float(np.linalg.norm(o)) for o in offsets]
    direction = (1 - s) * offsets[0] / sizes[0] + s * offsets[1] / sizes[1]
    norm = float(np.linalg.norm(direction))
    direction = offsets[1] / sizes[1] if norm < 0.05 else direction / norm
    size = sizes[0] ** (1 - s) * sizes[1] ** s
    view = (1 - s) * start.field_of_view_rad + s * end.field_of_view_rad
    up = (1 - s) * start.up + s * end.up
    up = end.up if np.linalg.norm(up) < 1e-6 else up / np.linalg.norm(up)
    return Camera(end.name, look + size * direction, look, up, view)


def fly_to(client: "viser.ClientHandle", camera: Camera, seconds: float = 0.6) -> None:
    """Bring a client's camera to a view, in a flight of some seconds (0: at once); call it from a worker thread.

    The view is fitted to the client's picture.
    """
    start = _now(client)
    camera = camera if start is None else camera.fitting(client.camera.aspect)
    steps = 0 if start is None else int(seconds * FRAMES_A_SECOND)
    began = time.monotonic()
    for k in range(1, steps):
        _set(client, between(start, camera, k / steps))
        time.sleep(max(0.0, began + k * seconds / steps - time.monotonic()))
    _set(client, camera)


def fit_once(client: "viser.ClientHandle", first: Camera, starts_m: ArrayLike) -> None:
    """Bring a new browser to its first view as soon as its panels leave the picture its width.

    ``starts_m`` is where browsers begin to look from, (3,); a view that somebody has moved since is left alone.
    """
    whole, fitted = client.camera.aspect, threading.Event()

    def changed(camera: "viser.CameraHandle") -> None:
        if camera.aspect == whole or fitted.is_set():
            return
        fitted.set()
        if np.allclose(camera.position, starts_m, atol=1e-3):
            fly_to(client, first, seconds=0.0)

    client.camera.on_update(changed)


def _now(client: "viser.ClientHandle") -> Camera | None:
    """The view that a client has; None before its browser has told."""
    try:
        eye = client.camera
        return Camera("now", eye.position.copy(), eye.look_at.copy(), eye.up_direction.copy(), float(eye.fov))
    except (AssertionError, ValueError):
        return None


def _set(client: "viser.ClientHandle", camera: Camera) -> None:
    with client.atomic():
        client.camera.up_direction = camera.up
        client.camera.position = camera.position_m
        client.camera.look_at = camera.look_at_m
        client.camera.fov = camera.field_of_view_rad
