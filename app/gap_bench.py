"""The diagnosis on the workbench: the session's points, or a campaign that somebody uploads. Nothing here draws.

It takes seconds, and so runs in a process of its own: measuring and solving go on meanwhile.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields

from app.beside import Beside, Tell
from app.pose_bench import PoseBench
from app.workbench import Workbench
from core.calibrated_arm import CalibratedArm
from core.campaign_archive import read_campaign_archive
from core.errors import InputError
from core.gap.result import GapReport
from core.measurements import Campaign
from core.session import Session
from core.session_campaign import to_campaign

LEAST_POINTS = 24
"""Seen points on moving links from which on a diagnosis may have something to say."""
Progress = Callable[[float, str], None]
Finished = Callable[[str], None]
"""Told at the end, from another thread: an empty text, or why there is no diagnosis."""


@dataclass(frozen=True, eq=False)
class Diagnosed:
    """What was found, and of which points."""

    report: GapReport
    of: str
    """What was diagnosed, in words."""
    shots: tuple[int, ...] | None
    """Ids of the session's shots that it rests on; None: it is of an uploaded campaign."""


class GapBench:
    """The last diagnosis of the session that the workbench is at."""

    def __init__(self, bench: Workbench) -> None:
        self._bench, self._poses = bench, PoseBench(bench)
        self._found: tuple[Session, Diagnosed] | None = None
        self._work = Beside("a diagnosis")

    @property
    def running(self) -> bool:
        """Whether a diagnosis is being made."""
        return self._work.running

    @property
    def enough(self) -> bool:
        """Whether the session has points enough to begin with."""
        links = {target.name: target.link for target in self._bench.state.targets}
        return sum(links.get(name, 0) > 0 for _, name in self._counting()) >= LEAST_POINTS

    @property
    def arm(self) -> CalibratedArm | None:
        """The calibrated arm of the last solution; None: there is none."""
        return self._poses.arm

    @property
    def found(self) -> Diagnosed | None:
        """The last diagnosis; None: none in this session."""
        if self._found is None or self._found[0] is not self._bench.session:
            return None
        return self._found[1]

    @property
    def outdated(self) -> bool:
        """Whether the session's shots are no longer those that were diagnosed."""
        found = self.found
        return found is not None and found.shots is not None and found.shots != self._ids()

    def diagnose(self, calibrated: bool, progress: Progress, finished: Finished) -> None:
        """Begin to diagnose the session's points against the nominal or the calibrated arm; this returns at once.

        Raises:
            InputError: there is no calibrated arm, or a diagnosis is being made already.
        """
        arm = self.arm if calibrated else None
        if calibrated and arm is None:
            raise InputError("No solution of the whole arm is there yet: solve first, or compare with the nominal arm.")
        of = f"this session and {'the last solution' if calibrated else 'the nominal arm'}"
        shots = self._ids()
        self._begin(_diagnosed, (to_campaign(self._bench.state), arm), of, shots, progress, finished)

    def diagnose_archive(self, data: bytes, name: str, progress: Progress, finished: Finished) -> None:
        """Begin to diagnose an uploaded campaign, a ZIP file of its folder, against its own sim.

        Raises:
            InputError: a diagnosis is being made already.
        """
        self._begin(_diagnosed_archive, (data, name), name, None, progress, finished)

    def stop(self) -> None:
        """Give up the diagnosis that is being made, if any."""
        self._work.stop()

    def _begin(
        self,
        work: Callable[..., GapReport],
        arguments: tuple,
        of: str,
        shots: tuple[int, ...] | None,
        progress: Progress,
        finished: Finished,
    ) -> None:
        session = self._bench.session

        def ended(report: GapReport | None, why_not: str) -> None:
            if report is not None:
                self._found = session, Diagnosed(report, of, shots)
            finished(why_not)

        self._work.start(work, arguments, lambda told: progress(*told), ended)

    def _counting(self) -> list[tuple[int, str]]:
        """Ids and targets of the shots that count and show a point."""
        return [(s.id, s.taken.target) for s in self._bench.state.shots if s.counts and s.taken.point_m is not None]

    def _ids(self) -> tuple[int, ...]:
        return tuple(number for number, _ in self._counting())


def _diagnosed(tell: Tell, campaign: Campaign, arm: CalibratedArm | None = None) -> GapReport:
    """The other process: the report alone, as the corrected sim beside it holds functions, which no pipe takes."""
    from core.gap.diagnosis import diagnose

    found = diagnose(campaign, arm, progress=lambda done, what: tell((done, what)))
    return GapReport(**{field.name: getattr(found, field.name) for field in fields(GapReport)})


def _diagnosed_archive(tell: Tell, data: bytes, name: str) -> GapReport:
    return _diagnosed(tell, read_campaign_archive(data, name))
