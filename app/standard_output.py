"""What other programs read on standard output."""

import sys


def print_result(summary: str, json_text: str, *, as_json: bool) -> None:
    """Print what was found: the summary, or its JSON with the summary on standard error."""
    if as_json:
        print(summary, file=sys.stderr)
        print_json(json_text)
    else:
        print(summary)


def print_json(text: str) -> None:
    """Write a JSON text as UTF-8, whatever the terminal's encoding is."""
    sys.stdout.flush()
    sys.stdout.buffer.write(text.encode("utf-8"))
    sys.stdout.buffer.flush()
