"""Where else a target may sit: on a bar at the last link, farther from its axis than the targets that are there."""

import numpy as np

from core.arm import turn
from core.errors import InputError
from core.estimate import axis_basis
from core.geometry import Array, Line, apply, invert
from core.kinematics import link_frames
from core.measurements import Target
from core.phi_model import frames, from_axes
from core.planning.site import Site

PLACES = 2
"""Opposite to each other."""
FARTHEST_M = 5.0
ON_AXIS_M = 1e-3
"""A point this near to an axis points nowhere."""


def with_bar(site: Site, radius_m: float) -> Site:
    """The same site with targets to choose from at both ends of a bar across the axis of the last joint.

    The bar points to where the first target of the last link sits and lies at its height along the axis.

    Args:
        radius_m: half the bar, from the axis to a target.

    Raises:
        InputError: the radius is not a length that a bar may have, or the last joint slides.
    """
    n = site.robot.joint_count
    if not 0 < radius_m <= FARTHEST_M:
        raise InputError(f"a bar of {radius_m * 1e3:g} mm, expected more than 0 and at most {FARTHEST_M * 1e3:g} mm")
    if site.robot.sliding[n - 1]:
        raise InputError("a bar stands across the axis of a last joint that turns, and this one slides")
    line, end = site.state.axes[n - 1], site.skeleton_m[n]
    there = [k for k in np.flatnonzero(site.placed) if site.links[k] == n]
    point = site.state.rest_points_m[there[0]] if there else end
    first = line.foot_of(point) + radius_m * _across(line, point)
    places = turn(line, np.arange(PLACES) * 2 * np.pi / PLACES, np.tile(first, (PLACES, 1)))
    names = {target.name for target in site.targets}
    free = [name for k in range(1, len(names) + PLACES + 1) if (name := f"bar{k}") not in names]
    added = tuple(Target(name, n) for name in free[:PLACES])
    return site.with_targets((*site.targets, *added), np.vstack([site.state.rest_points_m, places]))


def places_on_links(site: Site) -> np.ndarray:
    """Each target in the frame of its link, (t, 3), m; NaN where not known, as measured where it stands on the floor.

    Every drawn link frame keeps its place in the phi-frame of its joint, as in a calibrated arm.
    """
    robot = site.robot
    zero = np.zeros(robot.joint_count)
    base, nominal = from_axes(robot.axes_at_zero(), site.convention)
    real, model = from_axes(site.state.axes, site.convention)
    own = link_frames(robot, zero[None])[0, :-1]
    at_rest = frames(model, zero, real) @ invert(frames(nominal, zero, base)) @ own
    on_link = apply(invert(at_rest)[np.maximum(site.links, 1) - 1], site.state.rest_points_m)
    return np.where((site.links > 0)[:, None], on_link, site.state.rest_points_m)


def _across(line: Line, point_m: Array) -> Array:
    """Unit vector from a line to a point; any one across the line where the point lies on it."""
    out = point_m - line.foot_of(point_m)
    if np.linalg.norm(out) < ON_AXIS_M:
        out = axis_basis(line.direction)[0]
    return out / np.linalg.norm(out)
