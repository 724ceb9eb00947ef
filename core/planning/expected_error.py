"""How far a calibrated arm is to be expected from where it is sent, by the covariance of a calibration's unknowns.

To first order the tool's error is ``G d`` for errors d of the unknowns; with the Cramer-Rao bound of d this is the best
that any unbiased estimator makes of the sightings, the arm's repeatability on the day of use not included. The tool
rides on the last frame of the phi-model, which the axes alone fix (section 4 of the paper): an error of the last two
axes moves it as well.
"""

from dataclasses import dataclass

import numpy as np

from core.arm_jacobian import ArmState, Layout, moved, predict
from core.geometry import Array, cross, invert
from core.kinematics import link_frames
from core.phi_model import frames, from_axes
from core.planning.site import Site
from core.robot import Robot

STEP = 1e-6
"""Of the central differences of the tool's frame at rest by the axes, rad or m."""
MEAN_RADIUS = float(np.sqrt(8 / np.pi))
"""Mean length of three independent normal numbers of standard deviation 1."""
DIRECTIONS = 400


@dataclass(frozen=True)
class Required:
    """Poses that matter, and how the tool's errors in them follow from errors of the unknowns."""

    commanded: Array
    """(k, n)."""
    position: Array
    """Of the tool's origin in the instrument's frame, (k, 3, p), m."""
    orientation: Array
    """Of the tool's turn, (k, 3, p), rad."""

    def loss(self, lever_m: float) -> Array:
        """The quadratic form of errors whose expectation is the mean square error over the poses, (p, p), m^2.

        Args:
            lever_m: of how long a tool the tip is judged as well; it weighs orientations.
        """
        rows = np.concatenate([self.position, lever_m * self.orientation], axis=1).reshape(-1, self.position.shape[2])
        return rows.T @ rows / len(self.commanded)


@dataclass(frozen=True)
class ExpectedError:
    """Sizes of errors to be expected over required poses."""

    mean_position_m: float
    rms_position_m: float
    worst_position_m: float
    """Root mean square of the worst pose."""
    mean_orientation_rad: float
    rms_orientation_rad: float


def required(site: Site, commanded: Array) -> Required:
    """The tool in poses (m, n) of commands that matter."""
    tool, by_unknowns = _tool_at_rest(site)
    tips = tool[:3, 3] + np.concatenate([np.zeros((1, 3)), tool[:3, :3].T])
    points, jacobian = _carried(site, commanded, tips, _tips_by_unknowns(tips, by_unknowns))
    arms, by_arms = points[:, 1:] - points[:, :1], jacobian[:, 1:] - jacobian[:, :1]
    turn = np.sum(cross(arms[..., None, :], np.swapaxes(by_arms, 2, 3)), axis=1) / 2
    return Required(commanded, jacobian[:, 0], np.swapaxes(turn, 1, 2))


def expected_error(needed: Required, covariance: Array) -> ExpectedError:
    """What a covariance of the unknowns (p, p) lets expect, for errors that are normal."""
    position = needed.position @ covariance @ np.swapaxes(needed.position, 1, 2)
    orientation = needed.orientation @ covariance @ np.swapaxes(needed.orientation, 1, 2)
    squares, turns = (np.trace(c, axis1=1, axis2=2) for c in (position, orientation))
    return ExpectedError(
        mean_position_m=float(mean_lengths(position).mean()),
        rms_position_m=float(np.sqrt(squares.mean())),
        worst_position_m=float(np.sqrt(squares.max())),
        mean_orientation_rad=float(mean_lengths(orientation).mean()),
        rms_orientation_rad=float(np.sqrt(turns.mean())),
    )


def mean_lengths(covariance: Array) -> Array:
    """Mean length of normal vectors of covariances (k, 3, 3), (k,).

    A normal vector is a length times a direction; over directions u it is the mean of sqrt(u' C u), taken here over
    points spread evenly on the sphere (a Fibonacci lattice).
    """
    k = np.arange(DIRECTIONS) + 0.5
    height, azimuth = 1 - 2 * k / DIRECTIONS, np.pi * (1 + np.sqrt(5)) * k
    level = np.sqrt(1 - height**2)
    u = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), height], axis=1)
    return MEAN_RADIUS * np.sqrt(np.maximum(np.einsum("di,kij,dj->kd", u, covariance, u), 0.0)).mean(axis=1)


def _tool_at_rest(site: Site) -> tuple[Array, Array]:
    """The tool's frame at rest, (4, 4), and its twist (angular, linear at the origin) by all unknowns, (6, p)."""
    robot = site.robot
    base, nominal = from_axes(robot.axes_at_zero(), site.convention)
    on_frame = invert(frames(nominal, np.zeros(robot.joint_count), base)[-1]) @ _tool_of(robot)
    tool = _last_frame(site, site.state) @ on_frame
    twists = np.zeros((6, site.layout.size))
    for place in site.layout.axes:
        for column in range(place.start, place.stop) if place is not None else ():
            step = np.zeros(site.layout.size)
            step[column] = STEP
            ends = [_last_frame(site, moved(site.state, site.layout, sign * step)) @ on_frame for sign in (1, -1)]
            change = (ends[0] - ends[1]) / (2 * STEP)
            twists[:3, column] = np.sum(cross(tool[:3, :3].T, change[:3, :3].T), axis=0) / 2
            twists[3:, column] = change[:3, 3] - cross(twists[:3, column], tool[:3, 3])
    return tool, twists


def _tool_of(robot: Robot) -> Array:
    return link_frames(robot, np.zeros((1, robot.joint_count)))[0, -1]


def _last_frame(site: Site, state: ArmState) -> Array:
    base, model = from_axes(state.axes, site.convention)
    return frames(model, np.zeros(len(state.axes)), base)[-1]


def _tips_by_unknowns(tips: Array, twists: Array) -> Array:
    """Derivatives of points at rest on the last link by all unknowns, (j, 3, p)."""
    turned = cross(twists[:3].T[None], tips[:, None])
    return np.swapaxes(turned + twists[3:].T, 1, 2)


def _carried(site: Site, commanded: Array, tips: Array, tips_by_unknowns: Array) -> tuple[Array, Array]:
    """Points on the last link under commands, (k, j, 3), and their derivatives by all unknowns, (k, j, 3, p)."""
    k, j, n = len(commanded), len(tips), site.robot.joint_count
    state = ArmState(site.state.axes, site.state.transmissions, site.state.couplings, tips)
    layout = Layout.of(state, site.robot.sliding, site.robot.commanded, site.coupled)
    seen = site.observations(np.repeat(commanded, j, axis=0), np.zeros(k * j, dtype=int))
    seen.target[:], seen.link[:] = np.tile(np.arange(j), k), n
    found = predict(state, seen, layout)
    own = layout.targets.start
    jacobian = np.zeros((k * j, 3, site.layout.size))
    jacobian[:, :, :own] = found.jacobian[:, :, :own]
    each = np.arange(k * j)
    turned = np.stack([found.jacobian[each, :, own + 3 * seen.target + axis] for axis in range(3)], axis=2)
    jacobian += turned @ tips_by_unknowns[seen.target]
    return found.point_m.reshape(k, j, 3), jacobian.reshape(k, j, 3, -1)
