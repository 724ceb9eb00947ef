"""Files that came one by one through a browser, put together: a robot, or a whole campaign.

    robot.toml                            a robot
    robot.toml, and the URDF that it names    a robot
    a URDF, and two links of it           a robot
    campaign.toml, its robot, measurements.csv    a campaign

A tray never changes; ``added`` makes a new one. Every file is checked as it comes.
"""

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path, PurePosixPath, PureWindowsPath
from tempfile import TemporaryDirectory

from core.campaign_files import CAMPAIGN_FORMAT
from core.errors import InputError, RobotError
from core.input_files import MEGABYTE, InputText, one_line, shown
from core.robot import Robot
from core.robot_files import ROBOT_FORMAT
from core.session_events import Event, RobotChosen
from core.session_import import campaign_events
from core.session_robot import robot_of_texts
from core.text_table import LIMIT_BYTES as CSV_LIMIT_BYTES
from core.toml_records import LIMIT_BYTES as TOML_LIMIT_BYTES
from core.toml_records import TomlTable, parse_toml
from core.toml_text import toml_text
from core.urdf import URDF_LIMIT_BYTES, chain_ends

MOST_FILES = 10
LIMITS = {".toml": TOML_LIMIT_BYTES, ".urdf": URDF_LIMIT_BYTES, ".xml": URDF_LIMIT_BYTES, ".csv": CSV_LIMIT_BYTES}
MEASUREMENTS, CAMPAIGN = "measurements.csv", "campaign.toml"
_SAYS = re.compile(r"""^[ \t]*format[ \t]*=[ \t]*["']([^"'\n]{0,60})["']""", re.MULTILINE)


@dataclass(frozen=True)
class Tray:
    """Texts of files by name."""

    files: tuple[tuple[str, str], ...] = ()

    def added(self, name: str, data: bytes) -> "Tray":
        """The tray with one more file; one of the same name is replaced.

        Raises:
            InputError: it is too large, no text, of a kind that is of no use here, or there are too many.
        """
        name = plain_name(name)
        text = _text(name, data)
        if _ending(name) == ".toml":
            _table(name, text)
        files = (*(pair for pair in self.files if pair[0] != name), (name, text))
        if len(files) > MOST_FILES:
            raise InputError(f"{name} is one file too many, expected at most {MOST_FILES} at a time")
        return Tray(files)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(name for name, _ in self.files)

    @property
    def campaign(self) -> str | None:
        """The name of the file that describes a campaign; None: there is none."""
        return self._of_format(CAMPAIGN_FORMAT)

    @property
    def urdf_ends(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Links where a chain of a lone URDF file may begin and end; empty where robot.toml says it, or none is there.

        Raises:
            RobotError: the file is no URDF.
        """
        name = self._lone_urdf()
        return ((), ()) if name is None else chain_ends(self._source(name))

    def missing(self) -> str:
        """What is still needed, in a sentence; empty: a robot, or a campaign where one is described, is complete."""
        if self._missing_robot() or self.campaign is None or self._csv() is not None:
            return self._missing_robot()
        return f"{self.campaign} needs {MEASUREMENTS}, which is missing"

    def robot_event(self, base_link: str = "", tip_link: str = "") -> RobotChosen:
        """The robot in the tray.

        Args:
            base_link, tip_link: of a lone URDF file.

        Raises:
            InputError: something is missing, or the robot cannot be read.
        """
        self._require(self._missing_robot())
        name = self._robot_file()
        if name is None:
            return self._of_urdf(base_link, tip_link)
        toml, named = self._text_of(name), self._urdf_of(name)
        files = {} if named is None else {named: self._text_of(PurePosixPath(named).name)}
        event = RobotChosen(toml, files)
        _read(event)
        return event

    def robot(self, base_link: str = "", tip_link: str = "") -> Robot:
        """The same, read.

        Raises:
            InputError: as for ``robot_event``.
        """
        return _read(self.robot_event(base_link, tip_link))

    def campaign_events(self) -> list[Event]:
        """The campaign in the tray as events.

        Raises:
            InputError: something is missing, or it cannot be read.
        """
        self._require("campaign.toml is missing" if self.campaign is None else self.missing())
        try:
            with TemporaryDirectory(prefix="trueaxis-") as place:
                folder = Path(place)
                for name, text in self._placed():
                    (folder / name).parent.mkdir(parents=True, exist_ok=True)
                    (folder / name).write_text(text, encoding="utf-8", newline="")
                try:
                    return campaign_events(folder)
                except InputError as wrong:
                    raise type(wrong)(str(wrong).replace(f"{folder}/", "").replace(str(folder), "the files")) from None
        except OSError as wrong:
            raise InputError(f"the campaign cannot be read, as there is no room for it: {wrong.strerror}") from None

    def _placed(self) -> list[tuple[str, str]]:
        """The files of the campaign under the names by which they name each other."""
        campaign, robot = self.campaign, self._robot_file()
        named = _table(campaign, self._text_of(campaign)).text("robot", "robot.toml")
        placed = [(CAMPAIGN, self._text_of(campaign)), (MEASUREMENTS, self._text_of(self._csv()))]
        placed.append((_within(named), self._text_of(robot)))
        urdf = self._urdf_of(robot)
        if urdf is not None:
            placed.append(
                (str(PurePosixPath(_within(named)).parent / _within(urdf)), self._text_of(PurePosixPath(urdf).name))
            )
        return placed

    def _of_urdf(self, base_link: str, tip_link: str) -> RobotChosen:
        name = self._lone_urdf()
        if not base_link or not tip_link:
            raise InputError(f"{name}: no base and no tip of the arm is chosen, expected two of its links")
        lines = (f"format = {toml_text(ROBOT_FORMAT)}", f"urdf = {toml_text(name)}")
        ends = (f"base_link = {toml_text(base_link)}", f"tip_link = {toml_text(tip_link)}")
        event = RobotChosen("\n".join((*lines, *ends)) + "\n", {name: self._text_of(name)})
        _read(event)
        return event

    def _missing_robot(self) -> str:
        robot = self._robot_file()
        if robot is None:
            return "" if self._lone_urdf() else "a robot is missing: robot.toml, or a URDF file"
        named = self._urdf_of(robot)
        if named is not None and PurePosixPath(named).name not in self.names:
            return f"{robot} names the URDF file {shown(named)}, which is missing"
        return ""

    @staticmethod
    def _require(missing: str) -> None:
        if missing:
            raise InputError(f"{missing}, expected it among the files")

    def _of_format(self, form: str) -> str | None:
        found = (name for name, text in self.files if _ending(name) == ".toml" and _format(text) == form)
        return next(found, None)

    def _robot_file(self) -> str | None:
        return self._of_format(ROBOT_FORMAT)

    def _lone_urdf(self) -> str | None:
        """A URDF file that no robot.toml describes."""
        if self._robot_file() is not None:
            return None
        return next((name for name in self.names if _ending(name) in (".urdf", ".xml")), None)

    def _csv(self) -> str | None:
        found = [name for name in self.names if _ending(name) == ".csv"]
        return MEASUREMENTS if MEASUREMENTS in found else next(iter(found), None)

    def _urdf_of(self, robot: str) -> str | None:
        values = tomllib.loads(self._text_of(robot))
        return values["urdf"] if isinstance(values.get("urdf"), str) else None

    def _text_of(self, name: str) -> str:
        return dict(self.files)[name]

    def _source(self, name: str) -> InputText:
        text = self._text_of(name)
        return InputText(Path(name), text.encode(), text)


def plain_name(name: str) -> str:
    """The last part of a file's name, whatever path a browser sends with it.

    Raises:
        InputError: nothing sensible is left.
    """
    last = PureWindowsPath(PurePosixPath(name.replace("\0", "")).name).name
    if not last or last.startswith(".") or not one_line(last):
        raise InputError(f"a file is called {shown(name)}, expected a plain name")
    return last


def _text(name: str, data: bytes) -> str:
    limit = LIMITS.get(_ending(name))
    if limit is None:
        raise InputError(f"{name} is of no use here, expected one of {', '.join(LIMITS)}, .zip or .trueaxis")
    if len(data) > limit:
        raise InputError(f"{name} has {len(data) / MEGABYTE:.1f} MB, expected at most {limit / MEGABYTE:g} MB")
    if not data.strip():
        raise InputError(f"{name} is empty")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as wrong:
        raise InputError(f"{name}: byte {data[wrong.start]:#04x} at offset {wrong.start} is not UTF-8 text") from None
    if "\0" in text:
        raise InputError(f"{name} holds a NUL byte, expected plain UTF-8 text")
    return text


def _table(name: str, text: str) -> TomlTable:
    """A TOML file of one of the two formats."""
    form = CAMPAIGN_FORMAT if _format(text) == CAMPAIGN_FORMAT else ROBOT_FORMAT
    return parse_toml(InputText(Path(name), text.encode(), text), form, InputError)


def _format(text: str) -> str | None:
    """What a TOML file says of itself, without reading all of it."""
    found = _SAYS.search(text)
    return None if found is None else found[1]


def _within(name: str) -> str:
    """A name that stays in its folder; else only its last part, which then is not found and told."""
    path = PurePosixPath(name)
    return path.name if path.is_absolute() or ".." in path.parts else str(path)


def _read(event: RobotChosen) -> Robot:
    robot = robot_of_texts(event.toml, tuple(event.files.items()))
    if robot.joint_count < 1:
        raise RobotError("the robot has no joint")
    return robot


def _ending(name: str) -> str:
    return PurePosixPath(name).suffix.lower()
