"""``trueaxis verify``: errors of the nominal and the calibrated arm over a campaign's pose records."""

import argparse
import math
from pathlib import Path

from app.output import OutputFile, require_writable, write_files
from app.progress import Progress
from app.standard_output import print_result
from core.calibration_file import read_calibration
from core.campaign_files import read_campaign
from core.verification import Limits, Verification, calibrated_verdict, verify
from core.verification_json import verification_to_json

EPILOG = """A pose counts whole where three or more targets on the last link were seen, not on one line, or a 6-D
target (columns target_qw, ...); else with the position of its targets alone. Where they sit on the link is taken from
the sweeps of the calibration, or from xyz_mm in campaign.toml, and as far as neither tells, for each pose from the
other poses. With limits every pose passes, fails, or is undecided: its error with two standard uncertainties more is
within, with two less is not, or neither."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("campaign", type=Path, metavar="CAMPAIGN", help="campaign folder with pose records")
    parser.add_argument("--calibration", type=Path, required=True, metavar="FILE", help="calibration.json of the arm")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for the results")
    parser.add_argument("--json", action="store_true", help="print the JSON on standard output, nothing else")
    parser.add_argument("--limit-mm", type=_limit, metavar="D", help="largest position error that is allowed")
    parser.add_argument("--limit-mrad", type=_limit, metavar="D", help="largest orientation error that is allowed")
    parser.epilog = EPILOG


def run(arguments: argparse.Namespace) -> None:
    """Verify and write the results.

    Raises:
        InputError: the campaign or the calibration cannot be used, or the folder cannot be written.
    """
    require_writable(arguments.out)
    with Progress(4) as progress:
        progress.step("reading")
        arm = read_calibration(arguments.calibration)
        campaign = read_campaign(arguments.campaign)
        progress.step("comparing poses")
        found = verify(campaign, arm, _limits(arguments))
        progress.step("drawing the report")
        files = _files(found)
        progress.step("writing")
        write_files(arguments.out, files)
    print_result(_summary(found, arguments.out), files[0].text, as_json=arguments.json)


def _files(found: Verification) -> tuple[OutputFile, ...]:
    """Everything that is written, verification.json first."""
    # Figures take long to import: not before the input is known to be good.
    from app.verification_report import verification_html

    return (
        OutputFile("verification.json", verification_to_json(found)),
        OutputFile("report.html", verification_html(found)),
    )


def _summary(found: Verification, folder: Path) -> str:
    rows = [
        ("position", "mm", found.nominal.position, found.calibrated.position),
        ("orientation", "mrad", found.nominal.orientation, found.calibrated.orientation),
    ]
    lines = [found.campaign.title or "(a campaign without a title)", f"{'':<26}{'nominal':>10}{'calibrated':>14}"]
    for name, unit, nominal, calibrated in rows:
        for word in ("mean", "max"):
            label = f"{name}, {word} [{unit}]"
            if nominal.count:
                before, after = (getattr(errors, word) * 1e3 for errors in (nominal, calibrated))
                lines.append(f"  {label:<24}{before:>10.3f}{after:>14.3f}")
        lines.append(f"  {f'poses with {name}':<24}{nominal.count:>10}")
    if verdict := calibrated_verdict(found):
        lines.append(f"  {'within the limits':<24}{verdict:>24}")
    notes = [f"Note: {note}" for note in found.notes]
    return "\n".join([*lines, *notes, "", f"Written: {folder / 'verification.json'}, {folder / 'report.html'}"])


def _limits(arguments: argparse.Namespace) -> Limits:
    return Limits(
        None if arguments.limit_mm is None else arguments.limit_mm * 1e-3,
        None if arguments.limit_mrad is None else arguments.limit_mrad * 1e-3,
    )


def _limit(text: str) -> float:
    try:
        limit = float(text)
    except ValueError:
        limit = math.nan
    if not 0 < limit < math.inf:
        raise argparse.ArgumentTypeError(f"{text!r}, expected a number above 0")
    return limit
