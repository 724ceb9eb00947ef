"""Diagnosing many campaigns without knowing what is wrong with them.

Every campaign is read and diagnosed in a process of its own kind, from its folder alone; what is found goes no further
than ``Said``. The answers are none of this module's business.
"""

import os
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

from core.campaign_files import read_campaign
from core.errors import InputError, TrueaxisError
from core.gap.result import GapReport, Place, Verdict

ANSWERS = "answers.json"
MOST_PROCESSES = 2
ENDED = "its diagnosis ended without an answer, perhaps for want of memory"
Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class SaidCause:
    """A cause as it was said."""

    place: Place
    probability: float
    twins: tuple[Place, ...]
    """The class: causes that the data cannot tell from it, itself first."""

    @property
    def places(self) -> tuple[Place, ...]:
        """The class, whether or not there are twins."""
        return self.twins or (self.place,)


@dataclass(frozen=True)
class Said:
    """What was said of one campaign, or why nothing could be."""

    name: str
    """Of its folder."""
    verdict: Verdict | None
    """None: it could not be diagnosed."""
    causes: tuple[SaidCause, ...] = ()
    gap_rms_m: float = float("nan")
    left_rms_m: float = float("nan")
    floor_rms_m: float = float("nan")
    points: int = 0
    seconds: float = 0.0
    warnings: tuple[str, ...] = ()
    failure: str = ""
    """One sentence."""


def campaign_folders(folder: Path, out: Path | None = None) -> tuple[Path, ...]:
    """The subfolders that hold campaigns, by name; hidden ones and the one for the results are left out.

    Raises:
        InputError: there is no such folder, or none in it.
    """
    try:
        found = sorted((p for p in folder.iterdir() if p.is_dir() and not p.name.startswith(".")), key=lambda p: p.name)
    except OSError as wrong:
        reason = wrong.strerror or wrong
        raise InputError(f"{folder}: {reason}, expected a folder with campaigns in subfolders") from None
    own = None if out is None else out.resolve()
    found = [path for path in found if path.resolve() != own]
    if not found:
        raise InputError(f"{folder} has no subfolder, expected one with a campaign at least")
    return tuple(found)


def said_of(folder: Path) -> Said:
    """Read and diagnose one campaign; whatever goes wrong becomes a sentence."""
    # The diagnosis takes long to import and is not needed by whoever only scores.
    from core.gap.diagnosis import diagnose

    try:
        return said_in_short(folder.name, diagnose(read_campaign(folder)))
    except TrueaxisError as error:
        return Said(folder.name, None, failure=str(error))
    except Exception as error:
        return Said(folder.name, None, failure=f"unexpected error, {type(error).__name__}: {error}")


def said_in_short(name: str, report: GapReport) -> Said:
    """What a diagnosis says, without its arrays."""
    return Said(
        name=name,
        verdict=report.verdict,
        causes=tuple(SaidCause(c.place, float(c.probability), c.twins) for c in report.causes),
        gap_rms_m=float(report.gap_rms_m),
        left_rms_m=float(report.left_rms_m),
        floor_rms_m=float(report.noise.floor_rms_m),
        points=len(report.rows),
        seconds=float(report.seconds),
        warnings=report.warnings,
    )


def diagnose_all(
    folders: tuple[Path, ...],
    processes: int = MOST_PROCESSES,
    progress: Progress | None = None,
    say: Callable[[Path], Said] = said_of,
) -> tuple[Said, ...]:
    """Diagnose campaigns in processes of their own, in the order given.

    Args:
        folders: of the campaigns.
        processes: how many at once, 1..2.
        progress: told the share that is done and the name of the last campaign.
        say: what is done with each folder; importable, since processes start afresh.
    """
    found: dict[Path, Said] = {}

    def took(folder: Path, said: Said) -> None:
        found[folder] = said
        if progress is not None:
            progress(len(found) / len(folders), folder.name)

    lost = _run(folders, max(1, min(processes, MOST_PROCESSES, os.cpu_count() or 1)), say, took)
    for folder in lost:
        # A process that dies takes the others' work with it: each of those gets one of its own.
        if _run((folder,), 1, say, took):
            took(folder, Said(folder.name, None, failure=ENDED))
    return tuple(found[folder] for folder in folders)


def _run(
    folders: tuple[Path, ...], processes: int, say: Callable[[Path], Said], took: Callable[[Path, Said], None]
) -> tuple[Path, ...]:
    """Work through folders; those whose process died are returned."""
    lost = []
    with _single_threaded(), ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        waiting: dict[Future[Said], Path] = {pool.submit(say, folder): folder for folder in folders}
        for done in as_completed(waiting):
            try:
                took(waiting[done], done.result())
            except BrokenProcessPool:
                lost.append(waiting[done])
    return tuple(folder for folder in folders if folder in lost)


@contextmanager
def _single_threaded() -> Iterator[None]:
    """Processes that start in here do not fight for the processors with threads of their own."""
    name = "OMP_NUM_THREADS"
    before = os.environ.get(name)
    os.environ.setdefault(name, "1")
    try:
        yield
    finally:
        if before is None:
            os.environ.pop(name, None)
