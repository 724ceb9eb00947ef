"""What processes of their own may do with a campaign's folder, instead of a diagnosis."""

import os
from pathlib import Path

from core.gap.blind_check import Said
from core.gap.result import Verdict


def say_name(folder: Path) -> Said:
    """A process that answers."""
    return Said(folder.name, Verdict.NO_GAP, warnings=(str(os.getpid()), os.environ.get("OMP_NUM_THREADS", "")))


def say_or_die(folder: Path) -> Said:
    """One whose process ends where the folder's name says so."""
    if folder.name.startswith("dies"):
        os._exit(9)
    return say_name(folder)
