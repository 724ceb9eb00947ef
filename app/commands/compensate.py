"""``trueaxis compensate``: wanted poses -> the poses and joint values to be commanded (figure 5)."""

import argparse
import sys
from pathlib import Path

from app.output import OutputFile, require_writable, write_files
from app.progress import Progress
from core.calibration_file import read_calibration
from core.compensation import FRAMES, OK, compensate
from core.errors import InputError
from core.inverse_kinematics import Tolerance
from core.pose_files import PoseTable, poses_csv, read_poses

MOST_NAMED = 20
EPILOG = """columns of POSES.csv, units in their names:
  pose                    what the pose is called; optional
  x_mm, y_mm, z_mm        where the tool's origin is to be (or _m)
  qw, qx, qy, qz          its orientation as a unit quaternion, or
  rx_deg, ry_deg, rz_deg  as turns about the fixed axes x, then y, then z (or _rad)
  q1_deg, q2_deg, ...     joint values near which the arm is to take the pose; optional,
                          without them the nominal solution nearest to the arm's marks

Poses are those of the tool that robot.toml describes (of the last frame, where it has
none), in the robot's base frame: the one of the nominal robot, tied to the real arm by
its first axes. The file written has the poses to be commanded in the same columns,
always in the robot's base frame, the joint commands, and a status for each row: ok, or
why the arm cannot take that pose; such rows are left empty."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("poses", type=Path, metavar="POSES.csv", help="poses that are wanted")
    parser.add_argument("--calibration", type=Path, required=True, metavar="FILE", help="calibration.json of the arm")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="CSV file to be written")
    parser.add_argument(
        "--frame", choices=FRAMES, default="base", help="in which the wanted poses are given (default: base)"
    )
    parser.add_argument(
        "--within-mm", type=_size, default=1e-6, metavar="D", help="accept a pose that is missed by this much"
    )
    parser.add_argument(
        "--within-mrad",
        type=_size,
        default=1e-6,
        metavar="D",
        help="the same for its orientation: an arm with fewer than six joints cannot take every one",
    )
    parser.epilog = EPILOG


def run(arguments: argparse.Namespace) -> None:
    """Find the commands and write them.

    Raises:
        InputError: a file cannot be used or written, or not one of the poses can be had.
    """
    out: Path = arguments.out
    require_writable(out.absolute().parent)
    with Progress(3) as progress:
        progress.step("reading")
        arm = read_calibration(arguments.calibration)
        table = read_poses(arguments.poses, arm.nominal)
        progress.step("inverse kinematics")
        tolerance = Tolerance(arguments.within_mm * 1e-3, arguments.within_mrad * 1e-3)
        found = compensate(arm, table.poses, table.near, arguments.frame, tolerance)
    failed = [k for k, status in enumerate(found.status) if status != OK]
    if len(failed) == len(found.status):
        raise InputError(f"{table.path}: none of the {len(failed)} poses can be had; {_named(table, found.status, 0)}")
    text = poses_csv(table, arm.nominal, found.pose, found.commanded, found.status)
    write_files(out.absolute().parent, (OutputFile(out.name, text),))
    _complain(table, found.status, failed)
    print(f"{out}: {len(found.status) - len(failed)} of {len(found.status)} poses")


def _complain(table: PoseTable, status: tuple[str, ...], failed: list[int]) -> None:
    """Name the rows that cannot be had on standard error."""
    for k in failed[:MOST_NAMED]:
        print(f"trueaxis: {_named(table, status, k)}", file=sys.stderr)
    if len(failed) > MOST_NAMED:
        print(f"trueaxis: and {len(failed) - MOST_NAMED} more, see the column status", file=sys.stderr)


def _named(table: PoseTable, status: tuple[str, ...], row: int) -> str:
    return f"row {table.lines[row]}, pose {table.names[row]}: {status[row]}"


def _size(text: str) -> float:
    try:
        size = float(text)
    except ValueError:
        size = -1.0
    if not 0 <= size < 1e6:
        raise argparse.ArgumentTypeError(f"{text!r}, expected a number of at least 0")
    return size
