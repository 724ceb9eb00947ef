"""The robot of a session, whose files stand as texts in the session's own file."""

import os
import tempfile
from functools import lru_cache
from pathlib import Path

from core.errors import RobotError
from core.input_files import inside
from core.robot import Robot
from core.robot_files import read_robot

MAIN_FILE = "robot.toml"


@lru_cache(maxsize=16)
def robot_of_texts(toml: str, files: tuple[tuple[str, str], ...] = ()) -> Robot:
    """The robot that the text of a robot.toml describes.

    Args:
        files: names and texts of the files that it names.

    Raises:
        RobotError: as for ``read_robot``; places are told as in ``robot.toml``.
    """
    # The readers of robot descriptions take paths, since a robot.toml may name a file beside it.
    try:
        with tempfile.TemporaryDirectory(prefix="trueaxis-") as folder:
            return _read_within(Path(folder), toml, files)
    except OSError as wrong:
        raise RobotError(f"the robot cannot be read, as there is no room for it: {wrong.strerror}") from None


def write_texts(folder: Path, files: tuple[tuple[str, str], ...]) -> None:
    """Write texts into a folder, each whole or not at all.

    Raises:
        RobotError: the name of a file leads out of the folder, or it cannot be written.
    """
    for name, text in files:
        path = inside(folder, name, "the name of a robot's file", RobotError)
        beside = path.with_name(f".{path.name}.{os.getpid()}")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            beside.write_text(text, encoding="utf-8", newline="\n")
            os.replace(beside, path)
        except (OSError, ValueError) as wrong:
            raise RobotError(f"{name} cannot be written: {getattr(wrong, 'strerror', None) or wrong}") from None


def _read_within(folder: Path, toml: str, files: tuple[tuple[str, str], ...]) -> Robot:
    try:
        write_texts(folder, ((MAIN_FILE, toml), *files))
        return read_robot(folder / MAIN_FILE)
    except RobotError as wrong:
        raise RobotError(str(wrong).replace(f"{folder}{os.sep}", "")) from None
