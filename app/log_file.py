"""The log of a dashboard: what was refused and the trace of what went wrong, beside the session and on the terminal."""

import logging
import logging.handlers
import sys
import time
from pathlib import Path

LOG = logging.getLogger("trueaxis")
NAME = "trueaxis.log"
LARGEST_BYTES = 1_000_000
KEPT = 2
"""Older files that are kept, as ``trueaxis.log.1`` and so on."""


class _QuietFile(logging.handlers.RotatingFileHandler):
    """A log that finds no room is no reason to stop, nor to fill the terminal."""

    def handleError(self, record: logging.LogRecord) -> None:
        """Nothing: the terminal has what the file has not."""


def keep_log(folder: Path) -> Path | None:
    """Write the log from now on; where to, or None if nothing can be written in the folder."""
    form = logging.Formatter("%(asctime)sZ %(levelname)s %(message)s", "%Y-%m-%dT%H:%M:%S")
    form.converter = time.gmtime
    terminal = logging.StreamHandler(sys.stderr)
    terminal.setLevel(logging.WARNING)
    handlers: list[logging.Handler] = [terminal]
    path: Path | None = folder / NAME
    try:
        handlers.append(_QuietFile(path, maxBytes=LARGEST_BYTES, backupCount=KEPT, encoding="utf-8"))
    except OSError:
        path = None
    for handler in handlers:
        handler.setFormatter(form)
    for old in LOG.handlers:
        old.close()
    LOG.setLevel(logging.INFO)
    LOG.handlers = handlers
    LOG.propagate = False
    return path
