"""What is installed is complete: the wheel holds the code and everything that it reads."""

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from command_line import ROOT

from core.version import VERSION


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "-w", folder, ROOT]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (built,) = folder.glob("*.whl")
    return built


def shipped(folder: str) -> set[str]:
    """Files of a folder of the repository that belong in a wheel."""
    return {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / folder).rglob("*")
        if path.is_file() and path.suffix != ".pyc"
    }


@pytest.mark.slow
def test_the_wheel_holds_everything(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    assert shipped("core") | shipped("app") <= names
    data = shipped("static") | shipped("sample_data")
    assert len(shipped("static")) > 0
    assert {f"app/{name}" for name in data} <= names
    assert not [name for name in names if name.startswith(("tests", "static", "sample_data"))]


@pytest.mark.slow
def test_the_wheel_is_named_after_the_one_version_and_brings_the_command(wheel: Path) -> None:
    assert wheel.name == f"trueaxis-{VERSION}-py3-none-any.whl"
    entry = zipfile.ZipFile(wheel).read(f"trueaxis-{VERSION}.dist-info/entry_points.txt").decode()
    assert "trueaxis = app.__main__:main" in entry


@pytest.mark.slow
def test_the_wheel_alone_calibrates_its_own_sample(wheel: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(wheel) as packed:
        packed.extractall(tmp_path / "site")
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]); "
        "from app.__main__ import main; from app.paths import sample_folder; "
        "sys.exit(main(['calibrate', str(sample_folder() / 'irb_l6'), '--out', sys.argv[2]]))"
    )
    done = subprocess.run(
        [sys.executable, "-P", "-c", code, tmp_path / "site", tmp_path / "out"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "calibration.json").is_file()
