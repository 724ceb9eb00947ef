"""What was measured: a campaign of points with their commands and conditions, checked, in SI units.

Point tables are kept by columns; row k of every column belongs to the k-th measured point. A value that was
not recorded is NaN (0 for the sense of approach), a column that nobody recorded is None.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from core.errors import CampaignError
from core.geometry import Array
from core.robot import Robot

SWEEP, POSE, MOVE = "sweep", "pose", "move"


@dataclass(frozen=True)
class Target:
    """A point that the instrument can see, riding on a link."""

    name: str
    link: int
    """It moves with joints 1..link; 0: fixed to the floor."""
    point_m: tuple[float, float, float] | None = None
    """Its place in the frame that moves with joint ``link``, if it is known."""
    sigma_m: float = 0.0
    """Standard uncertainty of each coordinate of that place."""


@dataclass(frozen=True)
class Instrument:
    """What the points were measured with."""

    kind: str = "other"
    sigma_m: float | None = None
    """Stated standard deviation of one coordinate of a point; None: not stated."""
    description: dict[str, str] = field(default_factory=dict)
    """Whatever else the owner wrote down: model, serial number, last calibration."""
    turn_sigma_rad: float | None = None
    """Stated standard deviation of each component of a 6-D target's turn; None: not stated."""


@dataclass(frozen=True)
class Measurements:
    """The points of a campaign, by columns of length m."""

    record: np.ndarray
    """Number of the record, in the order of measurement, integer (m,)."""
    phase: np.ndarray
    """``sweep``, ``pose`` or ``move``, string (m,)."""
    joint: np.ndarray
    """The joint that moves in a sweep, 1..n, else 0, integer (m,)."""
    sweep: np.ndarray
    """Which sweep of that joint, 1.., else 0, integer (m,)."""
    step: np.ndarray
    """Index of the position within the sweep, else -1, integer (m,)."""
    pose: np.ndarray
    """Index of the standstill of a pose record, else -1, integer (m,)."""
    target: np.ndarray
    """Index into the campaign's targets, -1 for moves, integer (m,)."""
    commanded: Array
    """Commanded displacements, rad or m, (m, n); 0 for passive joints."""
    point_m: Array
    """Measured points in the instrument's frame, (m, 3); NaN: not seen."""
    covariance_m2: Array
    """Covariance of each point, (m, 3, 3); NaN where nothing is stated."""
    check: np.ndarray
    """True for the owner's validation rows, never to be fitted, boolean (m,)."""
    approach: np.ndarray
    """Sense in which each joint reached its place: +1, -1, or 0 for unknown, integer (m, n)."""
    time_s: Array | None = None
    temperature_c: Array | None = None
    arm_temperature_c: Array | None = None
    payload_kg: Array | None = None
    speed: Array | None = None
    """Joint speeds, rad/s or m/s, (m, n)."""
    torque_nm: Array | None = None
    """Joint torques (N for sliding joints), (m, n)."""
    readback: Array | None = None
    """Joint values read back, rad or m, (m, n)."""
    wanted: Array | None = None
    """Commands by which the nominal arm would take a compensated pose, rad or m, (m, n); NaN: as commanded."""
    target_quaternion: Array | None = None
    """Orientation of a 6-D target in the instrument's frame, w x y z, (m, 4)."""
    simulated_point_m: Array | None = None
    """The points as another simulator predicts them, (m, 3)."""

    @property
    def count(self) -> int:
        return len(self.record)

    @property
    def seen(self) -> np.ndarray:
        """Which rows hold a measured point, boolean (m,)."""
        return np.isfinite(self.point_m).all(axis=1)


@dataclass(frozen=True)
class Sweep:
    """The points of one sweep: one joint moves, the others are held."""

    joint: int
    number: int
    rows: np.ndarray
    """Rows of the campaign's measurements, integer (k,)."""
    stop: np.ndarray
    """Index of the standstill of each row, 0.., integer (k,); rows at the same step share it."""
    target: np.ndarray
    """Index of the target of each row, integer (k,)."""
    commanded: Array
    """Commanded displacements of all joints at each stop, (stops, n)."""
    point_m: Array
    """Measured points, (k, 3)."""
    covariance_m2: Array
    """Their stated covariance, (k, 3, 3); NaN where nothing is stated."""

    @property
    def name(self) -> str:
        return f"joint {self.joint}, sweep {self.number}"


@dataclass(frozen=True)
class Campaign:
    """Everything that was measured on one robot, and how."""

    robot: Robot
    targets: tuple[Target, ...]
    measurements: Measurements
    title: str = ""
    instrument: Instrument = field(default_factory=Instrument)
    joint_values: str = "commanded"
    """What the q columns are: ``commanded``, ``goal`` or ``readback``."""
    home: Array | None = None
    """Commanded values at which the arm stands at its marks, where displacement counts from zero, (n,)."""
    place_simulated: bool = False
    """Whether another simulator's points are first placed by a fitted base."""
    notes: dict[str, str] = field(default_factory=dict)
    """Whatever else the owner wrote down: who, where, serial numbers, conditions, where the data come from."""
    digest: str = ""
    """SHA-256 of the files that it was read from."""

    def __post_init__(self) -> None:
        n = self.robot.joint_count
        for target in self.targets:
            if not 0 <= target.link <= n:
                raise CampaignError(f"target {target.name!r} rides on link {target.link}, expected 0..{n}")
        if self.measurements.commanded.shape != (self.measurements.count, n):
            commands = self.measurements.commanded.shape[1]
            raise CampaignError(
                f"{self.robot.name} has {n} joints, but the measurements have {commands} commands a row"
            )
        if self.home is not None and np.shape(self.home) != (n,):
            raise CampaignError(f"the home pose needs {n} values, one a joint, got {np.size(self.home)}")

    @cached_property
    def sweeps(self) -> tuple[Sweep, ...]:
        """The sweeps with seen points that may be fitted, in the order of measurement."""
        table = self.measurements
        usable = np.flatnonzero((table.phase == SWEEP) & table.seen & ~table.check & (table.target >= 0))
        if len(usable) == 0:
            return ()
        keys = np.stack([table.joint[usable], table.sweep[usable]], axis=1)
        found, first, which = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        order = np.argsort(first)
        return tuple(self._sweep(int(found[k][0]), int(found[k][1]), usable[which.ravel() == k]) for k in order)

    def _sweep(self, joint: int, number: int, rows: np.ndarray) -> Sweep:
        table = self.measurements
        # A stop is a step reached in one go: a return pass over the same step is another stop.
        steps = np.stack([table.step[rows], table.approach[rows, joint - 1]], axis=1)
        _, first, stop = np.unique(steps, axis=0, return_index=True, return_inverse=True)
        rank = np.argsort(np.argsort(first))
        return Sweep(
            joint=joint,
            number=number,
            rows=rows,
            stop=rank[stop.ravel()],
            target=table.target[rows],
            commanded=table.commanded[rows[np.sort(first)]],
            point_m=table.point_m[rows],
            covariance_m2=table.covariance_m2[rows],
        )
