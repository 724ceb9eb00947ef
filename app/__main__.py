"""The command line: ``trueaxis COMMAND ...``.

Exit status 0: done; 2: what was given is wrong, one sentence on standard error says what; 1: anything else.
Nothing but the standard library is imported before a command is known, so that help is there at once.
"""

import argparse
import os
import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from types import ModuleType

from core.errors import InputError, TrueaxisError
from core.version import VERSION

DONE, FAILED, WRONG_INPUT, INTERRUPTED = 0, 1, 2, 130

COMMANDS = {
    "serve": "the dashboard in a browser; with no session, a simulated demo cell (this is also what no command means)",
    "calibrate": "calibrate an arm from its single-axis sweeps: JSON, report and tables",
    "simulate": "make a campaign by measuring a simulated arm, with faults if you like",
    "plan": "which shots tell the most of an arm: sweeps or free poses, with the error to expect of them",
    "axis": "find one joint axis from a plain CSV of points",
    "verify": "errors of the nominal and the calibrated arm over the pose records",
    "compensate": "find the commands that make the calibrated arm take given poses",
    "gap": "why simulated and real arm differ: where, which effects, how far that shrinks, what to measure next",
    "blind-check": "diagnose a folder of campaigns blind, then score what was said against answers.json",
    "compare": "this project's methods and the literature's on the same simulated arm",
    "export": "the calibrated robot for other tools: URDF, MJCF, Denavit-Hartenberg rows, JSON",
}


SERVE_OPTIONS = ("--host", "--port", "--sessions")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command that the arguments ask for (default: those of the process) and return the exit status."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if sys.stdout is not None and hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        try:
            return _run(given)
        finally:
            if sys.stdout is not None:
                sys.stdout.flush()
    except BrokenPipeError:
        _silence_stdout()
        return FAILED
    except OSError as error:
        _silence_stdout()
        return _complain(f"standard output cannot be written: {error.strerror or error}", FAILED)


def _run(given: list[str]) -> int:
    """Run a command; whatever goes wrong becomes one sentence and an exit status."""
    try:
        with warnings.catch_warnings():
            if "--debug" not in given and not sys.warnoptions:
                warnings.simplefilter("ignore", RuntimeWarning)
            return _dispatch(given)
    except BrokenPipeError:
        raise
    except KeyboardInterrupt:
        return _complain("interrupted", INTERRUPTED)
    except InputError as error:
        return _complain(str(error), WRONG_INPUT)
    except TrueaxisError as error:
        return _complain(str(error), FAILED)
    except OSError as error:
        if error.filename is None:
            raise
        return _complain(f"{error.filename}: {error.strerror or error}", WRONG_INPUT)
    except Exception as error:
        if "--debug" in given:
            raise
        what = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
        return _complain(f"unexpected error, {what}; run again with --debug for the trace", FAILED)


def _dispatch(given: list[str]) -> int:
    given = _with_command(given)
    chosen = next((word for word in given if not word.startswith("-")), None)
    command = import_module(f"app.commands.{chosen.replace('-', '_')}") if chosen in COMMANDS else None
    parser = _parser(chosen, command)
    try:
        arguments = parser.parse_args(given)
    except SystemExit as ended:
        return int(ended.code or 0)
    if command is None:
        parser.print_help()
    else:
        command.run(arguments)
    return DONE


def _with_command(given: list[str]) -> list[str]:
    """``serve`` stands for itself: no command, its options alone, or a session file in place of a command."""
    if any(word in ("-h", "--help", "--version") for word in given):
        return given
    first = next((word for word in given if not word.startswith("-")), None)
    is_file = first is not None and first not in COMMANDS and os.path.exists(first)
    if not given or is_file or given[0] in SERVE_OPTIONS or given[0].split("=")[0] in SERVE_OPTIONS:
        return ["serve", *given]
    return given


def _parser(chosen: str | None, command: ModuleType | None) -> argparse.ArgumentParser:
    """The parser of all commands; only the chosen one says what options it takes."""
    common = argparse.ArgumentParser(add_help=False)
    common.add_argument(
        "--debug", action="store_true", default=argparse.SUPPRESS, help="show the trace of an unexpected error"
    )
    parser = argparse.ArgumentParser(
        prog="trueaxis",
        description="Calibrate a robot arm from single-axis measurements.",
        parents=[common],
        formatter_class=lambda prog: argparse.HelpFormatter(prog, max_help_position=16),
    )
    parser.add_argument("--version", action="version", version=f"trueaxis {VERSION}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", dest="command")
    for name, help_text in COMMANDS.items():
        sentence = f"{help_text[0].upper()}{help_text[1:]}."
        one = commands.add_parser(
            name,
            help=help_text,
            description=sentence,
            parents=[common],
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        if name == chosen and command is not None:
            command.configure(one)
    return parser


def _complain(sentence: str, status: int) -> int:
    print(f"trueaxis: {' '.join(sentence.splitlines())}", file=sys.stderr)
    return status


def _silence_stdout() -> None:
    """Let what is still buffered go nowhere, so that nothing fails again when the process ends."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, sys.stdout.fileno())
    except (OSError, ValueError):
        pass
    finally:
        os.close(nowhere)


if __name__ == "__main__":
    sys.exit(main())
