"""``trueaxis gap``: where real and sim part, which effects cause it, how far that shrinks."""

import argparse
from pathlib import Path

from app.output import OutputFile, require_writable, write_files
from app.progress import Progress
from app.standard_output import print_result
from core.calibration_file import read_calibration
from core.campaign_files import read_campaign

EPILOG = """The sim is the nominal robot of the campaign, or the calibrated one if a calibration is given, or another
simulator's points where the campaign has sim_* columns. All lengths are judged on points that were kept out of the
fits. A cause that these data cannot tell from another is given with it, as a class, never as a forced name."""
DIAGNOSED = 0.9
"""Share of the work that the diagnosis is; the rest draws the report."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("campaign", type=Path, metavar="CAMPAIGN", help="campaign folder")
    parser.add_argument(
        "--calibration", type=Path, metavar="FILE", help="calibration.json of the arm: then it is the sim"
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for the results")
    parser.add_argument("--json", action="store_true", help="print the JSON on standard output, nothing else")
    parser.epilog = EPILOG


def run(arguments: argparse.Namespace) -> None:
    """Diagnose and write the results.

    Raises:
        InputError: the campaign or the calibration cannot be used, or the folder cannot be written.
    """
    require_writable(arguments.out)
    with Progress(1) as progress:
        progress.share(0.0, "reading")
        arm = None if arguments.calibration is None else read_calibration(arguments.calibration)
        campaign = read_campaign(arguments.campaign)
        # The diagnosis and its figures take long to import: not before the input is known to be good.
        from core.gap.diagnosis import diagnose

        report = diagnose(campaign, arm, progress=lambda done, text: progress.share(DIAGNOSED * done, text))
        progress.share(DIAGNOSED, "drawing the report")
        from app.gap_report import gap_html
        from app.gap_summary import gap_summary
        from core.gap.corrected_csv import corrected_to_csv
        from core.gap.gap_json import gap_to_json

        text = gap_to_json(report)
        files = (
            OutputFile("gap.json", text),
            OutputFile("corrected_points.csv", corrected_to_csv(report)),
            OutputFile("report.html", gap_html(report)),
        )
        progress.share(1.0, "writing")
        write_files(arguments.out, files)
    print_result(gap_summary(report, arguments.out), text, as_json=arguments.json)
