"""``trueaxis calibrate``: what it writes, where, and what it prints."""

import json
from pathlib import Path

import pandas as pd
import pytest
from command_line import ROOT, SAMPLES, assert_refused, contents, trueaxis


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str, str]:
    """The results of the sample campaign, and what was printed on both streams."""
    out = tmp_path_factory.mktemp("calibrate") / "deep" / "out"
    done = trueaxis("calibrate", "sample_data/irb_l6", "--out", out)
    assert done.returncode == 0, done.stderr
    return out, done.stdout, done.stderr


def test_the_files_of_the_contract_are_written(finished: tuple[Path, str, str]) -> None:
    out, _, _ = finished
    assert json.loads((out / "calibration.json").read_text(encoding="utf-8"))["format"] == "trueaxis-calibration/1"
    assert "</" in (out / "report.html").read_text(encoding="utf-8")
    tables = list((out / "tables").glob("*.csv"))
    assert tables
    assert max(len(pd.read_csv(path)) for path in tables) > 100
    assert {path.name for path in out.iterdir()} == {"calibration.json", "report.html", "tables"}
    assert [path.name for path in out.parent.iterdir()] == ["out"]


def test_the_summary_says_what_was_done_and_nothing_stands_on_standard_error(
    finished: tuple[Path, str, str],
) -> None:
    out, printed, errors = finished
    result = json.loads((out / "calibration.json").read_text(encoding="utf-8"))
    assert errors == ""
    assert f"{result['robot']}, 6 joints" in printed
    assert f"{result['noise_mm']:.3f} mm" in printed
    assert f"{result['points']['used']} used, {result['points']['rejected']} rejected" in printed
    significant = [finding["text"] for finding in result["findings"] if finding["significant"]]
    assert [line[4:] for line in printed.splitlines() if line.startswith("  - ")] == significant[:8]
    assert str(out / "calibration.json") in printed


def test_the_same_input_gives_the_same_bytes(finished: tuple[Path, str, str], tmp_path: Path) -> None:
    done = trueaxis("calibrate", SAMPLES / "irb_l6", "--out", tmp_path / "again")
    assert done.returncode == 0
    assert contents(tmp_path / "again") == contents(finished[0])


def test_json_is_all_that_stands_on_standard_output(finished: tuple[Path, str, str], tmp_path: Path) -> None:
    done = trueaxis("calibrate", "sample_data/irb_l6", "--out", tmp_path, "--json")
    assert done.stdout == (finished[0] / "calibration.json").read_text(encoding="utf-8")
    assert "6 joints" in done.stderr


def test_foreign_files_stay_and_own_files_are_replaced(tmp_path: Path) -> None:
    (tmp_path / "tables").mkdir()
    (tmp_path / "tables" / "mine.csv").write_text("a,b\n")
    (tmp_path / "report.html").write_text("old")
    assert trueaxis("calibrate", "sample_data/scara_slide", "--out", tmp_path).returncode == 0
    assert (tmp_path / "tables" / "mine.csv").read_text() == "a,b\n"
    assert (tmp_path / "report.html").read_text(encoding="utf-8") != "old"
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_the_estimator_and_kept_points_are_the_ones_asked_for(tmp_path: Path) -> None:
    arguments = ("calibrate", "sample_data/irb_l6", "--out", tmp_path, "--estimator", "paper", "--keep-all", "--json")
    result = json.loads(trueaxis(*arguments).stdout)
    assert result["estimator"] == "paper"
    assert all(sweep["used"] == sweep["points"] for sweep in result["sweeps"])


@pytest.mark.parametrize("below", ["file", "file/out", "file/deep/out"])
def test_an_output_folder_below_a_file_is_refused(below: str, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    assert_refused(trueaxis("calibrate", "sample_data/irb_l6", "--out", tmp_path / below), str(tmp_path / "file"))
    assert contents(tmp_path) == {"file": b"mine"}


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="there is no file system here that nobody may write in")
def test_an_output_folder_that_nobody_may_write_is_refused() -> None:
    assert_refused(trueaxis("calibrate", "sample_data/irb_l6", "--out", "/proc/trueaxis/out"), "/proc/trueaxis/out")


def test_a_folder_in_the_place_of_a_file_is_refused_and_nothing_replaced(tmp_path: Path) -> None:
    (tmp_path / "calibration.json").write_text("old")
    (tmp_path / "report.html").mkdir()
    done = trueaxis("calibrate", "sample_data/irb_l6", "--out", tmp_path)
    assert_refused(done, str(tmp_path / "report.html"), "folder")
    assert contents(tmp_path) == {"calibration.json": b"old"}


def test_names_that_are_not_ascii_survive(tmp_path: Path) -> None:
    out = tmp_path / "Käfig 機械"
    done = trueaxis("calibrate", ROOT / "sample_data" / "irb_l6", "--out", out)
    assert done.returncode == 0, done.stderr
    assert (out / "calibration.json").is_file()
