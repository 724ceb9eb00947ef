"""``trueaxis export``: the calibrated robot for other tools."""

import argparse
import sys
from pathlib import Path

from app.output import OutputFile, require_writable, write_files
from core.calibrated_arm import CalibratedArm
from core.calibration_file import read_calibration
from core.dh_export import dh_chain, dh_json, dh_warnings
from core.robot_export import chain_json, mjcf_text, urdf_text

FORMATS = ("urdf", "mjcf", "dh", "json")
EPILOG = """formats:
  urdf   links and joints, every axis on z, the tool behind a fixed joint
  mjcf   nested bodies for MuJoCo, the tool as a site
  dh     standard Denavit-Hartenberg rows as JSON, with a warning where axes are nearly parallel
  json   the chain as 4x4 transforms

All of them hold the geometry in the robot's base frame. Joint values are net displacements: what drives and couplings
make of commands is in calibration.json, and trueaxis compensate turns poses into commands."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("--calibration", type=Path, required=True, metavar="FILE", help="calibration.json of the arm")
    parser.add_argument("--format", choices=FORMATS, required=True, help="what to write")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="file to be written")
    parser.epilog = EPILOG


def run(arguments: argparse.Namespace) -> None:
    """Write the calibrated robot.

    Raises:
        InputError: the calibration cannot be used, or the file cannot be written.
    """
    out: Path = arguments.out
    require_writable(out.absolute().parent)
    arm = read_calibration(arguments.calibration)
    write_files(out.absolute().parent, (OutputFile(out.name, _text(arm, arguments.format)),))
    if arguments.format == "dh":
        for sentence in dh_warnings(dh_chain(arm.robot)):
            print(f"trueaxis: {sentence}", file=sys.stderr)
    print(f"{out}: {arm.robot.name}, calibrated with {arm.source or 'a campaign without a title'}")


def _text(arm: CalibratedArm, form: str) -> str:
    if form == "urdf":
        return urdf_text(arm.robot)
    if form == "mjcf":
        return mjcf_text(arm.robot)
    return dh_json(arm.robot) if form == "dh" else chain_json(arm)
