"""robot.toml <-> Robot: the nominal arm from a phi-model, Denavit-Hartenberg rows or a URDF file."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from math import hypot
from pathlib import Path

import numpy as np

from core.errors import RobotError
from core.input_files import InputText, inside, read_text
from core.phi_model import PhiModel
from core.robot import Coupling, Joint, JointKind, LinkMass, Robot
from core.robot_builders import DhRow, PhiTool, from_source_frame, robot_from_dh, robot_from_phi
from core.toml_records import LIMIT_BYTES, TomlTable, parse_toml
from core.units import displacement_units, to_si
from core.urdf import URDF_LIMIT_BYTES, parse_urdf

ROBOT_FORMAT = "trueaxis-robot/1"
FRAME_KEYS = ("phi_deg", "a_mm", "b_mm", "alpha_deg", "theta_deg")
TOOL_KEYS = (*FRAME_KEYS, "gamma_deg", "h_mm")
DH_KEYS = ("theta_deg", "d_mm", "a_mm", "alpha_deg")
COUPLING_KEYS = ("from", "to", "gain", "compensated", "form")
JOINT_KEYS = ("kind", "limits", "drive_ratio", "transmission")
LINK_KEYS = ("mass_kg", "com_mm")
MOST_JOINTS = 100


@dataclass(frozen=True)
class RobotSource:
    """A robot and the bytes of the files that describe it, for the digest."""

    robot: Robot
    contents: tuple[bytes, ...]


def read_robot(path: Path | str) -> Robot:
    """The robot that a robot.toml describes.

    Raises:
        RobotError: the file is missing, unreadable or says something impossible; the message says where.
    """
    return read_robot_source(Path(path)).robot


def read_robot_source(path: Path) -> RobotSource:
    """The same, with the bytes that were read: robot.toml's, then the URDF file's if it names one.

    Raises:
        RobotError: as for ``read_robot``.
    """
    source = read_text(path, LIMIT_BYTES, RobotError)
    top = parse_toml(source, ROBOT_FORMAT, RobotError)
    forms = [key for key in ("frame", "dh", "urdf") if key in top]
    if len(forms) > 1:
        raise top.failed(f"the geometry is given {len(forms)} times, by {' and '.join(forms)}, expected one of them")
    if "tool" in top and forms and forms != ["frame"]:
        raise top.failed("[tool] goes with the phi-model's [[frame]] rows only")
    with _placed(top, path):
        joints = _joints(top)
    if forms == ["urdf"]:
        return _from_urdf(top, joints, source)
    with _placed(top, path):
        robot = _from_dh(top, joints) if forms == ["dh"] else _from_phi(top, joints)
    return RobotSource(robot, (source.data,))


@contextmanager
def _placed(top: TomlTable, path: Path) -> Iterator[None]:
    """Name the file in what a record refuses at its birth, which does not know where it comes from."""
    try:
        yield
    except RobotError as wrong:
        raise wrong if str(wrong).startswith(str(path)) else top.failed(str(wrong)) from None


def _from_phi(top: TomlTable, joints: tuple[Joint, ...]) -> Robot:
    rows = top.tables("frame")
    if not joints or len(rows) != len(joints) - 1:
        raise top.failed(
            f"{len(joints)} [[joint]] tables and {len(rows)} [[frame]] tables, expected one [[frame]] less than joints"
            " (or one [[dh]] a joint, or a urdf)"
        )
    for row in rows:
        row.only(*FRAME_KEYS)
    values = np.array([[_si(row, key) for key in FRAME_KEYS] for row in rows]).reshape(-1, 5)
    model = PhiModel(*values.T, sliding=np.array([joint.slides for joint in joints]))
    robot = robot_from_phi(top.text("name"), joints, model, _tool(top), _couplings(top), (), _gravity(top))
    return replace(robot, links=_links(top, robot))


def _from_dh(top: TomlTable, joints: tuple[Joint, ...]) -> Robot:
    rows = top.tables("dh")
    if not joints or len(rows) != len(joints):
        raise top.failed(
            f"{len(joints)} [[joint]] tables and {len(rows)} [[dh]] tables, expected one [[dh]] for each [[joint]]"
        )
    for row in rows:
        row.only(*DH_KEYS)
    dh_rows = [DhRow(*(_si(row, key) for key in DH_KEYS)) for row in rows]
    robot = robot_from_dh(top.text("name"), joints, dh_rows, _couplings(top), (), _gravity(top))
    return replace(robot, links=_links(top, robot))


def _from_urdf(top: TomlTable, joints: tuple[Joint, ...], source: InputText) -> RobotSource:
    path = source.path
    urdf_path = inside(path.parent, top.text("urdf"), f"{path}: urdf", RobotError)
    urdf = read_text(urdf_path, URDF_LIMIT_BYTES, RobotError)
    chain = parse_urdf(urdf, top.text("base_link"), top.text("tip_link"))
    if joints and len(joints) != len(chain.joints):
        raise top.failed(
            f"{len(joints)} [[joint]] tables, but {urdf_path} has {len(chain.joints)} moving joints between base_link"
            " and tip_link"
        )
    merged = tuple(
        _merge(top, number, said, found)
        for number, (said, found) in enumerate(zip(joints or chain.joints, chain.joints, strict=True), 1)
    )
    with _placed(top, path):
        robot = chain.robot(top.text("name", chain.name), merged, _couplings(top), _gravity(top))
        links = _links(top, robot)
    return RobotSource(replace(robot, links=links) if links else robot, (source.data, urdf.data))


def _merge(top: TomlTable, number: int, said: Joint, found: Joint) -> Joint:
    if said.slides != found.slides:
        raise top.failed(f"joint {number} is {said.kind}, but {found.kind} in the URDF file")
    return said if np.isfinite(said.limits).any() else replace(said, limits=found.limits)


def _joints(top: TomlTable) -> tuple[Joint, ...]:
    tables = top.tables("joint")
    if len(tables) > MOST_JOINTS:
        raise top.failed(f"{len(tables)} [[joint]] tables, expected at most {MOST_JOINTS}")
    return tuple(_joint(table) for table in tables)


def _joint(table: TomlTable) -> Joint:
    table.only(*JOINT_KEYS)
    kind = JointKind(table.choice("kind", tuple(JointKind)))
    limits = (-np.inf, np.inf)
    if "limits" in table:
        unit = displacement_units(kind is JointKind.PRISMATIC)[0]
        low, high = table.numbers("limits", 2, infinite=True)
        if not low < high:
            raise table.wrong("limits", f"two numbers in {unit}, the lower first")
        limits = (to_si(low, unit), to_si(high, unit))
    return Joint(kind, limits, _drive_ratio(table), table.text("transmission", "auto"))


def _drive_ratio(table: TomlTable) -> float | None:
    if "drive_ratio" not in table:
        return None
    over, under = (
        table.numbers("drive_ratio", 2) if table.is_list("drive_ratio") else (table.number("drive_ratio"), 1.0)
    )
    if min(abs(over), abs(under)) < 1e-9:
        raise table.wrong("drive_ratio", "a number other than 0, or two such numbers, the first over the second")
    return over / under


def _couplings(top: TomlTable) -> tuple[Coupling, ...]:
    tables = top.tables("coupling")
    if len(tables) > MOST_JOINTS:
        raise top.failed(f"{len(tables)} [[coupling]] tables, expected at most one a joint")
    return tuple(_coupling(table) for table in tables)


def _coupling(table: TomlTable) -> Coupling:
    table.only(*COUPLING_KEYS)
    return Coupling(
        source=table.integer("from"),
        target=table.integer("to"),
        gain=table.number("gain"),
        compensated=table.flag("compensated", True),
        form=table.text("form", "auto"),
    )


def _links(top: TomlTable, robot: Robot) -> tuple[LinkMass, ...]:
    tables = top.tables("link")
    if tables and len(tables) != robot.joint_count:
        raise top.failed(
            f"{len(tables)} [[link]] tables and {robot.joint_count} joints, expected one [[link]] a joint, or none"
        )
    for table in tables:
        table.no_bare(*LINK_KEYS)
    centres = [[to_si(v, "mm") for v in table.numbers("com_mm", 3)] for table in tables]
    return tuple(
        LinkMass(table.number("mass_kg", low=0.0), from_source_frame(robot, link, centre))
        for link, (table, centre) in enumerate(zip(tables, centres, strict=True), 1)
    )


def _gravity(top: TomlTable) -> tuple[float, float, float] | None:
    if "gravity" not in top:
        return None
    table = top.table("gravity")
    x, y, z = table.numbers("direction", 3)
    length = hypot(x, y, z)
    if length < 1e-9:
        raise table.wrong("direction", "a direction, not zero")
    return x / length, y / length, z / length


def _tool(top: TomlTable) -> PhiTool | None:
    if "tool" not in top:
        return None
    table = top.table("tool")
    table.only(*TOOL_KEYS)
    return PhiTool(*(_si(table, key, None if key in FRAME_KEYS else 0.0) for key in TOOL_KEYS))


def _si(table: TomlTable, key: str, default: float | None = None) -> float:
    return to_si(table.number(key, default), key.rpartition("_")[2])
