"""Kill -9 of the dashboard itself while it measures, solves and exports: nothing shown is lost, and it goes on."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ROUNDS = 30


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="dashboards are forked")
def test_what_the_page_has_shown_survives_and_the_next_page_goes_on_at_the_same_step(tmp_path: Path) -> None:
    killer = Path(__file__).with_name("server_killer.py")
    environment = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    run = subprocess.run(
        [sys.executable, str(killer), str(tmp_path), str(ROUNDS), "1"],
        env=environment, capture_output=True, text=True, timeout=550, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    summary = json.loads(run.stdout.splitlines()[-1])
    assert summary["faults"] == []
    assert summary["killed"] == ROUNDS
    # The dashboards lived long enough, and died at what was meant.
    assert summary["acknowledged"] > 2 * ROUNDS
    assert summary["files"] > 5
    assert all(summary["during"].get(what, 0) > ROUNDS / 9 for what in ("measure", "solve", "export"))
