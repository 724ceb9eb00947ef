"""The diagnosis on the workbench: the session's points, or a campaign that somebody uploads. Nothing here draws."""

from collections.abc import Callable
from dataclasses import dataclass

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

    def diagnose(self, calibrated: bool, progress: Progress | None = None) -> None:
        """Diagnose the session's points against the nominal or the calibrated arm.

        Raises:
            InputError: there is no calibrated arm, or the points do not allow a diagnosis.
        """
        if calibrated and self.arm is None:
            raise InputError("No solution of the whole arm is there yet: solve first, or compare with the nominal arm.")
        shots = self._ids()
        sim = "the last solution" if calibrated else "the nominal arm"
        self._diagnose(
            to_campaign(self._bench.state), self.arm if calibrated else None, f"this session and {sim}", shots, progress
        )

    def diagnose_archive(self, data: bytes, name: str, progress: Progress | None = None) -> None:
        """Diagnose an uploaded campaign, a ZIP file of its folder, against its own sim.

        Raises:
            InputError: it cannot be read, or its points do not allow a diagnosis.
        """
        self._diagnose(read_campaign_archive(data, name), None, name, None, progress)

    def _diagnose(
        self,
        campaign: Campaign,
        arm: CalibratedArm | None,
        of: str,
        shots: tuple[int, ...] | None,
        progress: Progress | None,
    ) -> None:
        # It takes long to import: not before it is asked for.
        from core.gap.diagnosis import diagnose

        session = self._bench.session
        report = diagnose(campaign, arm, progress=progress)
        self._found = session, Diagnosed(report, of, shots)
        self._bench.changed()

    def _counting(self) -> list[tuple[int, str]]:
        """Ids and targets of the shots that count and show a point."""
        return [(s.id, s.taken.target) for s in self._bench.state.shots if s.counts and s.taken.point_m is not None]

    def _ids(self) -> tuple[int, ...]:
        return tuple(number for number, _ in self._counting())
