"""What other programs read on standard output."""

import sys


def print_json(text: str) -> None:
    """Write a JSON text as UTF-8, whatever the terminal's encoding is."""
    sys.stdout.flush()
    sys.stdout.buffer.write(text.encode("utf-8"))
    sys.stdout.buffer.flush()
