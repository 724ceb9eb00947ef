"""``trueaxis calibrate``: a campaign folder -> calibration.json, report.html and tables/*.csv."""

import argparse
from pathlib import Path

from app.output import OutputFile, require_writable, write_files
from app.progress import Progress
from app.standard_output import print_result
from app.summary import calibration_summary
from core.axes import ESTIMATORS
from core.calibration import Calibration, calibrate
from core.calibration_json import calibration_to_json
from core.campaign_files import read_campaign


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("campaign", type=Path, metavar="CAMPAIGN", help="campaign folder")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for the results")
    parser.add_argument("--json", action="store_true", help="print the JSON on standard output, nothing else")
    parser.add_argument(
        "--estimator", choices=ESTIMATORS, default="likelihood", help="of the axes (default: likelihood)"
    )
    parser.add_argument("--keep-all", action="store_true", help="fit points that stand out as well")


def run(arguments: argparse.Namespace) -> None:
    """Calibrate and write the results.

    Raises:
        InputError: the campaign cannot be used, or the folder cannot be written.
        NotConverged: an iteration did not reach its answer.
    """
    require_writable(arguments.out)
    with Progress(4) as progress:
        progress.step("reading the campaign")
        campaign = read_campaign(arguments.campaign)
        progress.step("axes, drives, all points at once")
        calibration = calibrate(campaign, arguments.estimator, reject=not arguments.keep_all)
        progress.step("drawing the report")
        files = _files(calibration)
        progress.step("writing")
        write_files(arguments.out, files)
    print_result(calibration_summary(calibration, arguments.out), files[0].text, as_json=arguments.json)


def _files(calibration: Calibration) -> tuple[OutputFile, ...]:
    """Everything that is written, calibration.json first."""
    # Tables and figures take long to import: not before the input is known to be good.
    from app.report_html import report_html
    from core.report import tables

    return (
        OutputFile("calibration.json", calibration_to_json(calibration)),
        OutputFile("report.html", report_html(calibration)),
        *(
            OutputFile(f"tables/{table.name}.csv", table.frame.to_csv(index=False, lineterminator="\n"))
            for table in tables(calibration)
        ),
    )
