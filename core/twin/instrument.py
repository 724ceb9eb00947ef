"""The demo cell's robot and instrument: the twin goes where it is told, and is measured there.

Random numbers come from the seed and the count of visits and shots alone, so that a session that goes on after a
restart (``shots_before``) never sees the same noise twice, and the same session sees the same again.
"""

from time import monotonic, sleep

import numpy as np

from core.geometry import Array
from core.instruments import (
    Cancelled,
    InstrumentFailed,
    MeasurementCancelled,
    MeasureRequest,
    PointMeter,
    Reading,
    RobotDriver,
)
from core.measurements import Instrument
from core.theodolite import intersect
from core.twin.cell import Cell, carried, chain
from core.twin.instruments import TheodolitePair
from core.twin.noise import MEAN_LENGTH, Noise, Repeatability
from core.twin.protocol import Schedule

UPPER = ((0, 0, 0, 1, 1, 2), (0, 1, 2, 1, 2, 2))
ALL_NOISE = Noise()


class DemoRobot(RobotDriver):
    """The twin's arm: at every visit each link stands a little off, as its repeatability has it.

    The statistics are those of simulated campaigns, where a target that is seen alone shows a link's shift only.
    """

    def __init__(
        self, cell: Cell, seed: int, visits_before: int = 0, noise: Noise = ALL_NOISE, seconds_a_move: float = 0.0
    ) -> None:
        self._cell, self._seed, self._visits = cell, seed, visits_before
        self._repeatability = cell.repeatability if noise.repeatability else Repeatability()
        self._seconds = seconds_a_move
        self.commanded: tuple[float, ...] = tuple(float(value) for value in cell.centre)

    def move_to(self, commanded: tuple[float, ...], cancelled: Cancelled) -> None:
        """Go there; staying where it is, is not a new visit.

        Raises:
            InstrumentFailed: there are not as many commands as joints, or one is beyond its limits.
            MeasurementCancelled: it was cancelled on the way.
        """
        wanted = tuple(float(value) for value in commanded)
        _check_commands(self._cell, wanted)
        if wanted == self.commanded:
            return
        _wait(self._seconds, cancelled)
        self.commanded = wanted
        self._visits += 1

    def points_m(self) -> Array:
        """Where all targets are now, (t, 3), in the instrument's frame."""
        cell, true = self._cell, self._cell.truth
        net = true.arm.net(np.array([self.commanded]))
        motions = chain(true.arm.axes, cell.robot.sliding, net).repeat(len(true.links), axis=0)
        points = carried(motions, true.links, true.rest_points_m)
        return self._displaced(points, true.links, np.random.default_rng((self._seed, 1, self._visits)))

    def _displaced(self, points_m: Array, links: np.ndarray, rng: np.random.Generator) -> Array:
        """Each link shifted and turned as a whole, about its first target; what stands on the floor stays."""
        count, moved = self._cell.robot.joint_count + 1, points_m.copy()
        shift = rng.normal(size=(count, 3)) * (self._repeatability.mean_translation_m / MEAN_LENGTH)
        turn = rng.normal(size=(count, 3)) * (self._repeatability.mean_rotation_rad / MEAN_LENGTH)
        for link in set(links.tolist()) - {0}:
            own = links == link
            moved[own] += shift[link] + np.cross(turn[link], points_m[own] - points_m[own][0])
        return moved


class DemoInstrument(PointMeter):
    """The twin's instrument, looking at the demo robot."""

    def __init__(
        self,
        cell: Cell,
        robot: DemoRobot,
        seed: int,
        shots_before: int = 0,
        noise: Noise = ALL_NOISE,
        seconds_a_shot: float = 0.0,
    ) -> None:
        self._cell, self._robot, self._seed, self._shots = cell, robot, seed, shots_before
        self._noise, self._seconds = noise, seconds_a_shot
        self._names = [target.name for target in cell.targets]

    @property
    def statement(self) -> Instrument:
        return self._cell.instrument.statement

    def measure(self, request: MeasureRequest, cancelled: Cancelled) -> Reading:
        """Measure a target where it is now; the clock of the simulation goes on by one shot.

        Raises:
            InstrumentFailed: there is no such target.
            MeasurementCancelled: it was cancelled.
        """
        if request.target not in self._names:
            names = ", ".join(self._names)
            raise InstrumentFailed(f"the instrument knows no target {request.target!r}, expected one of {names}")
        _wait(self._seconds, cancelled)
        self._shots += 1
        point = self._robot.points_m()[self._names.index(request.target)][None]
        seen, covariance, angles = self._seen(point, np.random.default_rng((self._seed, 2, self._shots)))
        time_s = self._cell.protocol.seconds_a_shot * self._shots
        nothing = np.zeros(0, dtype=int)
        day = Schedule(self._cell.robot, (), nothing, nothing, np.array([time_s]))
        return Reading(
            point_m=tuple(seen[0]),
            covariance_m2=tuple(covariance[0][UPPER]),
            angles_rad=angles,
            time_s=time_s,
            temperature_c=float(day.air_c[0]),
            arm_temperature_c=float(day.arm_c[0]),
        )

    def _seen(self, point_m: Array, rng: np.random.Generator) -> tuple[Array, Array, tuple[float, ...] | None]:
        """The point, its covariance, and the four angles if theodolites look at it."""
        pair = self._cell.instrument
        if not isinstance(pair, TheodolitePair):
            if self._noise.instrument:
                return *pair.measure(point_m, rng), None
            return point_m, pair.covariance(point_m), None
        angles = []
        for station in (pair.left, pair.right):
            spread = np.array([station.sigma_hz_rad, station.sigma_v_rad]) * self._noise.instrument
            angles.append(station.observe(point_m) + rng.normal(size=(1, 2)) * spread)
        met = intersect(pair.left, pair.right, *angles)
        return met.point_m, met.covariance_m2, tuple(np.concatenate(angles, axis=1)[0].tolist())


def _check_commands(cell: Cell, commanded: tuple[float, ...]) -> None:
    robot = cell.robot
    if len(commanded) != robot.joint_count or not np.isfinite(commanded).all():
        raise InstrumentFailed(f"the robot has {robot.joint_count} joints, got the commands {commanded}")
    for number, (joint, value) in enumerate(zip(robot.joints, commanded, strict=True), 1):
        low, high = joint.limits
        if not low - 1e-9 <= value <= high + 1e-9:
            raise InstrumentFailed(
                f"the robot does not go there: joint {number} at {value:.6g} is beyond its {low:.6g} to {high:.6g}"
            )


def _wait(seconds: float, cancelled: Cancelled) -> None:
    end = monotonic() + seconds
    while not cancelled():
        left = end - monotonic()
        if left <= 0:
            return
        sleep(min(left, 0.01))
    raise MeasurementCancelled("the measurement was cancelled")
