"""Kill -9 at 300 random moments of measuring, undoing, solving, exporting, opening and closing."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ROUNDS = 300


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="writers are forked")
def test_no_acknowledged_event_is_lost_when_the_program_is_killed(tmp_path: Path) -> None:
    killer = Path(__file__).with_name("session_killer.py")
    environment = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    run = subprocess.run(
        [sys.executable, str(killer), str(tmp_path), str(ROUNDS), "1"],
        env=environment, capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    summary = json.loads(run.stdout)
    assert summary["faults"] == []
    assert summary["killed"] == ROUNDS
    # The writers lived long enough for the test to mean something.
    assert summary["acknowledged"] > ROUNDS
    assert all(summary["kinds"].get(kind, 0) > 5 for kind in ("shot", "judged", "undo", "redo", "solved", "closed"))
    assert summary["copies"] > 5
    assert summary["campaigns"] > 5
