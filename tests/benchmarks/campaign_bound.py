"""The Cramer-Rao bound of the simulated IRB L6's campaign, from the twin's own forward model alone.

Nothing here uses the estimators or their derivatives: the arm is rebuilt from changed numbers (axes, constants of the
functions, targets), asked where its points and its tool are, and differences are taken. Every point weighs by all the
noise that it has: pointing of the theodolites and the arm's repeatability.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from core.arm import Arm
from core.drives import offsets
from core.geometry import Array, Line, rotation_about
from core.measurements import SWEEP, Campaign
from core.phi_convention import convention_of
from core.phi_model import frames, from_axes
from core.rotations import vectors_of_rotations
from core.twin.campaign import simulate_campaign
from core.twin.cell import Cell, chain
from core.twin.noise import MEAN_LENGTH, Noise

STEP = 1e-6
DRAWS = 400_000
SHOWN_COUPLINGS = (2, 4)
"""Indices of the joints whose passive motion table 1 shows: an extra point was watched while joints 2 and 4 moved."""


@dataclass(frozen=True, eq=False)
class CampaignBound:
    """What the sweeps of a cell allow."""

    cell: Cell
    noise: Noise

    @cached_property
    def campaign(self) -> Campaign:
        return simulate_campaign(0, self.cell)

    @cached_property
    def rows(self) -> np.ndarray:
        """Rows of the sweeps."""
        return np.flatnonzero(self.campaign.measurements.phase == SWEEP)

    @cached_property
    def commanded(self) -> Array:
        """Commands of the test poses, (12, 6)."""
        table = self.campaign.measurements
        pose, first = np.unique(table.pose, return_index=True)
        return table.commanded[first[pose >= 0]]

    @cached_property
    def repeatability_m(self) -> float:
        """Standard deviation of one coordinate."""
        return self.cell.repeatability.mean_translation_m / MEAN_LENGTH * self.noise.repeatability

    @cached_property
    def repeatability_rad(self) -> float:
        return self.cell.repeatability.mean_rotation_rad / MEAN_LENGTH * self.noise.repeatability

    @cached_property
    def whitener(self) -> Array:
        """Of every point, (129, 3, 3)."""
        stated = self.cell.instrument.covariance(self.cell.points_m[self.rows]) * self.noise.instrument
        return np.linalg.inv(np.linalg.cholesky(stated + self.repeatability_m**2 * np.eye(3)))

    @cached_property
    def best_linear(self) -> Array:
        """What the best linear estimator makes of the points' errors: shift and turn of the tool, (12, 6, 387)."""
        count = self._start.size
        points, tool = np.empty((3 * len(self.rows), count)), np.empty((len(self.commanded), 6, count))
        for k, step in enumerate(STEP * np.eye(count)):
            ahead, behind = (self._rebuilt(sign * step) for sign in (1, -1))
            points[:, k] = (self._points(*ahead) - self._points(*behind)).ravel() / (2 * STEP)
            one, other = self._tool(ahead[0]), self._tool(behind[0])
            tool[:, :3, k] = (one[:, :3, 3] - other[:, :3, 3]) / (2 * STEP)
            turn = one[:, :3, :3] @ np.swapaxes(other[:, :3, :3], 1, 2)
            tool[:, 3:, k] = vectors_of_rotations(turn) / (2 * STEP)
        white = self._whitened(points)
        return tool @ np.linalg.pinv(white, rcond=1e-13)

    def covariance(self, part: slice) -> Array:
        """Of the tool's shift or turn in every test pose by the points alone, (12, 3, 3)."""
        return self.best_linear[:, part] @ np.swapaxes(self.best_linear[:, part], 1, 2)

    @cached_property
    def position_m(self) -> float:
        """Mean length of the position error that the bound lets expect, repeatability of the visit included."""
        return _mean_length(self.covariance(slice(0, 3)) + self.repeatability_m**2 * np.eye(3))

    @cached_property
    def orientation_rad(self) -> float:
        return _mean_length(self.covariance(slice(3, 6)) + self.repeatability_rad**2 * np.eye(3))

    def linear_errors(self, measured: Campaign) -> Array:
        """Shift and turn of the tool that the best linear estimator's error makes in a campaign, (12, 6)."""
        noise = measured.measurements.point_m[self.rows] - self.cell.points_m[self.rows]
        return self.best_linear @ self._whitened(noise.reshape(-1, 1))[:, 0]

    def _whitened(self, columns: Array) -> Array:
        return (self.whitener @ columns.reshape(len(self.rows), 3, -1)).reshape(3 * len(self.rows), -1)

    @cached_property
    def _start(self) -> Array:
        """As many zeros as there are unknowns: four an axis, the constants, three a target."""
        arm = self.cell.truth.arm
        constants = sum(len(f.coefficients) for f in arm.transmissions)
        constants += sum(len(arm.couplings[k].coefficients) for k in SHOWN_COUPLINGS)
        return np.zeros(4 * len(arm.axes) + constants + 3 * len(self._targets))

    @cached_property
    def _targets(self) -> np.ndarray:
        """The targets that the sweeps show."""
        return np.unique(self.campaign.measurements.target[self.rows])

    def _rebuilt(self, x: Array) -> tuple[Arm, Array]:
        """The arm and its targets with every number changed a little."""
        true, values = self.cell.truth, list(x)
        take = lambda count: np.array([values.pop(0) for _ in range(count)])  # noqa: E731
        lines = tuple(_changed(line, take(4)) for line in true.arm.axes)
        drives = [replace(f, coefficients=f.coefficients + take(len(f.coefficients))) for f in true.arm.transmissions]
        couplings = list(true.arm.couplings)
        for k in SHOWN_COUPLINGS:
            one = couplings[k]
            couplings[k] = replace(one, coefficients=one.coefficients + take(len(one.coefficients)))
        rest = true.rest_points_m.copy()
        rest[self._targets] += take(3 * len(self._targets)).reshape(-1, 3)
        # The marks are known: whatever the functions are, they read there what they read there.
        zeros = offsets(self.campaign, drives)
        told = tuple(replace(f, offset=float(o)) for f, o in zip(drives, zeros, strict=True))
        return Arm(true.arm.robot, lines, told, tuple(couplings)), rest

    def _points(self, arm: Arm, rest: Array) -> Array:
        table = self.campaign.measurements
        target = table.target[self.rows]
        return arm.points(table.commanded[self.rows], self.cell.target_links[target], rest[target])

    def _tool(self, arm: Arm) -> Array:
        """The tool in the test poses, (12, 4, 4): it hangs on the last frame of the phi-model."""
        robot = self.cell.robot
        convention = convention_of(robot)
        base, model = from_axes(arm.axes, convention)
        tool = frames(model, np.zeros(robot.joint_count), base)[-1] @ robot.link_transforms[-1]
        return chain(arm.axes, robot.sliding, arm.net(self.commanded))[:, -1] @ tool


def _changed(line: Line, x: Array) -> Line:
    """A line tilted about and shifted along two directions across it."""
    first = np.cross(line.direction, np.eye(3)[np.argmin(np.abs(line.direction))])
    first /= np.linalg.norm(first)
    second = np.cross(line.direction, first)
    turn = rotation_about(first, x[0]) @ rotation_about(second, x[1])
    return Line(line.point_m + x[2] * first + x[3] * second, turn @ line.direction)


def _mean_length(covariance: Array) -> float:
    """Mean length of normal vectors, averaged over poses, by drawing them."""
    unit = np.random.default_rng(7).normal(size=(DRAWS, 3))
    return float(np.mean([np.linalg.norm(unit @ np.linalg.cholesky(c).T, axis=1).mean() for c in covariance]))
