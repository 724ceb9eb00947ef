"""``trueaxis simulate``: a campaign measured on a simulated arm, which says that it is simulated."""

import argparse
import tomllib
from pathlib import Path

from app.output import OutputFile, require_writable, write_files
from core.campaign_files import CAMPAIGN_FORMAT
from core.campaign_writer import campaign_toml
from core.errors import InputError
from core.measurement_writer import measurements_csv
from core.twin import irb_l6, scara
from core.twin.campaign import simulate_campaign
from core.twin.cell import Cell
from core.twin.effects import CATALOGUE, parse_effect

ARMS = {"irb_l6": irb_l6.cell, "scara": scara.cell}
LARGEST_SEED = 2**63 - 1


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="campaign folder to be made")
    parser.add_argument("--seed", type=_seed, default=1, metavar="N", help="of the random numbers (default: 1)")
    parser.add_argument(
        "--arm", choices=tuple(ARMS), default="irb_l6", help="irb_l6: the paper's robot (default); scara: has a slide"
    )
    parser.add_argument(
        "--effect",
        nargs="+",
        action="extend",
        default=[],
        metavar="NAME:JOINT:SIZE",
        help="faults to be put in, for example backlash:3:0.2deg",
    )
    parser.epilog = _catalogue()


def run(arguments: argparse.Namespace) -> None:
    """Simulate a campaign and write its folder.

    Raises:
        InputError: an effect cannot be, or the folder holds something else than a simulated campaign.
    """
    folder: Path = arguments.out
    require_writable(folder)
    _require_replaceable(folder)
    cell: Cell = ARMS[arguments.arm]()
    effects = tuple(parse_effect(text, cell.robot) for text in arguments.effect)
    campaign = simulate_campaign(arguments.seed, cell, effects=effects)
    files = (
        OutputFile("campaign.toml", campaign_toml(campaign)),
        OutputFile("robot.toml", cell.robot_toml()),
        OutputFile("measurements.csv", measurements_csv(campaign)),
    )
    write_files(folder, files)
    faults = f" with {', '.join(arguments.effect)} (not written down in it)" if effects else ""
    print(f"{folder}: {campaign.title}, seed {arguments.seed}, {campaign.measurements.count} points{faults}")


def _seed(text: str) -> int:
    try:
        seed = int(text)
    except ValueError:
        seed = -1
    if not 0 <= seed <= LARGEST_SEED:
        raise argparse.ArgumentTypeError(f"{text!r}, expected a whole number of at least 0")
    return seed


def _catalogue() -> str:
    """What can be put in, one line each."""
    lines = ["effects (NAME:JOINT:SIZE; sizes without a unit are in the one shown):"]
    lines += [f"  {kind.name:13} at {kind.place}; {kind.unit}\n{'':16}{kind.meaning}" for kind in CATALOGUE]
    return "\n".join(lines)


def _require_replaceable(folder: Path) -> None:
    """Never write over anything that may be somebody's measurements."""
    if not folder.exists() or not any(folder.iterdir()):
        return
    described = folder / "campaign.toml"
    try:
        found = tomllib.loads(described.read_text(encoding="utf-8"))
        notes = found.get("notes", {})
        simulated = found.get("format") == CAMPAIGN_FORMAT and str(notes.get("source", "")).startswith("simulated")
    except (OSError, ValueError, AttributeError):
        simulated = False
    if not simulated:
        raise InputError(
            f"{folder} holds files that are not an earlier simulated campaign and is left as it is; "
            "expected a new or empty folder, or such a campaign"
        )
