"""``trueaxis compare``: this project's methods and the literature's on the same simulated arm."""

import argparse
from pathlib import Path

from app.output import OutputFile, require_writable, write_files
from app.progress import Progress
from app.standard_output import print_result

EPILOG = """The arm is the simulated IRB L6; every method has 129 measured points with the same noise: those of the
paper's table 1, or as many in free poses. Errors are those over 12 kept-out poses after compensation. A trial takes
some seconds."""
MOST_SEEDS = 1000
COMPARED = 0.95
"""Share of the work that the trials are; the rest draws the report."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for the results")
    parser.add_argument(
        "--seeds", type=_seeds, default=5, metavar="N", help="how many trials are averaged (default: 5)"
    )
    parser.add_argument("--json", action="store_true", help="print the JSON on standard output, nothing else")
    parser.epilog = EPILOG


def run(arguments: argparse.Namespace) -> None:
    """Compare and write the results.

    Raises:
        InputError: the folder cannot be written.
    """
    require_writable(arguments.out)
    # The methods take long to import: not before the options are known to be good.
    from app.comparison_summary import comparison_summary
    from core.rivals.comparison_json import comparison_to_json
    from core.twin.trials import compare_on_twin

    with Progress(1) as progress:
        count = arguments.seeds
        found = compare_on_twin(
            count, lambda done: progress.share(COMPARED * done / count, f"trial {done + 1} of {count}")
        )
        progress.share(COMPARED, "drawing the report")
        from app.comparison_report import comparison_html

        text = comparison_to_json(found)
        files = (OutputFile("comparison.json", text), OutputFile("report.html", comparison_html(found)))
        progress.share(1.0, "writing")
        write_files(arguments.out, files)
    print_result(comparison_summary(found, arguments.out), text, as_json=arguments.json)


def _seeds(text: str) -> int:
    try:
        seeds = int(text)
    except ValueError:
        seeds = 0
    if not 1 <= seeds <= MOST_SEEDS:
        raise argparse.ArgumentTypeError(f"{text!r}, expected a whole number from 1 to {MOST_SEEDS}")
    return seeds
