"""The command line run as a process of its own, and campaign folders that can be spoiled in one place."""

import csv
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent
SAMPLES = ROOT / "sample_data"
Row = dict[str, str]


def trueaxis(*arguments: object, timeout: float = 120) -> subprocess.CompletedProcess[str]:
    """Run ``trueaxis`` and wait for it."""
    command = [sys.executable, "-m", "app", *map(str, arguments)]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=timeout, encoding="utf-8")


def copy_of_sample(folder: Path, name: str = "irb_l6") -> Path:
    """A copy of a sample campaign to be spoiled."""
    return Path(shutil.copytree(SAMPLES / name, folder / "campaign"))


def edit_rows(campaign: Path, edit: Callable[[list[Row]], list[Row]]) -> None:
    """Rewrite measurements.csv; the columns are those of the first row that ``edit`` returns."""
    path = campaign / "measurements.csv"
    with path.open(encoding="utf-8", newline="") as file:
        rows = edit(list(csv.DictReader(file)))
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def edit_cell(campaign: Path, row: int, column: str, value: str) -> None:
    """Replace one cell of measurements.csv; rows count from 0."""

    def edit(rows: list[Row]) -> list[Row]:
        rows[row][column] = value
        return rows

    edit_rows(campaign, edit)


def contents(folder: Path) -> dict[str, bytes]:
    """All files below a folder."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def assert_refused(done: subprocess.CompletedProcess[str], *words: str) -> None:
    """Exit status 2, nothing on standard output, one sentence on standard error that holds all words."""
    assert (done.returncode, done.stdout) == (2, ""), done.stderr
    assert done.stderr.startswith("trueaxis: ")
    assert done.stderr.count("\n") == 1, done.stderr
    assert "Traceback" not in done.stderr
    for word in words:
        assert word in done.stderr
