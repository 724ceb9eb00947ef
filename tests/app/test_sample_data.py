"""The sample data are what the commands beside them make, and they say that they are simulated."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import ROOT, SAMPLES

from app.__main__ import main
from app.paths import sample_folder, static_folder
from core.calibration import calibrate
from core.campaign_files import read_campaign

NUMBER = re.compile(r"-?\d+\.?\d*(?:e[+-]?\d+)?")
FILES = ("campaign.toml", "robot.toml", "measurements.csv")


def assert_same_text(made: str, kept: str) -> None:
    """Equal but for the last digits of numbers, which differ between machines."""
    assert NUMBER.sub("#", made) == NUMBER.sub("#", kept)
    np.testing.assert_allclose(
        [float(n) for n in NUMBER.findall(made)], [float(n) for n in NUMBER.findall(kept)], rtol=1e-9, atol=1e-9
    )


def documented_command(folder: Path) -> list[str]:
    """The arguments of the command by which a sample's README says it was made."""
    text = (folder / "README.md").read_text(encoding="utf-8")
    (command,) = re.findall(r"^    trueaxis (simulate .+)$", text, re.MULTILINE)
    return command.split()


@pytest.mark.parametrize("name", ["irb_l6", "scara_slide"])
def test_a_campaign_is_what_its_documented_command_makes(name: str, tmp_path: Path) -> None:
    arguments = documented_command(SAMPLES / name)
    assert arguments[arguments.index("--out") + 1] == f"sample_data/{name}"
    arguments[arguments.index("--out") + 1] = str(tmp_path / name)
    assert main(arguments) == 0
    for file in FILES:
        assert_same_text(
            (tmp_path / name / file).read_text(encoding="utf-8"), (SAMPLES / name / file).read_text(encoding="utf-8")
        )


def test_the_points_are_what_their_script_makes() -> None:
    script = SAMPLES / "one_axis" / "make_points.py"
    made = subprocess.run([sys.executable, script], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert_same_text(made, (SAMPLES / "one_axis" / "points.csv").read_text(encoding="utf-8"))


@pytest.mark.parametrize("folder", sorted(path.name for path in SAMPLES.iterdir()))
def test_every_sample_says_where_it_comes_from(folder: str) -> None:
    text = (SAMPLES / folder / "README.md").read_text(encoding="utf-8")
    for word in ("simulated", "Nothing in this folder was measured", "Source", "Licence", "mm"):
        assert word in text


@pytest.mark.parametrize("name", ["irb_l6", "scara_slide"])
def test_a_campaign_itself_says_that_it_is_simulated(name: str) -> None:
    campaign = read_campaign(SAMPLES / name)
    assert campaign.title.startswith("Simulated")
    assert campaign.notes["source"].startswith("simulated")


def test_the_samples_show_a_whole_arm_and_a_sliding_joint() -> None:
    whole, slide = (calibrate(read_campaign(SAMPLES / name)) for name in ("irb_l6", "scara_slide"))
    assert (whole.not_swept, slide.not_swept) == ((), ())
    assert whole.campaign.robot.joint_count == 6
    assert slide.campaign.robot.sliding.tolist() == [False, False, True, False]


def test_the_folders_are_found() -> None:
    assert sample_folder() == SAMPLES
    assert static_folder() == ROOT / "static"
