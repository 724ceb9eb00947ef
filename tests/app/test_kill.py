"""Kill -9 at random moments of measuring, undoing, solving, exporting: nothing shown is lost, the step is the same."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
KINDS = ("measure", "undo", "solve", "export")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not hasattr(os, "fork"), reason="programs are forked"),
]


def killed(name: str, rounds: int, folder: Path) -> dict:
    """The summary of a killer, in which nothing must be wrong."""
    (folder / "tmp").mkdir()
    environment = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", "TMPDIR": str(folder / "tmp")}
    run = subprocess.run(
        [sys.executable, str(Path(__file__).with_name(name)), str(folder), str(rounds), "1"],
        env=environment, capture_output=True, text=True, timeout=550, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    summary = json.loads(run.stdout.splitlines()[-1])
    assert summary["faults"] == []
    assert summary["rounds"] == summary["killed"] == rounds
    # They died at what was meant: a kill that comes late meets the next thing.
    assert all(summary["during"].get(kind, 0) > rounds / 15 for kind in KINDS), summary["during"]
    return summary


def test_300_workbenches_lose_nothing_that_was_acknowledged_and_go_on_at_the_same_step(tmp_path: Path) -> None:
    summary = killed("workbench_killer.py", 300, tmp_path)
    # They lived long enough for the test to mean something.
    assert summary["acknowledged"] > 600
    assert all(summary["kinds"].get(kind, 0) > 5 for kind in ("shot", "judged", "undo", "redo", "solved", "copy"))
    assert summary["unheard"] > 20
    assert summary["files"] > 30


def test_30_dashboards_lose_nothing_that_the_page_has_shown_and_go_on_at_the_same_step(tmp_path: Path) -> None:
    summary = killed("server_killer.py", 30, tmp_path)
    assert summary["acknowledged"] > 60
    assert summary["files"] > 5
