"""What the arm was doing at every point of the gap: the arguments of all effects."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from core.gap.history import History, drive_load, history, motors_of, running
from core.gap.loads import Loads, loads
from core.gap.observations import Observations
from core.geometry import Array

PAUSE_S, PAUSE_STEPS = 600.0, 10.0
"""An arm rests where more time passes from one record to the next, and so many times what mostly passes."""


@dataclass(frozen=True, eq=False)
class Doings:
    """Conditions of the points, (m, ...). Joints count from 0."""

    seen: Observations
    past: History

    def part(self, keep: np.ndarray) -> "Doings":
        """The same for some of the points."""
        past = self.past.part(keep)
        return Doings(past.seen, past)

    @cached_property
    def uncoupled(self) -> "Doings":
        """The same of an arm whose motors move one joint each."""
        return doings(self.seen.uncoupled)

    @property
    def count(self) -> int:
        return self.seen.count

    @property
    def active(self) -> Array:
        """What each motor was asked for, rad or m, (m, n)."""
        return self.seen.active

    @cached_property
    def sense(self) -> Array:
        """Sense in which each motor came, +1, -1 or 0, (m, n)."""
        return self.past.sense[self.past.last]

    @cached_property
    def travel(self) -> Array:
        """How far each motor came since it turned round, (m, n)."""
        return self.past.travel[self.past.last]

    @cached_property
    def loads(self) -> Loads | None:
        return loads(self.seen.chain, self.seen.net)

    @cached_property
    def drive_load(self) -> Array | None:
        """The load that turns each motor, N m or N, (m, n)."""
        return None if self.loads is None else drive_load(self.seen, self.loads, self.seen.payload_kg)

    @cached_property
    def own_load(self) -> Array | None:
        """The part of it that the arm's own links make, (m, n)."""
        return None if self.loads is None else drive_load(self.seen, self.loads, np.zeros(self.count))

    @cached_property
    def kilogram_load(self) -> Array | None:
        """What one kilogram at the tool adds to that, (m, n)."""
        if self.loads is None:
            return None
        one, none = np.ones(self.count), np.zeros(self.count)
        return drive_load(self.seen, self.loads, one) - drive_load(self.seen, self.loads, none)

    @cached_property
    def offset_load(self) -> Array | None:
        """What moving one kilogram by one metre in the tool's last frame adds to the loads, (m, n, 3)."""
        if self.loads is None:
            return None
        held = self.loads.joint_offset.copy()
        held[:, self.seen.chain.sliding] = 0.0
        held[:, :-1] += self.seen.chain.coupling_gains[1:, None] * held[:, 1:]
        return held

    @cached_property
    def middle_moment(self) -> Array | None:
        """Moment at the middle of every link, in its frame, N m, (m, n, 3)."""
        if self.loads is None:
            return None
        return self.loads.middle_own + self.seen.payload_kg[:, None, None] * self.loads.middle_kilogram

    def logged(self, column: str) -> Array | None:
        """A column of the measurements at these points; None: nobody logged it, or not everywhere."""
        values = getattr(self.seen.campaign.measurements, column)
        if values is None:
            return None
        here = values[self.seen.rows]
        return here if np.isfinite(here).all() else None

    @cached_property
    def speed(self) -> Array | None:
        """How fast each motor went, rad/s or m/s, (m, n); None: nobody logged it."""
        logged = self.logged("speed")
        return None if logged is None else motors_of(self.seen, logged)

    @cached_property
    def elapsed_s(self) -> Array | None:
        """Time since the first record, (m,)."""
        table = self.seen.campaign.measurements
        time = self.logged("time_s")
        return None if time is None else time - np.nanmin(table.time_s)

    @cached_property
    def _clock(self) -> tuple[np.ndarray, Array, Array]:
        """Records that have a time, in their order, and how much time each took, at work and at rest, s, (w,) each."""
        table = self.seen.campaign.measurements
        timed = np.flatnonzero(np.isfinite(table.time_s))
        order = timed[np.argsort(table.record[timed], kind="stable")]
        took = np.maximum(np.diff(table.time_s[order], prepend=table.time_s[order[:1]]), 0.0)
        rested = took > max(PAUSE_S, PAUSE_STEPS * float(np.median(took)))
        return table.record[order], np.where(rested, 0.0, took), np.where(rested, took, 0.0)

    @property
    def rested(self) -> bool:
        """Whether the arm stood idle between records long enough to cool."""
        return self.elapsed_s is not None and bool(self._clock[2].any())

    def warmth(self, constant_s: float) -> Array:
        """How warm work has made the arm at every point, 0 cold to 1, (m,): it warms as it works and cools at rest."""
        record, worked, rested = self._clock
        kept = np.exp(-(worked + rested) / constant_s)
        warm = running(kept, np.where(rested > 0, 0.0, 1.0 - kept))
        return warm[np.searchsorted(record, self.seen.record)]


def doings(seen: Observations) -> Doings:
    """The conditions of the points of a campaign."""
    return Doings(seen, history(seen))
