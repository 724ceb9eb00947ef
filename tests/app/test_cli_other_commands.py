"""``trueaxis simulate``, ``trueaxis axis``, help, and how the program ends."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from command_line import ROOT, SAMPLES, assert_refused, contents, trueaxis

from app.__main__ import COMMANDS, main
from core.campaign_files import read_campaign
from core.errors import NotConverged
from core.version import VERSION

POINTS = SAMPLES / "one_axis" / "points.csv"


def test_simulate_makes_a_campaign_that_says_what_it_is(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "campaign"
    assert trueaxis("simulate", "--out", folder, "--seed", 3, "--arm", "scara").returncode == 0
    assert set(contents(folder)) == {"campaign.toml", "robot.toml", "measurements.csv"}
    campaign = read_campaign(folder)
    assert campaign.notes["source"].startswith("simulated")
    assert campaign.notes["seed"] == "3"
    assert campaign.robot.name == "SCARA 650"


def test_simulated_faults_change_the_points_and_nothing_else(tmp_path: Path) -> None:
    effects = ("--effect", "zero_offset:2:0.5deg", "scale:-:100ppm", "--effect", "zero_offset:3:-0.1deg")
    assert trueaxis("simulate", "--out", tmp_path / "healthy").returncode == 0
    assert trueaxis("simulate", "--out", tmp_path / "faulty", *effects).returncode == 0
    healthy, faulty = contents(tmp_path / "healthy"), contents(tmp_path / "faulty")
    assert healthy["robot.toml"] == faulty["robot.toml"]
    assert healthy["campaign.toml"] == faulty["campaign.toml"]
    apart = (
        read_campaign(tmp_path / "faulty").measurements.point_m
        - read_campaign(tmp_path / "healthy").measurements.point_m
    )
    assert np.abs(apart).max() > 0.005


def test_simulate_replaces_an_earlier_simulated_campaign_only(tmp_path: Path) -> None:
    folder = tmp_path / "campaign"
    assert trueaxis("simulate", "--out", folder, "--seed", 1).returncode == 0
    first = contents(folder)
    (folder / "README.md").write_text("mine")
    assert trueaxis("simulate", "--out", folder, "--seed", 2).returncode == 0
    assert contents(folder)["measurements.csv"] != first["measurements.csv"]
    assert (folder / "README.md").read_text() == "mine"
    text = (folder / "campaign.toml").read_text(encoding="utf-8")
    (folder / "campaign.toml").write_text(text.replace("simulated:", "measured:"), encoding="utf-8")
    before = contents(folder)
    assert_refused(trueaxis("simulate", "--out", folder), str(folder), "simulated campaign")
    assert contents(folder) == before


def test_simulate_refuses_a_folder_of_something_else(tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("years of work")
    assert_refused(trueaxis("simulate", "--out", tmp_path), str(tmp_path))
    assert contents(tmp_path) == {"thesis.txt": b"years of work"}


@pytest.mark.parametrize("effect", ["backlash", "wobble:1:1deg", "backlash:9:1deg", "backlash:2:1mm", "backlash:2:x"])
def test_simulate_refuses_effects_that_cannot_be(effect: str, tmp_path: Path) -> None:
    assert_refused(trueaxis("simulate", "--out", tmp_path / "out", "--effect", effect), "effect")
    assert not (tmp_path / "out").exists()


def test_axis_finds_the_axis_that_the_points_were_made_about() -> None:
    found = json.loads(trueaxis("axis", POINTS, "--json").stdout)
    direction = np.array([0.012, -0.021, 1.0]) / np.linalg.norm([0.012, -0.021, 1.0])
    assert np.linalg.norm(np.cross(found["direction"], direction)) < 4 * found["direction_std_rad"]
    between = np.array(found["point_mm"]) - [2150.0, -640.0, 810.0]
    off = between - direction * (between @ direction)
    assert np.linalg.norm(off) < 4 * found["point_std_mm"]
    assert found["direction_std_rad"] < 3e-4
    assert found["point_std_mm"] < 0.3


def test_axis_prints_a_short_table_with_uncertainties() -> None:
    done = trueaxis("axis", POINTS)
    found = json.loads(trueaxis("axis", POINTS, "--json").stdout)
    assert (done.returncode, done.stderr) == (0, "")
    assert len(done.stdout.splitlines()) < 12
    assert f"+- {found['point_std_mm']:.4f} mm" in done.stdout
    assert f"{found['radius_mm'][0]:.3f} mm" in done.stdout
    assert "commanded 60.0000 deg" in done.stdout


def test_axis_of_a_joint_that_slides(tmp_path: Path) -> None:
    rows = [f"{q},{100 + 0.6 * q},{50 + 0.8 * q},{7 + 0.001 * (-1) ** k}" for k, q in enumerate(range(0, 100, 10))]
    (tmp_path / "slide.csv").write_text("\n".join(["q_mm,x_mm,y_mm,z_mm", *rows, ""]))
    found = json.loads(trueaxis("axis", tmp_path / "slide.csv", "--json").stdout)
    assert (found["kind"], found["point_std_mm"]) == ("prismatic", None)
    np.testing.assert_allclose(found["direction"], [0.6, 0.8, 0.0], atol=1e-4)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ("0 bytes",)),
        ("x_mm,y_mm\n1,2\n", ("z_mm",)),
        ("x,y,z\n1,2,3\n", ("x_mm",)),
        ("x_mm,y_mm,z_mm\n1,2,3\n4,nan,6\n", ("row 3", "y_mm", "nan")),
        ("x_mm,y_mm,z_mm\n0,0,0\n1,0,1\n2,1,0\n", ("3 points",)),
        ("x_mm,y_mm,z_mm\n" + "1,2,3\n" * 6, ("expected",)),
        ("x_mm,y_mm,z_mm,sigma_mm\n1,2,3,0.1\n4,5,7,\n6,5,6,\n7,8,1,0.1\n8,8,4,1\n", ("sigma",)),
    ],
)
def test_axis_refuses_points_that_define_none(text: str, words: tuple[str, ...], tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_text(text)
    assert_refused(trueaxis("axis", tmp_path / "points.csv"), "points.csv", *words)


def test_help_and_version() -> None:
    assert trueaxis("--version").stdout == f"trueaxis {VERSION}\n"
    asked = trueaxis("--help")
    assert asked.returncode == 0
    for command in COMMANDS:
        assert command in asked.stdout
        assert trueaxis(command, "--help").returncode == 0


@pytest.mark.parametrize("arguments", [["--help"], ["--version"], ["calibrated"]])
def test_nothing_heavy_is_imported_before_a_command_is_known(arguments: list[str]) -> None:
    code = (
        "import sys; from app.__main__ import main; main(sys.argv[1:]); "
        "heavy = {'numpy', 'scipy', 'pandas', 'plotly', 'jinja2', 'viser'} & set(sys.modules); "
        "sys.exit(99 if heavy else 0)"
    )
    done = subprocess.run([sys.executable, "-c", code, *arguments], cwd=ROOT, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ["calibrated"],
        ["--what"],
        ["calibrate"],
        ["calibrate", "a"],
        ["simulate", "--out", "a", "--seed", "-1"],
        ["simulate", "--out", "a", "--seed", "x"],
        ["calibrate", "a", "--out", "b", "--estimator", "guess"],
    ],
)
def test_wrong_arguments_end_with_status_2(arguments: list[str]) -> None:
    done = trueaxis(*arguments)
    assert (done.returncode, done.stdout) == (2, "")
    assert "error:" in done.stderr.splitlines()[-1]


@pytest.mark.parametrize(
    ("error", "status", "words"),
    [
        (NotConverged("it did not settle"), 1, "it did not settle"),
        (ZeroDivisionError("by nought"), 1, "--debug"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (PermissionError(13, "Permission denied", "/some/place"), 2, "/some/place: Permission denied"),
    ],
)
def test_what_goes_wrong_becomes_one_sentence_and_a_status(
    error: BaseException, status: int, words: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(_: object) -> None:
        raise error

    monkeypatch.setattr("app.commands.axis.read_points", fail)
    assert main(["axis", str(POINTS)]) == status
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert words in said.err


def test_debug_shows_the_trace(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.commands.axis.read_points", lambda _: 1 // 0)
    with pytest.raises(ZeroDivisionError):
        main(["--debug", "axis", str(POINTS)])


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_reader_that_goes_away_makes_no_noise(unbuffered: str) -> None:
    environment = os.environ | {"PYTHONUNBUFFERED": unbuffered}
    read, write = os.pipe()
    os.close(read)
    command = [sys.executable, "-m", "app", "axis", str(POINTS), "--json"]
    done = subprocess.run(command, cwd=ROOT, stdout=write, stderr=subprocess.PIPE, env=environment, check=False)
    os.close(write)
    assert (done.returncode, done.stderr) == (1, b"")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no device here that is always full")
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_full_disk_under_standard_output_is_said(unbuffered: str) -> None:
    environment = os.environ | {"PYTHONUNBUFFERED": unbuffered}
    with open("/dev/full", "wb") as full:
        command = [sys.executable, "-m", "app", "axis", str(POINTS)]
        done = subprocess.run(command, cwd=ROOT, stdout=full, stderr=subprocess.PIPE, env=environment, check=False)
    assert done.returncode == 1
    assert done.stderr.count(b"\n") == 1
    assert b"No space left" in done.stderr


def test_an_interrupt_ends_it_with_status_130() -> None:
    code = (
        "import signal, sys, time; signal.signal(signal.SIGINT, signal.default_int_handler); "
        "import app.commands.axis as axis; from app.__main__ import main; "
        "axis.read_points = lambda path: (print('waiting', flush=True), time.sleep(60)); sys.exit(main(['axis', 'x']))"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "waiting\n"
    time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=20)
    assert (process.returncode, errors) == (130, "trueaxis: interrupted\n")
