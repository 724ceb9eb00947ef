"""One line on a terminal that says what is being done; nothing in a pipe."""

import sys
from types import TracebackType
from typing import TextIO

CLEAR = "\r\x1b[K"
WIDTH = 20
LONGEST_TEXT = 60


class Progress:
    """A context in which the steps of a long piece of work are shown, and cleared away at its end."""

    def __init__(self, steps: int, stream: TextIO | None = None) -> None:
        """Args:
        steps: how many there will be.
        stream: where to; default: standard error.
        """
        self._stream = sys.stderr if stream is None else stream
        self._shown = self._stream is not None and self._stream.isatty()
        self._steps, self._step = steps, 0

    def step(self, text: str) -> None:
        """Say what is done next, in a few words."""
        self._step += 1
        self._write(_line((self._step - 1) / self._steps, f"{self._step}/{self._steps}", text))

    def share(self, done: float, text: str) -> None:
        """Say how much of the work is done, 0..1, and what is done next, which may come from a file."""
        self._write(_line(done, f"{done:4.0%}", text))

    def __enter__(self) -> "Progress":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._write(CLEAR)

    def _write(self, text: str) -> None:
        if self._shown:
            self._stream.write(text)
            self._stream.flush()


def _line(done: float, count: str, text: str) -> str:
    filled = int(WIDTH * min(max(done, 0.0), 1.0))
    shown = "".join(c if c.isprintable() else "?" for c in text[:LONGEST_TEXT])
    return f"{CLEAR}[{'#' * filled}{'.' * (WIDTH - filled)}] {count} {shown}"
