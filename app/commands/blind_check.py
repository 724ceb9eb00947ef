"""``trueaxis blind-check``: diagnoses every campaign of a folder, and only then opens the answers."""

import argparse
import os
from pathlib import Path

from app.output import OutputFile, require_writable, write_files
from app.progress import Progress
from core.errors import InputError
from core.gap.blind_check import ANSWERS, MOST_PROCESSES, Said, campaign_folders, diagnose_all

EPILOG = f"""FOLDER holds campaigns in subfolders, and {ANSWERS}: {{"subfolder": {{"effects": [{{"effect": "backlash",
"joint": 3}}]}}}}; an empty list: nothing is wrong; "effect": "other": something that the program does not know.
What is said of the campaigns is written to blind.json, and on the disk, before {ANSWERS} is opened."""
BLIND, CONFUSION, CAMPAIGNS, REPORT = "blind.json", "confusion.csv", "campaigns.csv", "report.html"


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="folder with campaigns in subfolders")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for the results")
    parser.add_argument(
        "--processes",
        type=int,
        choices=range(1, MOST_PROCESSES + 1),
        default=MOST_PROCESSES,
        help=f"campaigns diagnosed at a time (default: {MOST_PROCESSES})",
    )
    parser.epilog = EPILOG


def run(arguments: argparse.Namespace) -> None:
    """Diagnose all campaigns, write what was said, then score it.

    Raises:
        InputError: there are no campaigns, the answers are missing or odd, or the folder cannot be written.
    """
    folder, out = arguments.folder, arguments.out
    require_writable(out)
    folders = campaign_folders(folder, out)
    answers = folder / ANSWERS
    if not answers.is_file():
        raise InputError(f"{answers} is missing, expected the answers to {len(folders)} campaigns")
    with Progress(1) as progress:
        progress.share(0.0, f"{len(folders)} campaigns")
        said = diagnose_all(folders, arguments.processes, progress.share)
    _write_down(out, said)
    print(_scored(out, said, answers))


def _write_down(out: Path, said: tuple[Said, ...]) -> None:
    """What was said, on the disk whatever happens next."""
    from core.gap.blind_json import blind_to_json

    write_files(out, (OutputFile(BLIND, blind_to_json(said)),))
    for place in (out / BLIND, out):
        handle = os.open(place, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _scored(out: Path, said: tuple[Said, ...], path: Path) -> str:
    """Open the answers, write the score, and say it in short."""
    from app.blind_report import blind_html
    from app.gap_summary import blind_summary
    from core.gap.blind_answers import check_names, read_answers
    from core.gap.blind_json import blind_to_json
    from core.gap.blind_score import score
    from core.gap.blind_tables import campaigns_csv, confusion_csv

    try:
        answers = read_answers(path)
        notes = check_names(answers, tuple(one.name for one in said), path)
    except InputError as wrong:
        raise InputError(f"{wrong}; what was said of the campaigns is in {out / BLIND}, without a score") from None
    found = score(said, answers)
    files = (
        OutputFile(BLIND, blind_to_json(said, found, notes)),
        OutputFile(CONFUSION, confusion_csv(found)),
        OutputFile(CAMPAIGNS, campaigns_csv(found)),
        OutputFile(REPORT, blind_html(found, notes)),
    )
    write_files(out, files)
    return blind_summary(said, found, notes, tuple(out / file.name for file in files))
