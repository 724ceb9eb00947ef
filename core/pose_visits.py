"""Visits of test poses: which were made, by which commands, and what is still to be seen at each."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from core.measurements import POSE
from core.session_state import Shot, State
from core.standstills import SAME_COMMAND


@dataclass(frozen=True)
class PoseVisit:
    """One standstill at a pose, and the shots that count of it."""

    number: int
    """The index of the pose in the campaign: every standstill has its own."""
    commanded: tuple[float, ...]
    wanted: tuple[float, ...]
    """The commands of the nominal arm for the pose that was wanted."""
    shots: tuple[Shot, ...]

    @property
    def compensated(self) -> bool:
        """Whether other commands were sent than the nominal arm would take."""
        return not _same(self.commanded, self.wanted)

    @property
    def seen(self) -> frozenset[str]:
        """Names of the targets of which there is a point."""
        return frozenset(shot.taken.target for shot in self.shots if shot.taken.point_m is not None)

    def wants(self, wanted: tuple[float, ...]) -> bool:
        """Whether it was a visit of this pose."""
        return _same(self.wanted, wanted)


def pose_visits(state: State) -> tuple[PoseVisit, ...]:
    """Every visit of a pose of which a shot counts, by number."""
    by_number: dict[int, list[Shot]] = {}
    for shot in state.shots:
        if shot.taken.phase == POSE and shot.counts:
            by_number.setdefault(shot.taken.pose, []).append(shot)
    return tuple(_visit(number, tuple(shots)) for number, shots in sorted(by_number.items()))


def next_number(state: State) -> int:
    """The index of the next visit: after all that ever were, also of those that do not count."""
    return 1 + max((shot.taken.pose for shot in state.shots if shot.taken.phase == POSE), default=-1)


def last_complete(
    visits: Iterable[PoseVisit], wanted: tuple[float, ...], compensated: bool, targets: Iterable[str]
) -> PoseVisit | None:
    """The last visit of a pose, commanded in one way, that shows all targets; None: there is none."""
    needed = frozenset(targets)
    made = [v for v in visits if v.compensated == compensated and v.wants(wanted) and needed <= v.seen]
    return made[-1] if made else None


def _visit(number: int, shots: tuple[Shot, ...]) -> PoseVisit:
    taken = shots[0].taken
    given = dict(enumerate(taken.wanted or ()))
    wanted = tuple(c if given.get(i) is None else given[i] for i, c in enumerate(taken.commanded))
    return PoseVisit(number, taken.commanded, wanted, shots)


def _same(first: tuple[float, ...], second: tuple[float, ...]) -> bool:
    return len(first) == len(second) and bool(np.abs(np.subtract(first, second)).max(initial=0.0) <= SAME_COMMAND)
