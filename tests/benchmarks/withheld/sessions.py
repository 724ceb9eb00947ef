"""One day at an arm: which commands were given in which order, under which conditions, and what was looked at."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tests.benchmarks.withheld.arms import Arm
from tests.benchmarks.withheld.chains import Stand, seen_points, stand
from tests.benchmarks.withheld.rigid import Array, homogeneous, turn

PAUSE_S = 900.0
"""Longer than any step of work: the motors cool meanwhile."""


@dataclass(frozen=True)
class Session:
    """Every row of a campaign but the measured points, in order; rows are points and moves."""

    arm: Arm
    q: Array
    """Commands, (m, n), rad or m."""
    phase: np.ndarray
    """``sweep``, ``pose`` or ``move``, (m,)."""
    joint: np.ndarray
    """Swept joint from 0, else -1, (m,)."""
    sweep: np.ndarray
    """Number of the sweep of that joint, from 1, else 0, (m,)."""
    step: np.ndarray
    """(m,), -1 outside sweeps."""
    pose: np.ndarray
    """(m,), -1 outside poses."""
    target: np.ndarray
    """Which target, (m,), -1 for moves."""
    sense: np.ndarray
    """Sense in which each joint moved last, -1, 0, 1, (m, n)."""
    speed: Array
    """(m, n), rad/s or m/s."""
    bend: Array
    """Accelerations, (m, n): a moving joint speeds up and slows down."""
    time_s: Array
    payload_kg: Array
    places_m: Array
    """True places of the targets in the last frame, (targets, 3)."""
    base: Array
    """True place of the arm's base before the instrument, (4, 4)."""
    readback: bool = False
    """Whether the q columns were read from the encoders rather than commanded."""

    @property
    def measured(self) -> np.ndarray:
        """Which rows hold a point, boolean (m,)."""
        return self.target >= 0

    @property
    def targets(self) -> int:
        return len(self.places_m)

    @property
    def record(self) -> np.ndarray:
        """Numbers of the rows as written, from 1, (m,)."""
        return np.arange(1, len(self.q) + 1)

    @property
    def hours(self) -> Array:
        return self.time_s / 3600.0

    @cached_property
    def place_m(self) -> Array:
        """Place of the target of each row, (m, 3); the first one's for moves."""
        return self.places_m[np.maximum(self.target, 0)]

    @cached_property
    def nominal(self) -> Stand:
        """Frames of the nominal arm at every row."""
        return stand(self.arm.chain, self.q)

    @cached_property
    def nominal_m(self) -> Array:
        """Points as the nominal arm, rightly placed, would show them, (m, 3)."""
        return seen_points(self.arm.chain, self.q, self.place_m, self.base)

    def record_at(self, hours: float) -> int:
        """The first measured record at or after a time."""
        after = self.measured & (self.hours >= hours)
        return int(self.record[after][0])

    def warmth(self, lag_h: float) -> Array:
        """How warm a part is, (m,), 0 cold to 1 as warm as work makes it, by its own time constant."""
        step = np.diff(self.hours, prepend=0.0)
        working = np.where(step * 3600.0 < PAUSE_S, 1.0, 0.0)
        keep = np.exp(-step / lag_h)
        out, now = np.empty(len(step)), 0.0
        for k in range(len(step)):
            now = working[k] + (now - working[k]) * keep[k]
            out[k] = now
        return out


class Diary:
    """Rows as they come: the arm's last command, the clock, and what has been written so far."""

    def __init__(self, arm: Arm, rng: np.random.Generator) -> None:
        self.arm, self.rng = arm, rng
        self.now, self.payload = 0.0, 0.0
        self.rows: list[tuple] = []
        self.commands: list[Array] = []
        self.senses: list[Array] = []
        self.speeds: list[tuple[Array, Array]] = []
        self.sense = np.zeros(arm.count, dtype=int)

    def wait(self, seconds: float) -> None:
        self.now += seconds

    def move(self, q: Array, seconds: float = 6.0) -> None:
        """The arm passes here; nothing is measured."""
        self._go(q, seconds)
        self._write("move")

    def point(
        self,
        q: Array,
        phase: str,
        targets: list[int],
        joint: int = -1,
        sweep: int = 0,
        step: int = -1,
        pose: int = -1,
        seconds: float = 14.0,
    ) -> None:
        """The arm stands here and some of its targets are measured, one after the other."""
        self._go(q, seconds)
        for k, target in enumerate(targets):
            if k:
                self.now += 4.0
            self._write(phase, joint, sweep, step, pose, target)

    def passing(self, q: Array, speed: Array, bend: Array, joint: int, sweep: int, step: int, target: int) -> None:
        """A target is measured while a joint moves."""
        self._go(q, 0.5)
        self._write("sweep", joint, sweep, step, -1, target, speed, bend)

    def _go(self, q: Array, seconds: float) -> None:
        if self.commands:
            way = q - self.commands[-1]
            self.sense = np.where(np.abs(way) > 1e-9, np.sign(way), self.sense).astype(int)
        self.here = q
        self.now += seconds * self.rng.uniform(0.8, 1.3)

    def _write(
        self,
        phase: str,
        joint: int = -1,
        sweep: int = 0,
        step: int = -1,
        pose: int = -1,
        target: int = -1,
        speed: Array | None = None,
        bend: Array | None = None,
    ) -> None:
        still = np.zeros(self.arm.count)
        self.rows.append((phase, joint, sweep, step, pose, target, self.now, self.payload))
        self.commands.append(self.here)
        self.senses.append(self.sense)
        self.speeds.append((still if speed is None else speed, still if bend is None else bend))

    def session(self, places_m: Array, base: Array, readback: bool = False) -> Session:
        """Everything written so far as one record."""
        phase, joint, sweep, step, pose, target, time_s, payload = (
            np.array(column) for column in zip(*self.rows, strict=True)
        )
        speed, bend = (np.array(column) for column in zip(*self.speeds, strict=True))
        return Session(
            self.arm,
            np.array(self.commands),
            phase,
            joint,
            sweep,
            step,
            pose,
            target,
            np.array(self.senses),
            speed,
            bend,
            time_s,
            payload,
            places_m,
            base,
            readback,
        )


def random_places(rng: np.random.Generator, targets: int) -> Array:
    """Targets well off the last axis and well apart, m, (targets, 3)."""
    azimuth = rng.uniform(0, 2 * np.pi) + np.arange(targets) * 2 * np.pi / targets + rng.normal(0, 0.2, targets)
    radius = rng.uniform(0.09, 0.16, targets)
    return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), rng.uniform(0.04, 0.16, targets)], axis=1)


def random_base(rng: np.random.Generator) -> Array:
    """An arm metres from the instrument, turned anyhow about the vertical, upright to some mrad."""
    upright = turn(np.array([*rng.normal(0, 3e-3, 2), 0.0])) @ turn(np.array([0, 0, rng.uniform(-np.pi, np.pi)]))
    azimuth, distance = rng.uniform(-np.pi, np.pi), rng.uniform(2.5, 4.0)
    where = np.array([distance * np.cos(azimuth), distance * np.sin(azimuth), rng.uniform(-1.2, -0.4)])
    return homogeneous(upright, where)
