"""Every wrong campaign gets one clear sentence, exit status 2, and leaves nothing behind."""

from collections.abc import Callable
from pathlib import Path

import pytest
from command_line import Row, assert_refused, contents, copy_of_sample, edit_cell, edit_rows, trueaxis

Spoil = Callable[[Path], object]


def without_column(name: str) -> Spoil:
    def edit(rows: list[Row]) -> list[Row]:
        return [{key: value for key, value in row.items() if key != name} for row in rows]

    return lambda campaign: edit_rows(campaign, edit)


def renamed_column(old: str, new: str) -> Spoil:
    def edit(rows: list[Row]) -> list[Row]:
        return [{new if key == old else key: value for key, value in row.items()} for row in rows]

    return lambda campaign: edit_rows(campaign, edit)


def cell(row: int, column: str, value: str) -> Spoil:
    return lambda campaign: edit_cell(campaign, row, column, value)


def sweep_of_three(campaign: Path) -> None:
    def edit(rows: list[Row]) -> list[Row]:
        return [row for row in rows if row["joint"] != "1" or int(row["step"]) < 3]

    edit_rows(campaign, edit)


def no_sweeps(campaign: Path) -> None:
    edit_rows(campaign, lambda rows: [row for row in rows if row["phase"] != "sweep"])


def content(name: str, data: bytes) -> Spoil:
    return lambda campaign: (campaign / name).write_bytes(data)


def of_200_mb(name: str) -> Spoil:
    def spoil(campaign: Path) -> None:
        with (campaign / name).open("wb") as file:
            file.truncate(200_000_000)

    return spoil


def replaced(name: str, old: str, new: str) -> Spoil:
    def spoil(campaign: Path) -> None:
        text = (campaign / name).read_text(encoding="utf-8")
        assert old in text
        (campaign / name).write_text(text.replace(old, new, 1), encoding="utf-8")

    return spoil


FILES = ("campaign.toml", "robot.toml", "measurements.csv")
CASES: dict[str, tuple[Spoil, tuple[str, ...]]] = {
    "missing column": (without_column("y_mm"), ("measurements.csv", "y_mm")),
    "missing command": (without_column("q4_deg"), ("measurements.csv", "q4_deg")),
    "no unit on a point": (renamed_column("x_mm", "x"), ("measurements.csv", "x", "x_mm")),
    "no unit on a command": (renamed_column("q2_deg", "q2"), ("measurements.csv", "q2", "q2_deg")),
    "NaN in a point": (cell(5, "z_mm", "nan"), ("measurements.csv", "row 7", "z_mm", "nan", "number")),
    "NaN in a command": (cell(5, "q1_deg", "NaN"), ("measurements.csv", "row 7", "q1_deg", "NaN", "number")),
    "infinite": (cell(0, "x_mm", "inf"), ("measurements.csv", "row 2", "x_mm", "inf")),
    "text in a number": (cell(9, "x_mm", "12,5 mm"), ("measurements.csv", "row 11", "x_mm", "12,5 mm", "number")),
    "duplicate record": (cell(3, "record", "3"), ("measurements.csv", "row 5", "record", "3")),
    "unknown target": (cell(2, "target", "T77"), ("measurements.csv", "row 4", "T77")),
    "sweep of 3 points": (sweep_of_three, ("measurements.csv", "joint 1", "3 points")),
    "no sweeps": (no_sweeps, ("sweep",)),
    "outside the limits": (cell(4, "q1_deg", "999"), ("measurements.csv", "row 6", "q1_deg", "999")),
    "not there joint": (cell(4, "joint", "7"), ("measurements.csv", "row 6", "joint", "7")),
    "link that is not there": (replaced("campaign.toml", "link = 4", "link = 9"), ("campaign.toml", "9")),
    "not TOML": (replaced("robot.toml", "=", "=="), ("robot.toml",)),
    **{f"empty {name}": (content(name, b""), (name, "0 bytes")) for name in FILES},
    **{f"200 MB {name}": (of_200_mb(name), (name, "200.0 MB")) for name in FILES},
    **{f"not UTF-8 {name}": (content(name, b"x = 1\n\xff\xfe,1\n"), (name, "UTF-8")) for name in FILES},
    **{f"no {name}": (lambda campaign, name=name: (campaign / name).unlink(), (name, "missing")) for name in FILES},
}


@pytest.mark.parametrize("case", CASES)
def test_a_wrong_campaign_is_refused_in_one_sentence(case: str, tmp_path: Path) -> None:
    spoil, words = CASES[case]
    campaign = copy_of_sample(tmp_path)
    spoil(campaign)
    before = {name for name in contents(tmp_path)}
    assert_refused(trueaxis("calibrate", campaign, "--out", tmp_path / "out"), *words)
    assert not (tmp_path / "out").exists()
    assert {name for name in contents(tmp_path)} == before


def test_the_unspoiled_copy_is_accepted(tmp_path: Path) -> None:
    done = trueaxis("calibrate", copy_of_sample(tmp_path), "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr


def test_a_folder_that_is_not_there(tmp_path: Path) -> None:
    assert_refused(trueaxis("calibrate", tmp_path / "nowhere", "--out", tmp_path / "out"), "nowhere", "missing")
    assert contents(tmp_path) == {}


def test_a_file_instead_of_a_folder(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("here")
    assert_refused(trueaxis("calibrate", tmp_path / "file", "--out", tmp_path / "out"), "file", "folder")
    assert not (tmp_path / "out").exists()


def test_a_refused_campaign_leaves_earlier_results_as_they_were(tmp_path: Path) -> None:
    campaign, out = copy_of_sample(tmp_path), tmp_path / "out"
    assert trueaxis("calibrate", campaign, "--out", out).returncode == 0
    (out / "mine.txt").write_text("keep me")
    before = contents(out)
    edit_cell(campaign, 0, "x_mm", "nan")
    assert_refused(trueaxis("calibrate", campaign, "--out", out), "nan")
    assert contents(out) == before
