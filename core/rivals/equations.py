"""The aggregate model: what is measured of an arm as a whole, against what all its parameters say, with the Jacobian.

    measured - predicted = J (parameters - estimate) + noise

The parameters are tilts and shifts of every joint axis (four each, two where a joint slides), constants of drive
functions, and where the watched thing sits on the last link: three for each target where positions are measured, six
for a body whose pose is measured. Axes at rest with local deviations are the product of exponentials in its minimal
form (Okamura and Park, "Kinematic calibration using the product of exponentials formula", Robotica 14, 1996): a model
that is complete, has no parameter too many, and changes continuously with the arm, parallel axes or not, as
calibration needs it (Mooring, Roth and Driels, Fundamentals of Manipulator Calibration, Wiley 1991).

Equations are whitened: each has a noise of standard deviation 1.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace

import numpy as np

from core.arm_jacobian import ArmState, Layout, Observations, moved, predict
from core.geometry import Array
from core.measurements import Campaign
from core.rivals.markers import frames_of, marker_moves, markers
from core.rivals.rotation_charts import inverse_right_jacobian, left_jacobian
from core.rotations import rotations_of_vectors, vectors_of_rotations


@dataclass(frozen=True)
class Evaluated:
    """The equations at one state."""

    residual: Array
    """Measured less predicted, (e,)."""
    jacobian: Array
    """Of what is predicted, by local deviations: axes, functions, attachment, (e, size)."""


class Equations(ABC):
    """What was measured of an arm."""

    layout: Layout
    whitener: Array
    """Of each standstill: its transpose times itself is the inverse of the covariance, (count, e, e)."""

    @property
    @abstractmethod
    def count(self) -> int:
        """How many standstills give equations."""

    @property
    @abstractmethod
    def attachment(self) -> int:
        """How many parameters say where the watched thing sits."""

    @property
    def size(self) -> int:
        """Number of parameters."""
        return self.layout.targets.start + self.attachment

    @property
    def axes(self) -> slice:
        """The parameters that are deviations of axes."""
        return slice(0, sum(place.stop - place.start for place in self.layout.axes if place is not None))

    @property
    def functions(self) -> slice:
        """The parameters that are constants of drive functions."""
        return slice(self.axes.stop, self.layout.targets.start)

    @abstractmethod
    def evaluate(self, state: ArmState) -> Evaluated:
        """Residuals and Jacobian."""

    @abstractmethod
    def attached(self, rest_points_m: Array, change: Array) -> Array:
        """What is watched, at rest, after a change of where it sits, (t, 3)."""

    @abstractmethod
    def by_attachment(self, change: Array) -> Array:
        """Derivative of local deviations by a change that is not small, (attachment, attachment)."""

    @abstractmethod
    def part(self, standstills: slice) -> "Equations":
        """The equations of some standstills."""

    def moved(self, state: ArmState, step: Array) -> ArmState:
        """The state after local deviations, (size,)."""
        at = self.layout.targets.start
        without = np.concatenate([step[:at], np.zeros(self.layout.size - at)])
        return replace(moved(state, self.layout, without), rest_points_m=self.attached(state.rest_points_m, step[at:]))


@dataclass(frozen=True, eq=False)
class PointEquations(Equations):
    """Positions of targets: three equations a point, and three parameters a target."""

    layout: Layout
    seen: Observations
    whitener: Array
    """Its transpose times itself is the inverse of each point's covariance, (m, 3, 3)."""

    @staticmethod
    def of(layout: Layout, seen: Observations, covariance_m2: Array) -> "PointEquations":
        return PointEquations(layout, seen, _whiteners(covariance_m2))

    @property
    def count(self) -> int:
        return len(self.whitener)

    @property
    def attachment(self) -> int:
        return self.layout.size - self.layout.targets.start

    def evaluate(self, state: ArmState) -> Evaluated:
        predicted = predict(state, self.seen, self.layout)
        residual = self.whitener @ (self.seen.point_m - predicted.point_m)[:, :, None]
        return Evaluated(residual.ravel(), (self.whitener @ predicted.jacobian).reshape(-1, self.layout.size))

    def attached(self, rest_points_m: Array, change: Array) -> Array:
        return rest_points_m + change.reshape(-1, 3)

    def by_attachment(self, change: Array) -> Array:
        return np.eye(len(change))

    def part(self, standstills: slice) -> "PointEquations":
        return PointEquations(self.layout, _rows(self.seen, standstills), self.whitener[standstills])


@dataclass(frozen=True, eq=False)
class PoseEquations(Equations):
    """Full poses of a body on the last link: six equations a pose, and six parameters for how the body sits.

    The body is followed by three markers: its origin, and points one metre from it along its x and y. They are the
    ``rest_points_m`` of the state.
    """

    layout: Layout
    seen: Observations
    """Three rows a pose, one a marker; its ``point_m`` are the measured markers."""
    whitener: Array
    """Of each pose's shift and turn, (k, 6, 6)."""

    @staticmethod
    def of(layout: Layout, asked: Array, pose: Array, covariance: Array, campaign: Campaign) -> "PoseEquations":
        """Equations of measured poses.

        Args:
            layout: with three targets, the markers.
            asked: see ``Observations``, (k, n).
            pose: from the body to the instrument's frame, (k, 4, 4).
            covariance: of shift and turn of each, in the instrument's frame, (k, 6, 6).
            campaign: tells the robot's joints and whether its marks are known.
        """
        count = len(pose)
        seen = Observations(
            point_m=markers(pose).reshape(-1, 3),
            target=np.tile(np.arange(3), count),
            link=np.full(3 * count, campaign.robot.joint_count),
            asked=np.repeat(asked, 3, axis=0),
            sliding=campaign.robot.sliding,
            home=campaign.home is not None,
        )
        return PoseEquations(layout, seen, _whiteners(covariance))

    @property
    def count(self) -> int:
        return len(self.whitener)

    @property
    def attachment(self) -> int:
        return 6

    def evaluate(self, state: ArmState) -> Evaluated:
        predicted = predict(state, self.seen, self.layout)
        shown, expected = (p.reshape(-1, 3, 3) for p in (self.seen.point_m, predicted.point_m))
        there, here = (frames_of(p)[:, :3, :3] for p in (shown, expected))
        turn = vectors_of_rotations(there @ np.swapaxes(here, 1, 2))
        residual = np.concatenate([shown[:, 0] - expected[:, 0], turn], axis=1)
        at = self.layout.targets.start
        flat = predicted.jacobian.reshape(self.count, 9, -1)
        sits = flat[:, :, at:] @ marker_moves(state.rest_points_m[None])[0]
        # Markers move as one body, so their nine velocities are those of one twist exactly.
        twist = np.linalg.pinv(marker_moves(expected)) @ np.concatenate([flat[:, :, :at], sits], axis=2)
        twist[:, 3:] = inverse_right_jacobian(turn) @ twist[:, 3:]
        white = self.whitener @ np.concatenate([residual[:, :, None], twist], axis=2)
        return Evaluated(white[:, :, 0].ravel(), white[:, :, 1:].reshape(-1, self.size))

    def attached(self, rest_points_m: Array, change: Array) -> Array:
        origin, turn = rest_points_m[0], rotations_of_vectors(change[None, 3:])[0]
        return origin + change[:3] + (rest_points_m - origin) @ turn.T

    def by_attachment(self, change: Array) -> Array:
        out = np.eye(6)
        out[3:, 3:] = left_jacobian(change[3:])
        return out

    def part(self, standstills: slice) -> "PoseEquations":
        first, last, _ = standstills.indices(self.count)
        return PoseEquations(self.layout, _rows(self.seen, slice(3 * first, 3 * last)), self.whitener[standstills])


def _whiteners(covariance: Array) -> Array:
    return np.linalg.inv(np.linalg.cholesky(covariance))


def _rows(seen: Observations, rows: slice) -> Observations:
    return replace(
        seen, point_m=seen.point_m[rows], target=seen.target[rows], link=seen.link[rows], asked=seen.asked[rows]
    )
