"""A campaign folder -> Campaign: the one place where other people's files turn into SI units and checked records."""

import hashlib
from pathlib import Path

import numpy as np

from core.errors import CampaignError
from core.geometry import Array
from core.input_files import inside, read_text
from core.measurement_table import read_measurements
from core.measurements import Campaign, Instrument, Target
from core.robot import Robot
from core.robot_builders import from_source_frame
from core.robot_files import read_robot_source
from core.toml_records import LIMIT_BYTES, TomlTable, parse_toml
from core.units import displacement_units, to_si

CAMPAIGN_FORMAT = "trueaxis-campaign/1"
INSTRUMENT_KINDS = ("theodolite-pair", "total-station", "laser-tracker", "other")
JOINT_VALUES = ("commanded", "goal", "readback")
KNOWN_KEYS = ("format", "title", "robot", "joint_values", "instrument", "sim", "target", "home", "notes")
TARGET_KEYS = ("name", "link", "xyz_mm", "xyz_sigma_mm")


def read_campaign(folder: Path | str) -> Campaign:
    """The campaign in a folder of campaign.toml, robot.toml and measurements.csv.

    Targets and centres of mass come out in the core's frame i, whatever frame the robot's source calls 'link i'.

    Raises:
        CampaignError, RobotError: a file is missing or holds something that cannot be; one sentence says where.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise CampaignError(
            f"{folder} is {'not a folder' if folder.exists() else 'missing'}, expected a campaign folder"
        )
    source = read_text(folder / "campaign.toml", LIMIT_BYTES, CampaignError)
    top = parse_toml(source, CAMPAIGN_FORMAT, CampaignError)
    robot_path = inside(folder, top.text("robot", "robot.toml"), f"{source.path}: robot", CampaignError)
    described = read_robot_source(robot_path)
    robot = described.robot
    targets, instrument = _targets(top, robot), _instrument(top)
    joint_values = top.choice("joint_values", JOINT_VALUES, "commanded")
    measurements, data = read_measurements(
        folder / "measurements.csv", robot, targets, instrument.sigma_m, limited=joint_values != "readback"
    )
    return Campaign(
        robot=robot,
        targets=targets,
        measurements=measurements,
        title=_title(top),
        instrument=instrument,
        joint_values=joint_values,
        home=_home(top, robot),
        place_simulated=top.table("sim").flag("place", False),
        notes=top.free_texts(KNOWN_KEYS) | top.table("notes").free_texts(),
        digest=_digest(source.data, described.contents[0], data, *described.contents[1:]),
    )


def _digest(*contents: bytes) -> str:
    """SHA-256, as hex digits, of campaign.toml, robot.toml, measurements.csv and the URDF file, in this order."""
    digest = hashlib.sha256()
    for content in contents:
        digest.update(content)
    return digest.hexdigest()


def _title(top: TomlTable) -> str:
    return top.text("title") if "title" in top else ""


def _instrument(top: TomlTable) -> Instrument:
    table = top.table("instrument")
    table.no_bare("sigma_mm", "turn_sigma_mrad")
    kind = table.choice("kind", INSTRUMENT_KINDS, "other")
    sigma = None
    if "sigma_mm" in table:
        sigma = to_si(table.number("sigma_mm", low=1e-9), "mm")
    turn = None
    if "turn_sigma_mrad" in table:
        turn = to_si(table.number("turn_sigma_mrad", low=1e-9), "mrad")
    return Instrument(kind, sigma, table.free_texts(("kind", "sigma_mm", "turn_sigma_mrad")), turn)


def _targets(top: TomlTable, robot: Robot) -> tuple[Target, ...]:
    tables = top.tables("target")
    if not tables:
        raise top.failed("no [[target]], expected one for each target that was measured")
    targets = tuple(_target(table, robot) for table in tables)
    seen = set()
    for target, table in zip(targets, tables, strict=True):
        if target.name in seen:
            raise table.wrong("name", "a name of its own")
        seen.add(target.name)
    return targets


def _target(table: TomlTable, robot: Robot) -> Target:
    table.no_bare("xyz_mm", "xyz_sigma_mm")
    name, link = table.text("name").strip(), table.integer("link")
    if not 0 <= link <= robot.joint_count:
        raise table.wrong("link", f"a link 0..{robot.joint_count} of {robot.name}")
    sigma_m = to_si(table.number("xyz_sigma_mm", 0.0, low=0.0), "mm")
    if "xyz_mm" not in table:
        return Target(name, link, None, sigma_m)
    place = [to_si(value, "mm") for value in table.numbers("xyz_mm", 3)]
    return Target(name, link, from_source_frame(robot, link, place), sigma_m)


def _home(top: TomlTable, robot: Robot) -> Array | None:
    """Commands at the arm's marks, (n,), rad or m; None where the campaign does not tell."""
    if "home" not in top:
        return None
    table = top.table("home")
    if "q" not in table:
        raise table.wrong(
            "q", f"a list of {robot.joint_count} numbers, deg (mm where a joint slides), 0 for passive joints"
        )
    values = table.numbers("q", robot.joint_count)
    units = [displacement_units(joint.slides)[0] for joint in robot.joints]
    home = np.array([to_si(value, unit) for value, unit in zip(values, units, strict=True)])
    if home[~robot.commanded].any():
        raise table.wrong("q", "0 for joints that are passive")
    return home
