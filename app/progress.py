"""One line on a terminal that says what is being done; nothing in a pipe."""

import sys
from types import TracebackType
from typing import TextIO

CLEAR = "\r\x1b[K"


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
        width = 20
        done = width * (self._step - 1) // self._steps
        self._write(f"{CLEAR}[{'#' * done}{'.' * (width - done)}] {self._step}/{self._steps} {text}")

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
