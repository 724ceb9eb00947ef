"""Which targets a plan may count on: in the field of every station, and not behind the arm itself.

The arm is taken as rods from joint to joint (``Site.skeleton_m``), with a radius. A sight is blocked where the line
from station to target comes nearer to a rod than its radius. Next to the target the line is not looked at for one
radius, so that a target may sit on the surface of its own link, on the side that faces the station. Targets are seen
from all sides (spheres); clamps, cables, fixtures and the floor are the operator's to know.
"""

import numpy as np

from core.geometry import Array
from core.planning.site import Site

GRAZING = 0.95
"""Of a rod's radius: a line that just touches is not blocked."""


def visible(site: Site, commanded: Array, target: np.ndarray) -> np.ndarray:
    """Which sightings of targets (m,) under commands (m, n) every station has, boolean, (m,)."""
    net = site.net(commanded)
    points = site.carried(net, site.links[target], site.state.rest_points_m[target])
    seen = site.sight.in_field(points)
    if not site.sight.stations:
        return seen
    joints = _joints(site, net)
    for station in site.sight.stations:
        rows = np.flatnonzero(seen)
        seen[rows] = ~_blocked(site, station.position_m, points[rows], joints[rows])
    return seen


def within_limits(site: Site, commanded: Array) -> np.ndarray:
    """Which commands (m, n) every joint may be given, boolean, (m,)."""
    low, high = site.limits.T
    return ((commanded >= low - 1e-9) & (commanded <= high + 1e-9)).all(axis=1)


def segment_distance(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Shortest distance between segments a-b and c-d, each (..., 3): Ericson, Real-Time Collision Detection, 5.1.9."""
    u, v, w = b - a, d - c, a - c
    uu, vv, uv = np.sum(u * u, axis=-1), np.sum(v * v, axis=-1), np.sum(u * v, axis=-1)
    uw, vw = np.sum(u * w, axis=-1), np.sum(v * w, axis=-1)
    tiny = 1e-18
    square = uu * vv - uv**2
    s = np.where(square > tiny, np.clip((uv * vw - vv * uw) / np.where(square > tiny, square, 1.0), 0.0, 1.0), 0.0)
    t = np.clip(np.where(vv > tiny, (uv * s + vw) / np.where(vv > tiny, vv, 1.0), 0.0), 0.0, 1.0)
    s = np.clip(np.where(uu > tiny, (t * uv - uw) / np.where(uu > tiny, uu, 1.0), 0.0), 0.0, 1.0)
    return np.linalg.norm(w + s[..., None] * u - t[..., None] * v, axis=-1)


def _joints(site: Site, net: Array) -> Array:
    """Joints and tool for net displacements, (m, n + 1, 3): joint k rides on link k - 1, the tool on the last."""
    m, n = net.shape
    link = np.tile(np.arange(n + 1), m)
    points = site.carried(np.repeat(net, n + 1, axis=0), link, np.tile(site.skeleton_m, (m, 1)))
    return points.reshape(m, n + 1, 3)


def _blocked(site: Site, station: Array, points: Array, joints: Array) -> np.ndarray:
    n = joints.shape[1] - 1
    radius = np.full(n, site.body.radius_m)
    radius[-1] = site.body.tool_radius_m
    sight = station - points
    sight /= np.linalg.norm(sight, axis=1)[:, None]
    near = points[:, None, :] + radius[None, :, None] * sight[:, None, :]
    far = np.broadcast_to(station, near.shape)
    return (segment_distance(near, far, joints[:, :-1], joints[:, 1:]) < GRAZING * radius).any(axis=1)
